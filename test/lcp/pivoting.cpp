// What paths of complementary bases are made of: the ratio test, a path's ends, the way to an exact vertex, the ladder.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "lcp/complementary_path.h"
#include "lcp/dense_basis.h"
#include "lcp/exact_vertex.h"
#include "lcp/front.h"
#include "lcp/judge.h"
#include "lcp/ladder.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Row of the ratio test for a column and basic values (of at most eight rows).
struct Ratio : RatioTest {
  int operator()(const std::vector<double>& column, const std::vector<double>& values, int first = -1) {
    VectorXd c = VectorXd::Zero(8), x = c;
    for (std::size_t i = 0; i < column.size(); ++i) {
      c[static_cast<int>(i)] = column[i];
      x[static_cast<int>(i)] = values[i];
    }
    resize(8);
    return row(c.data(), x.data(), first);
  }
};

/// A problem without scales at the basis of its w.
struct Table {
  LcpProblem problem;
  ScaledLoad load;
  DenseBasis basis;

  Table(const MatrixXd& M, const VectorXd& q) {
    problem.M = M;
    problem.q = q;
    load.scales.rho = load.scales.rows = load.scales.columns = VectorXd::Ones(q.size());
    load.original = q;
    REQUIRE(load.set(problem));
    basis.start(problem, load.scales);
    basis.restart();
    basis.set_load(load.q);
  }
  void cover(const VectorXd& c) { basis.set_cover(c); }
};

ComplementaryPath path_on(const Basis& basis, int limit = 1000) {
  ComplementaryPath path;
  path.ratio.resize(basis.padded());
  path.pivots.limit = limit;
  return path;
}

}  // namespace

TEST_CASE("what blocks is the first row to fall to zero, and of those within the allowance the largest pivot") {
  Ratio ratio;
  CHECK(ratio({-1, -1, -1}, {3, 1, 2}) == 1);
  CHECK(ratio({-1, -4, 1}, {1, 4.5, 0}) == 0);
  CHECK(ratio({1, 0.5}, {0, 0}) == -1);  // nothing falls
  CHECK(ratio({}, {}) == -1);
  // Row 1 falls at 1 + 2.5e-13: row 0 may go 1e-12 below zero meanwhile.
  CHECK(ratio({-1, -2}, {1, 2 + 5e-13}) == 1);
  CHECK(ratio({-2, -1}, {2 + 5e-13, 1}) == 0);
  CHECK(ratio({-1, -2}, {1, 2 + 1e-11}) == 0);
  ratio.harris = 1e-10;
  CHECK(ratio({-1, -2}, {1, 2 + 1e-11}) == 1);
}

TEST_CASE("the allowance is rounding of the largest basic value where that is more") {
  Ratio ratio;
  // 16 eps 1e6 = 3.6e-9; row 2 does not fall.
  CHECK(ratio({-1, -2, 0}, {1, 2 + 5e-9, 1e6}) == 1);
  CHECK(ratio({-1, -2, 0}, {1, 2 + 2e-8, 1e6}) == 0);
  CHECK(ratio({-1, -2, 0}, {1, 2 + 5e-9, 1}) == 0);
}

TEST_CASE("only entries above the pivot tolerance block, and a value below zero blocks at once") {
  Ratio ratio;
  CHECK(ratio({-0.9e-9, -1}, {0, 5}) == 1);
  CHECK(ratio({-1.1e-9, -1}, {0, 5}) == 0);
  CHECK(ratio({-0.9e-9}, {0}) == -1);
  ratio.pivot_tolerance = 1e-10;
  CHECK(ratio({-0.9e-9}, {0}) == 0);
  // A row that has fallen by rounding blocks at a step of 0, not before it: the row at 0 has the larger pivot.
  ratio.harris = 0;
  CHECK(ratio({-1, -3}, {-1e-13, 0}) == 1);
  CHECK(ratio({-1, -3}, {-1e-13, 1}) == 0);
}

TEST_CASE("a row that is preferred wins among those that block, and nowhere else") {
  Ratio ratio;
  CHECK(ratio({-1, -2, -3}, {1, 2, 3}, 0) == 0);
  CHECK(ratio({-1, -2, -3}, {1, 2, 3}, 1) == 1);
  CHECK(ratio({-1, -2, -3}, {1.1, 2, 3}, 0) == 2);
  CHECK(ratio({-1e-10, -2}, {0, 2}, 0) == 1);  // no pivot
  CHECK(ratio({1, -2}, {0, 2}, 0) == 1);       // rises
}

TEST_CASE("z_0 enters for the row that needs most of it, of those that it helps") {
  const auto row = [](const VectorXd& q, const VectorXd& c) {
    Table table(MatrixXd::Identity(q.size(), q.size()), q);
    table.cover(c);
    ComplementaryPath path = path_on(table.basis, 1);
    const PathEnd end = path.follow(table.basis);
    if (end == PathEnd::solution) return -1;
    CHECK(end == PathEnd::pivot_limit);
    CHECK(path.pivots.done == 1);
    CHECK(path.left == table.basis.row_of(table.basis.artificial()));
    return path.left;
  };
  CHECK(row(VectorXd{{-1, -3, -2}}, VectorXd{{1, 1, 1}}) == 1);
  CHECK(row(VectorXd{{-1, -3, -2}}, VectorXd{{1, 3.5, 1}}) == 2);
  CHECK(row(VectorXd{{-1, -3, -2}}, VectorXd{{1, 0, -1}}) == 0);
  CHECK(row(VectorXd{{-1, -3}}, VectorXd{{0, -2}}) == -1);
  CHECK(row(VectorXd{{1, 0}}, VectorXd{{1, 1}}) == -1);
}

TEST_CASE("a path ends where its pivots are spent, where it turns back, in a ray and in the solution, and says so") {
  // w_0 = z_0 - 1, w_1 = z_1 - 2, z = (1, 2): the artificial variable starts at 1, where both pairs are of size 1/2, 1.
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const auto follow = [](Table& table, int limit, double retreat) {
    table.cover(VectorXd::Ones(2));
    ComplementaryPath path = path_on(table.basis, limit);
    path.retreat = retreat;
    const PathEnd end = path.follow(table.basis);
    CHECK(end == path.end);
    return std::pair{end, path.pivots.done};
  };
  const VectorXd q{{-1, -2}};
  Table on(I, q);
  CHECK(follow(on, 1000, HUGE_VAL) == std::pair{PathEnd::solution, 3});
  CHECK_FALSE(on.basis.is_basic(4));
  CHECK(on.basis.rhs()[on.basis.row_of(2)] == 0.5);  // of max |q|
  CHECK(on.basis.rhs()[on.basis.row_of(3)] == 1);
  Table cut(I, q);
  CHECK(follow(cut, 2, HUGE_VAL) == std::pair{PathEnd::pivot_limit, 2});
  CHECK(cut.basis.is_basic(4));
  Table just(I, q);
  CHECK(follow(just, 1000, 1) == std::pair{PathEnd::solution, 3});
  Table back(I, q);
  CHECK(follow(back, 1000, 0.999) == std::pair{PathEnd::turned_back, 1});
  // w = -1 whatever z: nothing blocks.
  Table ray(MatrixXd::Zero(2, 2), VectorXd{{-1, -1}});
  CHECK(follow(ray, 1000, HUGE_VAL).first == PathEnd::ray);
  // Of a path that is over nothing goes on.
  Table uncovered(I, q);
  ComplementaryPath none = path_on(uncovered.basis);
  CHECK_FALSE(none.enter(uncovered.basis, 0));
  CHECK(none.end == PathEnd::bad_pivot);
  CHECK(none.pivots.done == 0);
  CHECK_FALSE(none.goes_on(uncovered.basis));
}

TEST_CASE("at a ray z_0 leaves for whichever of the pair has the larger pivot, if that is one") {
  // w = m z + q + c z_0: in z_0's row w has 1 / c and z has -m / c.
  const auto in = [](double m, double c, int variable) {
    Table table(MatrixXd::Constant(1, 1, m), VectorXd::Constant(1, -1));
    table.cover(VectorXd::Constant(1, c));
    REQUIRE(table.basis.pivot(0, 2));
    ComplementaryPath path = path_on(table.basis);
    path.ray_variable = variable;
    DenseBasis basis = table.basis;
    const bool out = path.drop_artificial(basis);
    const int came = drop_artificial(table.basis, variable, path.ratio.pivot_tolerance);
    CHECK(out == (came >= 0));
    CHECK(path.pivots.done == (out ? 1 : 0));
    CHECK(table.basis.is_basic(2) == (came < 0));
    if (came >= 0) CHECK(table.basis.is_basic(came));
    return came;
  };
  for (const int variable : {0, 1}) {
    CHECK(in(2, 1, variable) == 1);
    CHECK(in(-2, 1, variable) == 1);
    CHECK(in(0.5, 1, variable) == 0);
    CHECK(in(0, 1, variable) == 0);
    CHECK(in(0.5, 1e10, variable) == -1);
    CHECK(in(20, 1e10, variable) == 1);
    CHECK(in(0.5, 0.9e9, variable) == 0);
  }
}

TEST_CASE("under a vertex's own cover its basic values grow with z_0 by what was asked") {
  // Rows and columns of different scales.
  const MatrixXd M{{4, 1, -0.5}, {-1, 3, 0.25}, {0.5, 2, 5}};
  LcpProblem problem;
  problem.M = M;
  problem.q = VectorXd{{1, -2, 3}};
  ScaledLoad load;
  load.scales.rho = VectorXd::Ones(3);
  load.scales.rows = VectorXd{{0.5, 2, 1}};
  load.scales.columns = VectorXd{{1, 0.25, 4}};
  load.original = problem.q;
  REQUIRE(load.set(problem));
  const VectorXd p{{1.25, 1.5, 1.75}};
  for (const std::vector<int>& active : {std::vector<int>{}, {1}, {0, 2}, {0, 1, 2}}) {
    DenseBasis basis;
    basis.start(problem, load.scales);
    VectorXd scratch, cover;
    set_own_cover(basis, load, active, p, scratch, cover);
    REQUIRE(basis.renew(active, -1, load.q, cover));
    for (int i = 0; i < 3; ++i)
      CHECK(basis.column(basis.artificial())[i] == Approx(p[basis.basic(i) % 3]).epsilon(1e-13));
  }
}

namespace {

/// M = 2 I + ones, q = -(M z) with z = (1, 2, 0), and w = (0, 0, 1).
struct Known : Table {
  Known() : Table(matrix(), load_of()) {}
  static MatrixXd matrix() { return 2 * MatrixXd::Identity(3, 3) + MatrixXd::Ones(3, 3); }
  static VectorXd load_of() { return VectorXd{{0, 0, 1}} - matrix() * VectorXd{{1, 2, 0}}; }
  bool at_answer() const { return basis.is_basic(3) && basis.is_basic(4) && basis.is_basic(2); }
};

}  // namespace

TEST_CASE("from a vertex that is none a path of its own leads to the exact one, and leaves the path's rules alone") {
  for (const std::vector<int>& active : {std::vector<int>{}, {2}, {0}, {0, 1, 2}, {0, 1}}) {
    Known known;
    REQUIRE(known.basis.renew(active, -1, known.load.q, VectorXd::Ones(3)));
    ComplementaryPath path = path_on(known.basis);
    path.ratio.harris = 3e-7;
    path.ratio.vanishing = 4e-7;
    path.retreat = 5;
    PathJudge judge;
    ExactVertex exact;
    VectorXd z;
    CHECK(exact.find(known.basis, known.load, path, judge, 1, z) <= 1e-15);
    CHECK((z - VectorXd{{1, 2, 0}}).norm() < 1e-14);
    CHECK(known.at_answer());
    CHECK((path.pivots.done == 0) == (active == std::vector<int>{0, 1}));
    CHECK(path.ratio.harris == 3e-7);
    CHECK(path.ratio.vanishing == 4e-7);
    CHECK(path.retreat == 5);
  }
}

TEST_CASE("where no path may be followed to a better vertex the one in hand is returned with its residual") {
  const auto find = [](int repairs, int limit, PathEnd first, bool given) {
    Known known;
    REQUIRE(known.basis.renew({0}, -1, known.load.q, VectorXd::Ones(3)));
    ComplementaryPath path = path_on(known.basis, limit);
    PathJudge judge;
    ExactVertex exact;
    exact.repairs = repairs;
    VectorXd z;
    int called = 0;
    const std::function<PathEnd()> own = [&] {
      ++called;
      return first;
    };
    const double residual =
        exact.find(known.basis, known.load, path, judge, 1, z, given ? own : std::function<PathEnd()>());
    CHECK(called == (given && repairs > 0 ? 1 : 0));
    return std::pair{residual, z};
  };
  // z_0 = 5 / 3 with w_1 = 5/3 - 7 and w_2 = 5/3 - 2: of 7 / sqrt(1) 16/21 is missing.
  const VectorXd at_hand{{5.0 / 3, 0, 0}};
  for (const auto& [residual, z] :
       {find(0, 1000, PathEnd::solution, false), find(4, 0, PathEnd::solution, false), find(4, 0, PathEnd::ray, true),
        find(0, 1000, PathEnd::ray, true), find(1, 1000, PathEnd::ray, true)}) {
    CHECK(residual == Approx(16.0 / 21));
    CHECK((z - at_hand).norm() < 1e-14);
  }
  // After a first path that ended elsewhere than at a solution one with a cover of its own is tried.
  for (const auto& [residual, z] : {find(2, 1000, PathEnd::ray, true), find(1, 1000, PathEnd::ray, false)}) {
    CHECK(residual < 1e-14);
    CHECK((z - VectorXd{{1, 2, 0}}).norm() < 1e-14);
  }
}

namespace {

struct Step {
  std::string_view name;
  PathEnd end;
  double residual, z;
};

struct Climbed {
  LcpSolution solution;
  Climb tried;
  bool answered;
  int attempts = 0;
};

Climbed climbed(const std::vector<Step>& ladder, int spent_after = 100) {
  Climbed c;
  c.solution.z = VectorXd::Constant(1, 7);
  c.solution.status = LcpStatus::cycling;
  VectorXd best;
  c.answered = climb(
      ladder, 1e-10, c.solution, best, c.tried,
      [&](const Step& step) {
        ++c.attempts;
        c.solution.residual = step.residual;
        c.solution.z[0] = step.z;
        return step.end;
      },
      [&] { return c.attempts >= spent_after; });
  return c;
}

}  // namespace

TEST_CASE("the first rung that solves a problem is the last to be tried, and the reason names those before it") {
  const Climbed at_once = climbed({{"one", PathEnd::solution, 1e-10, 1}, {"two", PathEnd::solution, 0, 2}});
  CHECK(at_once.answered);
  CHECK(at_once.attempts == 1);
  CHECK(at_once.solution.status == LcpStatus::solved);
  CHECK(at_once.solution.reason.empty());
  CHECK(at_once.solution.z[0] == 1);
  const Climbed later = climbed({{"one", PathEnd::solution, 1e-9, 1},
                                 {"two", PathEnd::ray, 0, 2},
                                 {"three", PathEnd::solution, 1e-11, 3},
                                 {"four", PathEnd::solution, 0, 4}});
  CHECK(later.answered);
  CHECK(later.attempts == 3);
  CHECK(later.solution.status == LcpStatus::solved);
  CHECK(later.solution.z[0] == 3);
  CHECK(later.solution.residual == 1e-11);
  CHECK(later.solution.reason == "one: vertex refused by the check; two: ray; solved by: three");
}

TEST_CASE("where no rung solves a problem the best vertex is inaccurate, and without one the endings are counted") {
  const Climbed vertices = climbed({{"one", PathEnd::solution, 1e-3, 1},
                                    {"two", PathEnd::solution, 1e-7, 2},
                                    {"three", PathEnd::solution, 1e-5, 3},
                                    {"four", PathEnd::pivot_limit, 1e-9, 4}});
  CHECK(vertices.answered);
  CHECK(vertices.solution.status == LcpStatus::inaccurate);
  CHECK(vertices.solution.residual == 1e-7);
  CHECK(vertices.solution.z[0] == 2);
  const Climbed none = climbed({{"one", PathEnd::ray, 0, 1},
                                {"two", PathEnd::bad_pivot, 0, 2},
                                {"three", PathEnd::doubtful_ray, 0, 3},
                                {"four", PathEnd::ray, 0, 4},
                                {"five", PathEnd::turned_back, 0, 5}});
  CHECK_FALSE(none.answered);
  CHECK(none.solution.status == LcpStatus::cycling);  // left alone
  CHECK(none.solution.z[0] == 0);
  CHECK(none.solution.residual == HUGE_VAL);
  CHECK(none.tried.rungs == 5);
  CHECK(none.tried.rays == 2);
  CHECK(none.tried.singular == 1);
  CHECK(none.tried.end == PathEnd::turned_back);
  CHECK(none.solution.reason ==
        "one: ray; two: pivot too small; three: ray that the original data refute; four: ray; five: path turned back");
  const Climbed cut = climbed({{"one", PathEnd::pivot_limit, 0, 1}, {"two", PathEnd::solution, 0, 2}}, 1);
  CHECK_FALSE(cut.answered);
  CHECK(cut.attempts == 1);
  CHECK(cut.solution.reason == "one: pivot limit");
}
