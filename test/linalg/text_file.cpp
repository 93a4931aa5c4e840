#include "linalg/text_file.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "linalg/file_error.h"

using namespace cb;

namespace {

struct File {
  std::string path;
  explicit File(const std::string& text)
      : path((std::filesystem::temp_directory_path() / ("text_file_" + std::to_string(getpid()))).string()) {
    std::ofstream(path) << text;
  }
  ~File() { std::filesystem::remove(path); }
};

}  // namespace

TEST_CASE("a count that the rest of a file cannot hold is refused, wherever in it the count stands") {
  const File file("10 20 30 40 1 2 3");
  TextFile text(file.path);
  for (int i = 0; i < 4; ++i) text.number("a number");
  text.expect_room(3, "the matrix");
  CHECK_THROWS_AS(text.expect_room(4, "the matrix"), FileError);
}

TEST_CASE("triplets fill a matrix to its last row and column, and not beyond") {
  const auto read = [](const std::string& entry) {
    const File file("2\n3\n2\n1\nCSparse\ntriplet: 3-by-2, nzmax: 4 nnz: 2\n0 0 : 5\n" + entry + "\n");
    TextFile text(file.path);
    return read_siconos_matrix(text, "M");
  };
  const Eigen::SparseMatrix<double> M = read("2 1 : 7");
  CHECK(M.coeff(0, 0) == 5);
  CHECK(M.coeff(2, 1) == 7);
  CHECK(M.nonZeros() == 2);
  CHECK_THROWS_AS(read("3 1 : 7"), FileError);
  CHECK_THROWS_AS(read("2 2 : 7"), FileError);
}

TEST_CASE(
    "a number too small for a double is the zero it rounds to, a plus sign is none, and one too large is refused") {
  const File file("1e-400 -4e-330 +2.5 4.9e-324 1e400 1e-400x");
  TextFile text(file.path);
  CHECK(text.number("a number") == 0);
  CHECK(text.number("a number") == 0);
  CHECK(text.number("a number") == 2.5);
  CHECK(text.number("a number") > 0);
  CHECK_THROWS_AS(text.number("a number"), FileError);
  CHECK_THROWS_AS(text.number("a number"), FileError);
}
