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
// program with bounds missed by half of what is accepted, which has an interior. Each island is solved by
// ConvexSolver; kappa and its proof come from convex_bound.cpp.
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
// Islands with restitution (Poisson): normal impulses of the first phase times 1 + theta e; where a contact still
// approaches, a second phase from the velocity reached. In the paper theta = 1, by which events with friction or
// coupled contacts gain energy; here theta <= 1 is the largest by which an island does not (restitution.h).
//
// Fails: `nonconverged`, `singular`, with the best feasible impulses met (at worst the frictionless ones);
// `inaccurate`, where rounding left more than epsilon over all islands; `not_finite`, `input_error` for the data,
// without impulses.

#include "methods/drumwright_shell.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "linalg/parallel.h"
#include "methods/same_event.h"
#include "methods/weigh.h"

namespace cb {

DrumwrightShell::DrumwrightShell(const Tolerances& tolerances) : tolerances_(tolerances) {}

// One phase: from `v0` to impulses with their certificate, island by island. Islands with restitution have two.
void DrumwrightShell::solve(const ContactProblem& problem, const std::vector<double>& v0, ConvexPhase phase,
                            ContactSolution& solution) {
  const int count = islands_.count;
  contacts_of_.assign(islands_.of_contact, count);
  blocks_of_.assign(islands_.of_block, count);
  if (tolerances_.warm_start) previous_.resize(count);
  endings_.resize(count);
  const int threads = worthwhile_threads(islands_, tolerances_.threads);
  while (static_cast<int>(workers_.size()) < threads) workers_.emplace_back(tolerances_);
  const double epsilon = solution.as<ConvexWitness>().epsilon;
  for_each_item(count, threads, [&](int i, int worker) {
    endings_[i] = {};
    if (phase == ConvexPhase::second && !elastic_[i]) return;
    Worker& own = workers_[worker];
    extract(problem, v0, weight_, contacts_of_[i], blocks_of_[i], own.block_in_island, own.island);
    endings_[i] = own.solver(epsilon / count, elastic_[i] ? phase : ConvexPhase::only,
                             tolerances_.warm_start ? &previous_[i] : nullptr, own.island);
    write(problem, own, solution);
  });
  say(epsilon, solution);
}

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
  find_islands(problem, islands_);
  const bool elastic = find_elastic(problem, islands_, elastic_);
  solve(problem, problem.v_minus, ConvexPhase::compression, solution);

  // Poisson: what compression took in, restitution gives back by the fraction e.
  if (!elastic) return;
  bounded_.assign(islands_.count, tolerances_.bounded_restitution ? 1 : 0);
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands_, bounded_, solution.impulse);
  if (!approaches_again()) return;
  first_impulse_ = solution.impulse;
  solve(problem, restitution_.v(), ConvexPhase::second, solution);
  for (int i = 0; i < 3 * nc; ++i)
    if (elastic_[islands_.of_contact[i / 3]]) solution.impulse[i] += first_impulse_[i];
}

// Does any contact with restitution on its island still approach, at more than a fraction of what its island's normal
// velocities are worth?
bool DrumwrightShell::approaches_again() {
  const auto scaled = [&](std::size_t c) { return restitution_.u()[3 * c] / std::sqrt(weight_[c]); };
  std::vector<double>& fastest = fastest_;
  fastest.assign(islands_.count, 0.0);
  for (std::size_t c = 0; c < islands_.of_contact.size(); ++c)
    fastest[islands_.of_contact[c]] = std::max(fastest[islands_.of_contact[c]], std::abs(scaled(c)));
  for (std::size_t c = 0; c < islands_.of_contact.size(); ++c)
    if (elastic_[islands_.of_contact[c]] && -scaled(c) > tolerances_.infeasibility * fastest[islands_.of_contact[c]])
      return true;
  return false;
}

// The island's answer and proof, into the whole: where no other island's are.
void DrumwrightShell::write(const ContactProblem& problem, const Worker& own, ContactSolution& solution) const {
  const ConvexIsland& island = own.island;
  const ConvexBound& bound = own.solver.bound();
  ConvexWitness& proof = solution.as<ConvexWitness>();
  for (std::size_t k = 0; k < island.contacts.size(); ++k) {
    const int c = island.contacts[k];
    std::copy_n(own.solver.r().data() + 3 * k, 3, solution.impulse.data() + 3 * c);
    proof.eta[c] = own.solver.eta()[k];
    if (tolerances_.bounded) proof.frictionless[c] = bound.f[k];
  }
  for (std::size_t k = 0; k < island.blocks.size() && tolerances_.bounded; ++k)
    std::copy_n(bound.z.data() + island.M.first[k], island.M.block_size(static_cast<int>(k)),
                proof.kappa_dual.data() + problem.M.first[island.blocks[k]]);
}

// What the islands' endings come to: in their order, on however many threads they were solved.
void DrumwrightShell::say(double epsilon, ContactSolution& solution) const {
  ConeStatus worst = ConeStatus::solved;  // of the islands without a good answer
  bool unproven = false, inaccurate = false;
  double excess = 0;  // J
  for (const ConvexEnding& of : endings_) {
    worst = std::max(worst, of.status);
    unproven = unproven || of.unproven;
    inaccurate = inaccurate || of.inaccurate;
    excess += of.excess;
    solution.iterations += of.iterations;
    solution.size += of.size;
    solution.claimed_residual += of.gap;
    if (of.warm_start && tolerances_.warm_starts) ++*tolerances_.warm_starts;
    if (tolerances_.answered_by && !of.who.empty()) tolerances_.answered_by->add(of.who);
  }
  switch (worst) {
    case ConeStatus::solved:
      if (inaccurate && excess > epsilon)
        solution.fail(Status::inaccurate, "the duality gap stayed above epsilon: rounding");
      break;
    case ConeStatus::nonconverged:
      solution.fail(Status::nonconverged,
                    unproven ? "no proof was found that kappa is the least sum of frictionless impulses"
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

namespace {

ContactMethod make_drumwright_shell(const MethodOptions& options) {
  DrumwrightShell::Tolerances tolerances;
  tolerances.epsilon = options.epsilon;
  tolerances.epsilon_relative = options.epsilon_relative;
  tolerances.bounded = options.compression_bound;
  tolerances.warm_start = options.warm_start;
  tolerances.threads = options.threads;
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
