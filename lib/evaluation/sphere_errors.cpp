// Errors of a sphere that falls on a plane: its first impact against the exact outcome of the recorded velocity before
// it, and its flight, sliding and rolling (sphere_impact.h).
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "evaluation/references.h"
#include "evaluation/sphere_impact.h"

namespace cb {

namespace {

class SphereErrors : public Measure {
 public:
  SphereErrors(const Scenario& scenario, const SimulationOptions& options, int edges, const OnPlane& on);
  void observe_event(const EventRecord& event) override;
  void observe_step(const State& state, const StepRecord& /*record*/) override {
    t_ = state.t;
    if (flight_) from_exact_.add((state.pose[0].p - flight_->position(t_)).norm(), t_, 2 * sphere_.radius);
  }
  void report(Values& out) const override;

 private:
  struct OutcomeErrors {
    double velocity, spin, energy;  // m/s, rad/s, J
  };
  struct Recorded {
    double t, speed, rolls_after, energy_before;
    Vec3 v, w;  // before it
    bool over;
    OutcomeErrors exact;
    std::optional<OutcomeErrors> polygon;
  };
  Recorded first_impact(const EventRecord& event) const;
  void observe_outcome(const EventRecord& event, Recorded& impact) const;

  OnPlane plane_;
  SphereBody sphere_;
  double duration_, step_, rotate_cone_;
  double gravity_speed_;  // m/s, that a step adds
  int k_;
  std::optional<SphereFlight> flight_;
  Distance from_exact_;
  double t_ = 0;
  std::optional<Recorded> impact_;
  std::optional<double> t_roll_;
  double energy_rise_ = 0, energy_rise_relative_ = 0;
};

SphereErrors::SphereErrors(const Scenario& scenario, const SimulationOptions& options, int edges, const OnPlane& on)
    : plane_(on),
      sphere_{scenario.model.bodies[0].mass, scenario.model.bodies[0].inertia.x(), scenario.shapes[on.shape].radius},
      duration_(options.duration),
      step_(options.step),
      rotate_cone_(on.cone_sign * scenario.rotate_cone),
      gravity_speed_(scenario.gravity.constant.norm() * options.step),
      k_(edges) {
  const Vec3& g = scenario.gravity.constant;
  const bool straight_down =
      !scenario.gravity.varies() && scenario.forces.empty() && (g + g.norm() * plane_.n).norm() <= 1e-12 * g.norm();
  if (straight_down && plane_.law.restitution == 0 && plane_.gap >= 0)
    flight_.emplace(sphere_, scenario.initial.pose[0], velocity_of(scenario.initial, 0), spin_of(scenario.initial, 0),
                    plane_.gap, plane_.n, g.norm(), plane_.law.mu);
}

SphereErrors::Recorded SphereErrors::first_impact(const EventRecord& event) const {
  const Vec3 v(event.problem.v_minus.data()), w(event.problem.v_minus.data() + 3);
  Recorded recorded{};
  recorded.t = event.t;
  recorded.v = v;
  recorded.w = w;
  recorded.speed = std::max(v.norm(), sphere_.radius * w.norm());
  recorded.energy_before = sphere_.kinetic_energy(v, w);
  // Rolling as it follows from the recorded impact's exact outcome.
  recorded.rolls_after =
      flight_ && std::isfinite(flight_->t_roll)
          ? SphereFlight(sphere_, Pose(), v, w, 0, plane_.n, flight_->gravity(), plane_.law.mu).t_roll
          : std::numeric_limits<double>::infinity();
  return recorded;
}

// By steps an impact takes two events: the first leaves the speed that closes the gap within its step, the next one
// takes it.
void SphereErrors::observe_outcome(const EventRecord& event, Recorded& impact) const {
  constexpr double rounding = 1e-9;  // of the speed before
  const Vec3 v_plus(event.v_plus.data()), w_plus(event.v_plus.data() + 3);
  const auto errors = [&](const SphereImpact& expected) {
    return OutcomeErrors{
        (v_plus - expected.v).norm(), (w_plus - expected.w).norm(),
        std::abs(sphere_.kinetic_energy(v_plus, w_plus) - sphere_.kinetic_energy(expected.v, expected.w))};
  };
  const PairLaw& law = plane_.law;
  impact.exact = errors(sphere_impact(sphere_, impact.v, impact.w, plane_.n, law.mu, law.restitution));
  if (k_ >= 3 && law.restitution == 0)
    impact.polygon = errors(sphere_impact_polygon(sphere_, impact.v, impact.w, plane_.n, law.mu, k_, rotate_cone_));
  impact.over = event.gap_speed.empty() || -plane_.n.dot(v_plus) <= std::max(gravity_speed_, rounding * impact.speed);
}

void SphereErrors::observe_event(const EventRecord& event) {
  if (event.contacts.empty() || event.problem.nv() != 6) return;
  const double gain = event.residuals.energy_gain, before = event.residuals.energy_before;
  energy_rise_ = std::max(energy_rise_, gain);
  if (before > 0) energy_rise_relative_ = std::max(energy_rise_relative_, gain / before);

  if (!impact_) {
    if (plane_.n.dot(Vec3(event.problem.v_minus.data())) >= 0) return;
    impact_ = first_impact(event);
  }
  if (!impact_->over) observe_outcome(event, *impact_);
  constexpr double rolling = 1e-6;  // slip over the speed before the impact
  const Vec3 v_plus(event.v_plus.data()), w_plus(event.v_plus.data() + 3);
  if (!t_roll_ && sphere_.slip(v_plus, w_plus, plane_.n).norm() <= rolling * impact_->speed) t_roll_ = event.t;
}

void SphereErrors::report(Values& out) const {
  if (impact_ && impact_->over) {
    out.emplace_back("velocity_after_impact_m_per_s", impact_->exact.velocity);
    out.emplace_back("spin_after_impact_rad_per_s", impact_->exact.spin);
    out.emplace_back("ke_after_impact_j", impact_->exact.energy);
    if (impact_->energy_before > 0)
      out.emplace_back("ke_after_impact_relative", impact_->exact.energy / impact_->energy_before);
    if (impact_->polygon) {
      out.emplace_back("polygon_velocity_after_impact_m_per_s", impact_->polygon->velocity);
      out.emplace_back("polygon_spin_after_impact_rad_per_s", impact_->polygon->spin);
      out.emplace_back("polygon_ke_after_impact_j", impact_->polygon->energy);
    }
  }
  out.emplace_back("energy_rise_linf_j", energy_rise_);
  out.emplace_back("energy_rise_relative", energy_rise_relative_);
  if (impact_ && flight_) {
    out.emplace_back("impact_time_error_s", std::abs(impact_->t - flight_->t_impact));
    if (t_roll_ && std::isfinite(impact_->rolls_after))
      out.emplace_back("rolling_start_error_s", std::abs(*t_roll_ - impact_->t - impact_->rolls_after));
  }
  from_exact_.report("", t_ >= duration_ - step_ / 2, out);
}

std::unique_ptr<Measure> make(const Scenario& scenario, const SimulationOptions& options, int k) {
  const auto on = body_on_plane(scenario, ShapeKind::sphere);
  return on ? std::make_unique<SphereErrors>(scenario, options, k, *on) : nullptr;
}

}  // namespace

ReferenceRow impacting_sphere_row() {
  return {"impacting_sphere",
          "a sphere's impact, sliding and rolling in closed form (Coulomb; normal impulse (1 + e) m v_n, sticks iff "
          "slip <= (1 + m r^2 / I) mu (1 + e) v_n)",
          {{"velocity_after_impact_m_per_s", "m/s; velocity after the first impact, from the recorded one before it"},
           {"spin_after_impact_rad_per_s", "rad/s; the same of the spin"},
           {"ke_after_impact_j", "J; the same of the kinetic energy, its size"},
           {"ke_after_impact_relative", "-; the same as a fraction of the kinetic energy before the impact"},
           {"polygon_velocity_after_impact_m_per_s", "m/s; against the polygon of the run's k edges (ap, e = 0)"},
           {"polygon_spin_after_impact_rad_per_s", "rad/s; against the polygon"},
           {"polygon_ke_after_impact_j", "J; against the polygon"},
           {"energy_rise_linf_j", "J; largest kinetic energy that one event adds (0 where none does)"},
           {"energy_rise_relative", "-; the same as a fraction of the kinetic energy before that event"},
           {"impact_time_error_s", "s; time of the first impact against exact free fall"},
           {"rolling_start_error_s", "s; time from impact to rolling (slip below 1e-6 of the speed before it), e = 0"},
           {"position_final_m", "m; distance from the exact centre at the end, e = 0"},
           {"position_linf_m", "m; the same, largest over time"},
           {"position_l2_m", "m; the same, root mean square over time"},
           {"horizon_s", "s; first time at which it passes a tenth of the diameter"}},
          make};
}

}  // namespace cb
