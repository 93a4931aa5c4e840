#pragma once

#include <optional>
#include <vector>

#include "contact/islands.h"
#include "contact/problem.h"

namespace cb {

/// What is true of an answer, recomputed from the original problem and the claimed impulses alone
/// (docs/judging.md). A claim that this refutes is counted as false.
struct Residuals {
  double model = 0;                     ///< residual of the law that was solved, -
  std::optional<double> law;            ///< against exact Coulomb friction, -; only where all e = 0
  std::optional<double> gap;            ///< convex: checked duality gap, J
  std::optional<double> infeasibility;  ///< convex: worst scaled violation of a constraint, -
  double approach = 0;                  ///< max(0, -u_n+), m/s
  double cone_violation = 0;            ///< largest distance of an impulse to the circular cone, N s
  double dissipation_gap = 0;           ///< largest mu r_n |u_t| + r_t.u_t, J
  double energy_gain = 0;               ///< kinetic energy after minus before, J
  double energy_before = 0;             ///< kinetic energy before, J
  double momentum = 0;                  ///< |M (v+ - v-) - J^T r| scaled as sqrt(J)
  bool finite = true;                   ///< no NaN or infinity in the claim
};

/// Recomputes every measure; owns its scratch, so that a run does not allocate after its first events.
class Referee {
 public:
  /// Checks `solution` under `law`. `v_plus` is set to v- + M^-1 J^T r, computed here and used by the caller:
  /// what is simulated is what was checked.
  Residuals check(const ContactProblem& problem, const ContactSolution& solution, Law law, std::vector<double>& v_plus);
  /// The impulses as an unambiguous verdict: does the claim hold to `tolerance`?
  /// anitescu_potra, newton, mirtich, convex with restitution: model <= tolerance. convex without: |gap| <= epsilon +
  /// 1e-14 KE, infeasibility <= 1e-9.
  static bool holds(const Residuals& residuals, const ContactSolution& solution, Law law, double tolerance);

 private:
  double coulomb(const ContactProblem& problem, std::span<const double> r, std::span<const double> u);
  double anitescu_potra(const ContactProblem& problem, const ContactSolution& solution, bool elastic);
  void convex(const ContactProblem& problem, const ContactSolution& solution, bool elastic, Residuals& out);
  void least_sum(const ContactProblem& problem, const ContactSolution& solution, double& worst);
  double newton(const ContactProblem& problem, const ContactSolution& solution) const;
  double mirtich(const ContactProblem& problem, const ContactSolution& solution, double energy_gain) const;

  BlockCholesky factor_;
  Islands islands_;
  double size_ = 0;             // sqrt(J): what the event is about,
  double size_q_ = 0;           // and what there is before any impulse
  std::vector<double> weight_;  // nc, w_i
  std::vector<double> u_plus_, u_minus_, y_, u_dual_, scratch_v_, scratch_u_, difference_, momentum_;
  std::vector<double> cosine_, sine_, given_back_, phase_;  // anitescu_potra: k, k, nc, 3 nc
  std::vector<double> slack_, sum_, kappa_, kappa_scale_;   // per island
};

}  // namespace cb
