#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "lcp/lcp.h"
#include "lcp/lcp_files.h"
#include "lcp/scaling.h"
#include "lcp/sparse_basis.h"
#include "lcp/ynl_states.h"
#include "linalg/stop.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

LcpSolution solve(const LcpProblem& problem, const LcpOptions& options = {}) {
  LcpSolution solution;
  find_lcp_solver("ynl")->make(options)(problem, solution);
  return solution;
}

LcpProblem stored(const std::string& name, const std::string& folder = "/problems/") {
  const std::string path = TEST_DATA + folder + name;
  return read_lcp_matrix_market(path + ".M.mtx", path + ".q.mtx");
}

LcpProblem dense(const MatrixXd& M, const VectorXd& q) {
  LcpProblem p;
  p.M = M;
  p.q = q;
  return p;
}

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

// Bodies of three velocities each, and pushing and rubbing pairs between a body and the ground, in the expanded form:
// A = masses, rows n, t, -t and a bound a contact, ordered contact by contact:
//   0 <= r_n _|_ n.v,  0 <= r_t _|_ t.v + s,  0 <= r_-t _|_ -t.v + s,  0 <= s _|_ mu r_n - r_t - r_-t
LcpProblem bodies(int m, int contacts, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const int nx = 3 * m, n = 4 * contacts;
  std::vector<Eigen::Triplet<double>> A, B, D;
  for (int i = 0; i < nx; ++i) A.emplace_back(i, i, 1 + 0.5 * uniform(generator));
  for (int c = 0; c < contacts; ++c) {
    const int body = c % m;
    const double angle = 0.3 * uniform(generator), arm = uniform(generator);
    const double across[3] = {-std::sin(angle), std::cos(angle), arm}, along[3] = {std::cos(angle), std::sin(angle), 1};
    for (int i = 0; i < 3; ++i) {
      B.emplace_back(3 * body + i, 4 * c, -across[i]);
      B.emplace_back(3 * body + i, 4 * c + 1, -along[i]);
      B.emplace_back(3 * body + i, 4 * c + 2, along[i]);
    }
    D.emplace_back(4 * c + 3, 4 * c, 0.5);
    for (int b = 1; b <= 2; ++b) {
      D.emplace_back(4 * c + 3, 4 * c + b, -1);
      D.emplace_back(4 * c + b, 4 * c + 3, 1);
    }
  }
  LcpProblem p;
  p.expanded = true;
  p.A.resize(nx, nx);
  p.B.resize(nx, n);
  p.D.resize(n, n);
  p.A.setFromTriplets(A.begin(), A.end());
  p.B.setFromTriplets(B.begin(), B.end());
  p.D.setFromTriplets(D.begin(), D.end());
  p.C = -p.B.transpose();
  VectorXd v = VectorXd::NullaryExpr(nx, [&] { return uniform(generator); });
  for (int b = 0; b < m; ++b) v[3 * b + 1] = -1 - std::abs(v[3 * b + 1]);
  p.a = -(p.A * v);
  p.q.setZero(n);
  return p;
}

// Murty's lower triangle, upside down as Siconos has it: M_ii = 1, M_ij = 2 for j > i, q_i = -(2^(n+1) - 2^(i+1)).
LcpProblem murty(int n) {
  LcpProblem p = dense(MatrixXd::Identity(n, n), VectorXd(n));
  for (int i = 0; i < n; ++i) {
    p.q[i] = std::exp2(i + 1) - std::exp2(n + 1);
    for (int j = i + 1; j < n; ++j) p.M(i, j) = 2;
  }
  return p;
}

}  // namespace

TEST_CASE("The stored-candidate search finds the answer that a positive definite problem was built from") {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const int n = 30;
    const MatrixXd S = MatrixXd::NullaryExpr(n, n, [&] { return uniform(generator); });
    const MatrixXd T = MatrixXd::NullaryExpr(n, n, [&] { return uniform(generator); });
    LcpProblem p = dense(S * S.transpose() + 0.1 * MatrixXd::Identity(n, n) + T - T.transpose(), VectorXd(n));
    VectorXd z(n), w(n);
    for (int i = 0; i < n; ++i) {
      const double x = uniform(generator);
      z[i] = std::max(x, 0.0);
      w[i] = seed % 2 == 0 ? 0 : std::max(-x, 0.0);  // even seeds: a degenerate vertex
    }
    p.q = w - p.M * z;
    const LcpSolution found = solve(p);
    CAPTURE(seed, found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK((found.z - z).lpNorm<Eigen::Infinity>() < 1e-9);
    CHECK(natural_residual(p, found.z) <= 1e-10);
  }
}

TEST_CASE("Bodies that meet the ground at many points are solved in the expanded form") {
  for (const int contacts : {1, 2, 5, 12, 30}) {
    const LcpProblem p = bodies(2, contacts, 7 + static_cast<unsigned>(contacts));
    const LcpSolution found = solve(p);
    CAPTURE(contacts, found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK(found.residual <= 1e-10);
    CHECK(natural_residual(p, found.z) <= 1e-10);
    CHECK((p.A * found.x + p.B * found.z + p.a).lpNorm<Eigen::Infinity>() < 1e-10);

    // The condensed form has the same answers.
    LcpProblem condensed;
    REQUIRE(condense(p, condensed));
    const LcpSolution other = solve(condensed);
    REQUIRE(other.status == LcpStatus::solved);
    CHECK(natural_residual(p, other.z) <= 1e-9);
  }
}

TEST_CASE("The search ends on the right side of zero where a wrong one would pass as a solution") {
  // Of each pair one half is 1e-11 to 1e-5 and the other zero; on the wrong basis the first is minus that.
  SECTION("q = -5e-11 beside q = 1: z = 0 has a residual of 5e-11") {
    const LcpSolution found = solve(dense(MatrixXd::Identity(2, 2), vector({1, -5e-11})));
    REQUIRE(found.status == LcpStatus::solved);
    CHECK(found.z == vector({0, 5e-11}));
  }
  SECTION("problems built backwards") {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
      std::mt19937 generator(seed);
      std::uniform_real_distribution<double> uniform(-1, 1);
      const int n = 24;
      const MatrixXd S = MatrixXd::NullaryExpr(n, n, [&] { return uniform(generator); });
      LcpProblem p = dense(S * S.transpose() + MatrixXd::Identity(n, n), VectorXd(n));
      VectorXd z = VectorXd::Zero(n), w = VectorXd::Zero(n);
      for (int i = 0; i < n; ++i) {
        const double size = i == 0 ? 1 : std::pow(10.0, -8 + 3 * uniform(generator));
        (i == 0 || uniform(generator) > 0 ? z : w)[i] = size;
      }
      p.q = w - p.M * z;
      const LcpSolution found = solve(p);
      CAPTURE(seed, found.reason);
      REQUIRE(found.status == LcpStatus::solved);
      CHECK((found.z - z).lpNorm<Eigen::Infinity>() < 1e-13);
      for (int i = 0; i < n; ++i) CHECK((found.z[i] > 0) == (z[i] > 0));
    }
  }
}

TEST_CASE("Where all rows tie the search still ends in a solution") {
  SECTION("a P-matrix on which least-index pivoting without a rule cycles: z = (1, 1, 1) / 3") {
    LcpProblem p = dense(MatrixXd(3, 3), vector({-1, -1, -1}));
    p.M << 1, 2, 0, 0, 1, 2, 2, 0, 1;
    const LcpSolution found = solve(p);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK((found.z - VectorXd::Constant(3, 1.0 / 3)).norm() < 1e-12);
  }
  SECTION("twelve copies of one pair: z sums to the one that a single pair has") {
    const int n = 12;
    const LcpProblem p = dense(MatrixXd::Ones(n, n), VectorXd::Constant(n, -3));
    const LcpSolution found = solve(p);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK(found.z.sum() == Approx(3).epsilon(1e-12));
  }
  SECTION("a ring of equal couplings, where z = 1 / 5 throughout") {
    // M = 3 I + (shift by one) + (shift by two): rows sum to 5, and x.M x >= 3 - 2 > 0.
    const int n = 24;
    MatrixXd M = 3 * MatrixXd::Identity(n, n);
    for (int i = 0; i < n; ++i) M(i, (i + 1) % n) = M(i, (i + 2) % n) = 1;
    const LcpSolution found = solve(dense(M, VectorXd::Constant(n, -1)));
    REQUIRE(found.status == LcpStatus::solved);
    CHECK((found.z - VectorXd::Constant(n, 0.2)).lpNorm<Eigen::Infinity>() < 1e-12);
  }
}

TEST_CASE("The search solves every stored problem that exact arithmetic can, and the stacks of up to eight boxes") {
  std::vector<LcpProblem> problems;
  for (const char* name :
       {"lcp_badscale_10", "lcp_copositive_20", "lcp_degenerate_6", "lcp_murty_upper_8", "lcp_psd_asym_20",
        "lcp_psd_asym_3", "lcp_psd_rankdef_20", "lcp_spd_20", "lcp_spd_8", "siconos_lcp_CPS_2", "siconos_lcp_CPS_4bis",
        "siconos_lcp_Pang_isolated_sol", "siconos_lcp_deudeu", "siconos_lcp_deudeu_block", "siconos_lcp_enum_fails",
        "siconos_lcp_exp_murty", "siconos_lcp_exp_murty2", "siconos_lcp_tobenna", "siconos_lcp_trivial_block"})
    problems.push_back(stored(name));
  for (const char* motion : {"rest", "rnd"})
    for (const char* size : {"1", "2", "4", "8"})
      for (const char* k : {"4", "8"})
        problems.push_back(stored(std::string("stack_") + motion + "_n" + size + "_k" + k, "/stacks/"));
  for (std::size_t i = 0; i < problems.size(); ++i) {
    const LcpSolution found = solve(problems[i]);
    CAPTURE(i, found.reason);
    CHECK(found.status == LcpStatus::solved);
    CHECK(natural_residual(problems[i], found.z) <= 1e-10);
  }
}

TEST_CASE("A change of units changes nothing but the units of the search's answer") {
  const LcpProblem p = stored("siconos_lcp_enum_fails");
  const VectorXd z = solve(p).z;
  VectorXd units(p.n());
  for (int i = 0; i < p.n(); ++i) units[i] = std::exp2(i % 2 == 0 ? 20 : -15);
  const LcpSolution found = solve(dense(units.asDiagonal() * p.M * units.asDiagonal(), units.cwiseProduct(p.q)));
  REQUIRE(found.status == LcpStatus::solved);
  CHECK((found.z.cwiseProduct(units) - z).lpNorm<Eigen::Infinity>() < 1e-12 * z.maxCoeff());
}

TEST_CASE("A load of any size is searched alike: bodies that all but rest, and bodies that are thrown") {
  const LcpProblem p = bodies(2, 9, 3);
  const LcpSolution given = solve(p);
  REQUIRE(given.status == LcpStatus::solved);
  for (const int power : {-200, -57, -30, 20, 200}) {
    LcpProblem scaled = p;
    scaled.a *= std::exp2(power);
    const LcpSolution found = solve(scaled);
    CAPTURE(power, found.reason);
    CHECK(found.status == given.status);
    CHECK(found.pivots == given.pivots);
    CHECK(found.z == given.z * std::exp2(power));
  }
}

TEST_CASE("Bodies that roll fast past each other are solved for the little by which they approach") {
  // Velocities along the ground of 1, and of 1e-10 to 1e-17 across it. The velocities are free unknowns, and what the
  // contacts see of them is their difference.
  for (const double approach : {1e-10, 1e-13, 1e-15, 1e-16, 1e-17}) {
    LcpProblem p = bodies(2, 4, 5);
    VectorXd v(p.nx());
    v << 1, approach, 0, -1, 2 * approach, 0;
    p.a = -(p.A * v);
    // Contacts turned into the axes: they see the approach alone, beside the slip.
    for (int j = 0; j < p.n(); ++j)
      for (SparseMatrix::InnerIterator it(p.B, j); it; ++it)
        if (j % 4 == 0 && it.row() % 3 == 0) it.valueRef() = 0;
    p.C = -p.B.transpose();
    const LcpSolution found = solve(p);
    CAPTURE(approach, found.reason);
    CHECK(found.status == LcpStatus::solved);
    CHECK(natural_residual(p, found.z) <= 1e-10);
  }
}

TEST_CASE("Murty's problem takes exponentially many pivots, and no more than the limit") {
  // z = (0, ..., 0, 2^n): w_n = 2^n - (2^(n+1) - 2^n) = 0, and w_i = 2^(n+1) - (2^(n+1) - 2^(i+1)) > 0.
  for (const int n : {4, 6, 8}) {
    const LcpSolution found = solve(murty(n));
    CAPTURE(n, found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    VectorXd z = VectorXd::Zero(n);
    z[n - 1] = std::exp2(n);
    CHECK(found.z == z);
  }
  LcpOptions few;
  few.pivot_limit = 8;
  const LcpSolution cut = solve(murty(12), few);
  CHECK(cut.status == LcpStatus::nonconverged);
  CHECK(cut.pivots <= 8);
  CHECK(cut.reason.find("pivot limit") == 0);
}

TEST_CASE("What has no solution, or no meaning, ends typed with finite numbers") {
  LcpProblem p = dense(MatrixXd::Zero(2, 2), vector({-1, 1}));
  LcpStatus expected = LcpStatus::ray;
  SECTION("w = q < 0 whatever z") {}
  SECTION("w = -z - 1") { p = dense(-MatrixXd::Identity(2, 2), vector({-1, -1})); }
  SECTION("a stored problem without solution") { p = stored("lcp_infeasible_3"); }
  SECTION("not finite") {
    p.q[1] = std::numeric_limits<double>::quiet_NaN();
    expected = LcpStatus::not_finite;
  }
  SECTION("infinite matrix") {
    p.M(0, 1) = std::numeric_limits<double>::infinity();
    expected = LcpStatus::not_finite;
  }
  SECTION("free unknowns without an equation") {
    p = bodies(1, 2, 1);
    p.A.setZero();
    expected = LcpStatus::singular;
  }
  const LcpSolution found = solve(p);
  CAPTURE(found.reason);
  CHECK(found.status == expected);
  CHECK_FALSE(found.reason.empty());
  CHECK(found.z.size() == p.n());
  CHECK(found.z.allFinite());
}

TEST_CASE("An answer that misses the tolerance is never called solved") {
  LcpOptions impossible;
  impossible.tolerance = 0;
  const LcpProblem p = stored("lcp_spd_20");
  const LcpSolution found = solve(p, impossible);
  CHECK(found.status == LcpStatus::inaccurate);
  CHECK(found.residual > 0);
  CHECK(found.residual < 1e-14);
  // Of that z and no other: both are rounding, of sums in another order.
  CHECK(found.residual == Approx(natural_residual(p, found.z)).epsilon(0.25).margin(0));
  CHECK(found.reason.find("ends refused by the check") != std::string::npos);
  // Many ways lead to the same states where there are many answers.
  CHECK(solve(stored("lcp_psd_asym_20"), impossible).reason.find(" states seen before") != std::string::npos);
}

TEST_CASE("The memory of the stored candidates is measured, and its limit stops the search") {
  // 40 unknowns, all rows of one size: hundreds of candidates wait.
  const LcpProblem p = stored("siconos_lcp_tobenna");
  const LcpSolution whole = solve(p);
  CAPTURE(whole.reason);
  REQUIRE(whole.status == LcpStatus::solved);
  CHECK(whole.peak_memory_mb > 0.1);
  CHECK(whole.peak_memory_mb < 10);

  for (const double limit : {0.001, 0.01, 0.1}) {
    LcpOptions small;
    small.memory_limit_mb = limit;
    const LcpSolution cut = solve(p, small);
    CAPTURE(limit, cut.reason);
    CHECK(cut.status == LcpStatus::memory_limit);
    CHECK(cut.reason.find("memory limit") == 0);
    CHECK(cut.peak_memory_mb <= limit);
    CHECK(cut.pivots < whole.pivots);
    CHECK(cut.z.allFinite());
  }
  LcpOptions enough;
  enough.memory_limit_mb = 3 * whole.peak_memory_mb;
  CHECK(solve(p, enough).status == LcpStatus::solved);
}

TEST_CASE("A stop that is asked for ends the search from within") {
  stop_asked = true;
  CHECK_THROWS_AS(solve(stored("siconos_lcp_tobenna"), {}), Stopped);
  stop_asked = false;
}

TEST_CASE("One search after another, of other sizes, repeats to the last bit") {
  const LcpSolver solver = find_lcp_solver("ynl")->make({});
  LcpSolution first, between, second;
  const LcpProblem p = bodies(2, 9, 3);
  solver(p, first);
  for (const LcpProblem& other : {stored("lcp_spd_8"), bodies(3, 20, 5), stored("siconos_lcp_tobenna")})
    solver(other, between);
  solver(p, second);
  CHECK(first.status == second.status);
  CHECK(first.z == second.z);
  CHECK(first.pivots == second.pivots);
  CHECK(first.peak_memory_mb == second.peak_memory_mb);
  CHECK(first.reason == second.reason);
}

TEST_CASE("Factorising a basis costs in proportion to the contacts on a given number of bodies") {
  // Bases in which two contacts a body slide under load (r_n, r_t and s basic: they meet through the body's mass) and
  // all others rub without load (r_t and s basic): of order nx + 2 contacts + ..., but the friction pairs are
  // eliminated among themselves. Counted: flops of the factorisation and nonzeros of the factors.
  const auto cost = [](int m, int contacts) {
    const LcpProblem p = bodies(m, contacts, 11);
    PairScales scales;
    pair_scales(p, scales);
    std::vector<int> active;
    for (int c = 0; c < contacts; ++c) {
      if (c < 2 * m) active.push_back(4 * c);
      active.push_back(4 * c + 1);
      active.push_back(4 * c + 3);
    }
    SparseBasis basis;
    basis.start(p, scales);
    VectorXd z, w;
    // The basis is solved: r_t = 0 and n.v = 0 where it should be.
    CHECK(basis.solve_at(active, z, w) < 1e-12);
    CHECK(basis.order() == 3 * m + static_cast<int>(active.size()));
    return std::pair{basis.flops(), basis.entries()};
  };
  for (const int m : {1, 4}) {
    const auto [flops, entries] = cost(m, 50);
    const auto [more_flops, more_entries] = cost(m, 1600);
    CAPTURE(m, flops, more_flops, entries, more_entries);
    // 32 times the contacts; the square would be 1024 times the cost. The ordering changes once on the way.
    CHECK(more_flops < 64 * flops);
    CHECK(more_entries < 64 * entries);
    CHECK(more_flops < 1e5);  // a dense basis of order 3200: 2e10
  }
}

TEST_CASE("states that wait take more memory exactly where they say that they are full", "[ynl]") {
  for (const std::size_t words : {1, 3}) {
    WaitingStates waiting;
    waiting.clear(words);
    SearchState state;
    state.basic.assign(words, 0);
    int grew = 0;
    for (int k = 0; k < 300; ++k) {
      const std::size_t before = waiting.bytes();
      const bool full = waiting.full();
      waiting.push(state);
      CHECK((waiting.bytes() != before) == full);
      grew += full;
      if (k % 5 == 4) waiting.pop(state);  // leaves a place
    }
    CHECK(grew > 5);
  }
}
