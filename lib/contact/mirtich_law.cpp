// mirtich: impacts one after another with Stronge's restitution. The works that the method claims must give back e^2 of
// what compression stored, take energy by friction, and on each island add up to the change of kinetic energy; and no
// island gains any, whatever the works say.

#include <cmath>

#include "contact/evidence.h"
#include "contact/laws.h"
#include "linalg/finite.h"

namespace cb {

namespace {

class MirtichCheck {
 public:
  void operator()(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
    const int nc = problem.nc();
    const WorkWitness& work = solution.as<WorkWitness>();
    for (const auto* of : {&work.compression, &work.restitution, &work.friction})
      if (static_cast<int>(of->size()) != nc || !all_finite(*of)) return Worst{.ratio = HUGE_VAL}.report(out);
    Worst worst = feasible(problem, solution.impulse, at);
    sum_.assign(at.islands.count, 0.0);
    for (int c = 0; c < nc; ++c) {
      const int g = at.islands.of_contact[c];
      const double stored = work.compression[c], returned = work.restitution[c], friction = work.friction[c];
      const double e = problem.restitution[c], energy = at.island_size[g] * at.island_size[g];
      at.see(worst, std::abs(returned + e * e * stored), energy, c);
      for (const double taken : {stored, -returned, friction}) at.see(worst, taken, energy, c);
      // The work of the impulses is r.(u- + u+) / 2; the kinetic energy of v knows nothing of the offset.
      sum_[g] += stored + returned + friction;
      for (int i = 3 * c; i < 3 * c + 3; ++i) sum_[g] -= solution.impulse[i] * (at.u_plus[i] + at.u_minus[i]) / 2;
    }
    for (int g = 0; g < at.islands.count; ++g)
      Evidence::see_island(worst, std::abs(sum_[g]), at.island_size[g] * at.island_size[g], g);
    see_gains(solution.impulse, 0, at, Which::all, gains_, worst);
    worst.report(out);
  }

 private:
  std::vector<double> sum_, gains_;  // per island, J
};

void rest(const ContactProblem& problem, const Witness&, ContactSolution& solution) {
  WorkWitness& work = solution.as<WorkWitness>();
  for (auto* of : {&work.compression, &work.restitution, &work.friction}) of->assign(problem.nc(), 0.0);
}

void join(const ProblemPart& part, const ContactSolution& answer, ContactSolution& whole) {
  const WorkWitness& from = answer.as<WorkWitness>();
  WorkWitness& to = whole.as<WorkWitness>();
  scatter(part.contacts, from.compression, 0, 1, to.compression, 0);
  scatter(part.contacts, from.restitution, 0, 1, to.restitution, 0);
  scatter(part.contacts, from.friction, 0, 1, to.friction, 0);
}

// Works that belong to impulses are not unique: with all of an island's work called friction the law holds where any
// works let it hold, as long as contacts take energy.
std::string_view prove(const ImpulsesAlone& answer, ContactSolution& solution) {
  rest(answer.problem, answer.terms, solution);
  std::vector<double> work(answer.islands.count, 0.0), members(answer.islands.count, 0.0);
  for (int c = 0; c < answer.problem.nc(); ++c) {
    const int g = answer.islands.of_contact[c];
    members[g] += 1;
    for (int i = 3 * c; i < 3 * c + 3; ++i) work[g] += solution.impulse[i] * (answer.u_minus[i] + answer.u_plus[i]) / 2;
  }
  for (int c = 0; c < answer.problem.nc(); ++c) {
    const int g = answer.islands.of_contact[c];
    solution.as<WorkWitness>().friction[c] = work[g] / members[g];
  }
  return {};
}

}  // namespace

Law mirtich_law() {
  return {.name = "mirtich",
          .check = []() -> LawCheck { return MirtichCheck(); },
          .rest = rest,
          .join = join,
          .prove = prove,
          .unseen_in_impulses =
              "restitution: how much work compression stored and what of it was returned is not "
              "known from impulses; judged is that nothing approaches, that impulses are in their "
              "cones, and that no island gains energy",
          .no_expansion = one_after_another};
}

}  // namespace cb
