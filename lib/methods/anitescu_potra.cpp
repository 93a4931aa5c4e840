// Anitescu and Potra's time-stepping contact model as a linear complementarity problem.
//
// Problem (nc contacts, k directions d_i = cos(2 pi i / k) t1 + sin(2 pi i / k) t2 each, e = 0):
//   0 <= c_n  _|_  N v+ + w_n          >= 0      c_n: nc, N s
//   0 <= c_t  _|_  D v+ + w_t + E lam  >= 0      c_t: k nc, N s, contact by contact
//   0 <= lam  _|_  mu c_n - E^T c_t    >= 0      lam: nc, m/s
//   v+ = v- + M^-1 (N^T c_n + D^T c_t)
// (k + 2) nc unknowns in the order c_n, c_t, lam.
//
// Source: M. Anitescu, F. A. Potra, Formulating dynamic multi-rigid-body contact problems with friction as solvable
// linear complementarity problems, Nonlinear Dynamics 14 (1997): the one-step LCP, and for e > 0 their compression and
// decompression phases with Poisson's hypothesis: the first LCP gives c (compression); then theta e c_n acts at each
// contact, and a second LCP of the same matrix, its friction bounded by mu (theta e c_n + c_n'), keeps contacts from
// approaching again.
//
// Differences from the source:
//  1. Impulses and velocities of one event only: forces have acted before (docs/architecture.md, "The path of a step").
//  2. No joint constraints: joints are inside M.
//  3. Small problems eliminate v+ (matrix of order (k + 2) nc from the Delassus matrix); larger ones keep v+ - v- as
//     free unknowns, so that what is sparse stays sparse. dense_limit decides, by the number of unknowns.
//  4. A contact with mu = 0 has no use for its c_t and lam: where told so (MethodOptions::idle_friction) they are no
//     unknowns, and z gets c_t = 0 and the lam that its slip asks for. Not with e > 0 or regularisation.
//  5. In the source theta = 1. Islands that gain energy by that are solved once more with the largest theta by which
//     they cannot (restitution.h).
//  6. Optional regularisation: E is added to the diagonal of all rows of the LCP, in the unit of each row.
//
// With --warm-start, where the previous event left everything at rest, its impulses are tried first: if they hold the
// present event at rest and lie in the polygons, they are an answer with lam = 0. Then the active set of the previous
// answer is, and its answer taken where it solves the present problem to rounding; else the LCP solver starts cold.
//
// Fails as the LCP solver fails; its ending and reason are passed on. With e > 0, z holds both phases, one after the
// other, 2 (k + 2) nc numbers.

#include <array>
#include <cmath>
#include <memory>

#include "lcp/lcp.h"
#include "methods/active_set_start.h"
#include "methods/lcp_status.h"
#include "methods/polygon_lcp.h"
#include "methods/registry.h"
#include "methods/resting_impulse.h"
#include "methods/restitution.h"
#include "methods/same_event.h"

namespace cb {

namespace {

/// -: of what the event is about; impulses kept from a resting one may leave their polygon by it. Larger: slip that a
/// cold start would see.
constexpr double rounding = 1e-13;
/// -: gain of energy over a fourth of |r.u-| (at most the island's energy, where it gains less) from which restitution
/// is scaled; a tenth of what the referee accepts.
constexpr double gain_rounding = 1e-10;

class AnitescuPotra {
 public:
  explicit AnitescuPotra(const MethodOptions& options);
  void solve(const ContactProblem& problem, ContactSolution& solution);

 private:
  bool start_at_rest(const ContactProblem& problem, ContactSolution& solution);
  bool solve_phase(const ContactProblem& problem, ContactSolution& solution);
  void append_answer(std::vector<double>& z) const;
  void bound_idle_slip(const ContactProblem& problem, ContactSolution& solution);
  double split(double t1, double t2, double* part) const;
  void add_impulses(ContactSolution& solution) const;
  void decompress(const ContactProblem& problem, ContactSolution& solution);
  void give_back(const ContactProblem& problem, ContactSolution& solution);
  bool bound_gains(const ContactProblem& problem, const ContactSolution& solution);

  double regularise_;
  bool idle_friction_;
  LcpOptions lcp_options_;
  LcpSolver solver_;
  std::string solver_failure_;

  int nc_ = 0;
  BlockCholesky factor_;
  PolygonLcp form_;
  LcpSolution answer_;
  std::vector<double> u_, v_, before_;
  std::vector<double> restored_;  // nc, N s: mu theta e c_n

  // Decompression.
  Islands islands_;
  Restitution restitution_;
  ContactSolution compression_;                // what there is without it
  Eigen::VectorXd sizes_;                      // and form_.sizes() then
  std::vector<char> bounded_;                  // per island: would it gain energy by all of e c_n?
  std::vector<std::array<double, 2>> gained_;  // per island, J: r.(u+ + u-)/2, r.u-

  bool warm_ = false;
  bool grouped_ = false;  // are the pairs of the present event grouped?
  std::shared_ptr<Counter> warm_starts_;
  RestingImpulse resting_{3};
  double size_ = 0;  // sqrt(J), of the event
  ActiveSetStart active_set_;
};

AnitescuPotra::AnitescuPotra(const MethodOptions& options)
    : regularise_(options.regularise),
      idle_friction_(options.idle_friction),
      form_(FrictionPolygon(options.k), options.regularise),
      warm_(options.warm_start),
      warm_starts_(options.warm_starts) {
  const std::string_view solver = options.solver.empty() ? std::string_view("lemke") : options.solver;
  const LcpSolverRow* row = find_lcp_solver(solver);
  if (row == nullptr) {
    solver_failure_ = "no LCP solver named " + std::string(solver);
  } else if (!row->unavailable.empty()) {
    solver_failure_ = std::string(row->unavailable);
  } else {
    solver_ = row->make(lcp_options_);
  }
}

// The impulses that kept the previous event at rest, split over the directions beside them: an answer where they lie in
// the polygons. Events with restitution or regularisation have other equations.
bool AnitescuPotra::start_at_rest(const ContactProblem& problem, ContactSolution& solution) {
  contact_velocity(problem, problem.v_minus, u_);
  contact_weights(problem, factor_, form_.weight());
  const std::vector<double>& weight = form_.weight();
  double square = 0;
  for (int c = 0; c < nc_; ++c)
    for (int i = 0; i < 3; ++i) square += u_[3 * c + i] * u_[3 * c + i] / weight[c];
  size_ = std::sqrt(square);
  const ContactView event{problem.M, factor_, problem.J, problem.v_minus, problem.offset, problem.mu, weight};
  if (!resting_.find(event, size_)) return false;
  const std::vector<double>&r = resting_.r(), &u = resting_.u();
  const int k = form_.polygon().k();
  std::vector<double>& z = solution.as<PolygonWitness>().z;
  z.assign((k + 2) * nc_, 0.0);
  double violation = 0;  // -, of the cones: answers of pivoting methods lie on their edges
  for (int c = 0; c < nc_; ++c) {
    const double normal = std::max(0.0, r[3 * c]);
    const double friction = split(r[3 * c + 1], r[3 * c + 2], &z[nc_ + k * c]);
    violation =
        std::max(violation, std::max(-r[3 * c], friction - problem.mu[c] * normal) * std::sqrt(weight[c]) / size_);
    if (!(violation <= rounding)) return false;
    z[c] = normal;
    if (problem.mu[c] == 0) z[nc_ + k * nc_ + c] = form_.polygon().least_slip_bound(&u[3 * c]);
  }
  solution.impulse = r;
  for (int c = 0; c < nc_; ++c) solution.impulse[3 * c] = z[c];
  solution.claimed_residual = std::max(violation, resting_.residual());
  if (warm_starts_) ++*warm_starts_;
  return true;
}

// An impulse along the plane as those along the two directions beside it; returns their sum.
double AnitescuPotra::split(double t1, double t2, double* part) const {
  if (t1 == 0 && t2 == 0) return 0;
  const int k = form_.polygon().k();
  const std::vector<double>&cosine = form_.polygon().cosine, &sine = form_.polygon().sine;
  int first = 0;
  const auto is_left_of = [&](int i) { return cosine[i % k] * t2 >= sine[i % k] * t1; };
  while (first < k - 1 && (!is_left_of(first) || is_left_of(first + 1))) ++first;
  const int second = (first + 1) % k;
  const double area = cosine[first] * sine[second] - sine[first] * cosine[second];
  part[first] = std::max(0.0, (t1 * sine[second] - t2 * cosine[second]) / area);
  part[second] = std::max(0.0, (cosine[first] * t2 - sine[first] * t1) / area);
  return part[first] + part[second];
}

bool AnitescuPotra::solve_phase(const ContactProblem& problem, ContactSolution& solution) {
  if (!grouped_) form_.group_by_contact(problem, factor_, u_);
  const bool warm = warm_ && active_set_.find(form_.lcp(), form_.at(), u_, answer_);
  if (warm && warm_starts_) ++*warm_starts_;
  if (!warm) solver_(form_.lcp(), answer_);
  solution.iterations += answer_.pivots;
  solution.claimed_residual = std::max(solution.claimed_residual, answer_.residual);
  const Status status = status_of(answer_.status);
  if (status > solution.status) {
    solution.status = status;
    solution.reason = answer_.reason;
  }
  const bool usable = answer_.z.size() == form_.lcp().n() && answer_.z.allFinite();
  if (usable) append_answer(solution.as<PolygonWitness>().z);
  return usable;
}

// In the places that all contacts would have.
void AnitescuPotra::append_answer(std::vector<double>& z) const {
  const PolygonUnknowns at = form_.at();
  const std::size_t first = z.size(), nc = nc_, k = at.k;
  z.resize(first + (k + 2) * nc, 0.0);
  const double* answer = answer_.z.data();
  std::copy_n(answer, nc, &z[first]);
  for (int f = 0; f < at.rough_count(); ++f) {
    std::copy_n(answer + at.first_direction(f), k, &z[first + nc + k * at.rough[f]]);
    z[first + nc + k * nc + at.rough[f]] = answer[at.slip_bound(f)];
  }
}

// lam of the contacts without unknowns of friction.
void AnitescuPotra::bound_idle_slip(const ContactProblem& problem, ContactSolution& solution) {
  const PolygonUnknowns at = form_.at();
  if (at.rough_count() == nc_) return;
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_);
  std::vector<double>& z = solution.as<PolygonWitness>().z;
  for (int c = 0; c < nc_; ++c)
    if (problem.mu[c] == 0) z[(at.k + 1) * nc_ + c] = form_.polygon().least_slip_bound(&u_[3 * c]);
}

void AnitescuPotra::add_impulses(ContactSolution& solution) const {
  const PolygonUnknowns at = form_.at();
  const double* z = answer_.z.data();
  for (int c = 0; c < nc_; ++c) solution.impulse[3 * c] += z[c];
  for (int f = 0; f < at.rough_count(); ++f) {
    double t1 = 0, t2 = 0;
    for (int a = 0; a < at.k; ++a) {
      t1 += at.cosine[a] * z[at.first_direction(f) + a];
      t2 += at.sine[a] * z[at.first_direction(f) + a];
    }
    solution.impulse[3 * at.rough[f] + 1] += t1;
    solution.impulse[3 * at.rough[f] + 2] += t2;
  }
}

void AnitescuPotra::solve(const ContactProblem& problem, ContactSolution& solution) {
  solution.clear();
  nc_ = problem.nc();
  PolygonWitness& witness = solution.as<PolygonWitness>();
  witness.k = form_.polygon().k();
  witness.regularisation = regularise_;
  bool elastic = false;
  for (const double e : problem.restitution) elastic = elastic || e != 0;
  form_.begin(problem, idle_friction_ || elastic || regularise_ != 0);
  solution.size = form_.at().count();
  solution.impulse.assign(3 * nc_, 0.0);
  if (nc_ == 0) return;
  if (!solver_) {
    solution.status = Status::unavailable;
    solution.reason = solver_failure_;
    return;
  }
  if (!factor_.factor(problem.M)) {
    solution.status = Status::singular;
    solution.reason = "the mass matrix is not positive definite";
    return;
  }

  const bool may_rest = warm_ && !elastic && regularise_ == 0;
  if (may_rest && start_at_rest(problem, solution)) return;
  witness.z.clear();

  if (solution.size <= lcp_options_.dense_limit)
    form_.build_dense(problem, factor_);
  else
    form_.build_expanded(problem, factor_);

  // Compression (all of it where e = 0).
  restored_.assign(nc_, 0.0);
  contact_velocity(problem, problem.v_minus, u_);
  form_.set_load(problem, u_, restored_);
  grouped_ = elastic;  // beside what was before the event, in the second phase too
  if (elastic) form_.group_by_contact(problem, factor_, u_);
  if (!solve_phase(problem, solution)) {
    active_set_.forget();
    resting_.forget();
    return;
  }
  add_impulses(solution);
  if (warm_) active_set_.remember(problem, factor_, form_.at(), u_, solution.impulse, answer_);
  bound_idle_slip(problem, solution);  // takes u_ for the velocities after the event
  if (may_rest)
    resting_.remember({problem.M, factor_, problem.J, problem.v_minus, problem.offset, problem.mu, form_.weight()},
                      solution.impulse, size_, true);
  else
    resting_.forget();
  if (elastic) decompress(problem, solution);
}

// All of e c_n is given back, and what would approach again is kept from it; where an island gains energy by that, so
// much that it cannot.
void AnitescuPotra::decompress(const ContactProblem& problem, ContactSolution& solution) {
  find_islands(problem, islands_);
  bounded_.assign(islands_.count, 0);
  compression_ = solution;
  sizes_ = form_.sizes();
  do {
    compression_.iterations = solution.iterations;  // of second phases that are given up, too
    solution = compression_;
    form_.sizes() = sizes_;
    give_back(problem, solution);
    if (!solve_phase(problem, solution)) return;
    add_impulses(solution);
  } while (bound_gains(problem, solution));
}

void AnitescuPotra::give_back(const ContactProblem& problem, ContactSolution& solution) {
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands_, bounded_, solution.impulse);
  for (int c = 0; c < nc_; ++c) {
    const double* r = &solution.impulse[3 * c];
    double& about = form_.sizes()[c];
    about = std::max(about, std::sqrt(form_.weight()[c] * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2])));
    restored_[c] = problem.mu[c] * restitution_.given()[c];
  }
  contact_velocity(problem, restitution_.v(), u_);
  form_.set_load(problem, u_, restored_);
}

// Does an island that is not bounded yet gain energy, as the referee measures it? It is from now on.
bool AnitescuPotra::bound_gains(const ContactProblem& problem, const ContactSolution& solution) {
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_);
  contact_velocity(problem, problem.v_minus, before_);
  gained_.assign(islands_.count, {0, 0});
  for (int i = 0; i < 3 * nc_; ++i) {
    auto& [gain, before] = gained_[islands_.of_contact[i / 3]];
    gain += solution.impulse[i] * (u_[i] + before_[i]) / 2;
    before += solution.impulse[i] * before_[i];
  }
  bool again = false;
  for (int g = 0; g < islands_.count; ++g) {
    const auto& [gain, before] = gained_[g];
    if (bounded_[g] || !(gain > gain_rounding * std::abs(before) / 4)) continue;
    bounded_[g] = 1;
    again = true;
  }
  return again;
}

}  // namespace

MethodRow anitescu_potra_row() {
  MethodRow row{"ap",
                "Anitescu and Potra: friction polygon, linear complementarity problem",
                "Anitescu and Potra, Nonlinear Dynamics 14 (1997)",
                anitescu_potra_law(),
                {},
                {},
                {{.flag = "k",
                  .unit = "-",
                  .default_value = "4",
                  .summary = "edges of the friction polygon, even, at least 4",
                  .field = &MethodOptions::k,
                  .type = "EDGES",
                  .short_name = "k",
                  .expected = "an even number of edges, at least 4, as in --k 8",
                  .least = 4,
                  .multiple_of = 2,
                  .always_named = true,
                  .of_scenario = true,
                  .of_law = true},
                 {.flag = "regularise",
                  .unit = "unit of each row",
                  .default_value = "0",
                  .summary = "added to the diagonal of the LCP",
                  .field = &MethodOptions::regularise,
                  .type = "E",
                  .short_name = "reg",
                  .expected = "a number of at least 0"},
                 warm_start_option("try the active set of the previous event first")},
                [](const MethodOptions& options) -> ContactMethod {
                  auto method = std::make_shared<AnitescuPotra>(options);
                  const auto solve = [method](const ContactProblem& problem, ContactSolution& solution) {
                    method->solve(problem, solution);
                  };
                  return options.warm_start ? reuse_same_event(solve, options.warm_starts) : ContactMethod(solve);
                },
                [](const MethodOptions& options) -> Witness {
                  return PolygonWitness{.k = options.k, .regularisation = options.regularise, .z = {}};
                }};
  for (const LcpSolverRow& solver : lcp_solvers())
    row.solvers.push_back({solver.name, solver.summary, solver.source, solver.unavailable});
  return row;
}

}  // namespace cb
