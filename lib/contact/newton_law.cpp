// newton: impacts one after another, each with Newton's restitution. Nothing approaches any more, and impulses lie in
// their cones. Where a contact is alone on its island the law holds to the letter: u_n+ = -e u_n-, and where it parts
// there is no impulse. (With several, impacts are a sequence, and each has its own u_n-.)

#include <cmath>

#include "contact/evidence.h"
#include "contact/laws.h"

namespace cb {

namespace {

void check(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
  Worst worst = feasible(problem, solution.impulse, at);
  std::vector<int> contacts(at.islands.count, 0);
  for (const int g : at.islands.of_contact) ++contacts[g];
  for (int c = 0; c < problem.nc(); ++c) {
    if (contacts[at.islands.of_contact[c]] > 1) continue;
    const double before = at.u_minus[3 * c], root_w = std::sqrt(at.weight[c]), size = std::sqrt(at.size2[c]);
    if (before < 0)
      at.see(worst, std::abs(at.u_plus[3 * c] + problem.restitution[c] * before) / root_w, size, c);
    else
      at.see(worst, (root_w * Eigen::Map<const Eigen::Vector3d>(&solution.impulse[3 * c])).norm(), size, c);
  }
  worst.report(out);
}

}  // namespace

Law newton_law() {
  return {.name = "newton", .check = []() -> LawCheck { return check; }, .no_expansion = one_after_another};
}

}  // namespace cb
