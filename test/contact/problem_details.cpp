// Contact problems from what a file holds, and what is said of them: blocks, rank, notes; statuses; islands.

#include <catch2/catch.hpp>
#include <set>

#include "contact/delassus_factor.h"
#include "contact/fclib_format.h"
#include "contact/islands.h"
#include "contact/problem_files.h"
#include "problems.h"

using namespace cb;

namespace {

Eigen::SparseMatrix<double> sparse(const Eigen::MatrixXd& A) { return A.sparseView(); }

FclibContent local(const Eigen::MatrixXd& W, std::vector<double> q, std::vector<double> mu) {
  FclibContent out;
  out.W = sparse(W);
  out.q = std::move(q);
  out.mu = std::move(mu);
  return out;
}

std::string refusal(const FclibContent& content, const ProblemFileOptions& options = {}) {
  try {
    to_problem(content, "file", options);
    return "";
  } catch (const FileError& error) {
    return error.what();
  }
}

/// Eigenvalues 1, 2 + d and -d.
Eigen::Matrix3d nearly_semidefinite(double d) {
  Eigen::Matrix3d W = Eigen::Matrix3d::Identity();
  W(1, 2) = W(2, 1) = 1 + d;
  return W;
}

}  // namespace

TEST_CASE("Each form of a problem's file has its name") {
  CHECK(name(ProblemFormat::fclib_global) == "fclib_global");
  CHECK(name(ProblemFormat::fclib_local) == "fclib_local");
  CHECK(name(ProblemFormat::siconos_text) == "siconos_text");
}

// The first contact touches all others: eliminated first, it would leave each of them coupled to each.
TEST_CASE("J is as sparse as W, in whatever order its contacts come") {
  const int nc = 31;
  Eigen::MatrixXd W = 2 * Eigen::MatrixXd::Identity(3 * nc, 3 * nc);
  for (int i = 3; i < 3 * nc; ++i) W(i, i % 3) = W(i % 3, i) = 0.1;
  const ContactProblem p =
      to_problem(local(W, std::vector<double>(3 * nc, 1.0), std::vector<double>(nc, 0.5)), "file", {}).problem;
  CHECK(p.J.band.back() <= 2 * nc);
}

TEST_CASE("A W that is negative by seven digits is repaired with a note, by three digits where that is asked for") {
  const ProblemFileOptions asked{.symmetrise = true};
  for (const double d : {1e-6, 1e-4}) {
    INFO(d);
    const FclibContent content = local(nearly_semidefinite(d), {-1, 0, 0}, {0.5});
    if (d > 1e-5)
      CHECK_THAT(refusal(content), Catch::Contains("its smallest eigenvalue is -5e-05 of its largest; --symmetrise"));
    else
      CHECK(refusal(content).empty());
    const StoredProblem stored = to_problem(content, "file", asked);
    CHECK(stored.rank == 2);
    CHECK(stored.asymmetry == 0);
    REQUIRE(stored.notes.size() == 2);
    CHECK(stored.notes[0] == std::string("W made positive semidefinite: its smallest eigenvalue was -") +
                                 (d > 1e-5 ? "5e-05" : "5e-07") + " of its largest");
    CHECK(stored.notes[1] == "W has rank 2 of 3");
    // d/2 on and off the diagonal goes with the eigenvalue.
    CHECK(stored.factor_error == Approx(d / 2).epsilon(1e-3));
  }
  CHECK_THAT(refusal(local(nearly_semidefinite(1e-2), {-1, 0, 0}, {0.5}), asked),
             Catch::Contains("its smallest eigenvalue is -0.00498 of its largest") && !Catch::Contains("--symmetrise"));
}

TEST_CASE("Of parts of W that are repaired the worst is told, whichever comes first") {
  for (const auto& [first, second] : {std::pair(1e-6, 1e-7), std::pair(1e-7, 1e-6)}) {
    INFO(first);
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(6, 6);
    W.topLeftCorner(3, 3) = nearly_semidefinite(first);
    W.bottomRightCorner(3, 3) = nearly_semidefinite(second);
    const StoredProblem stored = to_problem(local(W, {-1, 0, 0, -1, 0, 0}, {0.5, 0.5}), "file");
    REQUIRE(stored.notes.size() == 2);
    CHECK(stored.notes[0] == "W made positive semidefinite: its smallest eigenvalue was -5e-07 of its largest");
    CHECK(stored.notes[1] == "W has rank 4 of 6");
    CHECK(stored.factor_error == Approx(5e-7).epsilon(1e-3));
  }
}

TEST_CASE("A difference of W and its transpose within the last digits is averaged away without a word") {
  Eigen::Matrix3d W = 4 * Eigen::Matrix3d::Identity();
  W(0, 1) = 1;
  for (const auto& [difference, refused] : {std::pair(2e-12, false), std::pair(6e-12, true)}) {
    W(1, 0) = 1 + difference;  // of the largest entry, 4: below and above 1e-12
    CHECK(refusal(local(W, {-1, 0, 0}, {0.5})).empty() != refused);
  }
  W(1, 0) = 1 + 2e-12;
  const StoredProblem stored = to_problem(local(W, {-1, 0, 0}, {0.5}), "file");
  CHECK(stored.asymmetry == Approx(5e-13).epsilon(1e-3));
  CHECK(stored.notes.empty());
  CHECK(stored.W.coeff(0, 1) == stored.W.coeff(1, 0));
}

TEST_CASE("What a local file holds beside W is its contacts' own") {
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(6, 6);
  W.diagonal() << 1, 2, 3, 40, 50, 60;
  FclibContent content = local(W, {-1, 2, -3, -4, 5, -6}, {0.1, 0.2});
  content.restitution = {0.3, 0.4};
  const StoredProblem stored = to_problem(content, "file");
  CHECK(stored.format == ProblemFormat::fclib_local);
  CHECK(stored.problem.mu == content.mu);
  CHECK(stored.problem.restitution == content.restitution);
  CHECK(stored.q == content.q);
  CHECK(stored.rank == 6);
  CHECK(stored.factor_error < 1e-15);
  CHECK(stored.notes.empty());
  std::vector<double> u;
  contact_velocity(stored.problem, stored.problem.v_minus, u);
  for (std::size_t i = 0; i < 6; ++i) CHECK(u[i] == Approx(content.q[i]).epsilon(1e-14));
  // The least motion that explains q: sum of q^2 / W.
  double energy = 0;
  for (int i = 0; i < 6; ++i) energy += 0.5 * content.q[i] * content.q[i] / W(i, i);
  CHECK(0.5 * quadratic_form(stored.problem.M, stored.problem.v_minus) == Approx(energy).epsilon(1e-12));
  content.restitution = {0.3, 1.5};
  CHECK(refusal(content) == "file: restitution of contact 1 is 1.5; it must be from 0 to 1");
}

TEST_CASE("Rows of the same contacts make a body of at most six, in the file's order; what nobody touches is alone") {
  FclibContent content;
  content.global = true;
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(9, 9), H = Eigen::MatrixXd::Zero(9, 6);
  for (int i = 0; i < 9; ++i) M(i, i) = 1 + i;
  // Contact 0 sees all rows but 3 and 8, contact 1 sees row 3.
  for (const int i : {0, 1, 2, 4, 5, 6, 7}) H(i, i % 3) = 1 + i;
  H(3, 3) = 1;
  content.M = sparse(M);
  content.H = sparse(H);
  content.f = {1, 4, 9, 16, 25, 36, 49, 64, 81};
  content.w.assign(6, 0.0);
  content.mu = {0.1, 0.2};
  const StoredProblem stored = to_problem(content, "file");
  CHECK(stored.problem.M.first == std::vector<int>{0, 6, 7, 8, 9});
  CHECK(stored.row_of_v == std::vector<int>{0, 1, 2, 4, 5, 6, 3, 7, 8});
  for (int i = 0; i < 9; ++i) CHECK(stored.problem.v_minus[i] == Approx(1 + stored.row_of_v[i]));
  CHECK(stored.problem.restitution == std::vector<double>{0, 0});
  CHECK(stored.problem.J.block == std::vector<int>{0, 2, 1});
  // A velocity that is given is believed where M makes f of it.
  content.v_minus = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  CHECK(refusal(content).empty());
  content.v_minus[7] = 8 * (1 + 1e-10);
  CHECK(refusal(content).empty());
  content.v_minus[7] = 8 * (1 + 1e-8);
  CHECK_THAT(refusal(content), Catch::Contains("v_minus does not belong"));
}

TEST_CASE("Statuses have names and explanations of their own, from the mildest ending to the gravest") {
  struct Row {
    Status status;
    const char *name, *fragment;
  };
  const Row rows[] = {{Status::ok, "ok", "passed the referee"},
                      {Status::inaccurate, "inaccurate", "larger than accepted"},
                      {Status::nonconverged, "nonconverged", "limit of sweeps, pivots or iterations"},
                      {Status::ray, "ray", "Lemke"},
                      {Status::cycling, "cycling", "basis again"},
                      {Status::singular, "singular", "factorisation"},
                      {Status::not_finite, "not_finite", "NaN"},
                      {Status::energy_blowup, "energy_blowup", "kinetic energy"},
                      {Status::penetration, "penetration", "interpenetrate"},
                      {Status::interrupted, "interrupted", "signal"},
                      {Status::write_failed, "write_failed", "could not be written"},
                      {Status::event_stall, "event_stall", "too often within one step"},
                      {Status::time_limit, "time_limit", "time limit"},
                      {Status::memory_limit, "memory_limit", "memory limit"},
                      {Status::crash, "crash", "the program failed"},
                      {Status::unavailable, "unavailable", "not installed"},
                      {Status::unsupported, "unsupported", "cannot do this scene"},
                      {Status::input_error, "input_error", "input is wrong"}};
  CHECK(std::size(rows) == status_count);
  for (int i = 0; i < status_count; ++i) {
    CHECK(static_cast<int>(rows[i].status) == i);
    CHECK(name(rows[i].status) == rows[i].name);
    CHECK_THAT(std::string(explanation(rows[i].status)), Catch::Contains(rows[i].fragment));
  }
}

TEST_CASE("An island is elastic where any of its contacts is, first or last") {
  ContactProblem p;
  for (int b = 0; b < 4; ++b) test::add_body(p, 1, Eigen::Vector3d::Ones(), {0, -1, 0});
  for (const int b : {2, 0, 1, 2, 0, 1}) test::add_contact(p, b, {0, -1, 0}, -1, {}, test::ground_axes(), 0.5);
  Islands islands;
  find_islands(p, islands);
  CHECK(islands.count == 3);
  CHECK(islands.of_contact == std::vector<int>{0, 1, 2, 0, 1, 2});
  CHECK(islands.of_block == std::vector<int>{1, 2, 0, -1});
  std::vector<char> elastic{1, 1, 1, 1, 1};
  CHECK_FALSE(find_elastic(p, islands, elastic));
  CHECK(elastic == std::vector<char>{0, 0, 0});
  CHECK_FALSE(is_elastic(p));
  p.restitution[3] = 0.5;
  CHECK(find_elastic(p, islands, elastic));
  CHECK(elastic == std::vector<char>{1, 0, 0});
  p.restitution[2] = 1e-3;
  CHECK(find_elastic(p, islands, elastic));
  CHECK(elastic == std::vector<char>{1, 0, 1});
  CHECK(is_elastic(p));
}

TEST_CASE("Members stand by their groups in their order; some are in none, and a group may have none") {
  Groups groups;
  groups.assign({2, -1, 0, 2, 4, 0, -1}, 5);
  const auto members = [&](int g) { return std::vector<int>(groups[g].begin(), groups[g].end()); };
  CHECK(members(0) == std::vector<int>{2, 5});
  CHECK(members(1).empty());
  CHECK(members(2) == std::vector<int>{0, 3});
  CHECK(members(3).empty());
  CHECK(members(4) == std::vector<int>{4});
  groups.assign({}, 2);
  CHECK(members(1).empty());
}

namespace {

/// One contact of three unknowns with M = 2, normal first; f = (2, 0, -4).
FclibContent three_unknowns() {
  FclibContent out;
  out.global = true;
  out.M = sparse(2 * Eigen::Matrix3d::Identity());
  out.H = sparse(Eigen::Matrix3d::Identity());
  out.f = {2, 0, -4};
  out.w.assign(3, 0.0);
  out.mu = {0.3};
  return out;
}

}  // namespace

TEST_CASE("Blocks that leave out unknowns, a restitution below 0 and masses that are none are refused as such") {
  REQUIRE(refusal(three_unknowns()).empty());
  for (const std::vector<int>& first : {std::vector<int>{1, 3}, {0, 2}, {3}}) {
    INFO(first.front() << " to " << first.back());
    FclibContent content = three_unknowns();
    content.first = first;
    CHECK(refusal(content) ==
          "file: /contactbench/first: must rise from 0 to the order of M; remove the group to have the blocks found "
          "from M");
  }
  FclibContent content = three_unknowns();
  content.restitution = {-0.5};
  CHECK(refusal(content) == "file: restitution of contact 0 is -0.5; it must be from 0 to 1");
  content = three_unknowns();
  content.M.coeffRef(0, 1) = 3;  // eigenvalues 5, 2 and -1
  content.M.coeffRef(1, 0) = 3;
  CHECK(refusal(content) == "file: /fclib_global/M is not positive definite");
  content = three_unknowns();
  content.M.coeffRef(2, 2) = 1e-200;
  content.f[2] = 1e200;
  CHECK(refusal(content) == "file: v_minus = M^-1 f is not finite; M is nearly singular");
}

TEST_CASE("Blocks of M that no memory should be asked for are refused before it is") {
  constexpr int nv = 10001;
  FclibContent content = three_unknowns();
  content.M.resize(nv, nv);
  content.M.setIdentity();
  content.H.resize(nv, 3);
  content.H.insert(0, 0) = 1;
  content.f.assign(nv, 0.0);
  content.first = {0, nv};
  CHECK(refusal(content) == "file: /fclib_global/M: its blocks hold 100020001 numbers; at most 100000000 fit");
}

TEST_CASE("A zero that is stored in H joins no block, and nothing is lost by it") {
  FclibContent content = three_unknowns();
  // Rows 0 and 4 are a body, 1 and 3 one, and 2 is alone; the contact sees the second, and has zeros at the others.
  Eigen::MatrixXd M = 2 * Eigen::MatrixXd::Identity(5, 5);
  M(0, 4) = M(4, 0) = M(1, 3) = M(3, 1) = 1;
  content.M = sparse(M);
  content.H.resize(5, 3);
  const std::vector<Eigen::Triplet<double>> entries = {{1, 0, 1.0}, {3, 0, 2.0}, {4, 0, 0.0},
                                                       {1, 1, 0.5}, {2, 1, 0.0}, {3, 2, 0.25}};
  content.H.setFromTriplets(entries.begin(), entries.end());
  REQUIRE(content.H.nonZeros() == 6);
  content.f.assign(5, 0.0);
  const ContactProblem p = to_problem(content, "file").problem;
  CHECK(p.M.first == std::vector<int>{0, 2, 4, 5});
  CHECK(p.J.block == std::vector<int>{1});
  CHECK(p.J.values == std::vector<double>{1, 0.5, 0, 2, 0, 0.25});  // by columns
}

TEST_CASE("A ring of bodies keeps a block for each contact but the last, which the others determine") {
  Eigen::MatrixXd W = 2 * Eigen::MatrixXd::Identity(12, 12);
  for (int c = 0; c < 4; ++c)
    for (int i = 0; i < 3; ++i) {
      const int here = 3 * c + i, next = 3 * ((c + 1) % 4) + i;
      W(here, next) = W(next, here) = -1;
    }
  const StoredProblem stored =
      to_problem(local(W, std::vector<double>(12, 0.0), std::vector<double>(4, 0.5)), "file", {});
  CHECK(stored.notes == std::vector<std::string>{"W has rank 9 of 12"});
  CHECK(stored.problem.M.first == std::vector<int>{0, 3, 6, 9});
  BlockCholesky factor;
  REQUIRE(factor.factor(stored.problem.M));
  Eigen::MatrixXd again;
  delassus(stored.problem, factor, again);
  CHECK((again - W).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("A part of W that needs repair may have as many rows as are taken, and not one more") {
  const Eigen::SparseMatrix<double> W = sparse(nearly_semidefinite(1e-6));
  const std::vector<double> q = {-1, 0, 0};
  for (const int rows : {3, 2}) {
    DelassusFactorOptions options;
    options.dense_rows = rows;
    DelassusFactorReport report;
    ContactProblem p;
    CHECK(factor_delassus(W, q, options, p, report) ==
          (rows == 3 ? ""
                     : "W couples 3 rows and is not positive semidefinite to rounding; a part of at most 2 rows can be "
                       "repaired"));
  }
}

TEST_CASE("Velocities of contacts that no finite motion makes stay in the offset, as they are") {
  // The same contact twice: what would make the velocities of both is more than the largest number.
  Eigen::MatrixXd W(6, 6);
  const Eigen::Matrix3d one = Eigen::Vector3d(0.5, 1, 1.5).asDiagonal();
  W << one, one, one, one;
  const std::vector<double> q = {0, 0, 1.2e308, 0, 0, 1.2e308};
  const ContactProblem p = to_problem(local(W, q, {0.5, 0.5}), "file").problem;
  CHECK(p.v_minus == std::vector<double>(3, 0.0));
  CHECK(p.offset == q);
}
