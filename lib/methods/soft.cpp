// Contacts that give way: the regularised convex model of Drake (SAP) and MuJoCo.
//
// Problem (nc contacts, nv velocities; contact/problem.h; energies in J):
//   min over v of 1/2 (v - v-).M (v - v-) + sum_i l_i(u_i),   u = J v + w                                     (1)
// l_i(u) = 1/2 r.R_i r with r = P_i(-R_i^-1 u), P_i the projection on |r_t| <= mu r_n in the norm of R_i =
// diag(R_n, R_t, R_t), 1/kg (soft_contacts.h). -grad l_i = r_i are the impulses. (1) is the dual of
//   min over r in K of 1/2 r.(W + R) r + r.q,   q = J v- + w (2)
// Both are strictly convex: one v, one r. R follows from W_ii by two rules (contact/softness.h), `sap` and `mujoco`.
//
// How: Newton on M (v - v-) = J^T r and r = P(r - (u + R r) / w), P the projection on the cones, v and r each in their
// own right, with H = M + J^T G J, G a block a contact (soft_contacts.h), factored by blocks of bodies. A step is taken
// whole where it halves the least residual so far, else as far as (1) is near its least along it; where it is short, or
// does not go down, r begins anew at -grad l(u), from where every step goes down. From v-; with a warm start from the
// previous event's impulses and the velocities that they give, where (1) is less there. Ends where the conditions of
// (2) hold for r and the velocity that r itself gives, to `tolerance`, or where no step makes them better. With r =
// -grad l(u) all along, a contact of near rigid R is open or firm by what the last step made of u, and steps that
// change many are short: three to four times as many in a pile.
//
// Sources: A. Castro, F. Permenter, X. Han, An unconstrained convex formulation of compliant contact, IEEE T-RO 39
// (2023), eqs. 10-25; E. Todorov, Convex and analytically-invertible dynamics with contacts and constraints, ICRA 2014,
// and MuJoCo's documentation, "Computation".
// Differences: 1. no step h is known: `sap` is near rigid (R_n = beta^2 w / (4 pi^2)) unless --compliance says what
// 1 / (h (h + tau_d) k) is, and gaps are the offset's, w_n = g / h by steps (docs/stepping.md); 2. `mujoco` asks that a
// contact stop within the step, which is its stiffest time constant, 2 h; impedance is a constant; 3. restitution,
// which neither has (Poisson, as `ap` and `convex` have it), on islands that have any: normal impulses of a first phase
// times 1 + theta e, theta <= 1 the largest by which no island gains energy (restitution.h), and then (1) once more
// from the velocity reached; 4. solved to rounding.
//
// Fails: `nonconverged` where the conditions hold to less than `accepted`, with the best impulses; `singular`: M or H
// not positive definite; `not_finite`, `input_error`: the data, without impulses.

#include <algorithm>
#include <cmath>
#include <memory>

#include "cone/kkt_system.h"
#include "linalg/finite.h"
#include "linalg/stop.h"
#include "methods/registry.h"
#include "methods/restitution.h"
#include "methods/same_event.h"
#include "methods/soft_contacts.h"
#include "methods/weigh.h"

namespace cb {

namespace {

struct SoftOptions {
  Softness softness;
  bool warm_start = false;
  std::shared_ptr<Counter> warm_starts;
  /// -: residual, contact by contact, at which an answer is one; and up to which the best one is where none is better.
  double tolerance = 1e-13, accepted = 1e-10;
  int iteration_limit = 200;
  double rounding = 0x1p-45;  ///< -: of what a velocity is a sum of, what its last bits leave open (docs/judging.md)
  int stalled = 3;            ///< steps in turn that do not halve the residual; one less where it is accepted
  int lost = 5;               ///< of these in turn from which on r is -grad l(u) at each
  ConvexSearchOptions search;
  double whole = 0.5;       ///< -: of the least residual so far, up to which a whole step is taken as it is
  double astray = 0.25;     ///< -: length of a step from which on impulses go along
  double touching = 1e-12;  ///< -: of an island's fastest contact before: slower ones count as sticking in H
  double least_block = 3;   ///< mean size of a block of M from which on H is factored by blocks
};

class Soft {
 public:
  explicit Soft(const SoftOptions& options) : options_(options) {}
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  bool begin(const ContactProblem& problem, ContactSolution& solution);
  bool solve(const ContactProblem& problem, const std::vector<double>& v0, ContactSolution& solution);
  void start(const ContactProblem& problem);
  void change_after(const ContactProblem& problem, const std::vector<double>& r);
  void velocity_at(const ContactProblem& problem, const std::vector<double>& d, std::vector<double>& u) const;
  Status descend(const ContactProblem& problem, ContactSolution& solution);
  double look(const ContactProblem& problem);
  void take_step(const ContactProblem& problem, double length);
  double beside_others(const ContactProblem& problem, const std::vector<double>& r);
  bool rounding_is_left(const ContactProblem& problem, const std::vector<double>& r);
  bool find_step(const ContactProblem& problem);
  void linearise();
  void find_direction(const ContactProblem& problem);
  double refine(const ContactProblem& problem);
  double length_of_step(const ContactProblem& problem);
  double cost(const ContactProblem& problem, const std::vector<double>& d);

  SoftOptions options_;
  BlockCholesky factor_;
  SoftContacts contacts_;
  std::vector<double> weight_;  // nc, 1/kg
  KktSystem system_;
  // nv. d = v - v0 and not v: near rigid contacts make forty times the error of a velocity of it, and what an event
  // changes is small beside what moves.
  std::vector<double> v0_, d_, dv_, d_was_, d_plus_, momentum_;
  std::vector<double> u_, du_, u_minus_, u_plus_;   // 3 nc
  std::vector<double> r_, dr_, r_was_, a_, given_;  // 3 nc, N s; a: of linearise; given: in the cones
  std::vector<double> G_;                           // 9 nc
  std::vector<double> best_, previous_;             // 3 nc, N s
  std::vector<double> open_;                        // nc, m/s
  int previous_nv_ = -1;

  // Of restitution.
  Restitution restitution_;
  std::vector<char> elastic_, bounded_;  // per island
  std::vector<double> first_impulse_;    // 3 nc, N s
};

void Soft::operator()(const ContactProblem& problem, ContactSolution& solution) {
  solution.clear();
  solution.as<SoftWitness>().softness = options_.softness;
  solution.impulse.assign(3 * problem.nc(), 0.0);
  solution.size = problem.nv();
  if (!begin(problem, solution) || problem.nc() == 0) return;
  if (!solve(problem, problem.v_minus, solution)) return;
  const bool elastic = is_elastic(problem);
  if (!elastic) {
    previous_ = best_;
    previous_nv_ = problem.nv();
    return;
  }
  previous_nv_ = -1;
  const Islands& islands = contacts_.islands();
  find_elastic(problem, islands, elastic_);
  bounded_.assign(islands.count, 1);
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands, bounded_, solution.impulse);
  first_impulse_ = solution.impulse;
  solve(problem, restitution_.v(), solution);
  // An island without restitution has its answer: what gives way would be pushed a second time.
  for (std::size_t i = 0; i < first_impulse_.size(); ++i)
    solution.impulse[i] = first_impulse_[i] + (elastic_[islands.of_contact[i / 3]] ? solution.impulse[i] : 0);
}

// One phase (restitution has two), from v0.
bool Soft::solve(const ContactProblem& problem, const std::vector<double>& v0, ContactSolution& solution) {
  v0_ = v0;
  contact_velocity(problem, v0_, u_minus_);
  contacts_.begin(u_minus_, options_.touching);
  best_.assign(u_minus_.size(), 0.0);
  start(problem);
  const Status ending = descend(problem, solution);
  solution.impulse = best_;
  if (ending == Status::ok) return true;
  solution.fail(ending, ending == Status::singular ? "a Newton system could not be factored"
                        : ending == Status::not_finite
                            ? "overflow in Newton's method"
                            : "Newton's method came to a stand before the impulses were optimal");
  return false;
}

void Soft::velocity_at(const ContactProblem& problem, const std::vector<double>& d, std::vector<double>& u) const {
  u.resize(u_minus_.size());
  multiply(problem.J, problem.M, d, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += u_minus_[i];
}

// M^-1 J^T r, and u after it.
void Soft::change_after(const ContactProblem& problem, const std::vector<double>& r) {
  d_plus_.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, r, d_plus_);
  factor_.solve_in_place(d_plus_);
  velocity_at(problem, d_plus_, u_plus_);
}

bool Soft::begin(const ContactProblem& problem, ContactSolution& solution) {
  if (!weigh(problem, factor_, weight_, solution)) return false;
  contacts_.describe(problem, factor_, weight_, options_.softness);
  system_.prepare(problem.M, problem.J, options_.least_block);
  return true;
}

// J, of (1); leaves u and r at v0 + d behind.
double Soft::cost(const ContactProblem& problem, const std::vector<double>& d) {
  velocity_at(problem, d, u_);
  return contacts_.impulses(u_, r_) + 0.5 * quadratic_form(problem.M, d);
}

// d_, and u_ and r_ with it.
void Soft::start(const ContactProblem& problem) {
  d_.assign(problem.nv(), 0.0);
  const double nothing = cost(problem, d_);
  if (!options_.warm_start || previous_nv_ != problem.nv() || previous_.size() != u_minus_.size()) return;
  change_after(problem, previous_);
  if (!(cost(problem, d_plus_) < nothing)) {
    cost(problem, d_);
    return;
  }
  d_ = d_plus_;
  if (options_.warm_starts) ++*options_.warm_starts;
}

// What r_ is worth in the cones, with the velocities that it itself gives.
double Soft::look(const ContactProblem& problem) {
  given_ = r_;
  contacts_.project(given_);
  change_after(problem, given_);
  return contacts_.residual(given_, u_plus_, u_minus_);
}

Status Soft::descend(const ContactProblem& problem, ContactSolution& solution) {
  double least = HUGE_VAL, residual = look(problem);
  for (int no_better = 0, k = 0; k < options_.iteration_limit; ++k, ++solution.iterations) {
    poll_stop();
    no_better = residual <= 0.5 * least ? 0 : no_better + 1;
    if (residual < least) {
      least = residual;
      best_ = given_;
    }
    if (least <= options_.tolerance) {
      if (k > 0 && refine(problem) < least) best_ = given_;
      break;
    }
    const int enough = least <= options_.accepted ? options_.stalled - 1 : options_.stalled;
    if (no_better >= enough && (rounding_is_left(problem, best_) || rounding_is_left(problem, given_))) break;
    if (no_better >= options_.lost) contacts_.impulses(u_, r_);
    if (!find_step(problem)) return all_finite(G_) ? Status::singular : Status::not_finite;
    d_was_ = d_;
    r_was_ = r_;
    take_step(problem, 1);
    residual = look(problem);
    if (residual <= options_.whole * least) continue;
    d_ = d_was_;
    r_ = r_was_;
    velocity_at(problem, d_, u_);
    double length = length_of_step(problem);
    if (length == 0) {  // the impulses have gone another way than the velocities
      contacts_.impulses(u_, r_);
      if (!find_step(problem)) return all_finite(G_) ? Status::singular : Status::not_finite;
      length = length_of_step(problem);
    }
    if (length == 0) break;
    take_step(problem, length);
    residual = look(problem);
  }
  if (!std::isfinite(least)) return Status::not_finite;
  if (least > options_.accepted) least = beside_others(problem, best_);
  solution.claimed_residual = std::max(solution.claimed_residual, least);
  return least <= options_.accepted ? Status::ok : Status::nonconverged;
}

// One more step, with the factor of the last; returns the residual. Of stiff contacts -R^-1 u keeps few digits.
double Soft::refine(const ContactProblem& problem) {
  linearise();
  find_direction(problem);
  take_step(problem, 1);
  return look(problem);
}

// Are these impulses an answer but for rounding? Then they are the best.
bool Soft::rounding_is_left(const ContactProblem& problem, const std::vector<double>& r) {
  if (!(beside_others(problem, r) <= options_.accepted)) return false;
  if (&r != &best_) best_ = r;
  return true;
}

void Soft::take_step(const ContactProblem& problem, double length) {
  for (int i = 0; i < problem.nv(); ++i) d_[i] += length * dv_[i];
  velocity_at(problem, d_, u_);
  if (length < options_.astray) {
    contacts_.impulses(u_, r_);
    return;
  }
  for (std::size_t i = 0; i < r_.size(); ++i) r_[i] += length * dr_[i];
}

// What impulses are worth beside all that moves, and beside what the last bits of the data leave open: light contacts
// next to heavy ones, slow ones next to fast ones.
double Soft::beside_others(const ContactProblem& problem, const std::vector<double>& r) {
  change_after(problem, r);
  open_.resize(problem.nc());
  sizes_of_terms(problem.J, problem.M, v0_, problem.offset, open_);
  for (double& x : open_) x *= options_.rounding;
  return contacts_.residual(r, u_plus_, u_minus_, open_);
}

// M (d + dv) = J^T (r + dr) and r + dr = a - G J dv.
bool Soft::find_step(const ContactProblem& problem) {
  linearise();
  if (!system_.factor(G_, {})) return false;
  find_direction(problem);
  return true;
}

void Soft::linearise() { contacts_.linearise(u_, r_, G_, a_); }

// By the factor at hand.
void Soft::find_direction(const ContactProblem& problem) {
  dv_.resize(problem.nv());
  multiply(problem.M, d_, dv_);
  for (double& x : dv_) x = -x;
  multiply_transposed_add(problem.J, problem.M, a_, dv_);
  system_.solve_in_place(dv_);
  du_.resize(u_.size());
  multiply(problem.J, problem.M, dv_, du_);
  dr_.resize(r_.size());
  for (std::size_t i = 0; i < r_.size(); ++i) dr_[i] = a_[i] - r_[i];
  for (int c = 0; c < problem.nc(); ++c)
    Eigen::Map<Eigen::Vector3d>(&dr_[3 * c]).noalias() -=
        Eigen::Map<const Eigen::Matrix3d>(&G_[9 * c]) * Eigen::Map<const Eigen::Vector3d>(&du_[3 * c]);
}

// Where (1) is near its least along the step; 0 where the step does not go down.
double Soft::length_of_step(const ContactProblem& problem) {
  momentum_.resize(problem.nv());
  multiply(problem.M, dv_, momentum_);
  double square = 0, linear = 0;  // of the quadratic part
  for (int i = 0; i < problem.nv(); ++i) {
    square += dv_[i] * momentum_[i];
    linear += d_[i] * momentum_[i];
  }
  return convex_search(options_.search, [&](double alpha) {
    Along at = contacts_.along(u_, du_, alpha);
    at.slope += linear + alpha * square;
    at.curvature += square;
    return at;
  });
}

Softness softness_of(const MethodOptions& options) {
  return {options.variant == "mujoco" ? Softness::Rule::mujoco : Softness::Rule::sap,
          options.beta,
          options.sigma,
          options.compliance,
          options.impedance,
          options.impratio};
}

ContactMethod make(const MethodOptions& options) {
  SoftOptions soft;
  soft.softness = softness_of(options);
  soft.warm_start = options.warm_start;
  soft.warm_starts = options.warm_starts;
  const ContactMethod solve = [method = std::make_shared<Soft>(soft)](const ContactProblem& problem,
                                                                      ContactSolution& solution) {
    (*method)(problem, solution);
  };
  return options.warm_start ? reuse_same_event(solve, options.warm_starts) : solve;
}

OptionRow option(std::string_view flag, std::string_view variant, std::string_view unit, std::string_view standard,
                 std::string_view summary, double MethodOptions::*field, std::string_view expected) {
  return {.flag = flag,
          .unit = unit,
          .default_value = standard,
          .summary = summary,
          .field = field,
          .type = "NUMBER",
          .short_name = flag,
          .expected = expected,
          .variant = variant};
}

std::vector<OptionRow> options() {
  std::vector<OptionRow> rows{
      option("sigma", "sap", "-", "1e-3", "R_t = sigma w: how much contacts give way along the surface",
             &MethodOptions::sigma, "a positive number, as in --sigma 1e-3"),
      option("beta", "sap", "-", "1", "R_n = beta^2 w / (4 pi^2): how much contacts give way along the normal",
             &MethodOptions::beta, "a positive number, as in --beta 1"),
      option("compliance", "sap", "1/kg", "0", "R_n is at least this: 1 / (h (h + tau) k) of contacts of stiffness k",
             &MethodOptions::compliance, "0 or a positive number of 1/kg, as in --compliance 0.1"),
      option("impedance", "mujoco", "-", "0.9", "d, R_n = (1 - d) / d W_nn", &MethodOptions::impedance,
             "a number between 1e-4 and 0.9999, as in --impedance 0.9"),
      option("impratio", "mujoco", "-", "1", "R_t = R_n / impratio", &MethodOptions::impratio,
             "a positive number, as in --impratio 10"),
      warm_start_option("start from the velocities that the previous event's impulses give")};
  for (OptionRow& row : rows) {
    row.positive = row.flag != "compliance" && row.flag != "impedance";
    row.of_law = !row.between_events;
  }
  OptionRow& impedance = rows[3];
  impedance.least = 1e-4;
  impedance.most = 0.9999;
  return rows;
}

}  // namespace

MethodRow soft_row() {
  return {.name = "soft",
          .summary =
              "contacts that give way: regularised impulses in the friction cones, an unconstrained convex "
              "program in velocities",
          .source = "A. Castro, F. Permenter, X. Han, IEEE T-RO 39, 2023 (sap); E. Todorov, ICRA 2014 (mujoco)",
          .law = soft_law(),
          .solvers = {},
          .variants = {"sap", "mujoco"},
          .options = options(),
          .make = make,
          .terms = [](const MethodOptions& asked) -> Witness { return SoftWitness{softness_of(asked)}; }};
}

}  // namespace cb
