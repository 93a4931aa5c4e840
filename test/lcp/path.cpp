#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "lcp/complementary_path.h"
#include "lcp/dense_basis.h"
#include "lcp/lcp.h"
#include "lcp/lcp_files.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

LcpSolution solve(const LcpProblem& problem, const LcpOptions& options = {}) {
  LcpSolution solution;
  find_lcp_solver("path")->make(options)(problem, solution);
  return solution;
}

LcpProblem dense(const MatrixXd& M, const VectorXd& q) {
  LcpProblem p;
  p.M = M;
  p.q = q;
  return p;
}

/// What `solved` means, whoever says so.
void require_solved(const LcpProblem& p, const LcpSolution& s) {
  INFO(s.reason);
  REQUIRE(s.status == LcpStatus::solved);
  CHECK(natural_residual(p, s.z) <= 1e-10);
  CHECK(s.z.minCoeff() >= 0);
}

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  double operator()(double low = -1, double high = 1) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  MatrixXd matrix(int rows, int columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&](Eigen::Index, Eigen::Index) { return (*this)(); });
  }
  /// Positive definite, not symmetric: B B^T + a skew part + a diagonal.
  MatrixXd definite(int n) {
    const MatrixXd B = matrix(n, n), S = matrix(n, n);
    return B * B.transpose() + (S - S.transpose()) + 0.1 * MatrixXd::Identity(n, n);
  }

 private:
  std::mt19937 generator_;
};

}  // namespace

TEST_CASE("a problem built backwards from z and w gives z back", "[path]") {
  Random random(1);
  for (int n : {1, 2, 5, 17, 40})
    for (int trial = 0; trial < 20; ++trial) {
      // A positive definite M makes z unique.
      const MatrixXd M = random.definite(n);
      VectorXd z(n), w(n);
      for (int i = 0; i < n; ++i) {
        const double x = random();
        z[i] = std::max(x, 0.0);
        w[i] = std::max(-x, 0.0);
      }
      const LcpProblem p = dense(M, w - M * z);
      const LcpSolution s = solve(p);
      require_solved(p, s);
      CHECK((s.z - z).lpNorm<Eigen::Infinity>() < 1e-8);
    }
}

TEST_CASE("a monotone problem with a singular matrix is solved, dense and sparse alike", "[path]") {
  Random random(2);
  for (int trial = 0; trial < 30; ++trial) {
    // Bodies of unit mass; J has more rows than there are velocities: M = J J^T is singular.
    const int n = 24, nv = 6;
    const MatrixXd J = random.matrix(n, nv);
    VectorXd z(n), w(n);
    for (int i = 0; i < n; ++i) {
      const double x = random();
      z[i] = std::max(x, 0.0);
      w[i] = std::max(-x, 0.0);
    }
    LcpProblem p;
    p.expanded = true;
    p.A = MatrixXd::Identity(nv, nv).sparseView();
    p.B = (-J.transpose()).sparseView();
    p.C = J.sparseView();
    p.D.resize(n, n);
    p.q = VectorXd::Zero(n);
    // J v+ with v+ = v- + J^T z: choose v- such that w = J v+, where w must be in the range: take the offset in q
    // instead.
    p.a = VectorXd::Zero(nv);
    p.q = w - J * (J.transpose() * z);
    LcpOptions sparse;
    sparse.dense_limit = 0;
    const LcpSolution a = solve(p), b = solve(p, sparse);
    require_solved(p, a);
    require_solved(p, b);
    // The impulses are not unique, the velocities are (monotone problem).
    CHECK((J.transpose() * (a.z - b.z)).lpNorm<Eigen::Infinity>() < 1e-9);
    CHECK((a.x - J.transpose() * a.z).lpNorm<Eigen::Infinity>() < 1e-9);
    CHECK((b.x - J.transpose() * b.z).lpNorm<Eigen::Infinity>() < 1e-9);
  }
}

TEST_CASE("along the path of a P-matrix the normal map shrinks in proportion, and only shrinks", "[path]") {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 12;
    const MatrixXd M = random.definite(n);
    VectorXd q(n), w0(n);
    for (int i = 0; i < n; ++i) {
      q[i] = random();
      w0[i] = random(0.5, 1.5);
    }
    // From x = -w0 (z = 0): F_+(x) = q - w0, c = -F_+(x). Row of the first basic variable to fall to zero as z_0
    // leaves 1.
    const VectorXd cover = w0 - q;
    LcpProblem problem;
    problem.M = M;
    problem.q = q;
    PairScales scales;
    scales.rows = scales.columns = VectorXd::Ones(n);
    DenseBasis table;
    table.start(problem, scales);
    table.restart();
    table.set_load(q);
    table.set_cover(cover);
    int row = -1;
    double latest = 0;
    for (int i = 0; i < n; ++i)
      if (q[i] < 0 && -q[i] / cover[i] > latest) latest = -q[i] / cover[row = i];
    if (row < 0) continue;
    ComplementaryPath path;
    path.ratio.resize(table.padded());
    path.pivots.limit = 10000;
    REQUIRE(path.enter(table, row));
    double before = 1;
    while (path.goes_on(table)) {
      VectorXd z = VectorXd::Zero(n), w = z;
      double t = 0;
      for (int i = 0; i < n; ++i) {
        const int v = table.basic(i);
        (v == 2 * n ? t : v < n ? w[v] : z[v - n]) = table.rhs()[i];
      }
      CHECK(t < before + 1e-12);
      before = t;
      CHECK(z.dot(w) == 0);
      CHECK(std::min(z.minCoeff(), w.minCoeff()) > -1e-9);
      // F_+(p(t)) = (1 - t) F_+(x)
      CHECK((M * z + q - w + t * cover).lpNorm<Eigen::Infinity>() < 1e-9);
      const int entering = complement(path.left, n);
      path.exchange(table, entering, path.blocking_row(table, entering));
    }
    CHECK(path.end == PathEnd::solution);
  }
}

TEST_CASE("z_0 blocks where rounding alone would keep it above zero", "[path]") {
  // Along the path row 0 falls from 1 by 1 a unit, row 1, z_0, from 1e-3 (1 + off) by 1e-3 a unit.
  const auto blocking = [](double off, double vanishing = round_off) {
    VectorXd column = VectorXd::Zero(4), rhs = VectorXd::Ones(4);
    column[0] = -1;
    column[1] = -1e-3;
    rhs[1] = 1e-3 * (1 + off);
    RatioTest test;
    test.harris = 0;
    test.vanishing = vanishing;
    test.resize(4);
    return test.row(column.data(), rhs.data(), 1);
  };
  CHECK(blocking(-1e-9) == 1);
  CHECK(blocking(0) == 1);
  CHECK(blocking(1e-12) == 1);  // 1e-15 above zero, beside values of 1
  CHECK(blocking(1e-12, 0) == 0);
  CHECK(blocking(1e-9) == 0);
}

TEST_CASE("other units of the pairs give the same answer in those units", "[path]") {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 15;
    const MatrixXd M = random.definite(n);
    const VectorXd q = random.matrix(n, 1);
    VectorXd s(n);
    for (int i = 0; i < n; ++i) s[i] = std::pow(10.0, random(-4, 4));
    const LcpProblem p = dense(M, q), scaled = dense(s.asDiagonal() * M * s.asDiagonal(), s.cwiseProduct(q));
    const LcpSolution a = solve(p), b = solve(scaled);
    require_solved(p, a);
    require_solved(scaled, b);
    CHECK((a.z - s.cwiseProduct(b.z)).lpNorm<Eigen::Infinity>() < 1e-8 * (1 + a.z.lpNorm<Eigen::Infinity>()));
  }
}

TEST_CASE("a problem of nothing but ties is solved", "[path]") {
  // q = -1 everywhere, M = 1 1^T: any z >= 0 with sum 1.
  for (int n : {1, 4, 16, 64}) {
    const LcpProblem p = dense(MatrixXd::Ones(n, n), -VectorXd::Ones(n));
    const LcpSolution s = solve(p);
    require_solved(p, s);
    CHECK(s.z.sum() == Approx(1));
  }
  // q = 0: z = 0 solves it.
  const LcpProblem idle = dense(MatrixXd::Ones(5, 5), VectorXd::Zero(5));
  require_solved(idle, solve(idle));
  const LcpProblem empty = dense(MatrixXd(0, 0), VectorXd(0));
  CHECK(solve(empty).status == LcpStatus::solved);
}

TEST_CASE("an unsolvable problem ends in a typed failure that names every rung", "[path]") {
  // w = -z_1 - 1 < 0 for all z >= 0; and a pair of which the first row can only fall.
  const LcpProblem p = dense(-MatrixXd::Identity(1, 1), -VectorXd::Ones(1));
  const LcpProblem r = dense((MatrixXd(2, 2) << 0, -1, 1, 1).finished(), (VectorXd(2) << -1, 2).finished());
  for (const LcpProblem* problem : {&p, &r}) {
    const LcpSolution s = solve(*problem);
    CHECK(s.status == LcpStatus::ray);
    CHECK(s.z.isZero());
    CHECK(s.reason.find("crash from zero: ") == 0);
    CHECK(s.reason.find("proximal steps: ") != std::string::npos);
    CHECK(s.reason.find("start on the ray: ray") != std::string::npos);
  }
}

TEST_CASE("limits and broken data are typed", "[path]") {
  Random random(5);
  const int n = 30;
  LcpProblem p = dense(random.definite(n), -VectorXd::Ones(n));
  LcpOptions few;
  few.pivot_limit = 2;
  CHECK(solve(p, few).status == LcpStatus::nonconverged);
  LcpOptions strict;
  strict.tolerance = 1e-300;
  CHECK(solve(p, strict).status == LcpStatus::inaccurate);
  p.M(3, 4) = std::nan("");
  CHECK(solve(p).status == LcpStatus::not_finite);
  p.M(3, 4) = 0;
  p.q[2] = HUGE_VAL;
  CHECK(solve(p).status == LcpStatus::not_finite);
  LcpProblem singular;
  singular.expanded = true;
  for (SparseMatrix* m : {&singular.A, &singular.B, &singular.C, &singular.D}) m->resize(1, 1);
  singular.a = singular.q = -VectorXd::Ones(1);
  CHECK(solve(singular).status == LcpStatus::singular);
}

TEST_CASE("the same solver gives the same answer to the same problem, whatever it solved before", "[path]") {
  Random random(6);
  const LcpSolver kept = find_lcp_solver("path")->make({});
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 3 + 7 * trial % 31;
    const LcpProblem p = dense(random.definite(n), random.matrix(n, 1));
    LcpSolution s;
    kept(p, s);
    const LcpSolution fresh = solve(p);
    CHECK(s.z == fresh.z);
    CHECK(s.pivots == fresh.pivots);
  }
}

TEST_CASE("stored problems are solved on the original data, or fail with a type", "[path]") {
  int solved = 0, count = 0;
  for (const std::string folder : {"/problems", "/stacks"})
    for (const auto& entry : std::filesystem::directory_iterator(TEST_DATA + folder)) {
      const std::string file = entry.path().string();
      if (!file.ends_with(".M.mtx")) continue;
      const std::string stem = file.substr(0, file.size() - 6);
      const LcpProblem p = read_lcp_matrix_market(file, stem + ".q.mtx");
      const LcpSolution s = solve(p);
      INFO(stem << ": " << name(s.status) << ", " << s.reason);
      ++count;
      if (stem.ends_with("lcp_infeasible_3")) {
        CHECK(s.status == LcpStatus::ray);
        continue;
      }
      CHECK(s.status == LcpStatus::solved);
      CHECK(natural_residual(p, s.z) <= 1e-10);
      solved += s.status == LcpStatus::solved;
    }
  CHECK(count >= 30);
  CHECK(solved == count - 1);
}

TEST_CASE("a vertex that the tolerance asked for does not take for exact is repaired, and none else", "[path]") {
  const std::string stem = TEST_DATA "/problems/lcp_copositive_20";
  const LcpProblem p = read_lcp_matrix_market(stem + ".M.mtx", stem + ".q.mtx");
  CHECK(solve(p).factorisations == 0);
  LcpOptions options;
  options.tolerance = 1e-17;  // below rounding
  CHECK(solve(p, options).factorisations > 0);
}

// path-lib: the library is looked for once a process, so each case is a process of its own.
namespace {

bool passes_with(const std::string& environment, const std::string& test) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  return std::system((environment + " '" + self + "' '" + test + "' > /dev/null").c_str()) == 0;
}

LcpSolution library_solve(const LcpProblem& problem) {
  LcpSolution solution;
  find_lcp_solver("path-lib")->make({})(problem, solution);
  return solution;
}

}  // namespace

TEST_CASE("path-lib is unavailable with its reason where there is no library, and works where there is one", "[path]") {
  const std::string stub = "PATH50_LIBRARY='" PATH_STUB "'";
  CHECK(passes_with("PATH50_LIBRARY=/nowhere/libpath50.so", "path-lib without a library"));
  CHECK(passes_with("PATH50_LIBRARY=libc.so.6", "path-lib with a library of something else"));
  CHECK(passes_with("PATH50_LIBRARY=", "path-lib with a library of no name"));
  CHECK(passes_with(stub, "path-lib with a library"));
  CHECK(passes_with(stub + " PATH_STUB_APART=1", "path-lib with a library"));
  CHECK(passes_with(stub + " PATH_STUB_ANSWERS=nothing", "path-lib with a library that answers nothing"));
  CHECK(passes_with(stub + " PATH_STUB_ANSWERS=inf", "path-lib with a library that answers what is no number"));
  CHECK(passes_with(stub + " PATH_STUB_REFUSES=1", "path-lib with a library that refuses late"));
  CHECK(passes_with(stub + " PATH_STUB_SWEEPS=3", "path-lib with a library that is content with less"));
  for (const char* ending : {"ENDS=2 PATH_STUB_SAYS='no progress'", "ENDS=3 PATH_STUB_SAYS='major iteration limit'",
                             "ENDS=9 PATH_STUB_SAYS=infeasible", "ENDS=77 PATH_STUB_SAYS='no ending'"})
    CHECK(passes_with(stub + " PATH_STUB_" + ending, "path-lib with a library that gives up"));
  CHECK_FALSE(passes_with("PATH50_LIBRARY=/nowhere/libpath50.so", "path-lib with a library"));
}

TEST_CASE("path-lib without a library", "[.stub]") {
  const LcpSolverRow* row = find_lcp_solver("path-lib");
  REQUIRE(row != nullptr);
  CHECK(row->unavailable.find("/nowhere/libpath50.so") != std::string::npos);
  const LcpSolution s = library_solve(dense(MatrixXd::Identity(2, 2), -VectorXd::Ones(2)));
  CHECK(s.status == LcpStatus::unavailable);
  CHECK(s.reason == row->unavailable);
}

TEST_CASE("path-lib with a library of something else", "[.stub]") {
  CHECK(find_lcp_solver("path-lib")->unavailable.find("has no function") != std::string::npos);
}

TEST_CASE("path-lib with a library of no name", "[.stub]") {  // it is the one that is usually there
  const std::string_view unavailable = find_lcp_solver("path-lib")->unavailable;
  if (!unavailable.empty()) CHECK(unavailable.find("libpath50.so") != std::string_view::npos);
}

TEST_CASE("path-lib with a library that answers nothing", "[.stub]") {
  const LcpSolution s = library_solve(dense(MatrixXd::Identity(2, 2), -VectorXd::Ones(2)));
  CHECK(s.status == LcpStatus::inaccurate);
  CHECK(s.z.isZero(0));
  CHECK(s.z.size() == 2);
}

TEST_CASE("path-lib with a library that answers what is no number", "[.stub]") {
  const LcpSolution s = library_solve(dense(MatrixXd::Identity(2, 2), -VectorXd::Ones(2)));
  CHECK(s.status == LcpStatus::not_finite);
  CHECK(s.reason == "the PATH library returned no finite answer");
}

TEST_CASE("path-lib with a library", "[.stub]") {
  CHECK(find_lcp_solver("path-lib")->unavailable.empty());
  // Entries that are zero and a matrix that is not symmetric: a mistake in the columns would show.
  const MatrixXd M = (MatrixXd(3, 3) << 4, 1, 0, -1, 3, 0, 2, 0, 5).finished();
  const LcpProblem p = dense(M, (VectorXd(3) << -1, 2, -3).finished());
  const LcpSolution s = library_solve(p);
  require_solved(p, s);
  CHECK(s.pivots == 20000);
  // z_2 = 0: z = (1/4, 0, (3 - 1/2) / 5)
  CHECK((s.z - (VectorXd(3) << 0.25, 0, 0.5).finished()).lpNorm<Eigen::Infinity>() < 1e-12);
  // Nothing bounds an unknown from above.
  const LcpSolution large = library_solve(dense(M, 1e9 * p.q));
  CHECK((1e-9 * large.z - s.z).lpNorm<Eigen::Infinity>() < 1e-12);

  const LcpSolution refused = library_solve(dense(MatrixXd::Identity(11, 11), -VectorXd::Ones(11)));
  CHECK(refused.status == LcpStatus::unavailable);
  CHECK(refused.reason.find("licence refused") == 0);
  CHECK(refused.reason.find("11 unknowns") != std::string::npos);
}

TEST_CASE("path-lib with a library that refuses late", "[.stub]") {
  const LcpSolution s = library_solve(dense(MatrixXd::Identity(2, 2), -VectorXd::Ones(2)));
  CHECK(s.status == LcpStatus::unavailable);
  CHECK(s.reason.find("licence refused") == 0);
}

// Errors of Gauss and Seidel's sweeps fall by a fourth each here.
TEST_CASE("path-lib with a library that is content with less", "[.stub]") {
  const LcpProblem p = dense((MatrixXd(2, 2) << 2, 1, 1, 2).finished(), -3 * VectorXd::Ones(2));
  const LcpSolution s = library_solve(p);
  CHECK(s.status == LcpStatus::inaccurate);
  CHECK(s.reason == "solved, says the PATH library, by its own tolerance");
  CHECK(s.pivots == 3);
  CHECK(s.residual == natural_residual(p, s.z));
  CHECK(s.residual > 1e-6);
}

TEST_CASE("path-lib with a library that gives up", "[.stub]") {
  const char* says = std::getenv("PATH_STUB_SAYS");
  REQUIRE(says != nullptr);
  const LcpSolution s = library_solve(dense(MatrixXd::Identity(2, 2), -VectorXd::Ones(2)));
  CHECK(s.status == LcpStatus::nonconverged);
  CHECK(s.reason == "the PATH library ends with: " + std::string(says));
}
