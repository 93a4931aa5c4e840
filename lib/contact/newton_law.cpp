// newton: impacts one after another, each with Newton's restitution. Nothing approaches any more, and impulses lie in
// their cones. Where a single contact was solved the law holds to the letter: u_n+ = -e u_n-. (With several, impacts
// are a sequence, and each has its own u_n-.)

#include <cmath>

#include "contact/evidence.h"
#include "contact/laws.h"

namespace cb {

namespace {

void check(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
  Worst worst = feasible(problem, solution.impulse, at, Scale::contact);
  if (problem.nc() == 1 && at.u_minus[0] < 0)
    at.see(worst, std::abs(at.u_plus[0] + problem.restitution[0] * at.u_minus[0]) / std::sqrt(at.weight[0]),
           std::sqrt(at.size2[0]), 0);
  worst.report(out);
}

}  // namespace

Law newton_law() {
  return {.name = "newton", .check = []() -> LawCheck { return check; }, .no_expansion = one_after_another};
}

}  // namespace cb
