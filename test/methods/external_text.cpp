// How a contact problem is told to another program: every number in its place, as text and as bytes.

#include "methods/external_text.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <sstream>

#include "linalg/file_error.h"
#include "temporary.h"

using namespace cb;

namespace {

/// Blocks of 2 and 1 rows, a contact of both and one of the second alone.
ContactProblem small() {
  ContactProblem p;
  p.M.add_block(2);
  p.M.add_block(1);
  p.M.values = {2, 0.5, 0.5, 3, 4};
  p.J.add_band();
  p.J.add_entry(0, 2);
  p.J.add_entry(1, 1);
  p.J.add_band();
  p.J.add_entry(1, 1);
  p.J.values = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  p.v_minus = {-1, 0.1, -1e-300};
  p.offset = {21, 22, 23, 24, 25, 26};
  p.mu = {0.25, 0};
  p.restitution = {0.75, 1};
  return p;
}

const std::string body =
    "size 2 1\nentry 0 0 0 1 1 1\nM 2 0.5 0.5 3 4\nJ 1 2 3 4 5 6 7 8 9 10 11 12\nv -1 0.1 -1e-300\n"
    "w 21 22 23 24 25 26\nmu 0.25 0\ne 0.75 1\nend\n";

template <class Number>
std::vector<Number> take(const std::string& bytes, std::size_t& at, std::size_t count) {
  std::vector<Number> out(count);
  REQUIRE(at + count * sizeof(Number) <= bytes.size());
  std::memcpy(out.data(), bytes.data() + at, count * sizeof(Number));
  at += count * sizeof(Number);
  return out;
}

}  // namespace

TEST_CASE("a problem as text has its sizes, then a line for each of its lists, and ends") {
  std::string text = "before\n";
  append_text(small(), 17, text);
  CHECK(text == "before\nproblem 17 2 3 2 3 " + std::to_string(body.size()) + "\n" + body);
}

TEST_CASE("a problem as bytes has the same head, and the same numbers in the same order") {
  std::string bytes;
  append_binary(small(), 18, bytes);
  const std::size_t numbers = (2 + 6) * 4 + (5 + 12 + 3 + 6 + 2 + 2) * 8;
  const std::string head = "problem 18 2 3 2 3 " + std::to_string(numbers) + "\n";
  REQUIRE(bytes.substr(0, head.size()) == head);
  REQUIRE(bytes.size() == head.size() + numbers);
  std::size_t at = head.size();
  const ContactProblem p = small();
  CHECK(take<int>(bytes, at, 2) == std::vector<int>{2, 1});
  CHECK(take<int>(bytes, at, 6) == std::vector<int>{0, 0, 0, 1, 1, 1});
  CHECK(take<double>(bytes, at, 5) == p.M.values);
  CHECK(take<double>(bytes, at, 12) == p.J.values);
  CHECK(take<double>(bytes, at, 3) == p.v_minus);
  CHECK(take<double>(bytes, at, 6) == p.offset);
  CHECK(take<double>(bytes, at, 2) == p.mu);
  CHECK(take<double>(bytes, at, 2) == p.restitution);
}

TEST_CASE("a problem in a file is its text, and a file that cannot be is an error with its name") {
  const TemporaryDirectory directory;
  write_external_text(directory.file("problem"), small(), 3);
  CHECK(read_file(directory.path() / "problem") == "problem 3 2 3 2 3 " + std::to_string(body.size()) + "\n" + body);
  CHECK_THROWS_WITH(write_external_text("/nowhere/at/all", small(), 1),
                    Catch::Contains("/nowhere/at/all: cannot be opened"));
  CHECK_THROWS_WITH(write_external_text("/dev/full", small(), 1),
                    "/dev/full: could not be written to its end; is the disk full?");
}
