#include "linalg/text_file.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdint>
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

// What the shell makes of <(zcat q.mtx.gz): it was said to be larger than 2 GB.
TEST_CASE("a pipe is refused as one") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  CHECK(write(ends[1], "1 2\n", 4) == 4);
  close(ends[1]);
  CHECK_THROWS_WITH(TextFile("/proc/self/fd/" + std::to_string(ends[0])), Catch::Contains("is a pipe or a device"));
  close(ends[0]);
}

TEST_CASE("a file of more than 2 GB is refused before it is read, and one that is shorter than it says once it is") {
  const File file("");
  std::filesystem::resize_file(file.path, (std::uintmax_t{2} << 30) + 1);  // a hole: it takes no room
  CHECK_THROWS_WITH(TextFile(file.path), file.path + ": is larger than 2048 MB; store the problem as FCLIB HDF5");
  const std::string few = "/sys/devices/system/cpu/online";  // 4096 bytes, says the system, of a word
  if (std::filesystem::exists(few)) CHECK_THROWS_WITH(TextFile(few), few + ": cannot be read to its end");
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

TEST_CASE("two signs are no number") {
  for (const char* word : {"+-5", "++5", "-+5", "--5", "+"}) {
    const File file(word);
    TextFile text(file.path);
    INFO(word);
    CHECK_THROWS_AS(text.number("a number"), FileError);
  }
}

namespace {

Eigen::MatrixXd matrix(const std::string& text) {
  const File file(text);
  TextFile words(file.path);
  return Eigen::MatrixXd(read_siconos_matrix(words, "M"));
}
std::string refusal(const std::string& text) {
  try {
    matrix(text);
    return "";
  } catch (const FileError& error) {
    return error.what();
  }
}

}  // namespace

TEST_CASE(
    "a matrix that is not square is read alike from columns, blocks of several sizes, triplets and columns of few") {
  Eigen::MatrixXd expected(3, 4);
  expected << 1, 2, 0, 4, 5, 6, 0, 8, 0, 0, 11, 12;
  CHECK(matrix("0 3 4  3 4  1 5 0  2 6 0  0 0 11  4 8 12") == expected);
  // Block rows end at 2 and 3, block columns at 1, 2 and 4: four of the six blocks are there, each by columns.
  CHECK(matrix("1 3 4  4 2 3  2 3  1 2 4  3 4  0 3 4  0 1 2 2  0 1 5  1 2 6  2 0 0 4 8  3 11 12") == expected);
  CHECK(
      matrix("2 3 4  1\nCSparse Version\ntriplet: 3-by-4, nzmax: 9 nnz: 9\n2 3 : 12 0 0 : 0.25 1 0 : 5 0 1 : 2 1 1 : 6 "
             "0 3 : 4 1 3 : 8 2 2 : 11 0 0 : 0.75") == expected);
  CHECK(matrix("2 3 4  2\nCSparse\n3-by-4, nzmax: 8 nnz: 8, 1-norm: 24\ncol 0 : locations 0 to 1 0 : 1 1 : 5\n"
               "col 1 : locations 2 to 3 0 : 2 1 : 6\ncol 2 : locations 4 to 4 2 : 11\n"
               "col 3 : locations 5 to 7 0 : 4 1 : 8 2 : 12") == expected);
}

TEST_CASE("a message names the line where something is wrong, what stands there and what should") {
  CHECK_THAT(refusal("0 2 1\n2 1\n1\nx2\n"), Catch::EndsWith(":4: \"x2\" stands where a number should (M)"));
  CHECK_THAT(refusal("0 2 1\n2 1\n1\n\n\n"), Catch::EndsWith(":6: the file ends where M should stand"));
  CHECK_THAT(refusal("0\n2 1\n2 2"), Catch::EndsWith(":3: M: the two statements of its size differ"));
  CHECK_THAT(refusal("3 1 1"),
             Catch::EndsWith(":1: M, storage (0 dense, 1 sparse blocks, 2 sparse) is \"3\"; it must be from 0 to 2"));
  CHECK_THAT(refusal("0 -1 1"), Catch::Contains("M, rows is \"-1\"; it must be from 0 to 1000000"));
  CHECK_THAT(refusal("0 1 1000001"), Catch::Contains("M, columns is \"1000001\""));
  CHECK_THAT(refusal("0 1 1.5"), Catch::Contains("\"1.5\" stands where a whole number should (M, columns)"));
  CHECK_THAT(refusal("2 1 1 1 Sparse"), Catch::EndsWith("\"Sparse\" stands where \"CSparse\" should"));
  CHECK_THAT(refusal("0 1 1 1 1 " + std::string(50, 'a') + "\x07"),
             Catch::Contains("\"" + std::string(40, 'a') + "...\""));
  CHECK_THAT(refusal("0 1 1 1 1 a\x07"), Catch::Contains("\"a?\""));
}

TEST_CASE("words are told from lines, whatever stands between them") {
  const File file("  one\ttwo\r\n\nthree and the rest \nfour");
  TextFile text(file.path);
  CHECK(text.path() == file.path);
  CHECK(text.word("a word") == "one");
  CHECK(text.line() == 1);
  CHECK(text.word("a word") == "two");
  CHECK(text.word("a word") == "three");
  CHECK(text.line() == 3);
  CHECK(text.rest_of_line() == " and the rest ");
  CHECK(text.line() == 4);
  CHECK_FALSE(text.at_end());
  text.expect("four");
  CHECK(text.at_end());
  CHECK(text.rest_of_line().empty());
  CHECK(text.line() == 4);
}

TEST_CASE("blocks and columns whose counts do not agree with each other are refused with what is wrong") {
  const std::string numbers = "  0 1 5  1 2 6  2 0 0 4 8  3 11 12";
  // Number of blocks; block rows and columns and where they end; filled rows, blocks; where rows begin; columns.
  CHECK(refusal("1 3 4  4 2 3  2 3  1 2 4  3 4  0 3 4  0 1 2 2" + numbers).empty());
  const std::string head = "2 3 4  2\nCSparse\n3-by-4, nzmax: 9 ",
                    columns =
                        "col 0 : locations 0 to 1 0 : 1 1 : 5\ncol 1 : locations 2 to 3 0 : 2 1 : 6\n"
                        "col 2 : locations 4 to 4 2 : 11\ncol 3 : locations 5 to 7 0 : 4 1 : 8 2 : 12";
  CHECK(refusal(head + "nnz: 8, 1-norm: 24\n" + columns).empty());
  const std::pair<std::string, std::string> broken[] = {
      {"1 3 4  4 2 3  2 2  1 2 4  3 4  0 3 4  0 1 2 2" + numbers,
       "end of a block row is \"2\"; it must be from 3 to 3"},
      {"1 3 4  4 2 3  1 2  1 2 4  3 4  0 3 4  0 1 2 2" + numbers,
       "end of a block row: the last one must be the size, 3"},
      {"1 3 4  4 2 3  2 3  1 2 3  3 4  0 3 4  0 1 2 2" + numbers,
       "end of a block column: the last one must be the size, 4"},
      {"1 3 4  4 2 3  2 3  1 2 4  3 5  0 3 4  0 1 2 2" + numbers, "the two statements of its number of blocks differ"},
      {"1 3 4  4 2 3  2 3  1 2 4  3 4  0 3 3  0 1 2 2" + numbers, "must run from 0 to the number of blocks"},
      {"1 3 4  4 2 3  2 3  1 2 4  3 4  1 3 4  0 1 2 2" + numbers, "must run from 0 to the number of blocks"},
      {"1 3 4  4 2 3  2 3  1 2 4  3 4  0 3 4  0 1 3 2" + numbers, "column of a block is \"3\"; it must be from 0 to 2"},
      {head + "nnz: 9, 1-norm: 24\n" + columns, "the columns do not hold the number of entries that nnz says"},
      {head + "nnz: 7, 1-norm: 24\n" + columns, "last entry of a column is \"7\"; it must be from 4 to 6"},
      {"2 4 3  2\nCSparse\n3-by-4, nzmax: 9 nnz: 8", "M: \"3-by-4,\" stands where \"4-by-3\" should"},
      {"2 3 4  1\nCSparse\n3-by-4, nzmax: 9 nnz: 8", "M: \"triplet:\" should stand here, as origin 1 says"}};
  for (const auto& [text, wrong] : broken) {
    INFO(text);
    CHECK_THAT(refusal(text), Catch::Contains(wrong));
  }
}
