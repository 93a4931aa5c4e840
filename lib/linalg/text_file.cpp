// What: words and numbers of a text file, and the matrices of Siconos Numerics (NM_write_in_file, version 4.4: the
// layout was learned from files that its own library writes).
// Fails with FileError: file and line, what was found, what would be right.
#include "linalg/text_file.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

namespace cb {

namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v'; }

// A word as it may be shown in a message: short and printable.
std::string shown(std::string_view word) {
  std::string out = "\"";
  for (const char c : word.substr(0, 40)) out += (c >= 32 && c < 127) ? c : '?';
  return out + (word.size() > 40 ? "...\"" : "\"");
}

std::string_view without_comma(std::string_view word) {
  if (!word.empty() && word.back() == ',') word.remove_suffix(1);
  return word;
}

}  // namespace

TextFile::TextFile(const std::string& path) : path_(path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw FileError(path + ": is a folder; a file is needed");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path + ": cannot be opened for reading; give the path of an existing file");
  in.seekg(0, std::ios::end);
  const auto size = static_cast<long>(in.tellg());
  if (size < 0) throw FileError(path + ": is a pipe or a device, whose size is not known; a file is needed");
  if (size > file_limits.file_bytes)
    throw FileError(path + ": is larger than " + std::to_string(file_limits.file_bytes >> 20) +
                    " MB; store the problem as FCLIB HDF5");
  in.seekg(0);
  text_.resize(static_cast<std::size_t>(size));
  if (size > 0 && !in.read(text_.data(), size)) throw FileError(path + ": cannot be read to its end");
}

void TextFile::fail(const std::string& message) const {
  throw FileError(path_ + ":" + std::to_string(line_) + ": " + message);
}

bool TextFile::at_end() {
  while (at_ < text_.size() && is_space(text_[at_])) line_ += text_[at_++] == '\n';
  return at_ == text_.size();
}

std::string_view TextFile::word(std::string_view what) {
  if (at_end()) fail("the file ends where " + std::string(what) + " should stand");
  const std::size_t from = at_;
  while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
  return std::string_view(text_).substr(from, at_ - from);
}

std::string_view TextFile::rest_of_line() {
  const std::size_t from = at_;
  while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  const std::string_view rest = std::string_view(text_).substr(from, at_ - from);
  if (at_ < text_.size()) {
    ++at_;
    ++line_;
  }
  return rest;
}

double TextFile::number(std::string_view what) { return number(word(what), what); }

double TextFile::number(std::string_view word, std::string_view what) const {
  // std::from_chars knows no leading plus sign.
  std::string_view digits = word;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  // A number too small for a double is taken as the zero it rounds to; one too large is refused.
  if (code == std::errc::result_out_of_range && end == digits.data() + digits.size()) {
    const double wide = std::strtod(std::string(digits).c_str(), nullptr);
    if (std::abs(wide) < 1) return wide;
    fail(shown(word) + " is too large for a double (" + std::string(what) + ")");
  }
  if (code != std::errc() || end != digits.data() + digits.size())
    fail(shown(word) + " stands where a number should (" + std::string(what) + ")");
  if (!std::isfinite(value)) fail(shown(word) + " is not a finite number (" + std::string(what) + ")");
  return value;
}

long TextFile::integer(std::string_view what, long least, long most) { return integer(word(what), what, least, most); }

long TextFile::integer(std::string_view word, std::string_view what, long least, long most) const {
  long value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code == std::errc::invalid_argument || end != word.data() + word.size())
    fail(shown(word) + " stands where a whole number should (" + std::string(what) + ")");
  if (code != std::errc() || value < least || value > most)
    fail(std::string(what) + " is " + shown(word) + "; it must be from " + std::to_string(least) + " to " +
         std::to_string(most));
  return value;
}

void TextFile::expect(std::string_view expected) {
  const std::string_view found = word(shown(expected));
  if (found != expected) fail(shown(found) + " stands where " + shown(expected) + " should");
}

void TextFile::expect_room(long count, std::string_view what) {
  if (count > file_limits.entries || count > (static_cast<long>(text_.size() - at_) + 1) / 2)
    fail(std::string(what) + " would need " + std::to_string(count) + " numbers, more than the rest of the file holds");
}

namespace {

// Numbers column by column, although the lines look like rows.
void read_dense(TextFile& file, const std::string& what, long rows, long cols, Triplets& out) {
  if (file.integer(what + ", rows", 0, file_limits.dimension) != rows ||
      file.integer(what + ", columns", 0, file_limits.dimension) != cols)
    file.fail(what + ": the two statements of its size differ");
  file.expect_room(rows * cols, what);
  for (long j = 0; j < cols; ++j)
    for (long i = 0; i < rows; ++i) {
      const double x = file.number(what);
      if (x != 0) out.emplace_back(static_cast<int>(i), static_cast<int>(j), x);
    }
}

// Ends of block rows or columns: rising, the last one is the size.
std::vector<long> read_ends(TextFile& file, const std::string& what, long count, long size) {
  file.expect_room(count, what);
  std::vector<long> first{0};
  for (long b = 0; b < count; ++b) first.push_back(file.integer(what, first.back() + 1, size));
  if (first.back() != size) file.fail(what + ": the last one must be the size, " + std::to_string(size));
  return first;
}

void read_blocks(TextFile& file, const std::string& what, long rows, long cols, Triplets& out) {
  const long most = file_limits.dimension;
  const long count = file.integer(what + ", number of blocks", 0, file_limits.entries);
  if (count == 0) return;
  const long block_rows = file.integer(what + ", block rows", 1, most);
  const long block_cols = file.integer(what + ", block columns", 1, most);
  const auto row_first = read_ends(file, what + ", end of a block row", block_rows, rows);
  const auto col_first = read_ends(file, what + ", end of a block column", block_cols, cols);
  const long filled = file.integer(what + ", filled block rows + 1", 1, block_rows + 1);
  if (file.integer(what + ", blocks", 0, file_limits.entries) != count)
    file.fail(what + ": the two statements of its number of blocks differ");
  file.expect_room(filled + count, what);
  std::vector<long> start, col;
  for (long r = 0; r < filled; ++r)
    start.push_back(file.integer(what + ", first block of a row", start.empty() ? 0 : start.back(), count));
  if (start.front() != 0 || start.back() != count)
    file.fail(what + ": the first blocks of the rows must run from 0 to the number of blocks");
  for (long b = 0; b < count; ++b) col.push_back(file.integer(what + ", column of a block", 0, block_cols - 1));
  for (long r = 0; r + 1 < filled; ++r)
    for (long b = start[r]; b < start[r + 1]; ++b) {
      file.integer(what + ", number of a block", b, b);
      const long m = row_first[r + 1] - row_first[r], n = col_first[col[b] + 1] - col_first[col[b]];
      file.expect_room(m * n, what);
      for (long j = 0; j < n; ++j)
        for (long i = 0; i < m; ++i) {
          const double x = file.number(what);
          if (x != 0) out.emplace_back(static_cast<int>(row_first[r] + i), static_cast<int>(col_first[col[b]] + j), x);
        }
    }
}

// What CSparse's cs_print writes: a version line, a line of sizes, the entries.
void read_sparse(TextFile& file, const std::string& what, long rows, long cols, Triplets& out) {
  const long origin = file.integer(what + ", origin (1 triplets, 2 compressed columns)", 1, 2);
  file.expect("CSparse");
  file.rest_of_line();
  std::string_view sizes = file.word(what + ", sizes");
  if (origin == 1) {
    if (sizes != "triplet:") file.fail(what + ": \"triplet:\" should stand here, as origin 1 says");
    sizes = file.word(what + ", sizes");
  }
  if (without_comma(sizes) != std::to_string(rows) + "-by-" + std::to_string(cols))
    file.fail(what + ": " + shown(sizes) + " stands where \"" + std::to_string(rows) + "-by-" + std::to_string(cols) +
              "\" should");
  file.expect("nzmax:");
  file.integer(what + ", nzmax", 0, file_limits.entries);
  file.expect("nnz:");
  const long count = file.integer(without_comma(file.word(what + ", nnz")), what + ", nnz", 0, file_limits.entries);
  file.expect_room(3 * count, what);
  const auto entry = [&](long i, long j) {
    const double x = file.number(what);
    if (x != 0) out.emplace_back(static_cast<int>(i), static_cast<int>(j), x);
  };
  if (origin == 1) {
    for (long e = 0; e < count; ++e) {
      const long i = file.integer(what + ", row", 0, rows - 1), j = file.integer(what + ", column", 0, cols - 1);
      file.expect(":");
      entry(i, j);
    }
    return;
  }
  file.expect("1-norm:");
  file.number(what + ", norm");
  long next = 0;
  for (long j = 0; j < cols; ++j) {
    file.expect("col");
    file.integer(what + ", column", j, j);
    file.expect(":");
    file.expect("locations");
    file.integer(what + ", first entry of a column", next, next);
    file.expect("to");
    const long last = file.integer(what + ", last entry of a column", next - 1, count - 1);
    for (; next <= last; ++next) {
      const long i = file.integer(what + ", row", 0, rows - 1);
      file.expect(":");
      entry(i, j);
    }
  }
  if (next != count) file.fail(what + ": the columns do not hold the number of entries that nnz says");
}

}  // namespace

Sparse read_siconos_matrix(TextFile& file, std::string_view name) {
  const std::string what(name);
  const long storage = file.integer(what + ", storage (0 dense, 1 sparse blocks, 2 sparse)", 0, 2);
  const long rows = file.integer(what + ", rows", 0, file_limits.dimension);
  const long cols = file.integer(what + ", columns", 0, file_limits.dimension);
  Triplets triplets;
  if (storage == 0)
    read_dense(file, what, rows, cols, triplets);
  else if (storage == 1)
    read_blocks(file, what, rows, cols, triplets);
  else
    read_sparse(file, what, rows, cols, triplets);
  Sparse matrix(rows, cols);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

}  // namespace cb
