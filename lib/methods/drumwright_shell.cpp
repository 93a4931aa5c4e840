// Contact as a convex program.
//
// Problem (nc contacts, nv velocities; contact/problem.h), for each island of bodies joined by contacts:
//   min 1/2 v.M v + w.r,  v = v- + M^-1 J^T r,   N v + w_n >= 0,   |r_t| <= mu r_n,   1.r_n <= kappa      (1)
// kappa (N s): least 1.f over the solutions f of the frictionless problem (mu = 0, no bound). Energies in J.
// An answer is (r, eta): with u = J v + w, y = u - W_(:,n) eta + s 1_n and the least s >= 0 that puts every y_i into
// the dual cone,
//   gap = eta.(u_n)+ + s (kappa - 1.r_n)+ + r.y                                                           (2)
// bounds the suboptimality; how far u_n is below 0 and the sum beyond kappa is an infeasibility, accepted up to 1e-9 of
// the island. No solver is trusted beyond it (convex_judge.h). Without the bound s = 0, and a y outside the
// dual cone is an infeasibility, as a fraction of the impulses; (2) with kappa = 1.r_n, the suboptimality among
// impulses of no greater sum, says what it costs.
//
// Source: E. Drumwright, D. A. Shell, Modeling contact friction and joint friction in dynamic robotic simulation using
// the principle of maximum dissipation, WAFR 2010; their code of 2012 has the bound of kappa switched off.
// Differences: 1. second-order cones, not squares; 2. an active-set finish, so that answers are good to rounding;
// 3. answers are proposed (convex_proposers.cpp), those of one or two factorisations first, and count only if (2) says
// so; 4. program (3) where the bound leaves (1) no interior (convex_lift.h); 5. where the bounds leave no room, a
// program with bounds missed by half of what is accepted, which has an interior. The loop is in propose(); kappa and
// its proof come from convex_bound.cpp.
//
// Without the bound N v + w_n >= 0 follows from optimality (u is in the dual cone), so it is left out and eta = 0.
// With it, strict feasibility can fail. Let z be a velocity with N z = 1, T z = 0 on all contacts of the island and
// M z = N^T lambda with lambda >= 0, zero but where the frictionless solution touches (a stack lifted, each interface
// by the same amount). Every feasible r has 1.r_n = z.J^T r = lambda.(u_n - u_n-), and kappa = -lambda.u_n- likewise;
// so the bound says lambda.u_n <= 0: u_n = 0 on the support of lambda, and then 1.r_n = kappa by itself. The program
// solved is then
//   min 1/2 v.M v + w.r,   N v + w_n = 0 on the support of lambda,   r in cones                           (3)
// with multipliers eta of either sign. Since W_(:,n) lambda = 1_n, (eta + t lambda, s = t) is a certificate of (1) for
// every t large enough.
//
// Restitution (Poisson): normal impulses of the first phase times 1 + theta e; where a contact still approaches, a
// second phase from the velocity reached. In the paper theta = 1, by which events with friction or coupled contacts
// gain energy; here theta <= 1 is the largest by which an island does not (restitution.h).
// Fails: `nonconverged`, `singular`, with the best feasible impulses met (at worst the frictionless ones);
// `inaccurate`, where rounding left more than epsilon over all islands; `not_finite`, `input_error` for the data,
// without impulses.

#include "methods/drumwright_shell.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "methods/same_event.h"
#include "methods/weigh.h"

namespace cb {

// The loop over the island's proposers, cheapest first. Each answer counts for what its certificate says: the best is
// kept, and where it is good nobody else is asked, unless it is good only beside rounding of large impulses (excused).
ConeStatus DrumwrightShell::propose(ConvexPrevious* previous) {
  const ConvexEvent event{tolerances_, island_, bound_, program_, start_of(previous)};
  if (previous != nullptr) previous->by_newton = false;
  ConeStatus ending = ConeStatus::nonconverged;
  for (const ConvexProposer& proposer : convex_proposers()) {
    answer_.iterations = 0;
    answer_.s = 0;
    const bool proposes = proposer.propose(event, scratch_, answer_);
    iterations_ += answer_.iterations;
    if (!proposes) continue;
    // Large multipliers excuse much; with the bounds relaxed they are small, as a rule.
    if (offer(proposer) && !judge_.excused(island_, best_.certificate)) {
      keep_start(proposer, previous);
      return ConeStatus::solved;
    }
    if (answer_.status != ConeStatus::solved) ending = answer_.status;
  }
  return judge_.good(island_, best_.certificate, Allowed::backward) ? ConeStatus::solved : ending;
}

// Keeps answer_ where it is better than what there is. Is it as good as is asked?
bool DrumwrightShell::offer(const ConvexProposer& proposer) {
  unreduce(bound_, answer_.eta, multiplier_);
  const double limit = judge_.limit_of(proposer.allowed);
  const Certificate certificate = judge_(island_, program_, answer_.r, multiplier_);
  const bool done = judge_.good(island_, certificate, proposer.allowed);
  // A gap within the rounding of its own data is better than a smaller one beyond its own; but large multipliers would
  // excuse anything.
  const bool was_done = judge_.good(island_, best_.certificate, Allowed::backward);
  const bool better = best_.certificate.infeasibility > limit ||
                      (done && !was_done && !judge_.excused(island_, certificate)) ||
                      std::abs(certificate.gap) < std::abs(best_.certificate.gap);
  if (certificate.infeasibility > limit || !better || (was_done && !done)) return false;
  best_.certificate = certificate;
  best_.who = proposer.name;
  best_.r = answer_.r;
  best_.eta = multiplier_;
  return done;
}

// From rest, if the island stays there; else the bound first, then the frictionless answer, if it is good enough, then
// the proposers.
ConeStatus DrumwrightShell::solve_island(double epsilon, ContactSolution& solution, ConvexPrevious* previous,
                                         Endings& endings) {
  begin_island(epsilon, solution);
  bool proven = true;
  ConeStatus ending = ConeStatus::solved;
  if (previous == nullptr || !stays_at_rest(*previous)) {
    proven = bound_finder_.find(island_, bound_, iterations_);
    if (tolerances_.bounded) set_bound();
    if (!slides_freely()) {
      ending = propose(previous);
      if (elastic_ && tolerances_.bounded) prefer_frictionless();
    }
    if (previous != nullptr) remember(island_, tolerances_, best_.r, bound_, *previous);
  }
  if (tolerances_.answered_by) tolerances_.answered_by->add(best_.who);
  const Certificate& certificate = best_.certificate;
  solution.iterations += iterations_;
  solution.claimed_residual += std::abs(certificate.gap);
  endings.excess += std::max(0.0, std::abs(certificate.gap) - certificate.gap_rounding);
  if (!proven) {
    endings.unproven = true;
    return std::max(ending, ConeStatus::nonconverged);
  }
  // An answer at rounding whose certificate is not: friction coefficients or masses of many orders of magnitude.
  if (ending != ConeStatus::solved && certificate.infeasibility <= tolerances_.backward &&
      std::abs(certificate.gap) <= tolerances_.inaccurate * certificate.size * certificate.size) {
    endings.inaccurate = true;
    return ConeStatus::solved;
  }
  return ending;
}

// One phase (restitution has two): from `v0` to impulses with their certificate, island by island.
void DrumwrightShell::solve(const ContactProblem& problem, const std::vector<double>& v0, double epsilon,
                            ContactSolution& solution) {
  find_islands(problem, islands_);
  contacts_of_.assign(islands_.of_contact, islands_.count);
  blocks_of_.assign(islands_.of_block, islands_.count);
  if (tolerances_.warm_start) previous_.resize(islands_.count);
  Endings endings;
  for (int i = 0; i < islands_.count; ++i) {
    extract(problem, v0, weight_, contacts_of_[i], blocks_of_[i], block_in_island_, island_);
    const ConeStatus status =
        solve_island(epsilon / islands_.count, solution, tolerances_.warm_start ? &previous_[i] : nullptr, endings);
    endings.worst = std::max(endings.worst, status);
    write(problem, solution);
  }
  say(endings, epsilon, solution);
}

DrumwrightShell::DrumwrightShell(const Tolerances& tolerances)
    : tolerances_(tolerances), bound_finder_(tolerances), scratch_(tolerances), judge_(tolerances) {}

void DrumwrightShell::operator()(const ContactProblem& problem, ContactSolution& solution) {
  const int nc = problem.nc();
  solution.clear();
  solution.impulse.assign(3 * nc, 0.0);
  ConvexWitness& proof = solution.as<ConvexWitness>();
  proof.eta.assign(nc, 0.0);
  proof.bounded = tolerances_.bounded;
  if (tolerances_.bounded) {
    proof.frictionless.assign(nc, 0.0);
    proof.kappa_dual.assign(problem.nv(), 0.0);
  }
  if (!weigh(problem, factor_, weight_, solution)) return;
  proof.epsilon =
      tolerances_.epsilon_relative ? *tolerances_.epsilon_relative * energy_before(problem) : tolerances_.epsilon;
  if (nc == 0) return;
  elastic_ = is_elastic(problem);
  second_phase_ = false;
  solve(problem, problem.v_minus, proof.epsilon, solution);

  // Poisson: what compression took in, restitution gives back by the fraction e.
  if (!elastic_) return;
  bounded_.assign(islands_.count, tolerances_.bounded_restitution ? 1 : 0);
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands_, bounded_, solution.impulse);
  if (!approaches_again()) return;
  first_impulse_ = solution.impulse;
  second_phase_ = true;
  solve(problem, restitution_.v(), proof.epsilon, solution);
  for (int i = 0; i < 3 * nc; ++i) solution.impulse[i] += first_impulse_[i];
}

// Does any contact still approach, at more than a fraction of what its island's normal velocities are worth?
bool DrumwrightShell::approaches_again() {
  const auto scaled = [&](std::size_t c) { return restitution_.u()[3 * c] / std::sqrt(weight_[c]); };
  std::vector<double>& fastest = fastest_;
  fastest.assign(islands_.count, 0.0);
  for (std::size_t c = 0; c < islands_.of_contact.size(); ++c)
    fastest[islands_.of_contact[c]] = std::max(fastest[islands_.of_contact[c]], std::abs(scaled(c)));
  for (std::size_t c = 0; c < islands_.of_contact.size(); ++c)
    if (-scaled(c) > tolerances_.infeasibility * fastest[islands_.of_contact[c]]) return true;
  return false;
}

// The island's answer and proof, into the whole.
void DrumwrightShell::write(const ContactProblem& problem, ContactSolution& solution) const {
  ConvexWitness& proof = solution.as<ConvexWitness>();
  for (std::size_t k = 0; k < island_.contacts.size(); ++k) {
    const int c = island_.contacts[k];
    std::copy_n(best_.r.data() + 3 * k, 3, solution.impulse.data() + 3 * c);
    proof.eta[c] = best_.eta[k];
    if (tolerances_.bounded) proof.frictionless[c] = bound_.f[k];
  }
  for (std::size_t k = 0; k < island_.blocks.size() && tolerances_.bounded; ++k)
    std::copy_n(bound_.z.data() + island_.M.first[k], island_.M.block_size(static_cast<int>(k)),
                proof.kappa_dual.data() + problem.M.first[island_.blocks[k]]);
}

void DrumwrightShell::say(const Endings& endings, double epsilon, ContactSolution& solution) const {
  switch (endings.worst) {
    case ConeStatus::solved:
      if (endings.inaccurate && endings.excess > epsilon)
        solution.fail(Status::inaccurate, "the duality gap stayed above epsilon: rounding");
      break;
    case ConeStatus::nonconverged:
      solution.fail(Status::nonconverged,
                    endings.unproven ? "no proof was found that kappa is the least sum of frictionless impulses"
                                     : "no answer met reaches the duality gap that was asked for");
      break;
    case ConeStatus::singular:
      solution.fail(Status::singular, "a Newton system could not be factored");
      break;
    case ConeStatus::not_finite:
      solution.fail(Status::not_finite, "overflow in the interior point method");
      break;
  }
}

void DrumwrightShell::begin_island(double epsilon, ContactSolution& solution) {
  const int nc = island_.nc();
  island_.epsilon = epsilon;
  // What the first phase gave back is all that the event had: a gap here would be a gain of energy.
  if (second_phase_) island_.epsilon = std::min(epsilon, tolerances_.gain * island_.size * island_.size);
  program_ = island_.program(tolerances_.bounded);
  program_.gap = island_.epsilon;
  solution.size += 3 * nc + (tolerances_.bounded ? nc + 1 : 0);
  iterations_ = 0;
  best_.certificate = {};
  best_.r.assign(3 * nc, 0.0);
  best_.eta.assign(nc, 0.0);
}

void DrumwrightShell::set_bound() {
  program_.bounded_below = true;
  program_.kappa = program_.impulse_size = bound_.kappa;
  // Limits of joints do not count in kappa, and their impulses may be far larger.
  for (int c = 0; c < island_.nc(); ++c)
    if (island_.share[c] == 0) program_.impulse_size += bound_.f[c];
}

void DrumwrightShell::clear_bound() {
  program_.bounded_below = false;
  program_.kappa = program_.impulse_size = std::numeric_limits<double>::infinity();
}

// The previous answer at rest, if it is good enough.
bool DrumwrightShell::stays_at_rest(ConvexPrevious& previous) {
  if (!recall(island_, tolerances_, previous, bound_, best_.r)) return false;
  if (tolerances_.bounded) set_bound();
  best_.eta.assign(island_.nc(), 0.0);
  best_.certificate = judge_(island_, program_, best_.r, {});
  best_.who = "rest, again";
  if (judge_.good(island_, best_.certificate, Allowed::exact)) {
    if (tolerances_.warm_starts) ++*tolerances_.warm_starts;
    return true;
  }
  clear_bound();
  return false;
}

// The frictionless answer, if it is good enough.
bool DrumwrightShell::slides_freely() {
  best_.r = bound_.impulse;
  best_.eta.assign(island_.nc(), 0.0);
  best_.certificate = judge_(island_, program_, best_.r, {});
  best_.who = "frictionless";
  // A light body may slip below heavy ones: beside their impulses that is no infeasibility, and a slip costs r.y
  // nothing where there is no friction.
  if (!tolerances_.bounded) best_.certificate.gap = judge_.gap_at_own_sum(island_, program_, best_.r);
  return judge_.good(island_, best_.certificate, Allowed::exact);
}

// The frictionless impulses keep all bounds. Where multipliers are so large that they excuse an answer of more energy,
// it is not the least one, and restitution would gain what it has more.
void DrumwrightShell::prefer_frictionless() {
  judge_(island_, program_, best_.r, best_.eta);
  double more = 0;  // J
  for (std::size_t i = 0; i < best_.r.size(); ++i)
    more += 0.5 * (best_.r[i] - bound_.impulse[i]) * (judge_.u()[i] + bound_.u_f[i]);
  if (!(more > 0)) return;
  Certificate certificate = judge_(island_, program_, bound_.impulse, best_.eta);
  if (!judge_.good(island_, certificate, Allowed::backward)) {
    certificate = judge_(island_, program_, bound_.impulse, {});
    if (!judge_.good(island_, certificate, Allowed::backward)) return;
    best_.eta.assign(island_.nc(), 0.0);
  }
  best_.r = bound_.impulse;
  best_.certificate = certificate;
  best_.who = "frictionless";
}

// What the next event's Newton method may start from.
void DrumwrightShell::keep_start(const ConvexProposer& proposer, ConvexPrevious* previous) {
  if (proposer.is_start && tolerances_.warm_starts) ++*tolerances_.warm_starts;
  if (previous == nullptr || !proposer.starts_next) return;
  previous->by_newton = true;
  previous->nv = island_.nv();
  previous->answer = answer_;
}

// The previous event's answer, where Newton's method may start from it.
const ConeSolution* DrumwrightShell::start_of(const ConvexPrevious* previous) const {
  const bool same = previous != nullptr && previous->by_newton && previous->nv == island_.nv() &&
                    previous->answer.r.size() == 3 * island_.contacts.size();
  return same ? &previous->answer : nullptr;
}

namespace {

ContactMethod make_drumwright_shell(const MethodOptions& options) {
  DrumwrightShell::Tolerances tolerances;
  tolerances.epsilon = options.epsilon;
  tolerances.epsilon_relative = options.epsilon_relative;
  tolerances.bounded = options.compression_bound;
  tolerances.warm_start = options.warm_start;
  tolerances.warm_starts = options.warm_starts;
  tolerances.answered_by = options.answered_by;
  auto method = std::make_shared<DrumwrightShell>(tolerances);
  const auto solve = [method](const ContactProblem& problem, ContactSolution& solution) {
    (*method)(problem, solution);
  };
  return options.warm_start ? reuse_same_event(solve, options.warm_starts) : ContactMethod(solve);
}

}  // namespace

MethodRow drumwright_shell_row() {
  return {"convex",
          "least kinetic energy over impulses in the friction cones, sum of normal impulses bounded: a convex program",
          "E. Drumwright, D. A. Shell, WAFR 2010",
          convex_law(),
          {{"ipm", "primal-dual interior point method on second-order cones, finished by an active-set Newton method",
            "S. Boyd, L. Vandenberghe, Convex Optimization, 2004, ch. 11; L. Vandenberghe, CVXOPT, 2010", ""}},
          {},
          {{.flag = "epsilon",
            .unit = "J",
            .default_value = "1e-12",
            .summary = "suboptimality (checked duality gap) at which the solver may stop",
            .field = &MethodOptions::epsilon,
            .type = "J",
            .short_name = "eps",
            .expected = "a positive number of joules, as in --epsilon 1e-12",
            .positive = true,
            .always_named = true,
            .of_law = true},
           {.flag = "epsilon-relative",
            .unit = "-",
            .default_value = "none",
            .summary = "the same as a fraction of the kinetic energy before the event",
            .field = &MethodOptions::epsilon_relative,
            .type = "FRACTION",
            .short_name = "epsrel",
            .expected = "a positive fraction of the kinetic energy, as in --epsilon-relative 1e-12",
            .positive = true,
            .replaces = "epsilon",
            .of_law = true},
           {.flag = "compression-bound",
            .unit = "-",
            .default_value = "on",
            .summary = "bound the sum of normal impulses of each island by the frictionless sum",
            .field = &MethodOptions::compression_bound,
            .type = "on|off",
            .short_name = "bound-",
            .of_scenario = true,
            .of_law = true},
           warm_start_option("try Newton's method from the previous event's answer first")},
          make_drumwright_shell,
          [](const MethodOptions& options) -> Witness {
            ConvexWitness terms;
            terms.bounded = options.compression_bound;
            terms.epsilon = options.epsilon;
            terms.epsilon_relative = options.epsilon_relative;
            return terms;
          }};
}

}  // namespace cb
