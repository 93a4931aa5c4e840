// Contact as a convex program.
//
// Problem (nc contacts, nv velocities; contact/problem.h), for each island of bodies joined by contacts:
//   min 1/2 v.M v,  v = v- + M^-1 J^T r,   N v + w_n >= 0,   |r_t| <= mu r_n,   1.r_n <= kappa            (1)
// kappa (N s): least 1.f over the solutions f of the frictionless problem (mu = 0, no bound). Energies in J.
// An answer is (r, eta): with y = u - W_(:,n) eta + s 1_n and the least s >= 0 that puts every y_i into the dual cone,
//   gap = eta.(u_n)+ + s (kappa - 1.r_n)+ + r.y                                                           (2)
// bounds the suboptimality; how far u_n is below 0 and the sum beyond kappa is an infeasibility, accepted up to 1e-9 of
// the island. This file never trusts a solver beyond it. Without the bound s = 0, and a y outside the
// dual cone is an infeasibility, as a fraction of the impulses; (2) with kappa = 1.r_n, the suboptimality among
// impulses of no greater sum, says what it costs.
//
// Source: E. Drumwright, D. A. Shell, Modeling contact friction and joint friction in dynamic robotic simulation using
// the principle of maximum dissipation, WAFR 2010; their code of 2012 has the bound of kappa switched off.
// Differences: 1. second-order cones, not squares; 2. an active-set finish, so that answers are good to rounding;
// 3. answers are proposed (`proposers`), those of one or two factorisations first, and count only if (2) says so;
// 4. flat scenes (below); 5. where the bounds leave no room, a program with bounds missed by half
// of what is accepted, which has an interior.
//
// Without the bound N v + w_n >= 0 follows from optimality (u is in the dual cone), so it is left out and eta = 0.
// With it, strict feasibility can fail. Let z be a velocity with N z = 1, T z = 0 on all contacts of the island and
// M z = N^T lambda with lambda >= 0 where the frictionless solution touches (a stack lifted, each interface by the same
// amount). Every feasible r has 1.r_n = z.J^T r = lambda.(u_n - u_n-), and kappa = -lambda.u_n- likewise; so the bound
// says lambda.u_n <= 0: u_n = 0 on the support of lambda, and then 1.r_n = kappa by itself. The program solved is then
//   min 1/2 v.M v,   N v + w_n = 0,   r in cones                                                          (3)
// with multipliers eta of either sign. Since W_(:,n) lambda = 1_n, (eta + t lambda, s = t) is a certificate of (1) for
// every t large enough.
//
// Restitution (Poisson): normal impulses of the first phase times 1 + theta e; where a contact still approaches, a
// second phase from the velocity reached. In the paper theta = 1, by which events with friction or coupled contacts
// gain energy; here theta <= 1 is the largest by which an island does not (restitution.h; difference 6).
// Fails: `nonconverged`, `singular`, `not_finite` with the best feasible impulses met (at worst the frictionless ones).

#include "methods/drumwright_shell.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "cone/dense_interior_point.h"
#include "linalg/finite.h"
#include "methods/same_event.h"

namespace cb {

namespace {

/// -: of the terms of velocities, an infeasibility that no rounding explains.
constexpr double beyond_rounding = 1e-10;

double tangential(const double* x) { return std::sqrt(x[1] * x[1] + x[2] * x[2]); }

/// J, before the event. Where a problem comes as W and q alone it is in the offset.
double energy(const BlockDiagonalMatrix& M, const std::vector<double>& v, const std::vector<double>& offset,
              const std::vector<double>& weight) {
  double in_offset = 0;
  for (std::size_t i = 0; i < offset.size(); ++i)
    in_offset = std::max(in_offset, 0.5 * offset[i] * offset[i] / weight[i / 3]);
  return 0.5 * quadratic_form(M, v) + in_offset;
}

void fail(ContactSolution& solution, Status status, std::string reason) {
  solution.status = status;
  solution.reason = std::move(reason);
}

ConeOptions finishing(const DrumwrightShell::Tolerances& tolerances) {
  ConeOptions options = tolerances.cone;
  options.proximal = tolerances.finish_proximal;
  options.careful_proximal = tolerances.finish_first_proximal;
  return options;
}

}  // namespace

DrumwrightShell::DrumwrightShell(const Tolerances& tolerances)
    : tolerances_(tolerances),
      friction_solver_(tolerances.cone),
      normal_solver_(tolerances.cone),
      finisher_(finishing(tolerances)) {}

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
  if (!weigh(problem, solution)) return;
  proof.epsilon = tolerances_.epsilon_relative
                      ? *tolerances_.epsilon_relative * energy(problem.M, problem.v_minus, problem.offset, weight_)
                      : tolerances_.epsilon;
  if (nc == 0) return;
  second_phase_ = false;
  if (!solve(problem, problem.v_minus, proof.epsilon, solution)) return;

  // Poisson: what compression took in, restitution gives back by the fraction e.
  bool elastic = false;
  for (double e : problem.restitution) elastic = elastic || e != 0;
  if (!elastic) return;
  bounded_.assign(islands_.count, tolerances_.bounded_restitution ? 1 : 0);
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands_, bounded_, solution.impulse);
  if (!approaches_again()) return;
  first_impulse_ = solution.impulse;
  second_phase_ = true;
  if (!solve(problem, restitution_.v(), proof.epsilon, solution)) return;
  for (int i = 0; i < 3 * nc; ++i) solution.impulse[i] += first_impulse_[i];
}

// Does any contact still approach, at more than a fraction of what its island's normal velocities are worth?
bool DrumwrightShell::approaches_again() {
  const auto scaled = [&](std::size_t c) { return restitution_.u()[3 * c] / std::sqrt(weight_[c]); };
  std::vector<double>& fastest = h_;
  fastest.assign(islands_.count, 0.0);
  for (std::size_t c = 0; c < islands_.of_contact.size(); ++c)
    fastest[islands_.of_contact[c]] = std::max(fastest[islands_.of_contact[c]], std::abs(scaled(c)));
  for (std::size_t c = 0; c < islands_.of_contact.size(); ++c)
    if (-scaled(c) > tolerances_.infeasibility * fastest[islands_.of_contact[c]]) return true;
  return false;
}

// Checks the data, factors M, and finds the weights.
bool DrumwrightShell::weigh(const ContactProblem& problem, ContactSolution& solution) {
  if (!all_finite(problem.M.values) || !all_finite(problem.J.values) || !all_finite(problem.v_minus) ||
      !all_finite(problem.offset) || !all_finite(problem.mu)) {
    fail(solution, Status::not_finite, "NaN or infinity in the contact problem");
    return false;
  }
  if (!factor_.factor(problem.M)) {
    fail(solution, Status::singular, "the mass matrix is not positive definite");
    return false;
  }
  contact_weights(problem, factor_, weight_);
  for (int c = 0; c < problem.nc(); ++c) {
    if (!(weight_[c] > 0) || !std::isfinite(weight_[c])) {
      fail(solution, Status::input_error, "contact " + std::to_string(c) + " joins two fixed bodies (W_ii = 0)");
      return false;
    }
    if (problem.mu[c] < 0) {
      fail(solution, Status::input_error, "contact " + std::to_string(c) + " has a negative coefficient of friction");
      return false;
    }
  }
  return true;
}

bool DrumwrightShell::solve(const ContactProblem& problem, const std::vector<double>& v0, double epsilon,
                            ContactSolution& solution) {
  find_islands(problem, islands_);
  contacts_of_.assign(islands_.of_contact, islands_.count);
  blocks_of_.assign(islands_.of_block, islands_.count);
  ConeStatus worst = ConeStatus::solved;
  inaccurate_ = false;
  excess_ = 0;
  if (tolerances_.warm_start) previous_.resize(islands_.count);
  ConvexWitness& proof = solution.as<ConvexWitness>();
  for (int i = 0; i < islands_.count; ++i) {
    extract(problem, v0, i);
    const ConeStatus status =
        solve_island(epsilon / islands_.count, solution, tolerances_.warm_start ? &previous_[i] : nullptr);
    if (status != ConeStatus::solved) worst = status;
    for (std::size_t k = 0; k < island_.contacts.size(); ++k) {
      const int c = island_.contacts[k];
      std::copy_n(r_.data() + 3 * k, 3, solution.impulse.data() + 3 * c);
      proof.eta[c] = eta_[k];
      if (tolerances_.bounded) proof.frictionless[c] = f_[k];
    }
    if (tolerances_.bounded)
      for (std::size_t k = 0; k < island_.blocks.size(); ++k) {
        const int b = island_.blocks[k];
        std::copy_n(z_.data() + island_.M.first[k], island_.M.block_size(static_cast<int>(k)),
                    proof.kappa_dual.data() + problem.M.first[b]);
      }
  }
  switch (worst) {
    case ConeStatus::solved:
      if (inaccurate_ && excess_ > epsilon)
        fail(solution, Status::inaccurate, "the duality gap stayed above epsilon: rounding");
      return true;
    case ConeStatus::nonconverged:
      fail(solution, Status::nonconverged, "the interior point method did not reach the gap that was asked for");
      break;
    case ConeStatus::singular:
      fail(solution, Status::singular, "a Newton system could not be factored");
      break;
    case ConeStatus::not_finite:
      fail(solution, Status::not_finite, "overflow in the interior point method");
      break;
  }
  return true;
}

void DrumwrightShell::extract(const ContactProblem& problem, const std::vector<double>& v0, int island) {
  Island& out = island_;
  out.M.clear();
  out.J.clear();
  out.v0.clear();
  out.offset.clear();
  out.mu.clear();
  out.share.clear();
  out.weight.clear();
  out.contacts = contacts_of_[island];
  out.blocks = blocks_of_[island];
  block_in_island_.resize(problem.M.blocks());
  for (const int b : out.blocks) {
    const int size = problem.M.block_size(b);
    block_in_island_[b] = out.M.add_block(size);
    out.M.block(block_in_island_[b]) = problem.M.block(b);
    out.v0.insert(out.v0.end(), v0.begin() + problem.M.first[b], v0.begin() + problem.M.first[b + 1]);
  }
  for (const int c : out.contacts) {
    out.J.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const int k = out.J.add_entry(block_in_island_[problem.J.block[e]], problem.M.block_size(problem.J.block[e]));
      out.J.entry(k) = problem.J.entry(e);
    }
    out.mu.push_back(problem.mu[c]);
    out.share.push_back(is_limit(problem, c) ? 0 : 1);
    out.weight.push_back(weight_[c]);
    out.offset.insert(out.offset.end(), problem.offset.begin() + 3 * c, problem.offset.begin() + 3 * c + 3);
  }
  out.factor.factor(out.M);
}

// Rounding is looked at only where without it the answer would not do, and with it might.
Certificate DrumwrightShell::judge(std::span<const double> r, std::span<const double> eta) {
  velocities_.evaluate(program_, r, eta);
  const Certificate plain = certify(program_, r, eta, velocities_, q_);
  if (good(plain, tolerances_.infeasibility) || std::abs(plain.gap) > epsilon_ + most_excused * plain.size * plain.size)
    return plain;
  const double terms = plain.size + std::sqrt(quadratic_form(island_.M, island_.v0));
  if (plain.infeasibility > tolerances_.backward && plain.infeasibility * plain.size > beyond_rounding * terms)
    return plain;
  velocities_.bound_rounding(program_, r, {});
  return certify(program_, r, eta, velocities_, q_, tolerances_.cone.rounding_units);
}

bool DrumwrightShell::good(const Certificate& c, double infeasibility) const {
  return std::abs(c.gap) <= std::max(epsilon_, c.gap_rounding) && c.infeasibility <= infeasibility;
}

// Is it good for the rounding only that large multipliers make much of? With the bounds relaxed they are small, as a
// rule.
bool DrumwrightShell::excused(const Certificate& c) const {
  return std::abs(c.gap) > epsilon_ && c.gap_rounding >= most_excused * c.size * c.size;
}

double DrumwrightShell::limit_of(Allowed allowed) const {
  return allowed == Allowed::exact ? tolerances_.infeasibility : tolerances_.backward;
}

// (2) with kappa = 1.r_n and eta = 0, for the velocities that judge() left.
double DrumwrightShell::gap_at_own_sum(std::span<const double> r) {
  ConeProgram summed = program_;
  summed.kappa = 0;
  for (int c = 0; c < summed.nc(); ++c) summed.kappa += r[3 * c];
  return certify(summed, r, {}, velocities_, q_).gap;
}

// Answers are proposed, cheapest first, and each counts for what its certificate says.
ConeStatus DrumwrightShell::solve_island(double epsilon, ContactSolution& solution, Previous* previous) {
  begin_island(epsilon, solution);
  bool proven = true;
  ConeStatus ending = ConeStatus::solved;
  answered_by_ = "rest, again";
  if (previous == nullptr || !stays_at_rest(*previous)) {
    proven = find_bound();
    answered_by_ = "frictionless";
    if (!slides_freely()) ending = propose(previous);
    if (previous != nullptr) remember(*previous);
  }
  if (tolerances_.answered_by) tolerances_.answered_by->add(answered_by_);
  solution.iterations += iterations_;
  solution.claimed_residual += std::abs(best_.gap);
  excess_ += std::max(0.0, std::abs(best_.gap) - best_.gap_rounding);
  if (!proven) return ending == ConeStatus::solved ? ConeStatus::nonconverged : ending;
  // An answer at rounding whose certificate is not: friction coefficients or masses of many orders of magnitude.
  if (ending != ConeStatus::solved && best_.infeasibility <= tolerances_.backward &&
      std::abs(best_.gap) <= tolerances_.inaccurate * best_.size * best_.size) {
    inaccurate_ = true;
    return ConeStatus::solved;
  }
  return ending;
}

void DrumwrightShell::begin_island(double epsilon, ContactSolution& solution) {
  const int nc = static_cast<int>(island_.contacts.size());
  epsilon_ = epsilon;
  program_ = {&island_.M, &island_.factor, &island_.J, &island_.v0, &island_.offset, &island_.mu, &island_.weight};
  if (tolerances_.bounded) program_.share = &island_.share;
  zero_mu_.assign(nc, 0.0);
  normal_program_ = program_;
  normal_program_.mu = &zero_mu_;
  solution.size += 3 * nc + (tolerances_.bounded ? nc + 1 : 0);
  iterations_ = 0;
  shape_ = Shape::general;
  best_ = {};
  r_.assign(3 * nc, 0.0);
  eta_.assign(nc, 0.0);

  q_.resize(3 * nc);
  multiply(island_.J, island_.M, island_.v0, q_);
  size_ = 0;
  for (int c = 0; c < nc; ++c) {
    for (int i = 0; i < 3; ++i) q_[3 * c + i] += island_.offset[3 * c + i];
    size_ +=
        (q_[3 * c] * q_[3 * c] + q_[3 * c + 1] * q_[3 * c + 1] + q_[3 * c + 2] * q_[3 * c + 2]) / island_.weight[c];
  }
  size_ = std::sqrt(size_);
  // What the first phase gave back is all that the event had: a gap here would be a gain of energy.
  if (second_phase_) epsilon_ = std::min(epsilon_, tolerances_.gain * size_ * size_);
}

// kappa with its proof, and what program the island comes down to. Without the bound f is a first guess only.
bool DrumwrightShell::find_bound() {
  const bool solved = frictionless();
  if (!tolerances_.bounded) return true;
  const bool proven = least_sum(solved);
  program_.bounded_below = true;
  program_.kappa = program_.impulse_size = kappa_ = sum_of_shares(f_);
  shape_ = shape();
  return proven;
}

// Keeps answer_ where it is better than what there is. Is it as good as is asked?
bool DrumwrightShell::offer(const Proposer& proposer) {
  certify_unreduced(answer_);
  const double limit = limit_of(proposer.allowed);
  const Certificate certificate = judge(answer_.r, multiplier_);
  const bool done = good(certificate, limit);
  const bool better = best_.infeasibility > limit || std::abs(certificate.gap) < std::abs(best_.gap);
  if (certificate.infeasibility > limit || !better || (!done && good(best_, tolerances_.backward))) return false;
  best_ = certificate;
  answered_by_ = proposer.name;
  r_ = answer_.r;
  eta_ = multiplier_;
  return done;
}

// Multipliers of (1) from those of (3), which are of either sign: eta + t lambda. Into multiplier_.
void DrumwrightShell::certify_unreduced(const ConeSolution& x) {
  multiplier_.assign(x.eta.begin(), x.eta.end());
  double t = 0;
  for (std::size_t c = 0; c < multiplier_.size() && shape_ == Shape::flat; ++c)
    if (lambda_[c] > 0) t = std::max(t, -multiplier_[c] / lambda_[c]);
  for (std::size_t c = 0; c < multiplier_.size(); ++c)
    multiplier_[c] = std::max(0.0, t > 0 ? multiplier_[c] + t * lambda_[c] : multiplier_[c]);
}

// The frictionless answer, if it is good enough.
bool DrumwrightShell::slides_freely() {
  r_.assign(3 * f_.size(), 0.0);  // and not the friction of an answer at rest that was tried before
  eta_.assign(f_.size(), 0.0);
  for (std::size_t c = 0; c < f_.size(); ++c) r_[3 * c] = f_[c];
  best_ = judge(r_, {});
  // A light body may slip below heavy ones: beside their impulses that is no infeasibility, and a slip costs r.y
  // nothing where there is no friction.
  if (!tolerances_.bounded) best_.gap = gap_at_own_sum(r_);
  return good(best_, limit_of(Allowed::exact));
}

// Who proposes, in this order; how far the bounds may be missed; and is the answer one to start the next event from?
const std::array<DrumwrightShell::Proposer, 10> DrumwrightShell::proposers = {{
    {"previous answer", &DrumwrightShell::from_previous, Allowed::exact, true},
    {"stopping", &DrumwrightShell::all_stop, Allowed::exact, false},
    {"sticking", &DrumwrightShell::all_stick, Allowed::exact, false},
    {"guess", &DrumwrightShell::from_guess, Allowed::exact, true},
    {"interior point", &DrumwrightShell::interior, Allowed::exact, true},
    {"small, dense", &DrumwrightShell::small_dense, Allowed::exact, true},
    {"relaxed", &DrumwrightShell::relaxed, Allowed::backward, true},
    {"large, dense", &DrumwrightShell::large_dense, Allowed::exact, true},
    {"dense, relaxed", &DrumwrightShell::dense_relaxed, Allowed::backward, true},
    {"dense, short steps", &DrumwrightShell::dense_short, Allowed::exact, true},
}};

ConeStatus DrumwrightShell::propose(Previous* previous) {
  start_ =
      previous != nullptr && previous->by_newton && previous->nv == island_.M.order() ? &previous->answer : nullptr;
  if (start_ != nullptr && start_->r.size() != 3 * island_.contacts.size()) start_ = nullptr;
  program_.gap = epsilon_;
  if (previous != nullptr) previous->by_newton = false;
  ConeStatus ending = ConeStatus::nonconverged;
  for (const Proposer& proposer : proposers) {
    answer_.iterations = 0;
    answer_.s = 0;
    const bool proposes = (this->*proposer.propose)();
    iterations_ += answer_.iterations;
    if (!proposes) continue;
    // Large multipliers excuse much; with the bounds relaxed they are small, as a rule.
    if (offer(proposer) && !excused(best_)) {
      if (previous != nullptr && proposer.starts_next) {
        previous->by_newton = true;
        previous->nv = island_.M.order();
        previous->answer = answer_;
      }
      if (proposer.propose == &DrumwrightShell::from_previous && tolerances_.warm_starts) ++*tolerances_.warm_starts;
      return ConeStatus::solved;
    }
    if (answer_.status != ConeStatus::solved) ending = answer_.status;
  }
  return good(best_, tolerances_.backward) ? ConeStatus::solved : ending;
}

// (3) where it is the same as (1).
ConeProgram DrumwrightShell::reduced() const {
  ConeProgram program = program_;
  if (shape_ == Shape::flat) {
    program.fixed = &fixed_;
    program.kappa = std::numeric_limits<double>::infinity();
  }
  return program;
}

// (1) with bounds that may be missed by half of what is allowed, so that it has a strictly feasible point.
ConeProgram DrumwrightShell::relaxed_program() {
  const int nc = static_cast<int>(island_.contacts.size());
  const double slack = 0.5 * tolerances_.backward;
  double kappa_size = kappa_;
  slack_.resize(nc);
  for (int c = 0; c < nc; ++c) slack_[c] = slack * size_ * std::sqrt(island_.weight[c]);
  double approaching = 0;
  for (int c = 0; c < nc; ++c) approaching += std::abs(q_[3 * c]) / island_.weight[c];
  kappa_size = std::max(kappa_size, approaching);
  ConeProgram program = program_;
  program.slack = &slack_;
  program.kappa = kappa_ + slack * kappa_size;
  return program;
}

// Newton's method from the previous answer, an iterate like any other.
bool DrumwrightShell::from_previous() {
  if (start_ == nullptr) return false;
  answer_ = *start_;
  answer_.iterations = 0;
  const ConeProgram program = reduced();
  if (!program.has_bound()) answer_.s = 0;
  return friction_solver_.polish(program, answer_,
                                 PolishRules::bold(tolerances_.cone, tolerances_.cone.iterate_patience));
}

// Newton's method from the frictionless answer, with friction against its slip.
bool DrumwrightShell::from_guess() {
  const int nc = static_cast<int>(island_.contacts.size());
  answer_.r.assign(3 * nc, 0.0);
  answer_.eta.assign(nc, 0.0);
  for (int c = 0; c < nc; ++c) {
    const double t = tangential(&u_f_[3 * c]);
    answer_.r[3 * c] = f_[c];
    for (int i = 1; i < 3 && t > 0; ++i) answer_.r[3 * c + i] = -island_.mu[c] * f_[c] * u_f_[3 * c + i] / t;
    answer_.s = std::max(answer_.s, island_.mu[c] * t - u_f_[3 * c]);
  }
  const ConeProgram program = reduced();
  if (!program.has_bound()) answer_.s = 0;
  return friction_solver_.polish(program, answer_,
                                 PolishRules::bold(tolerances_.cone, tolerances_.cone.guess_patience));
}

bool DrumwrightShell::interior() {
  friction_solver_.solve(reduced(), answer_);
  return true;
}

bool DrumwrightShell::relaxed() {
  if (!tolerances_.bounded) return false;
  friction_solver_.solve(relaxed_program(), answer_);
  return true;
}

// The dense method rarely fails, but its time grows with the cube: it comes early for small islands, late for large.
bool DrumwrightShell::small_dense() {
  if (static_cast<int>(island_.contacts.size()) > tolerances_.dense_first) return false;
  solve_densely(reduced(), tolerances_.cone.step_fraction);
  return true;
}

bool DrumwrightShell::large_dense() {
  const int nc = static_cast<int>(island_.contacts.size());
  if (nc <= tolerances_.dense_first || nc > tolerances_.dense_limit) return false;
  solve_densely(reduced(), tolerances_.cone.step_fraction);
  return true;
}

// Short steps stay in the middle of mixed scales.
bool DrumwrightShell::dense_short() {
  if (static_cast<int>(island_.contacts.size()) > tolerances_.dense_limit) return false;
  solve_densely(reduced(), tolerances_.short_step);
  return true;
}

bool DrumwrightShell::dense_relaxed() {
  if (!tolerances_.bounded || static_cast<int>(island_.contacts.size()) > tolerances_.dense_limit) return false;
  solve_densely(relaxed_program(), tolerances_.cone.step_fraction);
  return true;
}

// Where slips differ by an angle a, how contacts share their load is worth a^2 of the energy: the cones are too curved
// for the interior point method to follow that far. Newton's method is not bound to their inside.
void DrumwrightShell::solve_densely(const ConeProgram& program, double step_fraction) {
  ConeOptions dense = tolerances_.cone;
  dense.step_fraction = step_fraction;
  solve_dense(program, dense, answer_);
  if (answer_.r.empty() || std::abs(answer_.gap) <= epsilon_) return;
  finished_ = answer_;
  finisher_.polish(program, finished_, PolishRules::careful(finisher_.options()));
  answer_.iterations = finished_.iterations;
  if (finished_.infeasibility <= tolerances_.infeasibility && std::abs(finished_.gap) < std::abs(answer_.gap))
    answer_ = finished_;
}

// What the next event may start from.
void DrumwrightShell::remember(Previous& previous) {
  const ContactView event = view();
  previous.impulse.remember(event, r_, size_);
  if (!tolerances_.bounded) return;
  std::vector<double>& normal = x_;
  normal.assign(r_.size(), 0.0);
  for (std::size_t c = 0; c < f_.size(); ++c) normal[3 * c] = f_[c];
  previous.frictionless.remember(event, normal, size_);
  previous.z = z_;
}

// The previous answer at rest, if it is good enough.
bool DrumwrightShell::stays_at_rest(Previous& previous) {
  if (start_at_rest(previous)) {
    best_ = judge(r_, {});
    if (good(best_, limit_of(Allowed::exact))) {
      if (tolerances_.warm_starts) ++*tolerances_.warm_starts;
      return true;
    }
  }
  program_.bounded_below = false;
  program_.kappa = program_.impulse_size = std::numeric_limits<double>::infinity();
  return false;
}

ContactView DrumwrightShell::view() const {
  return {island_.M, island_.factor, island_.J, island_.v0, island_.offset, island_.mu, island_.weight};
}

// Do the impulses that kept the previous event at rest keep this one, inside the cones, and is their sum bounded as the
// previous proof says? Into r_, eta_, f_, z_ and the bound of program_; the certificate has the last word.
bool DrumwrightShell::start_at_rest(Previous& previous) {
  const int nc = static_cast<int>(island_.contacts.size());
  const ContactView event = view();
  if (!previous.impulse.find(event, size_)) return false;
  const double slack = 1e-13 * size_;  // sqrt(J), rounding: answers may lie on the edges of the cones
  for (int c = 0; c < nc; ++c) {
    const double* r = &previous.impulse.r()[3 * c];
    if (!(tangential(r) <= island_.mu[c] * r[0] + slack / std::sqrt(island_.weight[c]))) return false;
  }
  if (tolerances_.bounded) {
    if (!previous.frictionless.find(event, size_) || static_cast<int>(previous.z.size()) != island_.M.order())
      return false;
    f_.resize(nc);
    for (int c = 0; c < nc; ++c) {
      const double f = previous.frictionless.r()[3 * c];
      if (!(f >= -slack / std::sqrt(island_.weight[c]))) return false;
      f_[c] = std::max(0.0, f);
    }
    u_f_ = previous.frictionless.u();
    z_ = previous.z;
    Jz_.resize(3 * nc);
    multiply(island_.J, island_.M, z_, Jz_);
    if (!proves_least_sum()) return false;
    program_.bounded_below = true;
    program_.kappa = program_.impulse_size = kappa_ = sum_of_shares(f_);
  }
  r_ = previous.impulse.r();
  eta_.assign(nc, 0.0);
  return true;
}

// f, v_f, u_f of the frictionless problem: Newton's method, first guess all contacts that do not clearly part closed.
bool DrumwrightShell::frictionless() {
  const int nc = static_cast<int>(island_.contacts.size());
  trial_.r.assign(3 * nc, 0.0);
  trial_.eta.assign(nc, 0.0);
  trial_.s = 0;
  trial_.iterations = 0;
  for (int c = 0; c < nc; ++c) trial_.r[3 * c] = 1e-3 * size_ / std::sqrt(island_.weight[c]);
  bool ok = size_ > 0 && has_robot() && stop_normals();
  if (!ok)
    ok = size_ > 0 && normal_solver_.polish(normal_program_, trial_,
                                            PolishRules::bold(tolerances_.cone, tolerances_.cone.guess_patience));
  if (!ok) {
    iterations_ += trial_.iterations;
    normal_solver_.solve(normal_program_, trial_);
    ok = trial_.status == ConeStatus::solved;
  }
  iterations_ += trial_.iterations;
  if (!all_finite(trial_.r)) {
    trial_.r.assign(3 * nc, 0.0);
    ok = false;
  }
  f_.resize(nc);
  for (int c = 0; c < nc; ++c) f_[c] = std::max(0.0, trial_.r[3 * c]);
  take_frictionless();
  return ok && complementary();
}

// Does f solve the frictionless problem?
bool DrumwrightShell::complementary() {
  const double size = size_ > 0 ? size_ : 1;
  bool bounded_rounding = false;
  for (std::size_t c = 0; c < f_.size(); ++c) {
    const double root_w = std::sqrt(island_.weight[c]), u_n = u_f_[3 * c] / root_w;
    const double wrong = std::max(-u_n, std::min(f_[c] * root_w, u_n));
    if (wrong <= tolerances_.backward * size) continue;
    if (!bounded_rounding) velocities_.bound_rounding(normal_program_, x_, {});
    bounded_rounding = true;
    if (wrong > tolerances_.cone.rounding_units * velocities_.rounding[c]) return false;
  }
  return true;
}

// v_f and u_f of f.
void DrumwrightShell::take_frictionless() {
  x_.assign(3 * f_.size(), 0.0);
  for (std::size_t c = 0; c < f_.size(); ++c) x_[3 * c] = f_[c];
  velocities_.evaluate(normal_program_, x_, {});
  v_f_ = velocities_.v;
  u_f_ = velocities_.u;
}

// Least energy velocity with N velocity + offset = 0 on a set of contacts, multipliers x (proximal iteration, started
// from the x given):  M velocity = M start + N^T x. target = 1: N velocity = 1 from rest; 0: the frictionless problem.
void DrumwrightShell::equalities(const std::vector<char>& in_set, double target, std::vector<double>& x,
                                 std::vector<double>& velocity) {
  const int nc = static_cast<int>(island_.contacts.size()), nv = island_.M.order();
  normals_.prepare(island_.M, island_.J, tolerances_.cone.least_block);
  G_.assign(9 * nc, 0.0);
  for (int c = 0; c < nc; ++c)
    if (in_set[c]) G_[9 * c] = 1 / (tolerances_.cone.proximal * island_.weight[c]);
  x.resize(nc);
  velocity.resize(nv);
  if (!normals_.factor(G_, {})) {
    std::fill(x.begin(), x.end(), 0.0);
    std::fill(velocity.begin(), velocity.end(), 0.0);
    return;
  }
  step_.resize(3 * nc);
  u_step_.resize(3 * nc);
  h_.resize(nv);
  double last = HUGE_VAL;
  for (int k = 0;; ++k) {
    step_.assign(3 * nc, 0.0);
    for (int c = 0; c < nc; ++c)
      if (in_set[c]) step_[3 * c] = x[c];
    std::fill(velocity.begin(), velocity.end(), 0.0);
    multiply_transposed_add(island_.J, island_.M, step_, velocity);
    island_.factor.solve_in_place(velocity);
    if (target == 0)
      for (int i = 0; i < nv; ++i) velocity[i] += island_.v0[i];
    multiply(island_.J, island_.M, velocity, u_step_);
    double worst = 0;
    for (int c = 0; c < nc; ++c) {
      const double miss = u_step_[3 * c] + (target == 0 ? island_.offset[3 * c] : -target * island_.share[c]);
      step_[3 * c] = in_set[c] ? -G_[9 * c] * miss : 0;
      if (in_set[c]) worst = std::max(worst, std::abs(miss));
    }
    miss_ = worst;
    if (worst == 0) return;
    const bool done = k == tolerances_.cone.polish_limit || worst > 0.1 * last;
    if (done && target == 0) return;
    last = worst;
    std::fill(h_.begin(), h_.end(), 0.0);
    multiply_transposed_add(island_.J, island_.M, step_, h_);
    normals_.solve_in_place(h_);
    if (done) {
      // z need not be an impulse's velocity: light bodies among heavy ones are put right directly.
      for (int i = 0; i < nv; ++i) velocity[i] += h_[i];
      return;
    }
    multiply(island_.J, island_.M, h_, u_step_);
    for (int c = 0; c < nc; ++c)
      if (in_set[c]) x[c] += step_[3 * c] - G_[9 * c] * u_step_[3 * c];
  }
}

// Duality of linear programming: N z <= 1 where contacts touch, = 1 where they carry.
bool DrumwrightShell::proves_least_sum() const {
  const int nc = static_cast<int>(island_.contacts.size());
  const double size = size_ > 0 ? size_ : 1;
  for (int c = 0; c < nc; ++c) {
    const double root_w = std::sqrt(island_.weight[c]), excess = Jz_[3 * c] - island_.share[c];

    const bool touches = u_f_[3 * c] / root_w <= (touch_.empty() ? tolerances_.touching * size : touch_[c]);
    if (touches && excess > tolerances_.backward) return false;
    if (-excess > tolerances_.backward && f_[c] * root_w > tolerances_.backward * size) return false;
  }
  return true;
}

// z with N z = 1 on set_, lambda and J z. Light bodies between contacts that nearly oppose each other make W nearly
// singular: there the proximal iteration ends early.
void DrumwrightShell::lift() {
  const int nc = static_cast<int>(island_.contacts.size());
  lambda_.assign(nc, 0.0);
  equalities(set_, 1, lambda_, z_);
  if (miss_ > tolerances_.solvable &&
      stopping_.prepare(island_.M, island_.J, island_.factor, island_.weight, set_, 1)) {
    x_.assign(3 * nc, 0.0);
    for (int c = 0; c < nc; ++c) x_[3 * c] = island_.share[c];
    stopping_.least_velocity(x_, island_.factor, z_);
  }
  Jz_.resize(3 * nc);
  multiply(island_.J, island_.M, z_, Jz_);
}

// The least sum of normal impulses and its proof z. Where N z = 1 can be solved on the contacts that touch every f has
// the same sum, z.M (v_f - v-). Otherwise the linear program is solved by a shift: with w_n + eps in place of w_n the
// frictionless problem minimises 1/2 f.W f + f.q + eps 1.f, whose answer for small eps has the least sum among the
// frictionless ones, and z = -dv_eps / deps proves it.
bool DrumwrightShell::least_sum(bool solved) {
  const int nc = static_cast<int>(island_.contacts.size());
  const auto solvable_on_set = [&] {
    lift();
    return proves_least_sum();
  };
  touch_.clear();
  miss_ = HUGE_VAL;
  set_.assign(nc, 1);
  if (solved && solvable_on_set()) return true;
  const double size = size_ > 0 ? size_ : 1;
  for (int c = 0; c < nc; ++c) set_[c] = u_f_[3 * c] <= 1e-11 * size * std::sqrt(island_.weight[c]) ? 1 : 0;
  if (solved && solvable_on_set()) return true;
  if (least_sum_densely()) return true;
  if (!solved) return false;

  double shift = 0;
  for (int c = 0; c < nc; ++c) shift = std::max(shift, std::sqrt(island_.weight[c]) * size * tolerances_.shift);
  const std::vector<double> first = f_;
  for (int attempt = 0; attempt < tolerances_.shift_attempts; ++attempt, shift /= 100) {
    kappa_offset_ = island_.offset;
    for (int c = 0; c < nc; ++c) kappa_offset_[3 * c] += shift * island_.share[c];
    ConeProgram shifted = normal_program_;
    shifted.offset = &kappa_offset_;
    normal_solver_.solve(shifted, trial_);
    iterations_ += trial_.iterations;
    velocities_.evaluate(shifted, trial_.r, {});
    f_shifted_.assign(nc, 0.0);
    for (int c = 0; c < nc; ++c) {
      set_[c] = trial_.r[3 * c] * island_.weight[c] > velocities_.u[3 * c] ? 1 : 0;
      if (set_[c]) f_shifted_[c] = trial_.r[3 * c];
    }
    // Impulses of the same support without the shift, and the derivative of v with respect to the shift.
    equalities(set_, 0, f_shifted_, velocity_);
    multiply(island_.J, island_.M, velocity_, u_step_);
    bool feasible = true;
    for (int c = 0; c < nc; ++c) {
      feasible = feasible &&
                 u_step_[3 * c] + island_.offset[3 * c] >= -tolerances_.solvable * size * std::sqrt(island_.weight[c]);
      feasible = feasible && f_shifted_[c] * std::sqrt(island_.weight[c]) >= -tolerances_.solvable * size;
      f_[c] = std::max(0.0, f_shifted_[c]);
    }
    lift();
    if (feasible && proves_least_sum()) {
      lambda_.assign(nc, 0.0);
      return true;
    }
  }
  f_ = first;
  lambda_.assign(nc, 0.0);
  return false;
}

// Where contacts depend on each other up to rounding the lift of all that touch cannot be even, and an active set
// cannot be named.
bool DrumwrightShell::least_sum_densely() {
  const int nc = static_cast<int>(island_.contacts.size());
  const std::vector<double> first = f_;
  z_.resize(island_.M.order());
  velocities_.bound_rounding(normal_program_, x_, {});
  const double rounding =
      tolerances_.cone.rounding_units * *std::max_element(velocities_.rounding.begin(), velocities_.rounding.end());
  if (!dense_sum_.solve(island_.M, island_.J, island_.factor, island_.weight, q_, island_.share,
                        std::max(rounding, tolerances_.touching * size_), f_, z_)) {
    f_ = first;
    return false;
  }
  take_frictionless();
  Jz_.resize(3 * nc);
  multiply(island_.J, island_.M, z_, Jz_);
  lambda_.assign(nc, 0.0);
  miss_ = HUGE_VAL;
  if (complementary() && proves_least_sum()) return true;
  f_ = first;
  take_frictionless();
  return false;
}

// Is (3) the same as (1)? z, lambda are those of least_sum(). Fills fixed_. lambda is not unique where more contacts
// touch than carry: those with the wrong sign are left out of it.
DrumwrightShell::Shape DrumwrightShell::shape() {
  const int nc = static_cast<int>(island_.contacts.size());
  if (nc == 0 || miss_ > tolerances_.flat || !lifts_evenly()) return Shape::general;
  const bool unsupported = !supports();
  if (unsupported) {
    proof_ = z_;
    for (int round = 0; round < nc && !supports(); ++round) {
      for (int c = 0; c < nc; ++c)
        if (!carries_lift(c)) set_[c] = 0;
      lift();
    }
    if (miss_ > tolerances_.flat || !supports() || !lifts_evenly()) {
      z_ = proof_;
      return Shape::general;
    }
  }
  fixed_ = set_;
  return Shape::flat;
}

// Is N z = 1 and T z = 0 on all contacts?
bool DrumwrightShell::lifts_evenly() {
  for (std::size_t c = 0; c < island_.contacts.size(); ++c)
    if (std::abs(Jz_[3 * c] - island_.share[c]) > tolerances_.solvable ||
        tangential(&Jz_[3 * c]) > tolerances_.solvable)
      return false;
  return true;
}

// Does a contact have lambda > 0 and touch?
bool DrumwrightShell::carries_lift(int c) const {
  const double size = size_ > 0 ? size_ : 1, root_w = std::sqrt(island_.weight[c]);
  return lambda_[c] * island_.weight[c] > tolerances_.carrying && u_f_[3 * c] / root_w / size <= tolerances_.solvable;
}

bool DrumwrightShell::supports() const {
  for (std::size_t c = 0; c < island_.contacts.size(); ++c)
    if (set_[c] && !carries_lift(static_cast<int>(c))) return false;
  return std::find(set_.begin(), set_.end(), 1) != set_.end();
}

double DrumwrightShell::sum_of_shares(std::span<const double> x) const {
  double sum = 0;
  for (std::size_t c = 0; c < x.size(); ++c) sum += island_.share[c] * x[c];
  return sum;
}

// Are there blocks other than free bodies'?
bool DrumwrightShell::has_robot() const {
  for (int b = 0; b < island_.M.blocks(); ++b)
    if (island_.M.block_size(b) != 6) return true;
  return false;
}

// Impulses that stop the contacts of set_, 1 or 3 rows each; into x_. Returns the largest velocity left in those rows,
// scaled; negative: too large for this.
double DrumwrightShell::stop_set(const ConeProgram& program, std::span<const double> weight, int rows) {
  const int nc = static_cast<int>(island_.contacts.size());
  if (!stopping_.prepare(island_.M, island_.J, island_.factor, weight, set_, rows)) return -1;
  ++iterations_;
  x_.assign(3 * nc, 0.0);
  double residual = HUGE_VAL;
  for (int k = 0; k < 3; ++k) {
    velocities_.evaluate(program, x_, {});
    residual = 0;
    for (int c = 0; c < nc; ++c)
      for (int i = 0; i < rows && set_[c]; ++i)
        residual = std::max(residual, std::abs(velocities_.u[3 * c + i]) / std::sqrt(island_.weight[c]));
    if (k < 2) stopping_.correct(velocities_.u, x_);
  }
  return residual;
}

// The frictionless answer by active sets: contacts that would pull are let go, one that would sink is taken back. Into
// trial_.r.
bool DrumwrightShell::stop_normals() {
  const int nc = static_cast<int>(island_.contacts.size());
  const double rounding = 1e-13 * std::max(size_, std::sqrt(quadratic_form(island_.M, island_.v0)));
  set_.assign(nc, 1);
  for (int round = 0; round < 2 * nc + 2; ++round) {
    const double residual = stop_set(normal_program_, island_.weight, 1);
    if (!(residual >= 0 && residual <= rounding)) return false;
    int pulls = -1, sinks = -1;
    for (int c = 0; c < nc; ++c) {
      if (set_[c] && x_[3 * c] < 0 && (pulls < 0 || x_[3 * c] < x_[3 * pulls])) pulls = c;
      const double root = std::sqrt(island_.weight[c]);
      if (!set_[c] && velocities_.u[3 * c] < -rounding * root &&
          (sinks < 0 || velocities_.u[3 * c] < velocities_.u[3 * sinks]))
        sinks = c;
    }
    if (pulls >= 0) {
      set_[pulls] = 0;
    } else if (sinks >= 0) {
      set_[sinks] = 1;
    } else {
      trial_.r = x_;
      return true;
    }
  }
  return false;
}

// Does the least impulse that stops the contacts that carry lie in the cones? If not, does one with friction and normal
// impulses weighted otherwise? As all_stick, but direct: for robots.
bool DrumwrightShell::all_stop() {
  if (!has_robot()) return false;
  const int nc = static_cast<int>(island_.contacts.size());
  std::vector<double>& weight = f_shifted_;
  weight = island_.weight;
  set_.assign(nc, 1);
  bool weighted = false;
  for (int round = 0; round < nc + 2; ++round) {
    if (stop_set(program_, weight, 3) < 0) return false;
    bool inside = true;
    double mean = 0;
    int pulls = -1, carry = 0;
    for (int c = 0; c < nc; ++c) {
      if (!set_[c]) continue;
      inside = inside && tangential(&x_[3 * c]) <= island_.mu[c] * x_[3 * c];
      mean += x_[3 * c];
      ++carry;
      if (x_[3 * c] < 0 && (pulls < 0 || x_[3 * c] < x_[3 * pulls])) pulls = c;
    }
    if (inside) {
      answer_.r = x_;
      answer_.eta.assign(nc, 0.0);
      answer_.status = ConeStatus::solved;
      return true;
    }
    if (pulls >= 0) {
      set_[pulls] = 0;
    } else if (!weighted) {
      weighted = true;
      for (int c = 0; c < nc; ++c)
        if (set_[c]) weight[c] = island_.weight[c] * mean / carry / std::max(x_[3 * c], 1e-3 * mean / carry);
    } else {
      return false;
    }
  }
  return false;
}

// Does an impulse in the cones stop all contacts? Least norm first; then with friction shared in the ratio of the
// normal impulses found.
bool DrumwrightShell::all_stick() {
  const int nc = static_cast<int>(island_.contacts.size()), nv = island_.M.order();
  sticking_.prepare(island_.M, island_.J, tolerances_.cone.least_block);
  G_.assign(9 * nc, 0.0);
  step_.resize(3 * nc);
  h_.resize(nv);
  u_step_.resize(3 * nc);
  x_.assign(3 * nc, 0.0);
  f_shifted_.assign(nc, 1.0);
  for (int round = 0; round < 2; ++round) {
    for (int c = 0; c < nc; ++c) {
      const double stiff = 1 / (tolerances_.cone.proximal * island_.weight[c]);
      G_[9 * c] = stiff;
      G_[9 * c + 4] = G_[9 * c + 8] = island_.mu[c] > 0 ? stiff * f_shifted_[c] : 0;
    }
    if (!sticking_.factor(G_, {})) return false;
    ++iterations_;
    std::fill(x_.begin(), x_.end(), 0.0);
    double least = HUGE_VAL, rounding = 0;
    for (int k = 0, stalled = 0;; ++k) {
      velocities_.evaluate(program_, x_, {});
      double residual = 0, impulses = 0;
      for (int c = 0; c < nc; ++c)
        for (int i = 0; i < 3; ++i) {
          residual = std::max(residual, std::abs(velocities_.u[3 * c + i]) / std::sqrt(island_.weight[c]));
          step_[3 * c + i] = -G_[9 * c + 4 * i] * velocities_.u[3 * c + i];
        }
      for (int c = 0; c < nc; ++c)
        impulses += island_.weight[c] * Eigen::Map<const Eigen::Vector3d>(&x_[3 * c]).squaredNorm();
      rounding = std::max(1e-13 * size_, 1e-15 * std::sqrt(impulses));
      // Three steps serve, but heavy bodies on light ones: there each takes away some digits only, and at the end large
      // impulses round at random, so that the best counts.
      stalled = residual < 0.5 * least ? 0 : stalled + 1;
      if (residual < least) {
        least = residual;
        least_x_ = x_;
      }
      const bool goes_on = stalled < 2 && residual > 1e-13 * size_ && k < tolerances_.cone.polish_limit;
      if (residual <= 1e-16 * size_ || (k >= 3 && !goes_on)) break;
      if (k == 2 && residual > 1e-6 * size_ && stalled > 0) return false;
      std::fill(h_.begin(), h_.end(), 0.0);
      multiply_transposed_add(island_.J, island_.M, step_, h_);
      sticking_.solve_in_place(h_);
      multiply(island_.J, island_.M, h_, u_step_);
      for (int i = 0; i < 3 * nc; ++i) x_[i] += step_[i] - G_[9 * (i / 3) + 4 * (i % 3)] * u_step_[i];
    }
    if (least > rounding) return false;
    x_ = least_x_;
    bool inside = true;
    double mean = 0;
    for (int c = 0; c < nc; ++c) {
      inside = inside && tangential(&x_[3 * c]) <= island_.mu[c] * x_[3 * c];
      mean += x_[3 * c] / nc;
    }
    if (inside) {
      answer_.r = x_;
      answer_.eta.assign(nc, 0.0);
      answer_.status = ConeStatus::solved;
      return true;
    }
    for (int c = 0; c < nc; ++c) {
      if (!(x_[3 * c] > 0)) return false;
      f_shifted_[c] = x_[3 * c] / mean;
    }
  }
  return false;
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
            .always_named = true},
           {.flag = "epsilon-relative",
            .unit = "-",
            .default_value = "none",
            .summary = "the same as a fraction of the kinetic energy before the event",
            .field = &MethodOptions::epsilon_relative,
            .type = "FRACTION",
            .short_name = "epsrel",
            .expected = "a positive fraction of the kinetic energy, as in --epsilon-relative 1e-12",
            .positive = true,
            .replaces = "epsilon"},
           {.flag = "compression-bound",
            .unit = "-",
            .default_value = "on",
            .summary = "bound the sum of normal impulses of each island by the frictionless sum",
            .field = &MethodOptions::compression_bound,
            .type = "on|off",
            .short_name = "bound-",
            .of_scenario = true},
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
