// coulomb: Signorini's condition and Coulomb's friction as they are, contact by contact,
//   u~ = u + mu |u_t| e_n,   r in K = { |r_t| <= mu r_n },   u~ in K*,   r.u~ = 0
// Error: the natural map r - P_K(r - u~ / w), in impulses, over the size of the contact. The last bits of u move u~ by
// 1 + mu of them, which is what mu adds to the rounding that counts as none. Of an island with restitution (Poisson)
// the answer is that of two phases: what is left is feasibility. And on no island comes energy from nowhere.
//
// A contact left out: r = 0 needs u_n+ >= 0 and nothing else. Corners: the same for a point inside a patch; who carries
// what matters where the patch spins. A contact alone, W = diag(W_n, w, w): r_n = -u_n / W_n, and r_t = -u_t / w where
// that is within mu r_n, else mu r_n against u_t.

#include <algorithm>
#include <cmath>

#include "contact/evidence.h"
#include "contact/laws.h"
#include "contact/referee.h"

namespace cb {

namespace {

using ConstVec3 = Eigen::Map<const Eigen::Vector3d>;

class CoulombCheck {
 public:
  void operator()(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
    const std::vector<double>& r = solution.impulse;
    Worst worst;
    for (int c = 0; c < problem.nc(); ++c) {
      const double size = std::sqrt(at.size2[c]);
      if (at.is_elastic(c)) {
        see_feasible(problem, r, at, size, c, worst);
        continue;
      }
      const double root_w = std::sqrt(at.weight[c]), mu = problem.mu[c];
      const double floor = (1 + mu) * at.open(c) / (Referee::accepted * root_w);
      const Eigen::Vector3d error =
          root_w * coulomb_error(ConstVec3(&r[3 * c]), ConstVec3(&at.u_plus[3 * c]), mu, at.weight[c]);
      at.see(worst, error.norm(), std::max(size, floor), c);
    }
    see_approach(at, worst);
    see_gains(r, 0, at, Which::all, sum_, worst);
    worst.report(out);
  }

 private:
  std::vector<double> sum_;  // per island
};

void alone(const LoneContact& contact, ContactSolution& answer) {
  const std::vector<double>& u = contact.u;
  const double normal = -u[0] / contact.W_n, slip = std::hypot(u[1], u[2]);
  const double size = std::min(slip / contact.w, contact.problem.mu[0] * normal);
  answer.impulse = {normal, 0, 0};
  for (int i = 1; i < 3 && slip > 0; ++i) answer.impulse[i] = -size * u[i] / slip;
  answer.size = 3;
}

}  // namespace

Law coulomb_law() {
  return {.name = "coulomb",
          .check = []() -> LawCheck { return CoulombCheck(); },
          .leave_out =
              [](const Witness&) { return LeaveOut{.corners = Corners::suffice_unless_spin, .closed_form = alone}; }};
}

}  // namespace cb
