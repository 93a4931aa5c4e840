#pragma once

#include <Eigen/Core>
#include <vector>

namespace cb {

/// Variables of a tableau of n pairs: w_i is i, z_i is n + i, the artificial z_0 is 2 n.
/// w_i and z_i are complements; the complement of z_0 does not exist.
constexpr int complement(int variable, int n) { return variable < n ? variable + n : variable - n; }

/// The dictionary of w = q + M z + c z_0 at a basis, dense and kept up to date pivot by pivot:
///   basic = rhs + T nonbasic,   n rows (padded to whole vector registers), n + 1 columns.
/// Storage is kept between problems. Cost of a pivot: 2 n (n + 1) flops, less where columns have a zero in the pivot
/// row; one pass over the table.
class DenseTableau {
 public:
  /// Takes a problem and its scales R, C (n). All are referred to until the next start.
  void start(const Eigen::MatrixXd& M, const Eigen::VectorXd& rows, const Eigen::VectorXd& columns);
  /// Basis of all w: T = R M C, rhs = 0, covering column 0.
  void restart();
  /// w = M z, in the problem's own units.
  void multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) const;
  /// |M| z for z >= 0: the sizes of the terms that w is the sum of.
  void magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) const;

  int n() const { return n_; }
  /// Rows including the padding, whose entries stay zero; a multiple of lanes.
  int padded() const { return padded_; }
  int basic(int row) const { return basic_[row]; }
  bool is_basic(int variable) const { return slot_[variable] < 0; }
  int row_of(int variable) const { return -1 - slot_[variable]; }

  /// Values of the basic variables (padded), owned by the caller's use: set, then carried along by pivot().
  double* rhs() { return rhs_.data(); }
  /// d basic / d variable for a nonbasic variable (padded); valid until the next pivot.
  const double* column(int variable) { return table_.data() + std::size_t(slot_[variable]) * padded_; }
  /// Right-hand side for load q (n, scaled).
  void set_load(const Eigen::VectorXd& q) { transform(q.data(), rhs_.data()); }
  /// Covering vector (n, scaled, in the original rows) of the artificial variable, which must be nonbasic.
  void set_cover(const Eigen::VectorXd& cover);
  /// The dictionary at a basis, from the original matrix: z_i basic for i in `active`, else w_i; z_0 for both of pair
  /// `out` (-1: nowhere). For load q and covering vector (n, scaled). False where the basis is singular. O(|a| n^2).
  bool renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q, const Eigen::VectorXd& cover);
  /// The table itself is the inverse: nothing to recompute.
  static bool refresh() { return true; }
  /// Exchanges the basic variable of `row` with the nonbasic `entering`. False where the pivot is zero or not finite.
  bool pivot(int row, int entering);
  /// values of the basic variables where all nonbasic ones are zero and q is `q` (length n; out is padded).
  void transform(const double* q, double* out) const;
  /// x <- M_aa^-1 x on the active set a = {i: z_i basic}: reads and writes x[i], i in a; `scratch` padded.
  void solve_active(const std::vector<int>& active, double* x, double* scratch) const;

  static constexpr int lanes = 8;
  static constexpr int column_solves = 0;  ///< that column() takes

 private:
  const Eigen::MatrixXd* M_ = nullptr;
  const Eigen::VectorXd *row_scale_ = nullptr, *column_scale_ = nullptr;
  int n_ = 0, padded_ = 0;
  Eigen::VectorXd table_, rhs_;
  std::vector<int> basic_;               // n: variable of each row
  std::vector<int> nonbasic_;            // n + 1: variable of each column
  std::vector<int> entering_, leaving_;  // scratch of renew()
  std::vector<int> slot_;                // 2 n + 1: column of a nonbasic variable, -1 - row of a basic one
};

}  // namespace cb
