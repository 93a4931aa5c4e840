#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <string_view>

#include "linalg/file_error.h"

namespace cb {

/// Sizes beyond which a problem file is refused before memory is asked for.
struct FileLimits {
  long file_bytes = 2L << 30;        ///< largest text file
  long dimension = 1'000'000;        ///< rows or columns of a matrix
  long entries = 50'000'000;         ///< stored numbers of one matrix or vector
  long dense_entries = 100'000'000;  ///< numbers of a matrix that is kept dense, or of the blocks of M
};
inline constexpr FileLimits file_limits;

/// Words of a text file, one by one, with the line that each stands in. Every failure is a FileError "FILE:LINE: ...".
class TextFile {
 public:
  /// Reads the whole file.
  explicit TextFile(const std::string& path);

  const std::string& path() const { return path_; }
  int line() const { return line_; }
  bool at_end();
  /// Next word (white space separates); `what` names it in the message where the file ends before it.
  std::string_view word(std::string_view what);
  /// The rest of the present line, without its end; then the next line begins.
  std::string_view rest_of_line();
  /// A finite number.
  double number(std::string_view what);
  double number(std::string_view word, std::string_view what) const;
  /// A whole number in [least, most].
  long integer(std::string_view what, long least, long most);
  long integer(std::string_view word, std::string_view what, long least, long most) const;
  /// The next word must be `expected`.
  void expect(std::string_view expected);
  /// Refuses a count of numbers that the rest of the file cannot hold (a digit and a space each).
  void expect_room(long count, std::string_view what);
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string path_, text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// Matrix in the text form of Siconos Numerics, 4.x: storage (0 dense, column-major; 1 sparse blocks; 2 sparse, as
/// triplets or compressed columns), sizes, numbers. `what` names it in messages. Zeros are dropped, duplicates add up.
Eigen::SparseMatrix<double> read_siconos_matrix(TextFile& file, std::string_view what);

}  // namespace cb
