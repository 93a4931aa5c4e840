#include "output/row_file.h"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "output/number.h"
#include "temporary.h"

using namespace cb;

namespace {

std::string printed(double x) {
  char text[number_room];
  return {text, print_number(text, x)};
}

void add(RowFile& file, const std::string& row) { file.end_row(print_text(file.begin_row(row.size()), row)); }

}  // namespace

TEST_CASE("a printed number reads back as the same double", "[output]") {
  std::mt19937_64 random(1);
  std::vector<double> numbers = {0.0,
                                 -0.0,
                                 1.0,
                                 -1.5,
                                 0.1,
                                 1e-3 * 300,
                                 std::numeric_limits<double>::denorm_min(),
                                 std::numeric_limits<double>::min(),
                                 -std::numeric_limits<double>::max(),
                                 -4.9406564584124654e-324,
                                 -1.7976931348623157e308};
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    double x;
    std::memcpy(&x, &bits, sizeof x);
    if (std::isfinite(x)) numbers.push_back(x);
  }
  for (const double x : numbers) {
    const std::string text = printed(x);
    REQUIRE(text.size() < number_room);
    const double back = std::strtod(text.c_str(), nullptr);
    REQUIRE(std::memcmp(&back, &x, sizeof x) == 0);
  }
}

TEST_CASE("what is no number leaves its cell empty", "[output]") {
  CHECK(printed(std::numeric_limits<double>::quiet_NaN()).empty());
  CHECK(printed(std::numeric_limits<double>::infinity()).empty());
  CHECK(printed(-std::numeric_limits<double>::infinity()).empty());
  char text[number_room];
  CHECK(print_number(text, std::optional<double>()) == text);
}

TEST_CASE("a cell with a comma or a quote is quoted", "[output]") {
  CHECK(csv_cell("box") == "box");
  CHECK(csv_cell("box, left") == "\"box, left\"");
  CHECK(csv_cell("the \"box\"") == "\"the \"\"box\"\"\"");
}

TEST_CASE("rows arrive in order however often the buffer fills up", "[output]") {
  TemporaryDirectory directory;
  const auto path = directory.path() / "rows.csv";
  std::string all = "a,b\n";
  {
    RowFile file(path, "a,b\n");
    CHECK(read_file(path) == "a,b\n");  // the header is there at once
    const std::string filler(200, 'x');
    for (int i = 0; i < 20000; ++i) {
      const std::string row = std::to_string(i) + "," + filler + "\n";
      add(file, row);
      all += row;
    }
    const std::string so_far = read_file(path);
    CHECK(so_far.size() > 4);
    CHECK(so_far.back() == '\n');
    CHECK(file.ok());
  }
  CHECK(read_file(path) == all);
}

TEST_CASE("a row longer than the buffer is written whole", "[output]") {
  TemporaryDirectory directory;
  const auto path = directory.path() / "rows.csv";
  const std::string row = std::string(3 * RowFile::capacity, 'x') + '\n';
  {
    RowFile file(path, "h\n");
    add(file, "short\n");
    add(file, row);
    add(file, "short\n");
  }
  CHECK(read_file(path) == "h\nshort\n" + row + "short\n");
}

TEST_CASE("a file whose disk is full ends with a whole row and keeps the error", "[output]") {
  TemporaryDirectory directory;
  const auto path = directory.path() / "rows.csv";
  // A file size limit stands for the full disk; the write that crosses it is cut short in the middle of a row.
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before;
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  rlimit small = before;
  small.rlim_cur = 1005;
  RowFile file(path, "header\n");
  REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
  for (int i = 0; i < 300; ++i) {
    add(file, "123456789\n");
    if (i == 49) file.flush();  // what was written before counts, too
  }
  file.flush();
  CHECK_FALSE(file.ok());
  CHECK(file.error() == EFBIG);
  add(file, "more\n");
  file.flush();
  REQUIRE(setrlimit(RLIMIT_FSIZE, &before) == 0);

  // 7 of the header and as many rows of 10 as go into 1005.
  const std::string text = read_file(path);
  CHECK(text.size() == 7 + 10 * 99);
  CHECK(text.back() == '\n');
}

TEST_CASE("a device without room is an error, not a crash", "[output]") {
  RowFile file("/dev/full", "header\n");
  CHECK(file.error() == ENOSPC);
  add(file, "row\n");
}

TEST_CASE("a file in a folder that is not there is an error", "[output]") {
  TemporaryDirectory directory;
  RowFile file(directory.path() / "nowhere" / "rows.csv", "header\n");
  CHECK(file.error() == ENOENT);
}
