// Projected Gauss-Seidel for linear complementarity problems. Outside the paper: the example of docs/adding.md.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns). Sweep over the rows, each solved for its own unknown:
//   z_i <- max(0, z_i - w_i / M_ii),   w <- w + M_i (change of z_i)
//
// Source: R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem (1992), sec. 5.2 (projected
// successive overrelaxation with relaxation 1). Converges for symmetric positive definite M; for symmetric positive
// semidefinite M with positive diagonal the residual does; for others nothing is known.
//
// Differences from the source:
//  1. w is formed afresh at every check, and the residual is the common one on the whole of the original data: a row
//     that was just solved says nothing about the rows after it.
//
// Returns: solved; singular where a diagonal is not positive: the sweep divides by it (the slip bounds of a friction
// pyramid have a zero there: such LCPs are refused before the first sweep, unless they are regularised);
// nonconverged (sweep limit; the reason says where the iterates grew without bound); not_finite. On each of
// them z is the best iterate that a check has seen.

#include <cmath>

#include "lcp/front.h"
#include "linalg/stop.h"

namespace cb {

namespace {

struct PgsOptions : LcpOptions {
  int check_every = 10;  ///< sweeps between two checks; more: cheaper sweeps, later endings
};

class Pgs {
 public:
  static constexpr Wants wants = Wants::dense_matrix;
  explicit Pgs(const LcpOptions& options) { static_cast<LcpOptions&>(o_) = options; }

  void solve(Front& front, LcpSolution& solution) {
    const auto end = [&](LcpStatus status, std::string reason = "") {
      solution.status = status;
      solution.reason = std::move(reason);
    };
    const LcpProblem& form = front.form();
    const int n = form.n(), limit = front.pivot_limit();
    for (int i = 0; i < n; ++i)
      if (form.M(i, i) <= 0)
        return end(LcpStatus::singular, "row " + std::to_string(i + 1) + " has no positive diagonal to divide by");

    z_.setZero(n);
    for (;;) {
      const double residual = natural_residual(form, z_);
      if (residual < solution.residual) {
        solution.residual = residual;
        solution.z = z_;
      }
      if (residual <= o_.tolerance) return end(LcpStatus::solved);
      if (!z_.allFinite()) return end(LcpStatus::nonconverged, "the iterates grow without bound");
      if (solution.pivots >= limit) return end(LcpStatus::nonconverged, "sweep limit");
      poll_stop();

      w_ = form.M * z_ + form.q;
      for (int s = 0; s < o_.check_every && solution.pivots < limit; ++s, ++solution.pivots)
        for (int i = 0; i < n; ++i) {
          const double free = z_[i] - w_[i] / form.M(i, i);
          const double next = free < 0 ? 0 : free, change = next - z_[i];  // a NaN stays
          if (change == 0) continue;
          w_ += change * form.M.col(i);
          z_[i] = next;
        }
    }
  }

 private:
  PgsOptions o_;
  Eigen::VectorXd z_, w_;  // n
};

}  // namespace

LcpSolverRow pgs_row() {
  return {"pgs", "projected Gauss-Seidel, outside the paper; not for rows without a positive diagonal (A-P's LCP)",
          "Cottle, Pang and Stone 1992, sec. 5.2", "", behind_front<Pgs>};
}

}  // namespace cb
