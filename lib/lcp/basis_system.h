#pragma once

#include <Eigen/Core>
#include <vector>

#include "lcp/lcp.h"
#include "lcp/reduced_matrix.h"
#include "lcp/scaling.h"
#include "linalg/sparse_lu.h"

namespace cb {

/// The equations of an LCP at one basis, put together from the original matrices each time (no tableau, no updates):
///   A x + B z           = -f        x: nx free unknowns (none in the dense form)
///   C x + D z + c z_0 - w = -p      D: M in the dense form
/// with z_i = 0 where z_i is not basic, w_i = 0 where w_i is not. Basic slacks are read off their own rows, so that
/// what is factorised has the order nx + |a|, a = {i: z_i basic}, plus one while z_0 is basic:
///   [A B_a .; C_a D_aa c_a; C_r D_ra c_r]     r: the pair that is out (both of its variables are nonbasic)
/// Rows, columns and free unknowns are scaled by powers of two.
class BasisSystem {
 public:
  /// Takes a problem and its scales. Both may go afterwards.
  void start(const LcpProblem& problem, const PairScales& scales);
  void set_cover(const Eigen::VectorXd& cover) { cover_ = cover; }  ///< n, scaled
  /// `active`: a, ascending; `out`: r, or -1 where z_0 is not basic. False where the basis is singular.
  bool factor(const std::vector<int>& active, int out);
  /// Solves for f (nx) and p (n), scaled, with one step of refinement; returns the largest residual left.
  double solve(const Eigen::VectorXd& free_load, const Eigen::VectorXd& pair_load);

  const Eigen::VectorXd& z() const { return z_; }  ///< n, scaled; zero where nonbasic
  const Eigen::VectorXd& w() const { return w_; }  ///< n, scaled; zero where nonbasic
  double z0() const { return z0_; }
  bool finite() const { return z_.allFinite() && w_.allFinite() && std::isfinite(z0_); }

  /// f and p of the problem itself, scaled (a and q).
  const Eigen::VectorXd& free_load() const { return a_; }
  const Eigen::VectorXd& pair_load() const { return q_; }
  /// f and p of z_i = 1: column i of B and D.
  void column(int i, Eigen::VectorXd& free_load, Eigen::VectorXd& pair_load) const;
  /// f and p of z: B z and D z.
  void product(const Eigen::VectorXd& z, Eigen::VectorXd& free_load, Eigen::VectorXd& pair_load) const;

  int order() const { return lu_.order(); }         ///< of what was factorised last
  double entries() const { return lu_.entries(); }  ///< nonzeros of its factors: flops of a solve are twice that
  double flops() { return lu_.flops(); }            ///< of its factorisation

 private:
  void residual();

  int n_ = 0, nx_ = 0, out_ = -1;
  SparseMatrix A_, B_, C_, D_;       // scaled
  Eigen::VectorXd a_, q_, x_scale_;  // scaled; nx
  Eigen::VectorXd cover_, z_, w_;    // n
  double z0_ = 0;
  std::vector<int> active_, reduced_row_;  // n: row of each pair in the factorised matrix, or -1
  ReducedMatrix matrix_;                   // that is factorised
  std::vector<double> right_, u_, change_;
  SparseLu lu_;
};

}  // namespace cb
