#include "observed_impact.h"

namespace cb {

ObservedImpact::ObservedImpact(const Scenario& scenario, bool single)
    : on_(body_on_plane(scenario, ShapeKind::sphere)), rounding_(single ? 1e-6 : 1e-12) {
  if (!on_) return;
  mass_ = scenario.model.bodies[0].mass;
  inertia_ = scenario.model.bodies[0].inertia.x();
}

void ObservedImpact::observe(const State& before, const State& after, const Loads& loads, double h,
                             SceneErrors& errors) {
  if (!on_) return;
  const Vec3 acceleration = loads.gravity + loads.force[0] / mass_;
  Twist free, now;
  for (int i = 0; i < 6; ++i) {
    free[i] = before.v[i] + (i < 3 ? h * acceleration[i] : 0.0);
    now[i] = after.v[i];
  }
  const double weight = h * loads.gravity.norm();
  const bool large = std::abs(on_->n.dot(now.head<3>() - free.head<3>())) > 2 * weight;
  if (impact_ && !large) {
    emit(*impact_, errors);
    impact_.reset();
  }
  const bool pushed = (now - free).norm() > rounding_ * (free.norm() + weight);
  if (large) {
    if (!impact_) impact_ = {before.t, free, now};
    impact_->after = now;
  } else if (pushed) {
    emit({before.t, free, now}, errors);
  }
}

void ObservedImpact::emit(const Impact& impact, SceneErrors& errors) const {
  ContactProblem problem;
  problem.clear();
  auto M = problem.M.block(problem.M.add_block(6));
  for (int i = 0; i < 6; ++i) M(i, i) = i < 3 ? mass_ : inertia_;
  problem.v_minus.assign(impact.before.data(), impact.before.data() + 6);
  const std::vector<double> v_plus(impact.after.data(), impact.after.data() + 6);
  ContactPoint point{};
  point.normal = on_->n;
  ContactSolution solution;
  Residuals residuals;
  const auto energy = [&](const Twist& v) {
    return (mass_ * v.head<3>().squaredNorm() + inertia_ * v.tail<3>().squaredNorm()) / 2;
  };
  residuals.energy_before = energy(impact.before);
  residuals.energy_gain = energy(impact.after) - residuals.energy_before;
  errors.observe_event({impact.t, problem, solution, residuals, v_plus, {point}});
}

}  // namespace cb
