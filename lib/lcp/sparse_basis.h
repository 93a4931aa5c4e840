#pragma once

#include <Eigen/Core>
#include <vector>

#include "lcp/lcp.h"
#include "lcp/reduced_matrix.h"
#include "linalg/sparse_lu.h"

namespace cb {

/// The dictionary of an expanded problem at a basis, never formed: columns are solved for, one a pivot.
/// Same interface as DenseTableau (dense_tableau.h). The free unknowns x are always basic and take no part in ratio
/// tests; slacks that are basic are eliminated as singletons, so that what is factorised has the order nx + |a|,
/// a = {i: z_i basic}:   [A B_a; C_a D_aa], plus the covering vector's column while z_0 is basic.
class SparseBasis {
 public:
  /// Takes a problem and factorises A; false where it is singular. The problem is referred to until the next start.
  bool start(const LcpProblem& problem);
  /// q - C A^-1 a: the load once x is eliminated.
  const Eigen::VectorXd& condensed_load() const { return condensed_load_; }
  /// x = -A^-1 (B z + a)
  void free_unknowns(const Eigen::VectorXd& z, Eigen::VectorXd& x);
  void set_scales(const Eigen::VectorXd& pair_rows, const Eigen::VectorXd& pair_columns);

  void restart();
  int padded() const { return padded_; }
  int basic(int row) const { return basic_[row]; }
  bool is_basic(int variable) const { return row_[variable] >= 0; }
  int row_of(int variable) const { return row_[variable]; }
  double* rhs() { return rhs_.data(); }

  void set_load(const Eigen::VectorXd& q);
  void set_cover(const Eigen::VectorXd& cover) { cover_ = cover; }
  const double* column(int variable);
  static constexpr int column_solves = 1;  ///< that column() takes, at most
  bool pivot(int row, int entering);
  void transform(const double* q, double* out);
  void solve_active(const std::vector<int>& active, double* x, double* scratch);
  void multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w);
  void magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms);
  /// Factorises the present basis afresh. False where that fails.
  bool refresh() { return refactor(); }
  /// Takes up a basis for a load and a covering vector, as DenseTableau does.
  bool renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q, const Eigen::VectorXd& cover);
  int factorisations() const { return factorisations_; }

  /// Exchanges kept as product form before the basis is factorised again; more: each solve costs more and loses digits.
  static constexpr int refactor_every = 100;
  /// Change of a basic value by a fresh factorisation (scaled) beyond which exchanges are halved, -.
  static constexpr double drift_allowed = 1e-9;

 private:
  bool refactor();
  void solve_free(Eigen::VectorXd& x);
  void solve_basis(const double* pair_rows, int free_column, double* out);

  const LcpProblem* problem_ = nullptr;
  int n_ = 0, nx_ = 0, padded_ = 0, factorisations_ = 0, refactor_every_ = refactor_every;
  SparseMatrix A_, B_, C_, D_;  // scaled by rows and columns
  Eigen::VectorXd x_scale_, condensed_load_, cover_, load_, rhs_, change_, pair_, slack_, work_x_, residual_x_;
  std::vector<int> basic_, row_;       // n: variable of each row; 2 n + 1: row of each variable, or -1
  std::vector<int> reduced_row_;       // n: row of the factorised matrix, or -1 where w_i is basic
  std::vector<int> source_;            // n: slack index of each row's basic variable, or -1 - index in the solve
  std::vector<int> reduced_variable_;  // |a|: the variable of each column beyond the free ones
  ReducedMatrix matrix_;               // that is factorised
  std::vector<double> reduced_;
  SparseLu free_, slack_basis_, other_basis_;  // A; the scaled A, while all slacks are basic; any other basis
  SparseLu* basis_ = &slack_basis_;            // the one at hand
  ProductForm updates_;
  int column_of_ = -1;  // the variable whose column is in change_
};

}  // namespace cb
