// Exact Coulomb friction: Signorini's condition and Coulomb's law as they are, no polygon, no convex relaxation.
//
// Problem (nc contacts, nv velocities; contact/problem.h), for each island of bodies joined by contacts:
//   v = v- + M^-1 J^T r,   u = J v + w,   u~ = u + mu |u_t| e_n
//   r in K = { |r_t| <= mu r_n },   u~ in K*,   r.u~ = 0                                                  (1)
// Impulses in N s, velocities in m/s; limits of joints are scalar rows, mu = 0. The solvers are those of the table of
// lib/ncp; an island is handed to one as matrices and cones. What answers are worth is the referee's to say.
//
// Source: G. De Saxce, Z.-Q. Feng, The bipotential method, Math. Comput. Modelling 28 (1998), for (1) in this form; the
// survey of V. Acary, M. Bremond and O. Huber (2018) for its solvers.
//
// Restitution (Poisson): normal impulses of the first phase times 1 + theta e; an island on which a contact still
// approaches has a second phase, (1) again from the velocity reached. theta <= 1 is the largest by which no island
// gains energy (restitution.h). Newton's u_n+ = -e u_n- would be one phase, and a law that r alone proves; but with
// friction or coupled contacts it gains energy (T. R. Kane, 1984) where nothing could scale it, and such an answer
// cannot be `ok`.
//
// With --warm-start the impulses of the previous event are where the solver begins.
// Fails as the solver does; its ending and reason are passed on, with the best impulses it met. What did not come to
// the tolerance and is off by 1e-6 at most is `inaccurate`: a run goes on with it, and says so.

#include <algorithm>
#include <cmath>
#include <memory>

#include "methods/convex_island.h"
#include "methods/registry.h"
#include "methods/restitution.h"
#include "methods/same_event.h"
#include "methods/weigh.h"
#include "ncp/ncp.h"

namespace cb {

namespace {

/// -: normal velocity, over its island's fastest both in m/s and in sqrt(J), below which a contact approaches by
/// rounding alone: what is light and fast hides nothing that is heavy.
constexpr double approaching = 1e-12;
/// -: natural residual up to which an answer that is not good is one to go on with.
constexpr double usable = 1e-6;

Status status_of(const NcpSolution& answer) {
  if (answer.status == NcpStatus::nonconverged && answer.residual <= usable) return Status::inaccurate;
  switch (answer.status) {
    case NcpStatus::solved:
      return Status::ok;
    case NcpStatus::inaccurate:
      return Status::inaccurate;
    case NcpStatus::nonconverged:
      return Status::nonconverged;
    case NcpStatus::singular:
      return Status::singular;
    case NcpStatus::not_finite:
      return Status::not_finite;
  }
  return Status::nonconverged;
}

// Impulses of one contact.
void copy(const std::vector<double>& from, std::size_t contact, std::vector<double>& to, std::size_t there) {
  for (std::size_t i = 0; i < 3; ++i) to[3 * there + i] = from[3 * contact + i];  // std::copy_n is a call
}

class Coulomb {
 public:
  explicit Coulomb(const MethodOptions& options);
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  void solve(const ContactProblem& problem, const std::vector<double>& v0, const std::vector<char>& asked,
             bool may_start, ContactSolution& solution);
  bool approaches_again();
  bool pulls_by_rounding(double weight, const double* r, const double* u) const;
  NcpProblem island(const ContactProblem& problem, const std::vector<double>& v0, int g);

  bool warm_;
  std::shared_ptr<Counter> warm_starts_;
  std::shared_ptr<AnsweredBy> answered_by_;
  double tolerance_ = NcpOptions().tolerance;  // -: natural residual that solvers are asked for
  NcpSolver solver_;
  std::string solver_failure_;

  BlockCholesky factor_;
  Islands islands_;
  Groups contacts_of_, blocks_of_;  // per island
  std::vector<double> weight_;
  std::vector<int> block_in_island_;
  ConvexIsland island_;
  NcpSolution answer_;
  std::vector<double> previous_, start_;  // 3 nc, N s: of the event before; of the island's

  Restitution restitution_;
  std::vector<char> all_, elastic_, again_;  // per island
  std::vector<double> first_impulse_;
  std::vector<double> fastest_, weighted_;  // per island: m/s, sqrt(J)
};

Coulomb::Coulomb(const MethodOptions& options)
    : warm_(options.warm_start), warm_starts_(options.warm_starts), answered_by_(options.answered_by) {
  const std::string_view name = options.solver.empty() ? ncp_solvers().front().name : std::string_view(options.solver);
  const NcpSolverRow* row = find_ncp_solver(name);
  if (row == nullptr) {
    solver_failure_ = "no solver named " + std::string(name);
    return;
  }
  NcpOptions asked;
  asked.tolerance = tolerance_;
  asked.sweeps = options.sweeps;
  asked.relaxation = options.relaxation;
  solver_ = row->make(asked);
}

void Coulomb::operator()(const ContactProblem& problem, ContactSolution& solution) {
  const int nc = problem.nc();
  solution.clear();
  solution.as<NoWitness>();
  solution.impulse.assign(3 * nc, 0.0);
  if (!solver_) {
    solution.status = Status::unavailable;
    solution.reason = solver_failure_;
    return;
  }
  if (!weigh(problem, factor_, weight_, solution) || nc == 0) return;
  find_islands(problem, islands_);
  contacts_of_.assign(islands_.of_contact, islands_.count);
  blocks_of_.assign(islands_.of_block, islands_.count);
  const bool elastic = find_elastic(problem, islands_, elastic_);
  all_.assign(islands_.count, 1);
  solve(problem, problem.v_minus, all_, warm_ && !elastic, solution);
  if (!elastic) return;

  previous_.clear();  // two phases are no start, and what was before them is of another event
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands_, all_, solution.impulse);
  if (!approaches_again()) return;
  first_impulse_ = solution.impulse;
  solve(problem, restitution_.v(), again_, false, solution);
  for (int i = 0; i < 3 * nc; ++i)
    if (again_[islands_.of_contact[i / 3]]) solution.impulse[i] += first_impulse_[i];
}

// again_: islands with restitution on which a contact still approaches. Is there any?
bool Coulomb::approaches_again() {
  fastest_.assign(islands_.count, 0.0);
  weighted_.assign(islands_.count, 0.0);
  for (std::size_t c = 0; c < weight_.size(); ++c) {
    const int g = islands_.of_contact[c];
    const double u_n = std::abs(restitution_.u()[3 * c]);
    fastest_[g] = std::max(fastest_[g], u_n);
    weighted_[g] = std::max(weighted_[g], u_n / std::sqrt(weight_[c]));
  }
  again_.assign(islands_.count, 0);
  bool any = false;
  for (std::size_t c = 0; c < weight_.size(); ++c) {
    const int g = islands_.of_contact[c];
    const double fastest = std::min(fastest_[g], std::sqrt(weight_[c]) * weighted_[g]);
    if (!elastic_[g] || !(-restitution_.u()[3 * c] > approaching * fastest)) continue;
    again_[g] = 1;
    any = true;
  }
  return any;
}

// Does a contact pull by no more than what an answer is solved to? It slips, and would be driven. One that sticks by
// large mu may have friction beside a normal impulse that is less than that: it keeps it.
bool Coulomb::pulls_by_rounding(double weight, const double* r, const double* u) const {
  return r[0] < 0 && weight * std::hypot(r[0], r[1], r[2]) <= tolerance_ * std::hypot(u[0], u[1], u[2]);
}

// One phase (restitution has two), from v0, of the islands that are asked for, one by one.
void Coulomb::solve(const ContactProblem& problem, const std::vector<double>& v0, const std::vector<char>& asked,
                    bool may_start, ContactSolution& solution) {
  const bool start = may_start && previous_.size() == solution.impulse.size();
  bool accepted = start;
  for (int g = 0; g < islands_.count; ++g) {
    if (!asked[g]) continue;
    NcpProblem part = island(problem, v0, g);
    const std::size_t nc = part.mu.size();
    if (start) {
      start_.resize(3 * nc);
      for (std::size_t k = 0; k < nc; ++k) copy(previous_, contacts_of_[g][k], start_, k);
      part.start = start_;
    }
    solver_(part, answer_);
    if (start && answer_.status > NcpStatus::inaccurate) {  // it was a bad one
      accepted = false;
      solution.iterations += answer_.iterations;
      part.start = {};
      solver_(part, answer_);
    }
    if (answered_by_ && !answer_.who.empty()) answered_by_->add(answer_.who);
    solution.size += static_cast<int>(3 * nc);
    solution.iterations += answer_.iterations;
    solution.claimed_residual = std::max(solution.claimed_residual, answer_.residual);
    for (std::size_t k = 0; k < nc; ++k) {
      double* r = &answer_.r[3 * k];
      if (answer_.status == NcpStatus::solved && pulls_by_rounding(part.weight[k], r, &answer_.u[3 * k]))
        std::fill_n(r, 3, 0.0);
      copy(answer_.r, k, solution.impulse, contacts_of_[g][k]);
    }
    const Status status = status_of(answer_);
    if (status <= solution.status) continue;
    solution.status = status;
    solution.reason = answer_.reason;
  }
  if (accepted && warm_starts_) ++*warm_starts_;
  if (may_start) previous_ = solution.impulse;
}

// Taken out where there are others. Views of the problem, or of island_.
NcpProblem Coulomb::island(const ContactProblem& problem, const std::vector<double>& v0, int g) {
  if (blocks_of_[g].size() == static_cast<std::size_t>(problem.M.blocks()))
    return {&problem.M, &factor_, &problem.J, v0, problem.offset, problem.mu, weight_, {}};
  extract(problem, v0, weight_, contacts_of_[g], blocks_of_[g], block_in_island_, island_);
  return {&island_.M, &island_.factor, &island_.J, island_.v0, island_.offset, island_.mu, island_.weight, {}};
}

}  // namespace

MethodRow coulomb_row() {
  MethodRow row{"coulomb",
                "exact Coulomb friction: no polygon, no convex relaxation",
                "G. De Saxce, Z.-Q. Feng, Math. Comput. Modelling 28 (1998)",
                coulomb_law(),
                {},
                {},
                {{.flag = "sweeps",
                  .unit = "-",
                  .default_value = "until it is done",
                  .summary = "sweeps after which nsgs ends as it is, as games do",
                  .field = &MethodOptions::sweeps,
                  .type = "COUNT",
                  .short_name = "sweeps",
                  .expected = "a whole number of sweeps, as in --sweeps 10"},
                 {.flag = "relaxation",
                  .unit = "-",
                  .default_value = "1",
                  .summary = "over-relaxation of nsgs, in (0, 2)",
                  .field = &MethodOptions::relaxation,
                  .type = "OMEGA",
                  .short_name = "relax",
                  .expected = "a factor more than 0 and less than 2, as in --relaxation 1.3",
                  .most = std::nextafter(2.0, 0.0),
                  .positive = true},
                 warm_start_option("begin with the previous event's impulses")},
                [](const MethodOptions& options) -> ContactMethod {
                  auto method = std::make_shared<Coulomb>(options);
                  const auto solve = [method](const ContactProblem& problem, ContactSolution& solution) {
                    (*method)(problem, solution);
                  };
                  return options.warm_start ? reuse_same_event(solve, options.warm_starts) : ContactMethod(solve);
                }};
  for (const NcpSolverRow& solver : ncp_solvers())
    row.solvers.push_back({solver.name, solver.summary, solver.source, {}});
  return row;
}

}  // namespace cb
