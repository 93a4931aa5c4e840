// What: matrices and vectors in Matrix Market files (array and coordinate), in and out.
// Source: R. Boisvert, R. Pozo, K. Remington, "The Matrix Market Exchange Formats", NISTIR 5935 (1996).
// Differences from the source: 1. complex, hermitian and pattern matrices are refused. 2. Line ends are white space
// like any other. 3. An entry that is given twice is refused (the source leaves it open).
// Fails with FileError: file, line, and what would be right.
#include "linalg/matrix_market.h"

#include <charconv>
#include <cstdio>
#include <vector>

#include "linalg/text_file.h"

namespace cb {

namespace {

std::string lower(std::string_view word) {
  std::string out(word);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

enum class Symmetry { general, symmetric, skew };

struct Banner {
  bool coordinate = false;
  bool integer = false;
  Symmetry symmetry = Symmetry::general;
};

Banner read_banner(TextFile& file) {
  Banner banner;
  const std::string right =
      "; the first line must read: %%MatrixMarket matrix {array|coordinate} {real|integer} "
      "{general|symmetric|skew-symmetric}";
  if (lower(file.word("the banner")) != "%%matrixmarket" || file.line() != 1)
    file.fail("this is no Matrix Market file" + right);
  const std::string object = lower(file.word("matrix")), format = lower(file.word("array or coordinate")),
                    field = lower(file.word("real or integer")), symmetry = lower(file.word("the symmetry"));
  if (file.line() != 1 || object != "matrix" || (format != "array" && format != "coordinate"))
    file.fail("unknown Matrix Market object" + right);
  if (field != "real" && field != "integer") file.fail("field \"" + field + "\" is not supported" + right);
  banner.coordinate = format == "coordinate";
  banner.integer = field == "integer";
  if (symmetry == "symmetric")
    banner.symmetry = Symmetry::symmetric;
  else if (symmetry == "skew-symmetric")
    banner.symmetry = Symmetry::skew;
  else if (symmetry != "general")
    file.fail("symmetry \"" + symmetry + "\" is not supported" + right);
  file.rest_of_line();
  return banner;
}

}  // namespace

Eigen::MatrixXd read_matrix_market(const std::string& path) {
  TextFile file(path);
  const Banner banner = read_banner(file);
  // Comments stand between the banner and the sizes only.
  std::string_view word = file.word("the sizes");
  while (word[0] == '%') {
    file.rest_of_line();
    word = file.word("the sizes");
  }
  const long rows = file.integer(word, "number of rows", 0, file_limits.dimension);
  const long cols = file.integer("number of columns", 0, file_limits.dimension);
  if (rows * cols > file_limits.dense_entries)
    file.fail(std::to_string(rows) + " x " + std::to_string(cols) + " is too large to be kept dense; at most " +
              std::to_string(file_limits.dense_entries) + " numbers fit");
  if (banner.symmetry != Symmetry::general && rows != cols) file.fail("a symmetric matrix must be square");

  Eigen::MatrixXd matrix;
  const auto set = [&](long i, long j, double x) {
    matrix(i, j) = x;
    if (banner.symmetry != Symmetry::general && i != j) matrix(j, i) = banner.symmetry == Symmetry::skew ? -x : x;
  };
  const auto value = [&] {
    const std::string_view digits = file.word("an entry");
    if (banner.integer) file.integer(digits, "an entry of an integer matrix", -(1L << 53), 1L << 53);
    return file.number(digits, "an entry");
  };
  if (banner.coordinate) {
    const long count = file.integer("number of entries", 0, rows * cols);
    file.expect_room(3 * count, "the list of entries");
    matrix.setZero(rows, cols);
    std::vector<bool> seen(static_cast<std::size_t>(rows * cols), false);
    for (long e = 0; e < count; ++e) {
      const long i = file.integer("row of an entry", 1, rows) - 1;
      const long j = file.integer("column of an entry", 1, cols) - 1;
      if (banner.symmetry != Symmetry::general && (i < j || (i == j && banner.symmetry == Symmetry::skew)))
        file.fail("entry (" + std::to_string(i + 1) + ", " + std::to_string(j + 1) +
                  ") is not below the diagonal; a symmetric matrix stores its lower triangle");
      const auto at = static_cast<std::size_t>(i + j * rows);
      if (seen[at]) file.fail("entry (" + std::to_string(i + 1) + ", " + std::to_string(j + 1) + ") is given twice");
      seen[at] = true;
      set(i, j, value());
    }
  } else {
    const long skip = banner.symmetry == Symmetry::skew ? 1 : 0;
    const long count = banner.symmetry == Symmetry::general ? rows * cols : rows * (rows + 1 - 2 * skip) / 2;
    file.expect_room(count, "the array");
    matrix.setZero(rows, cols);
    for (long j = 0; j < cols; ++j)
      for (long i = banner.symmetry == Symmetry::general ? 0 : j + skip; i < rows; ++i) set(i, j, value());
  }
  if (!file.at_end()) file.fail("the file goes on after its last entry");
  return matrix;
}

void write_matrix_market(const std::string& path, std::span<const double> values) {
  std::string text = "%%MatrixMarket matrix array real general\n" + std::to_string(values.size()) + " 1\n";
  char digits[32];
  for (const double x : values) {
    const auto end = std::to_chars(digits, digits + sizeof digits, x).ptr;
    text.append(digits, end);
    text += '\n';
  }
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) throw FileError(path + ": cannot be opened for writing; give a path in a folder that exists");
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const bool closed = std::fclose(file) == 0;
  if (!written || !closed) throw FileError(path + ": could not be written to its end; is the disk full?");
}

}  // namespace cb
