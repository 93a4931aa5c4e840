// Stronge's energetic restitution, integrated in impulse space (Mirtich).
//
// Problem (nc contacts, nv velocities; contact/problem.h). While a contact approaches, the fastest one suffers an
// impact of its own (stronge_impact.cpp; a resting contact is a sequence of such micro-impacts), until none has
// u_n < -tolerance.
//
// Source: B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, PhD thesis, Berkeley 1996, ch. 3.
// Differences: all approaching contacts of an event are taken in turn, the fastest first, and round-off is taken out of
// v before an end is believed.
//
// Fails: impact_limit or step_limit reached -> nonconverged with the impulses so far; NaN or infinity in the data or on
// the way -> not_finite, no impulse; M not positive definite -> singular, no impulse.

#include "methods/mirtich.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "linalg/finite.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using Eigen::Vector3d;

class Mirtich {
 public:
  explicit Mirtich(const MirtichOptions& options) : options_(options) {}

  void solve(const ContactProblem& problem, ContactSolution& solution) {
    solution.clear();
    const int nc = problem.nc();
    solution.size = 3 * nc;
    solution.impulse.assign(3 * nc, 0.0);
    WorkWitness& work = solution.as<WorkWitness>();
    const auto clear_work = [&] {
      for (auto* of : {&work.compression, &work.restitution, &work.friction}) of->assign(nc, 0.0);
    };
    clear_work();
    solution.status = state_.start(problem, options_.tolerances, solution.reason);
    if (solution.status != Status::ok) return;

    refresh_normal_velocities();
    const long limit = static_cast<long>(options_.impact_limit) * nc;
    bool fresh = true;
    int c = fastest_approach();
    while (c >= 0 && solution.iterations < limit) {
      poll_stop();
      ++solution.iterations;
      fresh = false;
      if (!impact(problem, c, solution)) break;
      c = fastest_approach();
      if (c < 0) {  // take round-off out of v before believing it
        state_.restart(solution.impulse);
        refresh_normal_velocities();
        fresh = true;
        c = fastest_approach();
      }
    }
    if (!fresh) state_.restart(solution.impulse);

    if (solution.status == Status::not_finite || !state_.finite() || !finite(work)) {
      solution.status = Status::not_finite;
      solution.reason = "the impulses grew beyond all bounds";
      solution.impulse.assign(3 * nc, 0.0);
      clear_work();
    } else if (solution.status == Status::ok && c >= 0) {
      solution.status = Status::nonconverged;
      solution.reason = "contacts still approach after " + std::to_string(solution.iterations) + " micro-impacts";
    }
    solution.claimed_residual = residual(problem, solution);
  }

 private:
  bool impact(const ContactProblem& problem, int c, ContactSolution& solution) {
    integrate_impact(state_.K(c), state_.velocity(c), problem.mu[c], problem.restitution[c], state_.slip_rounding(c),
                     state_.approach_before(c), options_.impact, impact_);
    if (impact_.status != Status::ok) {
      solution.status = impact_.status;
      if (impact_.status == Status::singular)
        solution.reason = "an impact without end: the contact's inertia is singular";
      else if (impact_.status == Status::nonconverged)
        solution.reason = "one impact took more steps than the limit";
      return false;
    }
    state_.apply(c, impact_.r);
    for (int i = 0; i < 3; ++i) solution.impulse[3 * c + i] += impact_.r[i];
    WorkWitness& work = solution.as<WorkWitness>();
    work.compression[c] += impact_.compression_work;
    work.restitution[c] += impact_.restitution_work;
    work.friction[c] += impact_.friction_work;
    for (int i : state_.neighbours(c)) normal_velocity_[i] = state_.normal_velocity(i);
    return true;
  }

  /// Works go as the square of velocities and overflow before them.
  static bool finite(const WorkWitness& work) {
    return all_finite(work.compression) && all_finite(work.restitution) && all_finite(work.friction);
  }

  void refresh_normal_velocities() {
    normal_velocity_.resize(state_.nc());
    for (int c = 0; c < state_.nc(); ++c) normal_velocity_[c] = state_.normal_velocity(c);
  }

  /// The contact with the least u_n of those that approach (in sqrt(J) where limits are on the island), or -1. The
  /// first of equals, up to round-off, so that the choice does not hang on the last bit.
  int fastest_approach() const {
    int fastest = -1;
    double least = 0;
    for (int c = 0; c < state_.nc(); ++c) {
      if (!(normal_velocity_[c] < -state_.approach_tolerance(c))) continue;
      const double u_n = normal_velocity_[c] * state_.measure_of(c);
      if (!(u_n < least)) continue;
      fastest = c;
      least = u_n * (1 + 1e-12);
    }
    return fastest;
  }

  /// The approach that is left as a fraction of that before the event, or the worst work returned in
  /// excess or want of e^2 times the work stored as a fraction of the latter, -.
  double residual(const ContactProblem& problem, const ContactSolution& solution) const {
    double worst = state_.approach_left();
    const WorkWitness& work = solution.as<WorkWitness>();
    for (int c = 0; c < problem.nc(); ++c) {
      const double stored = -work.compression[c], e = problem.restitution[c];
      if (stored > 0) worst = std::max(worst, std::abs(work.restitution[c] - e * e * stored) / stored);
    }
    return worst;
  }

  MirtichOptions options_;
  ImpactState state_;
  Impact impact_;
  std::vector<double> normal_velocity_;  // nc, m/s
};

ContactMethod make(const MethodOptions&) { return make_mirtich({}); }

}  // namespace

ContactMethod make_mirtich(const MirtichOptions& options) {
  return [mirtich = std::make_shared<Mirtich>(options)](const ContactProblem& problem, ContactSolution& solution) {
    mirtich->solve(problem, solution);
  };
}

MethodRow mirtich_row() {
  return {.name = "mirtich",
          .summary = "Stronge's energetic restitution integrated in impulse space, the fastest approach first",
          .source = "Mirtich 1996, Impulse-based Dynamic Simulation, ch. 3",
          .law = mirtich_law(),
          .solvers = {},
          .variants = {},
          .options = {},
          .make = make};
}

}  // namespace cb
