#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "lcp/dense_tableau.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
#include "linalg/stop.h"

namespace cb {

// What solvers share that follow a path of complementary bases w = M z + q + c z_0. A Table is the dictionary of the
// scaled problem at a basis: DenseTableau or SparseBasis. Scaled: |M_ii| ~ 1, max |q_i| ~ 1.

/// Pseudo-random number in [0, 1) that depends on nothing but its arguments.
double draw(unsigned seed, unsigned i);
/// Are all numbers of a problem finite?
bool finite(const LcpProblem& problem);
/// Of the largest basic value or z: what a sum of them cannot tell from zero by round-off, -. Smaller: rows that block
/// and signs of a vertex are decided by rounding; larger: answers are less exact.
inline constexpr double round_off = 16 * std::numeric_limits<double>::epsilon();

/// Scales of a problem and its load, the free unknowns eliminated.
struct ScaledLoad {
  PairScales scales;
  Eigen::VectorXd root;            ///< n: sqrt(rho_i)
  Eigen::VectorXd original;        ///< n, in the problem's units
  Eigen::VectorXd q;               ///< n: original_i rows_i / size
  double size = 1;                 ///< max_i |original_i| / root_i, or 1
  double judged = 1;               ///< what residuals are fractions of: `size`, or LcpProblem::size where that is more
  const LcpProblem* of = nullptr;  ///< whose size and groups count
  /// From scales and original, for `problem`, which is referred to. False where they are not finite.
  bool set(const LcpProblem& problem);
};

/// How good an answer is, -. The error of a group is the root of the sum of squares of min(z_i s_i, w_i / s_i) over its
/// pairs, as a fraction of the largest z_i s_i of them, or its size; without groups, that of each pair over all that
/// the problem is about. Where it is above `beyond_doubt`, w_i may be a small sum of large terms, t_i = |q_i| + sum_j
/// |M_ij| z_j.
struct Judgement {
  /// Is it an answer? Natural residual (lcp.h), or the worst error of a group where that is more. An error of
  /// `term_rounding` t_i, or of that of any row in the same unit, is none, and a group is about t_i / s_i too: the last
  /// bits of the data leave that open.
  double residual = HUGE_VAL;
  /// Could it be better? The worst error of a group, `round_off` t_i of it no error. A solver that is content with
  /// less leaves what adds up over a run: a stack of 16 boxes begins to creep after 600 steps.
  double beyond_rounding = HUGE_VAL;
};
inline constexpr double beyond_doubt = 1e-12;  ///< -
/// -: as many roundings of each term a sum may be off by, whose terms are sums themselves. Larger: errors pass for
/// rounding; smaller: paths are followed to find what is not there.
inline constexpr double term_rounding = 128 * std::numeric_limits<double>::epsilon();

/// Ratio test in two passes after Harris (1973): among the rows that block within an allowance the largest pivot wins.
class RatioTest {
 public:
  double pivot_tolerance = 1e-9;  ///< an entry that blocks must be larger than this, -
  /// Rows whose basic value would fall to no less than minus the allowance still compete for the largest pivot: this,
  /// or `round_off` of the largest basic value where that is more, -.
  double harris = 1e-12;
  void resize(int padded) { score_.resize(padded); }
  /// Row that blocks the entering variable, or -1. `preferred` wins whenever it is among them (-1: none).
  int row(const double* column, const double* rhs, int preferred);

 private:
  double nearest(const double* column, const double* rhs, double allowance, double& largest) const;

  Eigen::VectorXd score_;  // padded
};

/// How a path ends.
enum class PathEnd { solution, ray, doubtful_ray, turned_back, pivot_limit, bad_pivot };
std::string_view text(PathEnd end);

/// Follows a path by pivots: whatever variable left the basis last, its complement enters, until z_0 leaves.
struct PathFollower {
  RatioTest ratio;
  int pivots = 0;             ///< so far
  int pivot_limit = 0;        ///< pivots at which a path ends
  double retreat = HUGE_VAL;  ///< z_0 beyond which the path has turned back
  int ray_variable = 0;       ///< what nothing blocks, where a path ends in a ray

  /// From the basis that z_0 has just entered, `leaving` having left it. `at_basis()` is called after each pivot while
  /// z_0 is basic; where it returns false the basis is of no use.
  template <class Table, class AtBasis>
  PathEnd follow(Table& table, int n, int leaving, AtBasis&& at_basis) {
    const int artificial = 2 * n;
    for (;;) {
      if (leaving == artificial) return PathEnd::solution;
      if (pivots >= pivot_limit) return PathEnd::pivot_limit;
      poll_stop();
      if (table.rhs()[table.row_of(artificial)] > retreat) return PathEnd::turned_back;
      if (!at_basis()) return PathEnd::bad_pivot;
      const int entering = complement(leaving, n);
      const int row = ratio.row(table.column(entering), table.rhs(), table.row_of(artificial));
      if (row < 0) {
        ray_variable = entering;
        return PathEnd::ray;
      }
      leaving = table.basic(row);
      if (!table.pivot(row, entering)) return PathEnd::bad_pivot;
      ++pivots;
    }
  }

  /// Takes z_0 out where a path has ended in a ray, for whichever variable of the pair that is out has the larger
  /// pivot. Rounding of the data makes rays of problems that have none, close to z_0 = 0. False where neither has one.
  template <class Table>
  bool drop_artificial(Table& table, int n) {
    const int row = table.row_of(2 * n), other = complement(ray_variable, n);
    const double p = std::abs(table.column(ray_variable)[row]), p_other = std::abs(table.column(other)[row]);
    if (!table.pivot(row, p > p_other ? ray_variable : other)) return false;
    ++pivots;
    return true;
  }
};

/// Vertices and rays of a basis, judged on the original data.
struct PathJudge {
  double refined = 1e-16;       ///< refinement stops below this residual of the equalities, -
  int refinements = 3;          ///< steps of iterative refinement at most
  double ray_tolerance = 1e-9;  ///< a ray may violate its equations by this much of its largest entry, -

  /// The vertex of the present basis for the load, refined on the original data, then clipped: z, and how good it is;
  /// no good where the basis cannot be factorised.
  template <class Table>
  Judgement vertex(Table& table, const ScaledLoad& load, Eigen::VectorXd& z);

  /// Is the direction along which nothing blocks `variable` a ray of w = M z + q + c z_0?
  /// With d the change per unit of the variable: M dz + c dz_0 = dw, all of it >= 0, dz.dw = 0 by the basis.
  template <class Table>
  bool ray_holds(Table& table, const ScaledLoad& load, const Eigen::VectorXd& cover, int variable);

 private:
  template <class Table>
  Judgement judge(Table& table, const ScaledLoad& load, const Eigen::VectorXd& z);
  Judgement first_look(const ScaledLoad& load, const Eigen::VectorXd& z);
  void second_look(const ScaledLoad& load, Judgement& found);
  double worst_of_groups(const ScaledLoad& load);

  Eigen::VectorXd scratch_, w_, z_, product_;
  Eigen::VectorXd error_, size_, squares_;  // n; groups
  std::vector<int> active_;
};

template <class Table>
Judgement PathJudge::vertex(Table& table, const ScaledLoad& load, Eigen::VectorXd& z) {
  const auto n = static_cast<int>(load.q.size());
  const auto& scales = load.scales;
  if (!table.refresh()) return {};
  scratch_.resize(table.padded());
  w_.resize(n);
  z_.resize(n);
  active_.clear();
  for (int i = 0; i < n; ++i)
    if (table.is_basic(n + i)) active_.push_back(i);
  z.setZero(n);

  // M_aa z_a = -q_a through the inverse that the table holds; then residuals from the original M.
  double before = HUGE_VAL;
  for (const int i : active_) z_[i] = -load.original[i] * scales.rows[i];
  for (int step = 0;; ++step) {
    table.solve_active(active_, z_.data(), scratch_.data());
    for (const int i : active_) z[i] += z_[i] * scales.columns[i];
    table.multiply(z, w_);
    w_ += load.original;
    double worst = 0;
    for (const int i : active_) worst = std::max(worst, std::abs(z_[i] = -w_[i] * scales.rows[i]));
    if (step >= refinements || !(worst < 0.5 * before) || worst <= refined * load.size) break;
    before = worst;
  }

  bool clipped = false;
  for (const int i : active_)
    if (!(z[i] >= 0)) {
      z[i] = 0;
      clipped = true;
    }
  if (clipped) {
    table.multiply(z, w_);
    w_ += load.original;
  }
  return judge(table, load, z);
}

// Judges z, whose w = M z + q is in w_.
template <class Table>
Judgement PathJudge::judge(Table& table, const ScaledLoad& load, const Eigen::VectorXd& z) {
  Judgement found = first_look(load, z);
  if (found.beyond_rounding > beyond_doubt && found.beyond_rounding < HUGE_VAL) {
    table.magnitudes(z, product_);
    second_look(load, found);
  } else {
    found.residual = std::max(found.residual, found.beyond_rounding);
  }
  return found;
}

template <class Table>
bool PathJudge::ray_holds(Table& table, const ScaledLoad& load, const Eigen::VectorXd& cover, int variable) {
  const auto n = static_cast<int>(load.q.size());
  const double* column = table.column(variable);
  z_.setZero(n);
  w_.setZero(n);
  double artificial = 0, largest = 1;
  const auto put = [&](int v, double value) {
    largest = std::max(largest, std::abs(value));
    if (v == 2 * n)
      artificial = value;
    else if (v < n)
      w_[v] = value;
    else
      z_[v - n] = value * load.scales.columns[v - n];
  };
  for (int i = 0; i < n; ++i) put(table.basic(i), column[i]);
  put(variable, 1);
  const double lowest = std::min({artificial, z_.minCoeff(), w_.minCoeff()});
  table.multiply(z_, product_);
  double error = 0;
  for (int i = 0; i < n; ++i)
    error = std::max(error, std::abs(product_[i] * load.scales.rows[i] + cover[i] * artificial - w_[i]));
  return lowest >= -ray_tolerance * largest && error <= ray_tolerance * largest;
}

/// A covering vector under which the basic values of a complementary basis grow as p with z_0: c = p_w - M p_z, where
/// p_z is p for `active`, whose z are basic, p_w for the others, zero elsewhere. `p_z` is scratch; all n.
template <class Table>
void set_own_cover(Table& table, const ScaledLoad& load, const std::vector<int>& active, const Eigen::VectorXd& p,
                   Eigen::VectorXd& p_z, Eigen::VectorXd& cover) {
  p_z.setZero(p.size());
  for (const int i : active) p_z[i] = p[i] * load.scales.columns[i];
  table.multiply(p_z, cover);
  cover = p - cover.cwiseProduct(load.scales.rows);
  for (const int i : active) cover[i] -= p[i];
}

/// What the ways to start of a solver came to, where none of them reached an answer.
struct Climb {
  int rungs = 0, rays = 0, singular = 0;  ///< tried; of them ended by PathEnd::ray, by PathEnd::bad_pivot
  PathEnd end = PathEnd::bad_pivot;       ///< of the last
};

/// Tries each rung (`name`) by `attempt(rung)`, which leaves z and residual in `solution`, until one solves the problem
/// within `tolerance` or `spent()` holds; solution.reason tells how each ended. True where there is an answer:
/// `solved`, or the best vertex as `inaccurate`, kept meanwhile in `best` (n). Without one, z is zero and status is
/// left alone.
template <class Ladder, class Attempt, class Spent>
bool climb(const Ladder& ladder, double tolerance, LcpSolution& solution, Eigen::VectorXd& best, Climb& tried,
           const Attempt& attempt, const Spent& spent) {
  double least = HUGE_VAL;
  for (const auto& rung : ladder) {
    tried.end = attempt(rung);
    if (tried.end == PathEnd::solution && solution.residual <= tolerance) {
      solution.status = LcpStatus::solved;
      if (tried.rungs > 0) solution.reason += "; solved by: " + std::string(rung.name);
      return true;
    }
    if (tried.end == PathEnd::solution && solution.residual < least) {
      least = solution.residual;
      best = solution.z;
    }
    tried.rays += tried.end == PathEnd::ray;
    tried.singular += tried.end == PathEnd::bad_pivot;
    solution.reason += (tried.rungs++ > 0 ? "; " : "") + std::string(rung.name) + ": " + std::string(text(tried.end));
    if (spent()) break;
  }
  solution.residual = least;
  if (least == HUGE_VAL) {
    solution.z.setZero(solution.z.size());
    return false;
  }
  solution.z = best;
  solution.status = LcpStatus::inaccurate;
  return true;
}

}  // namespace cb
