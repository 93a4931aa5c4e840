#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <string>

#include "lcp/lcp.h"
#include "lcp/lcp_files.h"

using namespace cb;

namespace {

LcpSolution solve(const LcpProblem& problem, const LcpOptions& options = {}) {
  LcpSolution solution;
  find_lcp_solver("lemke")->make(options)(problem, solution);
  return solution;
}

LcpProblem stored(const std::string& stem) {
  const std::string path = std::string(TEST_DATA) + "/" + stem;
  return read_lcp_matrix_market(path + ".M.mtx", path + ".q.mtx");
}

LcpProblem dense(Eigen::MatrixXd M, Eigen::VectorXd q) {
  LcpProblem p;
  p.M = std::move(M);
  p.q = std::move(q);
  return p;
}

/// One problem in both forms.
struct Split {
  LcpProblem expanded, condensed;
};
Split split(int n, int nx, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random = [&](int rows, int columns) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return uniform(generator); }));
  };
  // A = diag > 0, B = -J^T, C = J, D = S S^T: M = J A^-1 J^T + S S^T is positive definite.
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(nx, nx);
  for (int k = 0; k < nx; ++k) A(k, k) = 1 + k;
  const Eigen::MatrixXd J = random(n, nx), S = random(n, n);
  const Eigen::MatrixXd D = 0.1 * S * S.transpose();
  const Eigen::VectorXd a = random(nx, 1), q = random(n, 1);
  Split s;
  s.expanded.expanded = true;
  s.expanded.A = A.sparseView();
  s.expanded.B = (-J.transpose()).sparseView();
  s.expanded.C = J.sparseView();
  s.expanded.D = D.sparseView();
  s.expanded.a = a;
  s.expanded.q = q;
  s.condensed.M = D + J * A.inverse() * J.transpose();
  s.condensed.q = q - J * (A.inverse() * a);
  return s;
}

}  // namespace

TEST_CASE("Lemke finds the one answer that a positive definite problem was built from") {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const int n = 5 + 13 * static_cast<int>(seed);
    const Eigen::MatrixXd S = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return uniform(generator); });
    // A skew part makes it unsymmetric; x.Mx stays positive, so z is unique.
    Eigen::MatrixXd M = S * S.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
    M += S.triangularView<Eigen::StrictlyUpper>();
    M -= Eigen::MatrixXd(S.triangularView<Eigen::StrictlyUpper>()).transpose();
    Eigen::VectorXd z(n), w(n);
    for (int i = 0; i < n; ++i) {
      const double x = uniform(generator);
      z[i] = std::max(x, 0.0);
      w[i] = std::max(-x, 0.0);
    }
    const LcpProblem p = dense(M, w - M * z);
    const LcpSolution found = solve(p);
    CAPTURE(seed, n, found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK((found.z - z).lpNorm<Eigen::Infinity>() < 1e-9);
    CHECK(natural_residual(p, found.z) < 1e-13);
  }
}

TEST_CASE("A problem built backwards with most of its pairs idle at zero is solved to the last digits") {
  // z = 0 and w = 0 in two pairs of three: a degenerate vertex, where a ratio test without tie-breaking may cycle.
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const int n = 40, rank = 15;
    const Eigen::MatrixXd S = Eigen::MatrixXd::NullaryExpr(n, rank, [&] { return uniform(generator); });
    const Eigen::MatrixXd M = S * S.transpose();
    Eigen::VectorXd z = Eigen::VectorXd::Zero(n), w = z;
    for (int i = 0; i < n; i += 3) (i % 2 ? z : w)[i] = 1 + uniform(generator);
    const LcpProblem p = dense(M, w - M * z);
    const LcpSolution found = solve(p);
    CAPTURE(seed, found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK(natural_residual(p, found.z) < 1e-12);
    // z is not unique for a singular M, but w = M z + q is.
    CHECK((M * found.z + p.q - w).lpNorm<Eigen::Infinity>() < 1e-9);
  }
}

TEST_CASE("All twenty stack problems are solved to a checked residual of 1e-10") {
  for (const std::string kind : {"rest", "rnd"})
    for (const int k : {4, 8})
      for (const int boxes : {1, 2, 4, 8, 16}) {
        const std::string stem = "stacks/stack_" + kind + "_n" + std::to_string(boxes) + "_k" + std::to_string(k);
        // The largest matrix is the same at rest and perturbed, and is kept once.
        const std::string path = std::string(TEST_DATA) + "/" + stem;
        const std::string twin = std::string(TEST_DATA) + "/stacks/stack_rest_n16_k8";
        const LcpProblem p = read_lcp_matrix_market((boxes == 16 && k == 8 ? twin : path) + ".M.mtx", path + ".q.mtx");
        const LcpSolution found = solve(p);
        CAPTURE(stem, found.reason, found.pivots);
        CHECK(found.status == LcpStatus::solved);
        CHECK(natural_residual(p, found.z) < 1e-12);
        // At rest no more than a few pivots a box, or ties are being walked around.
        if (kind == "rest") CHECK(found.pivots <= 4 * boxes);
      }
}

TEST_CASE("Stored problems end as exact rational pivoting says") {
  // `exact_lemke` of their reference files; CPS_3 and infeasible_3 end on a ray (CPS_3 has solutions all the same).
  for (const std::string name :
       {"lcp_badscale_10", "lcp_copositive_20", "lcp_degenerate_6", "lcp_murty_upper_8", "lcp_psd_asym_20",
        "lcp_psd_asym_3", "lcp_psd_rankdef_20", "lcp_spd_20", "lcp_spd_8", "siconos_lcp_CPS_2", "siconos_lcp_CPS_4bis",
        "siconos_lcp_Pang_isolated_sol", "siconos_lcp_deudeu", "siconos_lcp_deudeu_block", "siconos_lcp_enum_fails",
        "siconos_lcp_exp_murty", "siconos_lcp_exp_murty2", "siconos_lcp_tobenna", "siconos_lcp_trivial_block"}) {
    const LcpProblem p = stored("problems/" + name);
    const LcpSolution found = solve(p);
    CAPTURE(name, found.reason);
    CHECK(found.status == LcpStatus::solved);
    CHECK(natural_residual(p, found.z) < 1e-12);
    CHECK(found.z.minCoeff() >= 0);
  }
  for (const std::string name : {"lcp_infeasible_3", "siconos_lcp_CPS_3"}) {
    const LcpSolution found = solve(stored("problems/" + name));
    CAPTURE(name);
    CHECK(found.status == LcpStatus::ray);
    CHECK(found.reason.find("ray") != std::string::npos);
    CHECK(found.z.allFinite());
  }
}

TEST_CASE("Murty's problem takes 2^n pivots with a covering vector of ones, and is still solved") {
  // Murty (1978), q = -(2^n - 2^(n-1) ...): siconos_lcp_exp_murty2 has n = 6 and takes the full 2^6.
  const LcpSolution found = solve(stored("problems/siconos_lcp_exp_murty2"));
  CHECK(found.status == LcpStatus::solved);
  CHECK(found.pivots == 64);
  LcpOptions few;
  few.pivot_limit = 20;
  const LcpSolution stopped = solve(stored("problems/siconos_lcp_exp_murty2"), few);
  CHECK(stopped.status == LcpStatus::nonconverged);
  CHECK(stopped.pivots <= 20);
}

TEST_CASE("Pairs in other units give the same dimensionless answer and the same residual") {
  const LcpProblem p = stored("stacks/stack_rnd_n2_k4");
  Eigen::VectorXd s(p.n());
  for (int i = 0; i < p.n(); ++i) s[i] = std::pow(10.0, 3 * std::sin(i));
  // z = s z', w' = s w: M' = S M S, q' = S q.
  const LcpProblem scaled = dense(s.asDiagonal() * p.M * s.asDiagonal(), s.asDiagonal() * p.q);
  const LcpSolution one = solve(p), other = solve(scaled);
  REQUIRE(one.status == LcpStatus::solved);
  REQUIRE(other.status == LcpStatus::solved);
  const Eigen::VectorXd moved = one.z.cwiseQuotient(s);
  Eigen::VectorXd off = one.z, off_moved = moved;
  off[0] += 1e-3;
  off_moved[0] += 1e-3 / s[0];
  CHECK(natural_residual(scaled, off_moved) == Approx(natural_residual(p, off)).epsilon(1e-9));
  CHECK(natural_residual(scaled, other.z) < 1e-12);
  CHECK(natural_residual(p, other.z.cwiseProduct(s)) < 1e-12);
}

TEST_CASE("The residual sees an error that a huge z would hide, and leaves idle pairs at round-off alone") {
  // w = z - 1 with z = 1e12 in a second, uncoupled pair: z_1 = 0.9 is wrong by a tenth whatever z_2 is.
  const LcpProblem p = dense(Eigen::MatrixXd(Eigen::Vector2d(1, 1e-12).asDiagonal()), Eigen::Vector2d(-1, -1e-6));
  CHECK(natural_residual(p, Eigen::Vector2d(1, 1e6)) < 1e-9);
  CHECK(natural_residual(p, Eigen::Vector2d(0.9, 1e6)) > 0.09);
  const LcpProblem idle = dense(Eigen::MatrixXd::Identity(2, 2), Eigen::Vector2d(-1, 1e-17));
  CHECK(natural_residual(idle, Eigen::Vector2d(1, 1e-17)) < 1e-16);
  CHECK(std::isinf(natural_residual(idle, Eigen::Vector2d(1, NAN))));
}

TEST_CASE("Eliminating the free unknowns or keeping them gives the same answer") {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Split s = split(60, 12, seed);
    LcpOptions sparse;
    sparse.dense_limit = 0;
    const LcpSolution kept = solve(s.expanded, sparse), small = solve(s.expanded), eliminated = solve(s.condensed);
    CAPTURE(seed, kept.reason);
    REQUIRE(kept.status == LcpStatus::solved);
    REQUIRE(small.status == LcpStatus::solved);
    REQUIRE(eliminated.status == LcpStatus::solved);
    CHECK(kept.factorisations > 0);
    CHECK((kept.z - eliminated.z).lpNorm<Eigen::Infinity>() < 1e-10);
    CHECK((small.z - eliminated.z).lpNorm<Eigen::Infinity>() < 1e-10);
    // The free unknowns satisfy their own equations.
    for (const LcpSolution* one : {&kept, &small})
      CHECK((s.expanded.A * one->x + s.expanded.B * one->z + s.expanded.a).lpNorm<Eigen::Infinity>() < 1e-12);
    CHECK(natural_residual(s.expanded, kept.z) < 1e-12);
    CHECK(natural_residual(s.condensed, kept.z) < 1e-12);
  }
}

TEST_CASE("Many exchanges between factorisations lose nothing") {
  // More pivots than SparseBasis::refactor_every.
  const Split s = split(300, 20, 7);
  const LcpSolution kept = solve(s.expanded), eliminated = solve(s.condensed);
  REQUIRE(kept.status == LcpStatus::solved);
  CHECK(kept.pivots > 100);
  CHECK(kept.factorisations > 2);
  CHECK((kept.z - eliminated.z).lpNorm<Eigen::Infinity>() < 1e-9);
}

TEST_CASE("Data that are not numbers, empty problems and idle problems have typed endings") {
  const LcpProblem nan = dense(Eigen::MatrixXd::Identity(2, 2), Eigen::Vector2d(-1, NAN));
  CHECK(solve(nan).status == LcpStatus::not_finite);
  LcpProblem huge = dense(Eigen::MatrixXd::Identity(2, 2), Eigen::Vector2d(-1, -1));
  huge.M(0, 1) = HUGE_VAL;
  CHECK(solve(huge).status == LcpStatus::not_finite);
  Split broken = split(120, 10, 1);
  broken.expanded.a[3] = NAN;
  CHECK(solve(broken.expanded).status == LcpStatus::not_finite);
  Split singular = split(120, 10, 1);
  singular.expanded.A.coeffRef(4, 4) = 0;
  CHECK(solve(singular.expanded).status == LcpStatus::singular);

  const LcpSolution nothing = solve(dense(Eigen::MatrixXd(0, 0), Eigen::VectorXd(0)));
  CHECK(nothing.status == LcpStatus::solved);
  const LcpSolution idle = solve(dense(Eigen::MatrixXd::Zero(3, 3), Eigen::Vector3d(0, 1, 2)));
  CHECK(idle.status == LcpStatus::solved);
  CHECK(idle.z == Eigen::Vector3d::Zero());
  CHECK(idle.pivots == 0);
}

TEST_CASE("A solver used again, and after a harder problem, repeats its answer to the last bit") {
  const LcpSolver solver = find_lcp_solver("lemke")->make({});
  const LcpProblem small = stored("stacks/stack_rnd_n1_k4"), large = stored("stacks/stack_rnd_n4_k8");
  LcpSolution first, other, again;
  solver(small, first);
  solver(large, other);
  solver(small, again);
  CHECK(first.z == again.z);
  CHECK(first.pivots == again.pivots);
  CHECK(other.status == LcpStatus::solved);
}

TEST_CASE("an error that is no number is no answer, whichever pair it is of") {
  // z = (0, 1) has w_0 = -1e200; rho_0 overflows.
  const LcpProblem p = dense(Eigen::MatrixXd{{0, -1e200}, {1e200, 1}}, Eigen::VectorXd{{-1, -1}});
  for (const char* solver : {"lemke", "path", "ynl"}) {
    LcpSolution found;
    find_lcp_solver(solver)->make({})(p, found);
    INFO(solver << ": " << found.reason);
    CHECK(found.status != LcpStatus::solved);
  }
}

TEST_CASE("a residual is a fraction of the q that the free unknowns leave, in either form") {
  // w = 2 z + 1, of which x brings -999: q is 1000 in the expanded form. At z = 0.5 the map leaves 0.5 sqrt(2).
  LcpProblem expanded, dense;
  expanded.expanded = true;
  const auto one = [](double x) {
    SparseMatrix m(1, 1);
    m.insert(0, 0) = x;
    m.makeCompressed();
    return m;
  };
  expanded.A = one(4), expanded.B = one(0), expanded.C = one(-1), expanded.D = one(2);
  expanded.a = Eigen::VectorXd::Constant(1, -4 * 999.0);
  expanded.q = Eigen::VectorXd::Constant(1, 1000);
  REQUIRE(condense(expanded, dense));
  CHECK(dense.q[0] == Approx(1));
  const Eigen::VectorXd z = Eigen::VectorXd::Constant(1, 0.5);
  const double of_the_map = 0.5 * std::sqrt(2), size = 1 / std::sqrt(2);
  CHECK(natural_residual(dense, z) == Approx(of_the_map / size));
  CHECK(natural_residual(expanded, z) == Approx(of_the_map / size));
  expanded.size = 10;  // what the problem is about, where that is larger
  CHECK(natural_residual(expanded, z) == Approx(of_the_map / 10));
}
