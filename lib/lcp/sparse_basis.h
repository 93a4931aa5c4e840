#pragma once

#include <Eigen/Core>
#include <vector>

#include "lcp/basis.h"
#include "lcp/reduced_matrix.h"
#include "linalg/sparse_lu.h"

namespace cb {

/// The dictionary of an expanded problem, never formed: columns are solved for, one a pivot. The free unknowns x are
/// always basic and take no part in ratio tests; slacks that are basic are eliminated as singletons, so that what is
/// factorised has the order nx + |a|, a = {i: z_i basic}:
///   [A B_a .; C_a D_aa c_a; C_r D_ra c_r]     r: the pair that is out, and the last column, while z_0 is basic
class SparseBasis : public Basis {
 public:
  void start(const LcpProblem& problem, const PairScales& scales) override;
  bool eliminate() override;
  const Eigen::VectorXd& eliminated_load() const override { return eliminated_load_; }
  void restart() override;

  void set_load(const Eigen::VectorXd& q) override;
  void set_cover(const Eigen::VectorXd& cover) override { cover_ = cover; }
  const double* column(int variable) override;
  bool pivot(int row, int entering) override;
  bool renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q, const Eigen::VectorXd& cover) override;
  int exchanges_left() const override { return refactor_every_ - updates_.exchanges(); }
  bool refresh() override { return factorise(); }

  void solve_active(const std::vector<int>& active, double* x, double* scratch) override;
  void multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) override;
  void magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) override;
  double solve_at(const std::vector<int>& active, Eigen::VectorXd& z, Eigen::VectorXd& w) override;
  int column_solves() const override { return 1; }

  /// x = -A^-1 (B z + a)
  void free_unknowns(const Eigen::VectorXd& z, Eigen::VectorXd& x);

  int order() const { return basis_->order(); }         ///< of what was factorised last
  double entries() const { return basis_->entries(); }  ///< nonzeros of its factors: flops of a solve are twice that
  double flops() const { return basis_->flops(); }      ///< of its factorisation

  /// Exchanges kept as product form before the basis is factorised again; more: each solve costs more and loses digits.
  static constexpr int refactor_every = 100;
  /// Change of a basic value by a fresh factorisation (scaled) beyond which exchanges are halved, -.
  static constexpr double drift_allowed = 1e-9;

 private:
  void take_up(const std::vector<int>& active, int out);
  bool factorise();
  int list_reduced();
  void solve_free(Eigen::VectorXd& x);
  void solve_basis(const double* pair_rows, int free_column, double* out);
  void read_basic(const double* pair_rows, double* out);
  void equation_errors(const std::vector<double>& right, std::vector<double>& errors) const;

  const LcpProblem* problem_ = nullptr;
  const PairScales* scales_ = nullptr;
  int nx_ = 0, refactor_every_ = refactor_every;
  SparseMatrix A_, B_, C_, D_;                              // scaled by rows and columns
  Eigen::VectorXd x_scale_, work_x_, product_x_;            // nx
  Eigen::VectorXd eliminated_load_, cover_, load_, slack_;  // n
  Eigen::VectorXd change_, pair_;                           // padded
  std::vector<int> reduced_row_;                            // n: row of the factorised matrix, or -1 where w_i is basic
  std::vector<int> source_;            // n: slack index of each row's basic variable, or -1 - index in the solve
  std::vector<int> reduced_variable_;  // the variable of each column beyond the free ones
  ReducedMatrix matrix_;               // that is factorised
  std::vector<double> reduced_, right_, errors_;  // order of matrix_
  SparseLu free_, slack_basis_, other_basis_;     // A; the scaled A, while all slacks are basic; any other basis
  SparseLu* basis_ = &slack_basis_;               // the one at hand
  ProductForm updates_;
  int column_of_ = -1;  // the variable whose column is in change_
};

}  // namespace cb
