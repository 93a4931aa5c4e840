#pragma once

#include <Eigen/LU>
#include <climits>
#include <vector>

#include "lcp/basis.h"

namespace cb {

/// The dictionary of a dense problem, kept up to date pivot by pivot: n rows, n + 1 columns. A pivot costs 2 n (n + 1)
/// flops, less where columns have a zero in the pivot row; renew() O(|a| n^2).
class DenseBasis : public Basis {
 public:
  void start(const LcpProblem& problem, const PairScales& scales) override;
  bool eliminate() override { return true; }
  const Eigen::VectorXd& eliminated_load() const override { return problem_->q; }
  void restart() override;

  void set_load(const Eigen::VectorXd& q) override;
  void set_cover(const Eigen::VectorXd& cover) override;
  const double* column(int variable) override { return column_of(variable); }
  bool pivot(int row, int entering) override;
  bool renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q, const Eigen::VectorXd& cover) override;
  int exchanges_left() const override { return INT_MAX; }
  bool refresh() override { return true; }  // the table itself is the inverse

  void solve_active(const std::vector<int>& active, double* x, double* scratch) override;
  void multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) override;
  void magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) override;
  double solve_at(const std::vector<int>& active, Eigen::VectorXd& z, Eigen::VectorXd& w) override;
  int column_solves() const override { return 0; }

 private:
  const double* column_of(int variable) const { return table_.data() + std::size_t(place_[variable]) * padded_; }
  void transform(const double* q, double* out) const;

  const LcpProblem* problem_ = nullptr;
  const PairScales* scales_ = nullptr;
  Eigen::VectorXd table_;
  std::vector<int> entering_, leaving_;  // scratch of renew()
  Eigen::MatrixXd active_matrix_;        // scratch of solve_at()
  Eigen::VectorXd active_z_, active_error_, active_correction_;
  Eigen::PartialPivLU<Eigen::MatrixXd> active_factor_;
};

}  // namespace cb
