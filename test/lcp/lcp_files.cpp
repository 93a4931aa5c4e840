#include "lcp/lcp_files.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>

#include "linalg/matrix_market.h"
#include "temporary.h"

using namespace cb;

namespace {

namespace fs = std::filesystem;

struct Folder : TemporaryDirectory {
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name), std::ios::binary) << text;
    return file(name);
  }
};

template <class Read>
std::string refusal(Read&& read) {
  try {
    read();
    return "";
  } catch (const FileError& error) {
    return error.what();
  }
}

// The matrix that Siconos was given: A_ij = 4 [i = j] + i / 8 - j / 16.
double siconos_entry(int i, int j) { return (i == j ? 4 : 0) + 0.125 * i - 0.0625 * j; }

}  // namespace

TEST_CASE("Every form of a Matrix Market file gives the matrix that it describes") {
  const Folder folder;
  const auto read = [&](const std::string& text) { return read_matrix_market(folder.write("m.mtx", text)); };
  const std::string banner = "%%MatrixMarket matrix ";
  Eigen::MatrixXd general(2, 3), symmetric(2, 2), skew(2, 2);
  general << 1, 0, -3, 4.5, 5e-1, 0;
  symmetric << 1, 2, 2, 3;
  skew << 0, -2, 2, 0;
  CHECK(read(banner + "array real general\n2 3\n1 4.5 0 .5 -3 0\n") == general);
  CHECK(read(banner + "coordinate real general\n% a comment\n%\n2 3 4\n1 1 1\n2 1 4.5\n1 3 -3.0E0\n2 2 +0.5\n") ==
        general);
  // Each entry has a place of its own in a matrix of any shape.
  const std::string entries = "6\n1 1 1\n2 1 4.5\n1 2 0\n2 2 .5\n1 3 -3\n2 3 0\n";
  CHECK(read(banner + "coordinate real general\n2 3 " + entries) == general);
  const std::string transposed = "coordinate real general\n3 2 6\n1 1 1\n1 2 4.5\n2 1 0\n2 2 .5\n3 1 -3\n3 2 0\n";
  CHECK(read(banner + transposed) == general.transpose());
  CHECK(read(banner + "array real symmetric\n2 2\n1\n2\n3\n") == symmetric);
  CHECK(read(banner + "coordinate integer symmetric\n2 2 3\n1 1 1\n2 1 2\n2 2 3\n") == symmetric);
  CHECK(read(banner + "array real skew-symmetric\n2 2\n2\n") == skew);
  CHECK(read("%%matrixmarket MATRIX Coordinate Real Skew-Symmetric\r\n2 2 1\r\n2 1 2\r\n") == skew);
}

TEST_CASE("A vector written as Matrix Market reads back to the last bit") {
  const Folder folder;
  std::mt19937_64 random(3);
  std::vector<double> x = {0.0, -0.0, 5e-324, 1.0 / 3, -1.7976931348623157e308, 1e23};
  while (x.size() < 2000) {
    const double any = std::bit_cast<double>(random());
    if (std::isfinite(any)) x.push_back(any);
  }
  write_matrix_market(folder.file("x.mtx"), x);
  const Eigen::MatrixXd back = read_matrix_market(folder.file("x.mtx"));
  REQUIRE(back.rows() == static_cast<long>(x.size()));
  REQUIRE(back.cols() == 1);
  bool same = true;
  for (std::size_t i = 0; i < x.size(); ++i)
    same = same && std::bit_cast<std::uint64_t>(x[i]) == std::bit_cast<std::uint64_t>(back.data()[i]);
  CHECK(same);
  CHECK_THROWS_AS(write_matrix_market(folder.file("no/such/folder.mtx"), x), FileError);
  // A disk that is full says so where the file is closed, or before.
  for (const std::vector<double>& numbers : {x, std::vector<double>{1}})
    CHECK_THROWS_WITH(write_matrix_market("/dev/full", numbers),
                      "/dev/full: could not be written to its end; is the disk full?");
}

TEST_CASE("Every broken Matrix Market file is refused in one message with its file and line") {
  const Folder folder;
  const std::string banner = "%%MatrixMarket matrix ";
  const std::vector<std::pair<std::string, std::string>> broken = {
      {"", ":1: the file ends"},
      {"hello", "no Matrix Market file"},
      {"\n" + banner + "array real general\n1 1\n1\n", "no Matrix Market file"},
      {banner + "array real\n1 1\n1\n", "unknown Matrix Market object"},
      {banner + "list real general\n1 1\n1\n", "unknown Matrix Market object"},
      {banner + "array complex general\n1 1\n1 0\n", "\"complex\" is not supported"},
      {banner + "coordinate pattern general\n1 1 1\n1 1\n", "\"pattern\" is not supported"},
      {banner + "array real hermitian\n1 1\n1\n", "\"hermitian\" is not supported"},
      {banner + "array real general\n", "ends where the sizes"},
      {banner + "array real general\n-1 1\n", ":2: number of rows is \"-1\""},
      {banner + "array real general\n99999999999 1\n", "number of rows"},
      {banner + "array real general\n1000000 1000000\n1\n", "too large"},
      {banner + "coordinate real general\n1000000 1000000 1\n1 1 1\n", "too large"},
      {banner + "array real general\n3000 3000\n1\n", "more than the rest of the file holds"},
      {banner + "coordinate real general\n3 3 9\n1 1 1\n", "more than the rest of the file holds"},
      {banner + "coordinate real general\n3 3 10\n1 1 1\n", "number of entries"},
      {banner + "coordinate real general\n3 3 -1\n", "number of entries"},
      {banner + "array real general\n2 1\n1.25\n", "ends where an entry"},
      {banner + "array real general\n2 1\n1\n2\n3\n", ":5: the file goes on"},
      {banner + "array real general\n2 1\n1\ntwo\n", ":4: \"two\" stands where a number should"},
      {banner + "array real general\n2 1\n1\nNaN\n", "not a finite number"},
      {banner + "array real general\n2 1\n1\ninf\n", "not a finite number"},
      {banner + "array real general\n2 1\n1\n1e400\n", "too large for a double"},
      {banner + "array real general\n2 1\n1\n0x10\n", "stands where a number should"},
      {banner + "array integer general\n2 1\n1\n1.5\n", "whole number"},
      {banner + "array real symmetric\n2 3\n1 2 3 4\n", "must be square"},
      {banner + "coordinate real general\n2 2 1\n3 1 1\n", "row of an entry is \"3\""},
      {banner + "coordinate real general\n2 2 1\n1 0 1\n", "column of an entry is \"0\""},
      {banner + "coordinate real general\n2 2 2\n1 1 1\n1 1 2\n", "given twice"},
      {banner + "coordinate real symmetric\n2 2 1\n1 2 1\n", "lower triangle"},
      {banner + "coordinate real skew-symmetric\n2 2 1\n1 1 1\n", "lower triangle"},
  };
  for (const auto& [text, expected] : broken) {
    const std::string path = folder.write("broken.mtx", text);
    const std::string message = refusal([&] { read_matrix_market(path); });
    INFO(text << " -> " << message);
    CHECK_THAT(message, Catch::StartsWith(path) && Catch::Contains(expected));
    CHECK(message.find('\n') == std::string::npos);
  }
  CHECK_THAT(refusal([&] { read_matrix_market(folder.file("nowhere.mtx")); }), Catch::Contains("cannot be opened"));
}

TEST_CASE("A matrix and a vector that do not belong together are refused by name") {
  const Folder folder;
  const std::string banner = "%%MatrixMarket matrix array real general\n";
  const std::string M = folder.write("M.mtx", banner + "2 2\n1 0 0 1\n"),
                    q = folder.write("q.mtx", banner + "2 1\n-1 1\n"),
                    wide = folder.write("wide.mtx", banner + "1 2\n-1 1\n"),
                    longer = folder.write("longer.mtx", banner + "3 1\n-1 1 1\n"),
                    none = folder.write("none.mtx", banner + "0 0\n");
  const LcpProblem problem = read_lcp_matrix_market(M, q);
  CHECK(problem.n() == 2);
  CHECK_FALSE(problem.expanded);
  CHECK_THAT(refusal([&] { read_lcp_matrix_market(M, longer); }),
             Catch::StartsWith(longer) && Catch::Contains("2 x 1"));
  CHECK_THAT(refusal([&] { read_lcp_matrix_market(M, wide); }), Catch::StartsWith(wide));
  CHECK_THAT(refusal([&] { read_lcp_matrix_market(M, M); }),
             Catch::StartsWith(M) && Catch::Contains("the vector is 2 x 2"));
  CHECK_THAT(refusal([&] { read_lcp_matrix_market(none, none); }),
             Catch::StartsWith(none) && Catch::Contains("the matrix is 0 x 0; an LCP needs a square one"));
  CHECK_THAT(refusal([&] { read_lcp_matrix_market(q, q); }), Catch::StartsWith(q) && Catch::Contains("square"));
}

TEST_CASE("Siconos stores the columns of a dense matrix one after the other, although the lines look like rows") {
  for (const char* name : {"dense", "triplets", "blocks"}) {
    INFO(name);
    const LcpProblem problem = read_lcp_siconos(std::string(TEST_DATA) + "/siconos/lcp_" + name + ".dat");
    REQUIRE(problem.n() == 6);
    // Triplets: only where i + j is even. Blocks: rows 0-1 with columns 0 and 3-5, rows 2-5 with columns 1-2.
    const auto kept = [&](int i, int j) {
      if (name[0] == 't') return (i + j) % 2 == 0;
      if (name[0] == 'b') return i < 2 ? (j == 0 || j >= 3) : (j == 1 || j == 2);
      return true;
    };
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) CHECK(problem.M(i, j) == (kept(i, j) ? siconos_entry(i, j) : 0));
      CHECK(problem.q[i] == -1 - 0.5 * i);
    }
  }
}

TEST_CASE("Every broken Siconos LCP is refused in one message with its file and line") {
  const Folder folder;
  const std::vector<std::pair<std::string, std::string>> broken = {
      {"", "ends where number of unknowns"},
      {"0", "number of unknowns"},
      {"-5", "number of unknowns"},
      {"1000000000", "number of unknowns"},
      {"x", "whole number"},
      {"2 0 2 2 2 2 1 0 0 1 -1", "ends where q"},
      {"2 0 2 2 2 2 1 0 0", "more than the rest"},
      {"2 0 3 3 3 3 1 0 0 0 1 0 0 0 1 -1 -1", "square"},
      {"2 0 2 3 2 3 1 0 0 1 0 0 -1 -1", "square"},
      {"2 0 3 2 3 2 1 0 0 0 1 0 -1 -1", "square"},
      {"2 0 2 2 2 2 1 0 0 1 -1 nan", "finite"},
      {"2 5 2 2 2 2 1 0 0 1 -1 -1", "storage"},
  };
  for (const auto& [text, expected] : broken) {
    const std::string path = folder.write("broken.dat", text);
    const std::string message = refusal([&] { read_lcp_siconos(path); });
    INFO(text << " -> " << message);
    CHECK_THAT(message, Catch::StartsWith(path) && Catch::Contains(expected));
  }
  CHECK(refusal([&] { read_lcp_siconos(folder.write("good.dat", "1 0 1 1 1 1 2 -1 % the answer is 0.5")); }).empty());
}

TEST_CASE("The stored LCPs read as what their references say they are") {
  int seen = 0;
  for (const auto& entry : fs::directory_iterator(std::string(TEST_DATA) + "/problems")) {
    const std::string name = entry.path().filename().string();
    if (name.size() < 7 || name.substr(name.size() - 6) != ".M.mtx") continue;
    INFO(name);
    const std::string stem = entry.path().string().substr(0, entry.path().string().size() - 6);
    const LcpProblem problem = read_lcp_matrix_market(stem + ".M.mtx", stem + ".q.mtx");
    CHECK(problem.n() > 0);
    ++seen;
  }
  CHECK(seen == 21);
}
