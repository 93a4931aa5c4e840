#include "contact/problem_files.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "linalg/text_file.h"
#include "temporary.h"

using namespace cb;

namespace {

namespace fs = std::filesystem;

using Folder = TemporaryDirectory;

std::string write(const Folder& folder, const std::string& name, const std::string& text) {
  std::ofstream(folder.file(name), std::ios::binary) << text;
  return folder.file(name);
}

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream out;
  out << in.rdbuf();
  return out.str();
}

// The message with which a file is refused; empty where it is read.
std::string refusal(const std::string& path, const ProblemFileOptions& options = {}) {
  try {
    read_contact_problem(path, options);
    return "";
  } catch (const FileError& error) {
    return error.what();
  }
}

// W by its definition, J M^-1 J^T.
Eigen::MatrixXd delassus_of(const ContactProblem& problem) {
  BlockCholesky factor;
  REQUIRE(factor.factor(problem.M));
  Eigen::MatrixXd W;
  delassus(problem, factor, W);
  return W;
}

const std::string friction_text = text_of(std::string(TEST_DATA) + "/siconos/friction_dense.dat");

}  // namespace

TEST_CASE("A problem that comes by W and q becomes one with the same W, the same velocity and mass one") {
  for (const char* name : {"dense", "blocks", "triplets", "columns"}) {
    INFO(name);
    const StoredProblem stored = read_contact_problem(std::string(TEST_DATA) + "/siconos/friction_" + name + ".dat");
    REQUIRE(stored.format == ProblemFormat::siconos_text);
    const ContactProblem& p = stored.problem;
    REQUIRE(p.nc() == 2);
    CHECK(p.mu == std::vector<double>{0.3, 0.7});
    CHECK(p.restitution == std::vector<double>{0, 0});
    // The numbers that the library was given: W_ij = 4 [i = j] + (i j mod 5) / 16, halved between the contacts.
    Eigen::MatrixXd W(6, 6);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) W(i, j) = (i == j ? 4 : 0) + 0.0625 * (i * j % 5) * (i / 3 == j / 3 ? 1 : 0.5);
    CHECK((delassus_of(p) - W).cwiseAbs().maxCoeff() < 1e-14);
    std::vector<double> u;
    contact_velocity(p, p.v_minus, u);
    for (int i = 0; i < 6; ++i) CHECK(u[i] == Approx(-1 - 0.5 * i).epsilon(1e-15));
    for (int b = 0; b < p.M.blocks(); ++b) CHECK(p.M.block(b).isIdentity(0));
  }
}

TEST_CASE("What follows a Siconos friction problem is comment") {
  const Folder folder;
  CHECK(refusal(write(folder, "more.dat", friction_text + "\n1\nsolution of 2004\n")).empty());
}

TEST_CASE("An unsymmetric W is refused, and symmetrised on request with a note") {
  const Folder folder;
  // W = [[2, 1, 0], [0, 2, 0], [0, 0, 2]] stored by columns; its symmetric part has 1/2 off the diagonal.
  const std::string path = write(folder, "skew.dat", "3 1 0 3 3 3 3\n2 0 0  1 2 0  0 0 2\n-1 0 0\n0.5\n");
  const std::string message = refusal(path);
  CHECK_THAT(message, Catch::Contains(path) && Catch::Contains("--symmetrise") && Catch::Contains("0.5"));
  const StoredProblem stored = read_contact_problem(path, {.symmetrise = true});
  CHECK(stored.asymmetry == 0.5);
  REQUIRE(stored.notes.size() == 1);
  CHECK(stored.notes[0] == "W symmetrised: it differed from its transpose by 0.5 of its largest entry");
  Eigen::Matrix3d W;
  W << 2, 0.5, 0, 0.5, 2, 0, 0, 0, 2;
  CHECK((delassus_of(stored.problem) - W).cwiseAbs().maxCoeff() < 1e-15);
}

TEST_CASE("A W with a clearly negative eigenvalue is refused, one that is singular keeps its rank") {
  const Folder folder;
  // Eigenvalues 3, -1, 1: no mass gives this.
  const std::string bad = write(folder, "bad.dat", "3 1 0 3 3 3 3\n1 2 0  2 1 0  0 0 1\n-1 0 0\n0.5\n");
  CHECK_THAT(refusal(bad), Catch::Contains(bad) && Catch::Contains("semidefinite"));
  CHECK_THAT(refusal(bad, {.symmetrise = true}), Catch::Contains("semidefinite"));
  // The same contact twice: rank 3 of 6.
  const std::string twice = write(folder, "twice.dat",
                                  "3 2 0 6 6 6 6\n2 0 0 2 0 0  0 1 0 0 1 0  0 0 1 0 0 1\n2 0 0 2 0 0  0 1 0 0 1 0  "
                                  "0 0 1 0 0 1\n-1 1 0 -1 1 0\n0.5 0.5\n");
  const StoredProblem stored = read_contact_problem(twice);
  CHECK(stored.rank == 3);
  CHECK(stored.problem.nv() == 3);
  // One body of 1/2 kg (n) and 1 kg (t) that moves at (-1, 1, 0): kinetic energy 1/4 + 1/2.
  CHECK(0.5 * quadratic_form(stored.problem.M, stored.problem.v_minus) == Approx(0.75).epsilon(1e-12));
}

TEST_CASE("Bodies without contact between them stay apart when only W is known") {
  const Folder folder;
  const std::string path =
      write(folder, "apart.dat",
            "3 2 2 6 6 1\nCSparse\ntriplet: 6-by-6, nzmax: 6 nnz: 6\n0 0 : 1\n1 1 : 1\n2 2 : 1\n3 3 "
            ": 4\n4 4 : 4\n5 5 : 4\n-1 0 0 -2 0 0\n0.5 0.5");
  const StoredProblem stored = read_contact_problem(path);
  CHECK(stored.problem.M.blocks() == 2);
  for (int c = 0; c < 2; ++c) CHECK(stored.problem.J.band[c + 1] - stored.problem.J.band[c] == 1);
}

TEST_CASE("Every broken friction text is refused in one message with its file and line") {
  const Folder folder;
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = friction_text;
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
  };
  const std::vector<std::pair<std::string, std::string>> broken = {
      {"", "ends where dimension"},
      {"garbage and more of it", "whole number"},
      {"2 2 0 4 4 4 4 1 0 0 0", "dimension 2"},
      {"4 2 0", "from 2 to 3"},
      {"3 0 0 0 0", "number of contacts"},
      {"3 -2 0 6 6", "number of contacts"},
      {"3 2.5 0 6 6", "whole number"},
      {"3 99999999999999999999 0 6 6", "number of contacts"},
      {"3 333333 0 999999 999999 999999 999999 1 2 3", "more than the rest of the file holds"},
      {"3 2 7 6 6 6 6", "storage"},
      {"3 2 0 6 5 6 5" + friction_text.substr(friction_text.find("6\t6") + 3), "square"},
      {"3 2 0 6 6 6 7 0 0", "two statements of its size differ"},
      {replaced("4.000000000000000000000000e+00", "nan"), "not a finite number"},
      {replaced("4.000000000000000000000000e+00", "-inf"), "not a finite number"},
      {replaced("4.000000000000000000000000e+00", "1.0e+999"), "too large"},
      {replaced("4.000000000000000000000000e+00", "1,0"), "stands where a number should"},
      {replaced("6.999999999999999555910790e-01", "-0.7"), "must not be negative"},
      {friction_text.substr(0, friction_text.size() / 2), "ends where W"},
      {friction_text.substr(0, friction_text.rfind("6.99")), "ends where mu"},
      {"3 1 0 3 3 3 3  0 0 0 0 0 0 0 0 0  -1 0 0  0.5", "no mobility"},
      {"3 1 1 3 3 1 1 1 2 3 2 1 0 1 0 0 1 0 0 0 1 0 0 0 1 1 1 1 1", "end of a block row"},
      {"3 1 1 3 3 1 1 1 3 3 2 1 0 1 5 0 1 0 0 0 1 0 0 0 1 1 1 1 1", "column of a block"},
      {"3 1 1 3 3 1 1 1 3 3 2 1 0 1 0 3 1 0 0 0 1 0 0 0 1 1 1 1 1", "number of a block"},
      {"3 1 2 3 3 1\nCSparse\ntriplet: 3-by-3, nzmax: 3 nnz: 3\n0 0 : 1\n1 1 : 1\n3 2 : 1\n-1 0 0 0.5", "row"},
      {"3 1 2 3 3 1\nCSparse\ntriplet: 4-by-3, nzmax: 3 nnz: 3\n0 0 : 1\n1 1 : 1\n2 2 : 1\n-1 0 0 0.5", "3-by-3"},
      {"3 1 2 3 3 3\nCSparse\n3-by-3, nzmax: 3 nnz: 3, 1-norm: 1", "origin"},
      {"3 1 2 3 3 2\nCSparse\n3-by-3, nzmax: 1 nnz: 1, 1-norm: 1 col 0 : locations 0 to 7 0 : 1 1 : 2 2 : 2",
       "last entry"},
  };
  for (std::size_t i = 0; i < broken.size(); ++i) {
    INFO(i << ": " << broken[i].first.substr(0, 60));
    const std::string path = write(folder, "broken.dat", broken[i].first);
    const std::string message = refusal(path);
    CHECK_THAT(message, Catch::StartsWith(path) && Catch::Contains(broken[i].second));
    CHECK(message.find('\n') == std::string::npos);
  }
  CHECK_THAT(refusal(folder.file("nowhere.dat")), Catch::Contains("nowhere.dat: cannot be opened"));
  CHECK_THAT(refusal(folder.path().string()), Catch::Contains("is a folder"));
}

#ifdef CONTACTBENCH_HAVE_HDF5

#include <hdf5.h>

namespace {

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
  return true;
}

bool same_bits(const ContactProblem& a, const ContactProblem& b) {
  return a.M.first == b.M.first && same_bits(a.M.values, b.M.values) && a.J.band == b.J.band &&
         a.J.block == b.J.block && a.J.offset == b.J.offset && same_bits(a.J.values, b.J.values) &&
         same_bits(a.v_minus, b.v_minus) && same_bits(a.offset, b.offset) && same_bits(a.mu, b.mu) &&
         same_bits(a.restitution, b.restitution);
}

// Two bodies and three contacts with awkward numbers: subnormal, negative zero, thirds.
ContactProblem awkward_problem() {
  ContactProblem p;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const int size : {6, 2, 6}) {
    const int b = p.M.add_block(size);
    Eigen::MatrixXd A(size, size);
    for (int i = 0; i < A.size(); ++i) A.data()[i] = any(random);
    const Eigen::MatrixXd B = A * A.transpose() + Eigen::MatrixXd::Identity(size, size) / 3;
    p.M.block(b) = (B + B.transpose()) / 2;
  }
  // A free body: zeros off the inertia, one of them negative.
  p.M.block(2).topRightCorner(3, 3).setZero();
  p.M.block(2).bottomLeftCorner(3, 3).setZero();
  p.M.block(2)(0, 5) = p.M.block(2)(5, 0) = -0.0;
  for (const auto& blocks : {std::vector<int>{0, 2}, {1}, {1, 2}}) {
    p.J.add_band();
    for (const int b : blocks) {
      const int e = p.J.add_entry(b, p.M.block_size(b));
      for (int i = 0; i < p.J.entry(e).size(); ++i) p.J.entry(e).data()[i] = any(random);
    }
  }
  p.J.entry(0)(0, 0) = -0.0;
  p.J.entry(0)(1, 1) = 5e-324;
  p.J.entry(1)(2, 3) = 0;
  for (int i = 0; i < p.nv(); ++i) p.v_minus.push_back(any(random) / 3);
  for (int i = 0; i < 9; ++i) p.offset.push_back(i == 4 ? -0.0 : any(random) * 1e-3);
  p.mu = {0, 0.1, 1.0 / 3};
  p.restitution = {0, 1, 0.3};
  return p;
}

// The datasets of an FCLIB file, to be broken one at a time.
struct Dataset {
  std::vector<double> x;
  std::vector<long long> n;
  bool whole = false;
  bool empty_chunks = false;  ///< claims claimed numbers without storing one
  hsize_t claimed = 0;
  int rank = 1;         ///< dimensions: 0 of a number alone, 2 of a column
  bool summed = false;  ///< kept with a check sum
};
using Content = std::map<std::string, Dataset>;

Dataset numbers(std::vector<double> x) { return {.x = std::move(x), .n = {}}; }
Dataset integers(std::vector<long long> n) { return {.x = {}, .n = std::move(n), .whole = true}; }

std::string save(const Folder& folder, const std::string& name, const Content& content) {
  const std::string path = folder.file(name);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t links = H5Pcreate(H5P_LINK_CREATE), create = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_create_intermediate_group(links, 1);
  for (const auto& [where, set] : content) {
    hsize_t size = set.whole ? set.n.size() : set.x.size();
    hid_t properties = H5P_DEFAULT;
    if (set.empty_chunks) {
      size = set.claimed;
      const hsize_t chunk = std::min<hsize_t>(64, size);
      H5Pset_chunk(create, 1, &chunk);
      properties = create;
    }
    if (set.summed) {
      H5Pset_chunk(create, 1, &size);
      H5Pset_fletcher32(create);
      properties = create;
    }
    const hsize_t sizes[] = {size, 1};
    const hid_t space = set.rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(set.rank, sizes, nullptr);
    const hid_t type = set.whole ? H5T_NATIVE_LLONG : H5T_NATIVE_DOUBLE;
    const hid_t data = H5Dcreate2(file, where.c_str(), type, space, links, properties, H5P_DEFAULT);
    REQUIRE(data >= 0);
    if (!set.empty_chunks)
      H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT,
               set.whole ? static_cast<const void*>(set.n.data()) : set.x.data());
    H5Dclose(data);
    H5Sclose(space);
  }
  H5Pclose(create);
  H5Pclose(links);
  H5Fclose(file);
  return path;
}

// One body of 2 kg on one contact: x, z of the contact swapped against those of the body, spin about nothing.
Content small_global() {
  Content c;
  c["/fclib_global/spacedim"] = integers({3});
  c["/fclib_global/M/m"] = c["/fclib_global/M/n"] = c["/fclib_global/M/nz"] = c["/fclib_global/M/nzmax"] =
      integers({3});
  c["/fclib_global/M/p"] = c["/fclib_global/M/i"] = integers({0, 1, 2});
  c["/fclib_global/M/x"] = numbers({2, 2, 2});
  c["/fclib_global/H/m"] = c["/fclib_global/H/n"] = c["/fclib_global/H/nzmax"] = integers({3});
  c["/fclib_global/H/nz"] = integers({-1});
  c["/fclib_global/H/p"] = integers({0, 1, 2, 3});
  c["/fclib_global/H/i"] = integers({2, 1, 0});
  c["/fclib_global/H/x"] = numbers({1, 1, 1});
  c["/fclib_global/vectors/f"] = numbers({2, 0, -4});
  c["/fclib_global/vectors/w"] = numbers({0.5, 0, 0});
  c["/fclib_global/vectors/mu"] = numbers({0.3});
  return c;
}

Content small_local() {
  Content c;
  c["/fclib_local/spacedim"] = integers({3});
  c["/fclib_local/W/m"] = c["/fclib_local/W/n"] = c["/fclib_local/W/nz"] = c["/fclib_local/W/nzmax"] = integers({3});
  c["/fclib_local/W/p"] = c["/fclib_local/W/i"] = integers({0, 1, 2});
  c["/fclib_local/W/x"] = numbers({0.5, 0.5, 0.5});
  c["/fclib_local/vectors/q"] = numbers({-2, 0, 1});
  c["/fclib_local/vectors/mu"] = numbers({0.3});
  return c;
}

}  // namespace

TEST_CASE("A global problem gives v- = M^-1 f, and the same Delassus matrix as its local form") {
  const Folder folder;
  const StoredProblem global = read_contact_problem(save(folder, "global.hdf5", small_global()));
  REQUIRE(global.format == ProblemFormat::fclib_global);
  // v- = f / 2 = (1, 0, -2); u_n = z, u_t2 = x.
  const std::vector<double> v_expected = {1, 0, -2}, u_expected = {-1.5, 0, 1};
  for (int i = 0; i < 3; ++i) CHECK(global.problem.v_minus[i] == Approx(v_expected[i]).epsilon(1e-15));
  std::vector<double> u;
  contact_velocity(global.problem, global.problem.v_minus, u);
  for (int i = 0; i < 3; ++i) CHECK(u[i] == Approx(u_expected[i]).epsilon(1e-15));
  const StoredProblem local = read_contact_problem(save(folder, "local.hdf5", small_local()));
  REQUIRE(local.format == ProblemFormat::fclib_local);
  CHECK((delassus_of(global.problem) - delassus_of(local.problem)).cwiseAbs().maxCoeff() < 1e-15);
}

TEST_CASE("In triplets p holds the columns and i the rows") {
  const Folder folder;
  Content content = small_global();
  // H has one entry at row 2 of M's unknowns for u_n (column 0), one at row 0 for u_t2 (column 2), and a fourth that is
  // given in two parts; nzmax says more than there is.
  content["/fclib_global/H/nz"] = integers({4});
  content["/fclib_global/H/nzmax"] = integers({50});
  content["/fclib_global/H/p"] = integers({0, 1, 2, 1});
  content["/fclib_global/H/i"] = integers({2, 1, 0, 1});
  content["/fclib_global/H/x"] = numbers({1, 0.25, 1, 0.75});
  const StoredProblem triplets = read_contact_problem(save(folder, "triplets.hdf5", content));
  const StoredProblem columns = read_contact_problem(save(folder, "columns.hdf5", small_global()));
  CHECK(same_bits(triplets.problem, columns.problem));
}

TEST_CASE("Compressed rows hold the transpose of compressed columns, and nzmax may exceed what is used") {
  const Folder folder;
  Content content = small_global();
  // The same H: row 0 has column 2, row 1 column 1, row 2 column 0; then numbers that belong to nobody.
  content["/fclib_global/H/nz"] = integers({-2});
  content["/fclib_global/H/nzmax"] = integers({5});
  content["/fclib_global/H/i"] = integers({2, 1, 0, 0, 0});
  content["/fclib_global/H/x"] = numbers({1, 1, 1, 7, 7});
  const StoredProblem rows = read_contact_problem(save(folder, "rows.hdf5", content));
  const StoredProblem columns = read_contact_problem(save(folder, "columns.hdf5", small_global()));
  CHECK(same_bits(rows.problem, columns.problem));
}

TEST_CASE("A stored solution is never taken for an answer") {
  const Folder folder;
  Content content = small_global();
  content["/solution/r"] = numbers({0, 0, 0});
  content["/solution/u"] = numbers({0, 0});
  CHECK(refusal(save(folder, "solution.hdf5", content)).empty());
}

TEST_CASE("A body whose mass matrix was stored without its zeros is one block, whatever its contact's rows look like") {
  const Folder folder;
  Content content = small_global();
  content["/fclib_global/H/nzmax"] = integers({4});
  content["/fclib_global/H/p"] = integers({0, 1, 3, 4});
  content["/fclib_global/H/i"] = integers({2, 1, 2, 0});
  content["/fclib_global/H/x"] = numbers({1, 1, 0.5, 1});
  const ContactProblem p = read_contact_problem(save(folder, "uneven.hdf5", content)).problem;
  CHECK(p.M.blocks() == 1);
  CHECK(p.M.block(0).isApprox(2 * Eigen::Matrix3d::Identity()));
}

TEST_CASE("Every broken FCLIB file is refused in one message with its file and dataset") {
  const Folder folder;
  const auto global = [](const std::string& where, Dataset set) {
    Content c = small_global();
    c["/fclib_global" + where] = std::move(set);
    return c;
  };
  const auto without = [](Content c, const std::string& where) {
    c.erase(where);
    return c;
  };
  const auto both = [] {
    Content c = small_global();
    c.merge(small_local());
    return c;
  };
  const double nan = std::nan(""), inf = INFINITY;
  std::vector<std::pair<Content, std::string>> broken = {
      {Content{}, "neither /fclib_global nor /fclib_local"},
      {both(), "both"},
      {global("/spacedim", integers({2})), "spacedim: is 2"},
      {global("/spacedim", integers({4})), "spacedim: entry 0 is 4"},
      {global("/spacedim", integers({3, 3})), "spacedim: holds 2 numbers"},
      {global("/spacedim", numbers({3})), "spacedim: must hold whole numbers"},
      {global("/M/m", integers({-3})), "M/m: entry 0 is -3"},
      {global("/M/m", integers({3000000000})), "M/m: entry 0 is 3000000000"},
      {global("/M/m", integers({1LL << 62})), "M/m"},
      {global("/M/m", integers({2})), "M/i"},
      {global("/M/n", integers({2})), "M/p"},
      {global("/M/m", integers({4})), "is not square"},
      {global("/M/nz", integers({-3})), "M/nz: entry 0 is -3"},
      {global("/M/nz", integers({4})), "the matrix has 4 entries"},
      {global("/M/nzmax", integers({2})), "M/nzmax: is 2"},
      {global("/M/nzmax", integers({-1})), "M/nzmax"},
      {global("/M/p", numbers({0, 1, 2})), "M/p: must hold whole numbers"},
      {global("/M/p", integers({0, 1, 3})), "M/p: entry 2 is 3"},
      {global("/M/p", integers({0, 1})), "M/p: holds 2 numbers"},
      {global("/M/i", integers({0, -1, 2})), "M/i: entry 1 is -1"},
      {global("/M/i", integers({0, 1})), "M/i: holds 2 numbers; the matrix has 3 entries"},
      {global("/M/x", integers({2, 2, 2})), "M/x: must hold floating-point numbers"},
      {global("/M/x", numbers({2, 2})), "M/x: holds 2 numbers"},
      {global("/M/x", numbers({2, nan, 2})), "M/x: entry 1 is not a finite number"},
      {global("/M/x", numbers({2, inf, 2})), "M/x: entry 1 is not a finite number"},
      {global("/M/x", numbers({2, -2, 2})), "M: entry (1, 1) is -2; M must be positive definite"},
      {global("/M/x", numbers({2, 0, 2})), "positive definite"},
      {global("/H/p", integers({0, 1, 2})), "H/p: holds 3 numbers; compressed columns need 4"},
      {global("/H/p", integers({1, 1, 2, 3})), "H/p: must begin with 0"},
      {global("/H/p", integers({0, 2, 1, 3})), "H/p: falls"},
      {global("/H/p", integers({0, 1, 2, 4})), "the matrix has 4 entries"},
      {global("/H/i", integers({2, 1, 3})), "H/i: entry 2 is 3"},
      {global("/H/x", numbers({0, 0, 0})), "moves nothing"},
      {global("/H/x", numbers({1, 1})), "H/x: holds 2 numbers; the matrix has 3 entries"},
      {global("/H/x", {.x = {}, .n = {}, .empty_chunks = true, .claimed = 3}), "H/x: was never written"},
      {global("/H/x", {.x = {}, .n = {}, .empty_chunks = true, .claimed = 1ULL << 40}), "H/x: claims"},
      {global("/vectors/f", numbers({1, 2})), "vectors/f: holds 2 numbers; 3 belong here"},
      {global("/vectors/w", numbers({1, 2, 3, 4})), "vectors/w: holds 4 numbers; 3 belong here"},
      {global("/vectors/w", numbers({1, 2, nan})), "vectors/w: entry 2"},
      {global("/vectors/mu", numbers({})), "vectors/mu: holds 0 numbers"},
      {global("/vectors/mu", numbers({-0.1})), "mu of contact 0 is -0.1"},
      {global("/vectors/mu", integers({1})), "vectors/mu: must hold floating-point numbers"},
      {global("/vectors/f", {.x = {2, 0, -4}, .n = {}, .rank = 2}), "vectors/f: must be a list (one dimension)"},
      {global("/G/n", integers({2})), "bilateral"},
      {global("/G/m", integers({2})), "bilateral"},
  };
  for (const auto& [where, set] : small_global()) {
    static_cast<void>(set);
    broken.emplace_back(without(small_global(), where), where + ": is missing");
  }
  for (const auto& [where, set] : small_local()) {
    static_cast<void>(set);
    broken.emplace_back(without(small_local(), where), where + ": is missing");
  }
  Content c = small_global();
  c["/fclib_global/M/nz"] = c["/fclib_global/M/nzmax"] = integers({4});
  c["/fclib_global/M/p"] = integers({0, 1, 2, 0});
  c["/fclib_global/M/i"] = integers({0, 1, 2, 1});
  c["/fclib_global/M/x"] = numbers({2, 2, 2, 0.5});
  broken.emplace_back(c, "M is not symmetric at (0, 1)");
  c["/fclib_global/M/p"] = integers({0, 1, 2, 2});  // in the second of two blocks
  c["/contactbench/first"] = integers({0, 1, 3});
  broken.emplace_back(c, "M is not symmetric at (1, 2)");
  c = small_global();
  c["/fclib_global/H/n"] = integers({6});
  c["/fclib_global/H/p"] = integers({0, 1, 2, 3, 3, 3, 3});
  c["/fclib_global/vectors/w"] = numbers({0, 0, 0, 0, 0, 0});
  c["/fclib_global/vectors/mu"] = numbers({0.3, 0.3});
  broken.emplace_back(c, "H: contact 1 moves nothing");
  c = small_global();
  c["/fclib_global/H/n"] = integers({2});
  c["/fclib_global/H/p"] = integers({0, 1, 2});
  c["/fclib_global/vectors/w"] = numbers({0, 0});
  broken.emplace_back(c, "H/n: is 2; three for each contact");
  c = small_global();
  c["/fclib_global/H/n"] = c["/fclib_global/H/p"] = integers({0});
  c["/fclib_global/vectors/w"] = c["/fclib_global/vectors/mu"] = numbers({});
  broken.emplace_back(c, "H/n: is 0; three for each contact, and at least one contact, belong here");
  c = small_global();
  c.erase("/fclib_global/vectors/mu");
  c["/fclib_global/vectors/mu/0"] = numbers({0.3});
  broken.emplace_back(c, "vectors/mu: is not a dataset that can be opened");
  c = small_global();
  c["/fclib_global/H/m"] = integers({4});
  broken.emplace_back(c, "H: has 4 rows; M has 3");
  c = small_global();
  c["/contactbench/v_minus"] = numbers({1, 0, -3});
  broken.emplace_back(c, "/contactbench/v_minus does not belong");
  c["/contactbench/v_minus"] = numbers({1, 0});
  broken.emplace_back(c, "/contactbench/v_minus: holds 2 numbers");
  c = small_global();
  c["/contactbench/restitution"] = numbers({1.5});
  broken.emplace_back(c, "restitution of contact 0 is 1.5");
  c["/contactbench/restitution"] = numbers({0.5, 0.5});
  broken.emplace_back(c, "/contactbench/restitution: holds 2 numbers; 1 belong here");
  c = small_global();
  c["/contactbench/first"] = integers({0, 2, 2, 3});
  broken.emplace_back(c, "/contactbench/first: must rise");
  c["/contactbench/first"] = integers({0, 4});
  broken.emplace_back(c, "/contactbench/first: entry 1 is 4");
  c["/contactbench/first"] = integers({0, 1, 3});
  c["/fclib_global/M/nz"] = integers({-1});
  c["/fclib_global/M/nzmax"] = integers({5});
  c["/fclib_global/M/p"] = integers({0, 2, 4, 5});
  c["/fclib_global/M/i"] = integers({0, 1, 0, 1, 2});
  c["/fclib_global/M/x"] = numbers({2, 0.5, 0.5, 2, 2});
  broken.emplace_back(c, "M couples rows 1 and 0 of different blocks of /contactbench/first");
  c = small_local();
  c["/fclib_local/V/n"] = integers({2});
  broken.emplace_back(c, "bilateral");
  c = small_local();
  c["/fclib_local/W/n"] = integers({4});
  broken.emplace_back(c, "/fclib_local/W: is not square");
  c = small_local();
  c["/fclib_local/vectors/q"] = numbers({-2, 0});
  broken.emplace_back(c, "vectors/q: holds 2 numbers; 3 belong here");
  for (const char* size : {"m", "n", "nz", "nzmax"}) c[std::string("/fclib_local/W/") + size] = integers({2});
  c["/fclib_local/W/p"] = c["/fclib_local/W/i"] = integers({0, 1});
  c["/fclib_local/W/x"] = numbers({0.5, 0.5});
  broken.emplace_back(c, "/fclib_local/W/m: is 2; three for each contact");
  c = small_local();
  c["/fclib_local/W/x"] = numbers({0.5, -0.5, 0.5});
  broken.emplace_back(c, "semidefinite");
  c["/fclib_local/W/x"] = numbers({0, 0, 0});
  broken.emplace_back(c, "no mobility");

  for (std::size_t i = 0; i < broken.size(); ++i) {
    const std::string path = save(folder, "broken.hdf5", broken[i].first);
    const std::string message = refusal(path);
    INFO(i << ": expected " << broken[i].second << ", got " << message);
    CHECK_THAT(message, Catch::StartsWith(path) && Catch::Contains(broken[i].second));
    CHECK(message.find('\n') == std::string::npos);
  }
}

TEST_CASE("A file may say that it has no bilateral constraints") {
  const Folder folder;
  Content global = small_global(), local = small_local();
  global["/fclib_global/G/n"] = local["/fclib_local/V/n"] = integers({0});
  CHECK(refusal(save(folder, "global.hdf5", global)).empty());
  CHECK(refusal(save(folder, "local.hdf5", local)).empty());
}

TEST_CASE("A number may stand alone or as a list of one") {
  const Folder folder;
  Content content = small_global();
  content["/fclib_global/spacedim"] = {.x = {}, .n = {3}, .whole = true, .rank = 0};
  content["/fclib_global/vectors/mu"] = {.x = {0.3}, .n = {}, .rank = 0};
  CHECK(read_contact_problem(save(folder, "alone.hdf5", content)).problem.mu == std::vector<double>{0.3});
}

TEST_CASE("What our own group says of unknowns is no matter of a file in local form") {
  const Folder folder;
  Content content = small_local();
  content["/contactbench/v_minus"] = numbers({1, 2});
  content["/contactbench/first"] = integers({0, 7});
  content["/contactbench/restitution"] = numbers({0.25});
  CHECK(read_contact_problem(save(folder, "local.hdf5", content)).problem.restitution == std::vector<double>{0.25});
}

TEST_CASE("Numbers that do not fit the check sum that they are kept with are refused") {
  const Folder folder;
  Content content = small_global();
  content["/fclib_global/vectors/f"].summed = content["/fclib_global/H/i"].summed = true;
  const std::string whole = text_of(save(folder, "whole.hdf5", content));
  CHECK(refusal(folder.file("whole.hdf5")).empty());
  const auto bytes = [](const auto& list) {
    return std::string(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(list[0]));
  };
  for (const auto& [where, held] : {std::pair("/fclib_global/vectors/f", bytes(std::vector<double>{2, 0, -4})),
                                    std::pair("/fclib_global/H/i", bytes(std::vector<long long>{2, 1, 0}))}) {
    const auto at = whole.find(held);
    REQUIRE(at != std::string::npos);
    std::string damaged = whole;
    damaged[at + 8] = 2;  // the second number: another that would be read without a word
    const std::string path = write(folder, "damaged.hdf5", damaged);
    CHECK(refusal(path) == path + ": " + where + ": cannot be read (truncated or damaged?)");
  }
}

TEST_CASE("An FCLIB file that was cut short is refused, wherever the cut is") {
  const Folder folder;
  const std::string whole = text_of(save(folder, "whole.hdf5", small_global()));
  REQUIRE(whole.size() > 1000);
  for (std::size_t cut = 0; cut < whole.size(); cut += whole.size() / 40) {
    const std::string path = write(folder, "cut.hdf5", whole.substr(0, cut));
    INFO(cut);
    CHECK_THAT(refusal(path), Catch::StartsWith(path));
  }
}

TEST_CASE("A problem that was saved comes back to the last bit, block by block") {
  const Folder folder;
  const ContactProblem problem = awkward_problem();
  write_contact_problem(folder.file("saved.hdf5"), problem, "awkward numbers");
  const StoredProblem back = read_contact_problem(folder.file("saved.hdf5"));
  CHECK(same_bits(back.problem, problem));
  write_contact_problem(folder.file("again.hdf5"), back.problem, "awkward numbers");
  CHECK(text_of(folder.file("saved.hdf5")) == text_of(folder.file("again.hdf5")));
  CHECK_FALSE(fs::exists(folder.file("saved.hdf5.part")));
  CHECK_THROWS_AS(write_contact_problem(folder.file("no/such/folder.hdf5"), problem), FileError);
}

TEST_CASE("Interleaved bodies are gathered into blocks, and written back in the file's own order") {
  const Folder folder;
  Content content = small_global();
  // Unknowns 0 and 2 belong together, 1 stands alone: M = [[2, 0, 1], [0, 2, 0], [1, 0, 2]]. Two contacts; the second
  // sees only unknown 1.
  content["/fclib_global/M/nz"] = content["/fclib_global/M/nzmax"] = integers({5});
  content["/fclib_global/M/p"] = integers({0, 1, 2, 0, 2});
  content["/fclib_global/M/i"] = integers({0, 1, 2, 2, 0});
  content["/fclib_global/M/x"] = numbers({2, 2, 2, 1, 1});
  content["/fclib_global/H/n"] = integers({6});
  content["/fclib_global/H/nzmax"] = integers({4});
  content["/fclib_global/H/p"] = integers({0, 1, 2, 3, 4, 4, 4});
  content["/fclib_global/H/i"] = integers({2, 0, 2, 1});
  content["/fclib_global/H/x"] = numbers({1, 1, 0.5, 1});
  content["/fclib_global/vectors/w"] = numbers({0, 0, 0, 0, 0, 0});
  content["/fclib_global/vectors/mu"] = numbers({0.3, 0});
  content["/fclib_global/vectors/f"] = numbers({0, 4, 3});
  const StoredProblem stored = read_contact_problem(save(folder, "mixed.hdf5", content));
  CHECK(stored.problem.M.first == std::vector<int>{0, 2, 3});
  CHECK(stored.row_of_v == std::vector<int>{0, 2, 1});
  // [[2, 1], [1, 2]] v = (0, 3): v = (-1, 2); 2 v = 4: v = 2.
  CHECK(stored.problem.v_minus[0] == Approx(-1));
  CHECK(stored.problem.v_minus[1] == Approx(2));
  CHECK(stored.problem.v_minus[2] == Approx(2));
  write_contact_problem(folder.file("back.hdf5"), stored.problem, "", stored.row_of_v);
  const StoredProblem back = read_contact_problem(folder.file("back.hdf5"));
  CHECK(back.row_of_v == stored.row_of_v);
  CHECK(same_bits(back.problem, stored.problem));
}

TEST_CASE("The reference answers of the stored problems satisfy the identities of the problems as read") {
  // With v+ and u of the convex reference: u = J v+ + w. With z of A-P: r from z, v+ = v- + M^-1 J^T r.
  int seen = 0;
  for (const auto& entry : fs::directory_iterator(std::string(TEST_DATA) + "/problems")) {
    if (entry.path().extension() != ".hdf5") continue;
    fs::path answers = entry.path();
    // JSON knows no infinity; the files write one where a bound is missing.
    std::string text = text_of(answers.replace_extension(".ref.json").string());
    for (auto at = text.find("Infinity"); at != std::string::npos; at = text.find("Infinity"))
      text.replace(at, 8, "1e308");
    const auto ref = nlohmann::json::parse(text);
    INFO(entry.path().filename().string());
    const StoredProblem stored = read_contact_problem(entry.path().string());
    const ContactProblem& p = stored.problem;
    const bool global = stored.format == ProblemFormat::fclib_global;
    REQUIRE(p.nc() == ref["nc"].get<int>());
    ++seen;
    BlockCholesky factor;
    REQUIRE(factor.factor(p.M));
    if (global) {
      const double energy = ref["KE_before"];
      CHECK(0.5 * quadratic_form(p.M, p.v_minus) == Approx(energy).epsilon(1e-10));
      const std::vector<double> v_file = ref["ds_kappa"]["vplus"], u_ref = ref["ds_kappa"]["u"];
      std::vector<double> v(p.nv()), u;
      double scale = 0;
      for (int i = 0; i < p.nv(); ++i) {
        v[i] = v_file[stored.row_of_v[i]];
        scale = std::max({scale, std::abs(v[i]), std::abs(p.v_minus[i])});
      }
      contact_velocity(p, v, u);
      for (int i = 0; i < 3 * p.nc(); ++i) CHECK(std::abs(u[i] - u_ref[i]) <= 1e-9 * scale);
    } else {
      CHECK(stored.rank == ref["W_rank"].get<int>());
      // 8.4e-8 for the one W that was written with seven digits and has negative eigenvalues for it.
      CHECK(stored.factor_error <= 1e-7);
      std::vector<double> u;
      contact_velocity(p, p.v_minus, u);
      for (int i = 0; i < 3 * p.nc(); ++i) CHECK(std::abs(u[i] - stored.q[i]) <= 1e-14 * (1 + std::abs(stored.q[i])));
    }
    for (const int k : {4, 8}) {
      const std::string name = "ap_k" + std::to_string(k);
      if (!ref.contains(name) || !ref[name].contains("z") || ref[name]["residual"]["score"].get<double>() > 1e-10)
        continue;
      const std::vector<double> z = ref[name]["z"], u_ref = ref[name]["u"];
      std::vector<double> r(3 * p.nc(), 0.0), v_plus, u;
      for (int c = 0; c < p.nc(); ++c) {
        r[3 * c] = z[c];
        for (int i = 0; i < k; ++i) {
          const double angle = 2 * M_PI * i / k, strength = z[p.nc() + k * c + i];
          r[3 * c + 1] += std::cos(angle) * strength;
          r[3 * c + 2] += std::sin(angle) * strength;
        }
      }
      apply_impulse(p, factor, r, v_plus);
      contact_velocity(p, v_plus, u);
      double scale = 0;
      for (const double x : u_ref) scale = std::max(scale, std::abs(x));
      for (const double x : r) scale = std::max(scale, 1e-3 * std::abs(x));
      for (int i = 0; i < 3 * p.nc(); ++i) CHECK(std::abs(u[i] - u_ref[i]) <= 1e-9 * (1 + scale));
    }
  }
  CHECK(seen == 60);
}

TEST_CASE("A stack that is known by W alone keeps the sparsity of its bodies") {
  // 16 boxes: one interface with the ground, 15 between boxes, four contacts each. The true Jacobian has
  // 4 x 3 x 6 + 15 x 4 x 3 x 12 = 2232 numbers in blocks of six columns.
  const StoredProblem stored = read_contact_problem(std::string(TEST_DATA) + "/stacks/stack_rnd_n16.hdf5");
  const ContactProblem& p = stored.problem;
  CHECK(stored.rank == 96);
  CHECK(p.M.blocks() == 16);
  for (int b = 0; b < 16; ++b) CHECK(p.M.block_size(b) == 6);
  CHECK(p.J.values.size() == 2232);
  const Eigen::MatrixXd W = stored.W;
  CHECK((delassus_of(p) - W).cwiseAbs().maxCoeff() < 1e-13 * W.cwiseAbs().maxCoeff());
}

#ifdef CONTACTBENCH_HAVE_FCLIB

// The header itself knows no C++.
extern "C" {
#include <fclib.h>
}

namespace {

Eigen::MatrixXd dense(const fclib_matrix& A) {
  REQUIRE(A.nz == -1);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(A.m, A.n);
  for (int j = 0; j < A.n; ++j)
    for (int e = A.p[j]; e < A.p[j + 1]; ++e) out(A.i[e], j) = A.x[e];
  return out;
}

std::vector<double> list(const double* x, long count) { return {x, x + count}; }
std::vector<double> list(const Eigen::MatrixXd& A) { return list(A.data(), A.size()); }

}  // namespace

TEST_CASE("libfclib's own reader finds M, H, f, w and mu of a saved problem to the last bit") {
  const Folder folder;
  const ContactProblem problem = awkward_problem();
  const std::string path = folder.file("saved.hdf5");
  write_contact_problem(path, problem, "a title");
  fclib_global* read = fclib_read_global(path.c_str());
  REQUIRE(read);
  CHECK(read->spacedim == 3);
  CHECK(read->G == nullptr);
  CHECK(std::string(read->info->title) == "a title");
  const int nv = problem.nv(), nc = problem.nc();
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(nv, nv), H = Eigen::MatrixXd::Zero(nv, 3 * nc);
  for (int b = 0; b < problem.M.blocks(); ++b)
    M.block(problem.M.first[b], problem.M.first[b], problem.M.block_size(b), problem.M.block_size(b)) =
        problem.M.block(b);
  for (int c = 0; c < nc; ++c)
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e)
      H.block(problem.M.first[problem.J.block[e]], 3 * c, problem.J.entry(e).cols(), 3) =
          problem.J.entry(e).transpose();
  std::vector<double> f(nv);
  multiply(problem.M, problem.v_minus, f);
  CHECK(same_bits(list(dense(*read->M)), list(M)));
  CHECK(same_bits(list(dense(*read->H)), list(H)));
  CHECK(same_bits(list(read->f, nv), f));
  CHECK(same_bits(list(read->w, 3 * nc), problem.offset));
  CHECK(same_bits(list(read->mu, nc), problem.mu));
  fclib_delete_global(read);
  std::free(read);  // the library leaves that to its caller
}

#endif
#endif
