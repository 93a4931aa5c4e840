// Impulses from files, in each of the forms that they come in; and the answer that goes into a problem's own file.

#include "contact/answer_files.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "contact/problem_files.h"
#include "problems.h"
#include "temporary.h"

using namespace cb;

namespace {

using Folder = TemporaryDirectory;

std::vector<double> read(const std::string& text, int nc) {
  const Folder folder;
  std::ofstream(folder.file("r"), std::ios::binary) << text;
  return read_impulses(folder.file("r"), nc);
}

std::string refusal(const std::string& text, int nc) {
  try {
    read(text, nc);
    return "";
  } catch (const FileError& error) {
    return error.what();
  }
}

const std::string matrix = "%%MatrixMarket matrix array real general\n";

}  // namespace

TEST_CASE("Impulses are read contact by contact, whatever the file's form") {
  const std::vector<double> two = {1, 2, 3, 4, 5, 6};
  CHECK(read("1 2 3\n4 5 6\n", 2) == two);
  CHECK(read(" 1\n2\n3\n4\n5\n6", 2) == two);
  // A matrix stands column by column: a vector, a column each, a row each.
  CHECK(read(matrix + "6 1\n1\n2\n3\n4\n5\n6\n", 2) == two);
  CHECK(read(matrix + "3 2\n1\n2\n3\n4\n5\n6\n", 2) == two);
  CHECK(read(matrix + "2 3\n1\n4\n2\n5\n3\n6\n", 2) == two);
  // Of three contacts a square matrix has a row each.
  CHECK(read(matrix + "3 3\n1\n4\n7\n2\n5\n8\n3\n6\n9\n", 3) == std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9});
  for (const char* size : {"3 1\n", "1 3\n"})
    CHECK(read(matrix + size + "1\n2\n3\n", 1) == std::vector<double>{1, 2, 3});
  CHECK(read("%%MatrixMarket matrix coordinate real general\n6 1 2\n2 1 -7\n6 1 8\n", 2) ==
        std::vector<double>{0, -7, 0, 0, 0, 8});
}

TEST_CASE("Another number of impulses than the contacts need is refused, with both numbers") {
  for (const std::string& text : {std::string("1 2 3 4"), matrix + "4 1\n1\n2\n3\n4\n"}) {
    CHECK_THAT(refusal(text, 2), Catch::Contains("holds 4 impulses; 2 contacts need 6 (n, t1, t2 of each)"));
    CHECK_THAT(refusal(text, 1), Catch::Contains("holds 4 impulses; 1 contacts need 3"));
  }
  CHECK_THAT(refusal("", 1), Catch::Contains("holds 0 impulses"));
  CHECK_THAT(refusal("1 2 x", 1), Catch::Contains("r:1"));
  CHECK_THROWS_AS(read_impulses("/nowhere/at/all", 1), FileError);
}

#ifdef CONTACTBENCH_HAVE_HDF5

#include <hdf5.h>

namespace {

std::vector<double> dataset(const std::string& path, const char* where) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  const hid_t data = H5Dopen2(file, where, H5P_DEFAULT);
  REQUIRE(data >= 0);
  const hid_t space = H5Dget_space(data);
  std::vector<double> out(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, out.data());
  H5Sclose(space);
  H5Dclose(data);
  H5Fclose(file);
  return out;
}

}  // namespace

TEST_CASE("An answer in a problem's file stands as FCLIB has it, velocities in the file's own order of unknowns") {
  const Folder folder;
  const ContactProblem p = test::sphere({1, -2, 3}, {4, 5, 6});
  StoredAnswer answer;
  answer.impulse = {0.1, 0.2, 0.3};
  answer.v_plus = {10, 11, 12, 13, 14, 15};
  answer.u_plus = {-1, -2, -3};
  // Unknown i of ours is row order[i] of the file.
  const std::vector<int> order = {5, 3, 1, 0, 2, 4};
  write_contact_problem(folder.file("p.hdf5"), p, "", order, &answer);
  CHECK(dataset(folder.file("p.hdf5"), "/solution/r") == answer.impulse);
  CHECK(dataset(folder.file("p.hdf5"), "/solution/u") == answer.u_plus);
  CHECK(dataset(folder.file("p.hdf5"), "/solution/v") == std::vector<double>{13, 12, 14, 11, 15, 10});
  const std::vector<double> f = dataset(folder.file("p.hdf5"), "/fclib_global/vectors/f");
  const double m = p.M.block(0)(0, 0);
  CHECK(f[5] == m * 1);
  CHECK(f[3] == m * -2);
  CHECK(f[1] == m * 3);
  CHECK(f[2] == 0.4 * m * 5);
  CHECK(read_impulses(folder.file("p.hdf5"), 1) == answer.impulse);
  CHECK_THROWS_AS(read_impulses(folder.file("p.hdf5"), 2), FileError);
  // Beside it the problem is the same.
  const StoredProblem back = read_contact_problem(folder.file("p.hdf5"));
  std::vector<double> u, u_back;
  contact_velocity(p, p.v_minus, u);
  contact_velocity(back.problem, back.problem.v_minus, u_back);
  CHECK(u_back == u);

  write_contact_problem(folder.file("bare.hdf5"), p);
  try {
    read_impulses(folder.file("bare.hdf5"), 1);
    FAIL("there is no answer");
  } catch (const FileError& error) {
    CHECK_THAT(error.what(), Catch::Contains("bare.hdf5: holds no /solution"));
  }
}

#endif
