#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "lcp/lcp.h"
#include "lcp/scaling.h"

namespace cb {

/// Variables of n pairs: w_i is i, z_i is n + i, the artificial z_0 is 2 n.
/// w_i and z_i are complements; the complement of z_0 does not exist.
constexpr int complement(int variable, int n) { return variable < n ? variable + n : variable - n; }

/// Of the largest basic value or z: what a sum of them cannot tell from zero by round-off, -. Smaller: rows that block
/// and signs of a vertex are decided by rounding; larger: answers are less exact.
inline constexpr double round_off = 16 * std::numeric_limits<double>::epsilon();

/// A basis of w = M z + q + c z_0, pairs scaled by R and C (scaling.h): of 2 n + 1 variables n are basic, one a row,
/// the others zero. Its dictionary, basic = rhs + T nonbasic, is what all pivoting methods read. Two kernels:
///   DenseBasis   dense form: keeps all of T, a pass over it a pivot
///   SparseBasis  expanded form: factorises the basis and solves for the column that is asked for
/// Vectors of rows are padded to whole vector registers; the entries beyond n stay zero. Storage is kept.
class Basis {
 public:
  virtual ~Basis() = default;

  /// Takes a problem and its scales; both are referred to until the next start.
  virtual void start(const LcpProblem& problem, const PairScales& scales) = 0;
  /// Eliminates the free unknowns; all that follows but solve_at() needs it. False where A is singular.
  virtual bool eliminate() = 0;
  /// n: q, and -C A^-1 a of the free unknowns, in the problem's units.
  virtual const Eigen::VectorXd& eliminated_load() const = 0;
  /// Basis of all w, rhs = 0, c = 0.
  virtual void restart() = 0;

  int n() const { return n_; }
  int padded() const { return padded_; }
  int basic(int row) const { return basic_[row]; }
  bool is_basic(int variable) const { return place_[variable] < 0; }
  int row_of(int variable) const { return -1 - place_[variable]; }
  int artificial() const { return 2 * n_; }
  /// Values of the basic variables (padded), carried along by pivot().
  double* rhs() { return rhs_.data(); }
  const double* rhs() const { return rhs_.data(); }

  /// rhs for load q (n, scaled).
  virtual void set_load(const Eigen::VectorXd& q) = 0;
  /// Covering vector c (n, scaled) of z_0, which must be nonbasic.
  virtual void set_cover(const Eigen::VectorXd& cover) = 0;
  /// d basic / d variable for a nonbasic variable (padded); valid until the next pivot.
  virtual const double* column(int variable) = 0;
  /// Exchanges the basic variable of `row` with the nonbasic `entering`. False where the pivot is zero or not finite.
  virtual bool pivot(int row, int entering) = 0;
  /// Takes up a basis from the original matrix: z_i basic for i in `active`, else w_i; z_0 for both of pair `out` (-1:
  /// nowhere). For load q and covering vector (n, scaled). False where it is singular.
  virtual bool renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q,
                     const Eigen::VectorXd& cover) = 0;
  /// Exchanges up to and with the next one after which pivot() takes the basis up from the matrix by itself.
  virtual int exchanges_left() const = 0;
  /// Recomputes what exchanges have worn. False where the basis cannot be factorised.
  virtual bool refresh() = 0;

  /// x <- M_aa^-1 x on the active set a = {i: z_i basic}: reads and writes x[i], i in a; `scratch` padded.
  virtual void solve_active(const std::vector<int>& active, double* x, double* scratch) = 0;
  /// w = M z, in the problem's own units.
  virtual void multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) = 0;
  /// |M| z for z >= 0: the sizes of the terms that w is the sum of.
  virtual void magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) = 0;

  /// z and w (n, in the problem's units) where z_i is basic for i in `active` (ascending) and w_i elsewhere: straight
  /// from the matrices and refined once, without a dictionary. Returns the largest error of the equations that w does
  /// not show, in scaled rows; HUGE_VAL where the basis is singular. Forgets the basis at hand.
  virtual double solve_at(const std::vector<int>& active, Eigen::VectorXd& z, Eigen::VectorXd& w) = 0;

  /// Solves that column() takes at most.
  virtual int column_solves() const = 0;
  /// Bases taken from the original matrix since the start.
  int factorisations() const { return factorisations_; }

 protected:
  int n_ = 0, padded_ = 0, factorisations_ = 0;
  Eigen::VectorXd rhs_;
  std::vector<int> basic_;  // n: variable of each row
  std::vector<int> place_;  // 2 n + 1: -1 - row of a basic variable; of another what the kernel has for it, >= 0
};

}  // namespace cb
