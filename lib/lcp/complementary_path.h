#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string_view>

#include "lcp/basis.h"

namespace cb {

// What solvers share that follow a path of complementary bases w = M z + q + c z_0. Scaled: |M_ii| ~ 1, max |q_i| ~ 1.

/// Ratio test in two passes after Harris (1973): among the rows that block within an allowance the largest pivot wins.
class RatioTest {
 public:
  double pivot_tolerance = 1e-9;  ///< an entry that blocks must be larger than this, -
  /// Rows whose basic value would fall to no less than minus the allowance still compete for the largest pivot: this,
  /// or `round_off` of the largest basic value where that is more, -.
  double harris = 1e-12;
  /// `preferred` blocks too where what others leave of it is no more than this of the largest basic value, -. Without
  /// (0), rows that vanish together with it are told apart by their rounding, and lead past the solution; with it, a
  /// cover that parts z_0 from all other values at the solution loses digits for nothing.
  double vanishing = 0;
  void resize(int padded) { score_.resize(padded); }
  /// Row that blocks the entering variable, or -1. `preferred` wins whenever it is among them (-1: none).
  int row(const double* column, const double* rhs, int preferred);

 private:
  double nearest(const double* column, const double* rhs, double allowance, double& largest) const;

  Eigen::VectorXd score_;  // padded
};

/// Takes z_0 out of the basis at a ray along `variable`, which nothing blocks, for whichever of its pair has the larger
/// pivot. Rounding of the data makes rays of problems that have none, close to z_0 = 0. Returns what came in; -1 where
/// neither has a pivot above the tolerance.
int drop_artificial(Basis& basis, int variable, double pivot_tolerance);

/// Pivots of a solver, restarts included.
struct PivotCount {
  int done = 0, limit = 0;
  bool spent() const { return done >= limit; }
};

/// How a path ends.
enum class PathEnd { solution, ray, doubtful_ray, turned_back, pivot_limit, bad_pivot };
std::string_view text(PathEnd end);

/// A path of almost complementary bases, pivot by pivot:
///   enter(basis, row);
///   while (goes_on(basis)) exchange(basis, complement(left, n), blocking row);
/// Whatever variable left the basis last, its complement enters, until z_0 leaves or nothing blocks.
struct ComplementaryPath {
  RatioTest ratio;
  PivotCount pivots;          ///< at whose limit a path ends
  double retreat = HUGE_VAL;  ///< z_0 beyond which the path has turned back
  int left = 0;               ///< the variable that left the basis last
  PathEnd end = PathEnd::solution;
  int ray_variable = 0;  ///< what nothing blocks, where it ends in a ray

  /// All of that from the complementary basis in hand: z_0 enters for the row that needs most of it to be feasible.
  PathEnd follow(Basis& basis);
  /// Begins: z_0 enters for the variable of `row`. False where there is no pivot for it.
  bool enter(Basis& basis, int row);
  /// Is the path to go on? If not, `end` says why.
  bool goes_on(const Basis& basis);
  /// Row that blocks `entering`; z_0 wins wherever it is among those that do (RatioTest::vanishing).
  int blocking_row(Basis& basis, int entering);
  /// `entering` for the variable of `row`; -1: nothing blocks it.
  void exchange(Basis& basis, int entering, int row);
  /// The same where the path has ended in a ray.
  bool drop_artificial(Basis& basis);

 private:
  bool ended_ = false;
};

}  // namespace cb
