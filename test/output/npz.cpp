#include "output/npz.h"

#include <catch2/catch.hpp>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>

#include "temporary.h"

using namespace cb;

namespace {

std::uint32_t number(const std::string& bytes, std::size_t at, int size) {
  std::uint32_t x = 0;
  for (int i = 0; i < size; ++i) x |= std::uint32_t(static_cast<unsigned char>(bytes.at(at + i))) << (8 * i);
  return x;
}

/// CRC-32 bit by bit, without a table.
std::uint32_t crc_of(const std::string& bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  return ~crc;
}

/// Files of a zip archive by their names, found by its central directory; all that is said twice is said alike.
std::map<std::string, std::string> unzipped(const std::string& bytes) {
  std::map<std::string, std::string> out;
  const std::size_t end = bytes.size() - 22;
  REQUIRE(bytes.substr(end, 4) == "PK\x05\x06");
  const std::uint32_t entries = number(bytes, end + 10, 2);
  CHECK(number(bytes, end + 8, 2) == entries);
  std::size_t at = number(bytes, end + 16, 4);
  CHECK(at + number(bytes, end + 12, 4) == end);
  for (std::uint32_t i = 0; i < entries; ++i) {
    REQUIRE(bytes.substr(at, 4) == "PK\x01\x02");
    const std::size_t local = number(bytes, at + 42, 4), length = number(bytes, at + 28, 2);
    const std::uint32_t size = number(bytes, at + 24, 4);
    CHECK(number(bytes, at + 20, 4) == size);
    const std::string name = bytes.substr(at + 46, length);
    REQUIRE(bytes.substr(local, 4) == std::string("PK\x03\x04"));
    CHECK(bytes.substr(local + 4, 26) == bytes.substr(at + 6, 26));  // version to extra field
    CHECK(bytes.substr(local + 30, length) == name);
    const std::string content = bytes.substr(local + 30 + length, size);
    CHECK(number(bytes, at + 16, 4) == crc_of(content));
    out[name] = content;
    at += 46 + length;
  }
  CHECK(at == end);
  return out;
}

struct Npy {
  std::string head, data;
};
Npy npy(const std::string& content) {
  REQUIRE(content.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t length = number(content, 8, 2);
  return {content.substr(10, length), content.substr(10 + length)};
}

std::vector<double> doubles(const Npy& array) {
  std::vector<double> out(array.data.size() / sizeof(double));
  std::memcpy(out.data(), array.data.data(), array.data.size());
  return out;
}

}  // namespace

TEST_CASE("an npz holds each array with its shape, its numbers and words of any letters", "[output]") {
  const TemporaryDirectory directory;
  const std::string path = directory.path() / "a.npz";
  NpzFile file(path);
  file.add("table", {2, 3}, {1, 2, 3, 4, 5, 6});
  file.add("list", {2}, {-0.5, 1e300});
  file.add("words", {"box", "\xC3\xA9\xE2\x82\xAC", "\xF0\x9D\x84\x9E", ""});  // e acute, euro; a clef
  REQUIRE(file.finish());
  const auto files = unzipped(read_file(path));
  REQUIRE(files.size() == 3);
  const Npy table = npy(files.at("table.npy")), list = npy(files.at("list.npy")), words = npy(files.at("words.npy"));
  CHECK(table.head.starts_with("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, ), }"));
  CHECK(doubles(table) == std::vector<double>{1, 2, 3, 4, 5, 6});
  CHECK(list.head.starts_with("{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }"));
  CHECK(doubles(list) == std::vector<double>{-0.5, 1e300});
  CHECK(words.head.starts_with("{'descr': '<U3', 'fortran_order': False, 'shape': (4,), }"));
  const char32_t expected[] = {U'b', U'o', U'x', 0xE9, 0x20AC, 0, 0x1D11E, 0, 0, 0, 0, 0};
  REQUIRE(words.data.size() == sizeof expected);
  CHECK(std::memcmp(words.data.data(), expected, sizeof expected) == 0);
}

TEST_CASE("a trajectory's rows become arrays by body and time; an empty cell is no number", "[output]") {
  const TemporaryDirectory directory;
  {
    std::ofstream rows(directory.path() / "trajectory.csv");
    rows << "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n"
            "0,box,1,2,3,4,5,6,7,8,9,10,11,12,13\n"
            "0,\"a \"\"b\"\", c\",14,15,16,17,18,19,20,21,22,23,24,25,26\n"
            "0.5,box,27,28,29,30,31,32,33,34,35,36,37,38,39\n"
            "0.5,\"a \"\"b\"\", c\",40,,42,43,44,45,46,47,48,49,50,51,52\n";
  }
  int error = 0;
  REQUIRE(trajectory_as_npz(directory.path(), 2, error));
  CHECK_FALSE(std::filesystem::exists(directory.path() / "trajectory.csv"));
  CHECK_FALSE(std::filesystem::exists(directory.path() / "trajectory.npz.part"));
  const auto files = unzipped(read_file(directory.path() / "trajectory.npz"));
  CHECK(files.size() == 6);
  const auto numbers = [&](const std::string& name, const std::string& shape) {
    const Npy array = npy(files.at(name + ".npy"));
    CHECK(array.head.find("'shape': " + shape) != std::string::npos);
    return doubles(array);
  };
  CHECK(numbers("t", "(2,)") == std::vector<double>{0, 0.5});
  std::vector<double> position = numbers("position", "(2, 2, 3, )");
  REQUIRE(position.size() == 12);
  CHECK(std::isnan(position[10]));
  position[10] = 41;
  CHECK(position == std::vector<double>{1, 2, 3, 14, 15, 16, 27, 28, 29, 40, 41, 42});
  CHECK(numbers("orientation", "(2, 2, 4, )") ==
        std::vector<double>{4, 5, 6, 7, 17, 18, 19, 20, 30, 31, 32, 33, 43, 44, 45, 46});
  CHECK(numbers("velocity", "(2, 2, 3, )") == std::vector<double>{8, 9, 10, 21, 22, 23, 34, 35, 36, 47, 48, 49});
  CHECK(numbers("angular_velocity", "(2, 2, 3, )") ==
        std::vector<double>{11, 12, 13, 24, 25, 26, 37, 38, 39, 50, 51, 52});
  const Npy bodies = npy(files.at("bodies.npy"));
  CHECK(bodies.head.find("'<U8'") != std::string::npos);
  const std::u32string expected = std::u32string(U"box\0\0\0\0\0", 8) + U"a \"b\", c";
  REQUIRE(bodies.data.size() == expected.size() * sizeof(char32_t));
  CHECK(std::memcmp(bodies.data.data(), expected.data(), bodies.data.size()) == 0);
}

TEST_CASE("of a trajectory the rows before one that is not whole become arrays", "[output]") {
  const std::string rest = ",1,2,3,4,5,6,7,8,9,10,11,12,13";
  for (const std::string& cut : {std::string("1"), std::string("1,a,2,3"), "1" + rest}) {
    INFO(cut);
    const TemporaryDirectory directory;
    std::ofstream(directory.path() / "trajectory.csv")
        << "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n0,a" << rest << "\n"
        << cut << "\n";
    int error = 0;
    REQUIRE(trajectory_as_npz(directory.path(), 1, error));
    const auto files = unzipped(read_file(directory.path() / "trajectory.npz"));
    CHECK(doubles(npy(files.at("t.npy"))) == std::vector<double>{0});
  }
}

TEST_CASE("a trajectory whose last time is cut short stays as rows, and so does one that finds no room", "[output]") {
  const TemporaryDirectory directory;
  const std::string head = "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n", row = ",1,2,3,4,5,6,7,8,9,10,11,12,13\n";
  const std::string cut = head + "0,a" + row + "0,b" + row + "1,a" + row;
  std::ofstream(directory.path() / "trajectory.csv") << cut;
  int error = 0;
  CHECK_FALSE(trajectory_as_npz(directory.path(), 2, error));
  CHECK(error == EIO);
  CHECK(read_file(directory.path() / "trajectory.csv") == cut);
  CHECK_FALSE(std::filesystem::exists(directory.path() / "trajectory.npz"));

  std::ofstream(directory.path() / "trajectory.csv") << head + "0,a" + row;
  std::filesystem::create_symlink("/dev/full", directory.path() / "trajectory.npz.part");
  CHECK_FALSE(trajectory_as_npz(directory.path(), 1, error));
  CHECK(error == ENOSPC);
  CHECK(std::filesystem::exists(directory.path() / "trajectory.csv"));
  CHECK_FALSE(std::filesystem::exists(directory.path() / "trajectory.npz"));
  NpzFile nowhere(directory.path() / "nowhere" / "a.npz");
  nowhere.add("x", {1}, {1});
  CHECK_FALSE(nowhere.finish());
  CHECK(nowhere.error() == ENOENT);
}
