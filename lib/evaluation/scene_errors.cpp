// The errors of a run against its scene's closed form, gathered step by step.
//
// What each reference needs is checked when the run is set up: a scene that names a reference but does not have its
// shape (another number of bodies, a gravity that varies along the normal, a box that would tip over) leaves out what
// has no closed form. Nothing is kept of the trajectory.
#include "evaluation/scene_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <variant>

#include "evaluation/robot_errors.h"
#include "evaluation/slider.h"
#include "evaluation/sphere_impact.h"

namespace cb {

namespace {

using Values = std::vector<std::pair<std::string, double>>;

/// Fraction of the body's size that an error passes at the horizon.
constexpr double horizon_fraction = 0.1;

Vec3 velocity_of(const State& state, std::size_t body) { return Vec3(&state.v[6 * body]); }
Vec3 spin_of(const State& state, std::size_t body) { return Vec3(&state.v[6 * body + 3]); }

/// Angle between two orientations, exact near zero.
double turned(const Quat& from, const Quat& to) {
  const double sine = (from.conjugate() * to).vec().norm();
  return 2 * std::asin(std::min(1.0, sine));
}

/// Distance from a reference over time.
struct Distance {
  double last = 0, largest = 0, sum2 = 0;
  long samples = 0;
  std::optional<double> horizon;
  void add(double distance, double t, double limit) {
    last = distance;
    largest = std::max(largest, distance);
    sum2 += distance * distance;
    ++samples;
    if (!horizon && distance > limit) horizon = t;
  }
  void report(const std::string& prefix, bool ended, Values& out) const {
    if (samples == 0) return;
    if (ended) out.emplace_back(prefix + "position_final_m", last);
    out.emplace_back(prefix + "position_linf_m", largest);
    out.emplace_back(prefix + "position_l2_m", std::sqrt(sum2 / static_cast<double>(samples)));
    if (horizon) out.emplace_back(prefix + "horizon_s", *horizon);
  }
};

/// A body on a plane: the one moving body of the scene and the one half-space.
struct OnPlane {
  int shape = -1;  ///< the body's
  Vec3 n, t1, t2;  ///< normal of the plane, in-plane axes at cone angle 0
  double gap = 0;  ///< of the shape at the start, m
  PairLaw law;
};

std::optional<OnPlane> body_on_plane(const Scenario& scenario, ShapeKind kind) {
  if (scenario.model.bodies.size() != 1 || scenario.shapes.size() != 2) return std::nullopt;
  OnPlane out;
  int plane = -1;
  for (int i = 0; i < 2; ++i) {
    const Shape& shape = scenario.shapes[i];
    if (shape.kind == ShapeKind::half_space) plane = i;
    if (shape.kind == kind && shape.body == 0 && shape.local.p.isZero(0)) out.shape = i;
  }
  if (plane < 0 || out.shape < 0) return std::nullopt;
  const PairLaw* law = scenario.pairs.find(plane, out.shape);
  if (!law) return std::nullopt;
  out.law = *law;
  out.n = scenario.shapes[plane].local.q * Vec3(0, 1, 0);
  contact_tangents(out.n, 0, out.t1, out.t2);
  const Shape& shape = scenario.shapes[out.shape];
  const Pose pose{scenario.initial.pose[0].p, scenario.initial.pose[0].q * shape.local.q};
  out.gap = separation(shape, pose, scenario.shapes[plane], scenario.shapes[plane].local);
  return out;
}

// --- a box that slides on a plane
// ---------------------------------------------------------------------------------------

enum class Sliding { pushed, on_slope, round };

struct SlidingMeasure {
  Sliding kind;
  double duration, step, size;
  OnPlane plane;
  Vec3 p0 = Vec3::Zero(), p_half = Vec3::Zero(), p_last = Vec3::Zero();
  Quat q0;
  std::optional<Slider> exact, polygon;
  Vec2 exact_last = Vec2::Zero(), polygon_last = Vec2::Zero();
  Distance from_exact, from_polygon;
  double t = 0;

  // Displacement from the start, along the normal, across the push, before and after it.
  double displacement = 0, lift = 0, lateral = 0, tilt = 0, creep_before = 0, creep_after = 0;
  std::optional<double> first_past[3];
  std::optional<Vec2> push;           ///< direction of the first push
  double push_from = 0, push_to = 0;  ///< first and last time of a push
  std::optional<Vec3> p_settled;
  bool have_half = false, stopped_for_good = true;

  // Turns: sums over the current one, mean place and radius of the first and the last whole one.
  struct Turn {
    Vec2 sum = Vec2::Zero();
    double sum2 = 0;
    void add(const Vec2& p) {
      sum += p;
      sum2 += p.squaredNorm();
    }
    Vec2 mean(long n) const { return sum / static_cast<double>(n); }
    double radius(long n) const {
      return std::sqrt(std::max(0.0, sum2 / static_cast<double>(n) - mean(n).squaredNorm()));
    }
  };
  double period = 0;
  long turns = 0, in_turn = 0;
  Turn run_turn, exact_turn;
  Vec2 first_shift = Vec2::Zero(), last_shift = Vec2::Zero();
  double radius_error = 0;

  SlidingMeasure(const Scenario& scenario, const SimulationOptions& options, int k, Sliding what, const OnPlane& on);
  void start(const State& state) {
    p0 = p_half = p_last = state.pose[0].p;
    q0 = state.pose[0].q;
  }
  void observe(const State& state);
  void report(Values& out) const;
};

SlidingMeasure::SlidingMeasure(const Scenario& scenario, const SimulationOptions& options, int k, Sliding what,
                               const OnPlane& on)
    : kind(what), duration(options.duration), step(options.step), size(scenario.shapes[on.shape].size()), plane(on) {
  const Body& body = scenario.model.bodies[0];
  const auto in_plane = [this](const Vec3& x) { return Vec2(x.dot(plane.t1), x.dot(plane.t2)); };
  const State& initial = scenario.initial;
  const Vec3 v = velocity_of(initial, 0);

  Drive drive;
  drive.constant = in_plane(scenario.gravity.constant);
  double weight = -plane.n.dot(scenario.gravity.constant);  // normal acceleration that the plane takes up
  bool steady_weight = true;
  double strongest = drive.constant.norm();
  for (int axis = 0; axis < 3; ++axis) {
    const Harmonic& harmonic = scenario.gravity.harmonic[axis];
    if (harmonic.amplitude == 0) continue;
    const Vec3 amplitude = harmonic.amplitude * Vec3::Unit(axis);
    steady_weight &= std::abs(plane.n.dot(amplitude)) <= 1e-12 * amplitude.norm();
    if (harmonic.frequency == 0) {
      drive.constant += std::cos(harmonic.phase) * in_plane(amplitude);
    } else {
      drive.harmonics.push_back({in_plane(amplitude), harmonic.frequency, harmonic.phase});
      period = 2 * std::numbers::pi / std::abs(harmonic.frequency);
    }
    strongest += amplitude.norm();
  }
  for (const Force& force : scenario.forces) {
    const Vec3 a = force.force / body.mass;
    steady_weight &= std::abs(plane.n.dot(a)) <= 1e-12 * a.norm();
    if (force.to <= force.from) continue;
    drive.pushes.push_back({in_plane(a), force.from, force.to});
    strongest += a.norm();
    if (!push && in_plane(a).norm() > 0) {
      push = in_plane(a).normalized();
      push_from = force.from;
    }
    push_from = std::min(push_from, force.from);
    push_to = std::max(push_to, force.to);
  }
  for (const Drive::Harmonic& harmonic : drive.harmonics)
    if (harmonic.frequency != drive.harmonics.front().frequency) period = 0;

  // Flush on the plane, sliding without turning, and too low to tip over: the friction it can meet, times the height of
  // the centre, must not reach beyond the base.
  const Shape& box = scenario.shapes[on.shape];
  const Mat3 R = (initial.pose[0].q * box.local.q).toRotationMatrix();
  double height = 0, base = std::numeric_limits<double>::infinity();
  int upright = -1;
  for (int i = 0; i < 3; ++i)
    if (std::abs(std::abs(plane.n.dot(R.col(i))) - 1) < 1e-12) upright = i;
  if (upright >= 0) {
    height = box.half_extents[upright];
    for (int i = 0; i < 3; ++i)
      if (i != upright) base = std::min(base, box.half_extents[i]);
  }
  const bool flush = upright >= 0 && std::abs(plane.gap) <= 1e-6 * size && std::abs(plane.n.dot(v)) <= 1e-9 &&
                     spin_of(initial, 0).isZero(0);
  const double friction = plane.law.mu * weight;
  const bool moving = v.norm() > 0;
  const double most = moving ? friction : std::min(friction, strongest);
  if (!flush || !steady_weight || !(weight > 0) || most * height > weight * base * (1 + 1e-12)) return;

  const SliderState at_start{Vec2::Zero(), in_plane(v)};
  exact = coulomb_slider(drive, friction, at_start);
  if (k >= 3) polygon = PolygonSlider(drive, friction, k, scenario.rotate_cone, at_start);
}

void SlidingMeasure::observe(const State& state) {
  t = state.t;
  const Vec3 d = state.pose[0].p - p0;
  const Vec2 p(d.dot(plane.t1), d.dot(plane.t2));
  const double up = d.dot(plane.n), distance = d.norm();
  displacement = std::max(displacement, distance);
  lift = std::max(lift, std::abs(up));
  if (kind == Sliding::on_slope) {
    constexpr double marks[] = {1e-9, 1e-6, 1e-3};
    for (int i = 0; i < 3; ++i)
      if (!first_past[i] && distance > marks[i]) first_past[i] = t;
    tilt = std::max(tilt, turned(q0, state.pose[0].q));
    if (!have_half && t >= duration / 2 - step / 2) {
      have_half = true;
      p_half = state.pose[0].p;
    }
  }
  p_last = state.pose[0].p;

  Vec2 p_exact = Vec2::Zero();
  if (exact) {
    const SliderState now = std::visit([this](auto& slider) { return slider.at(t); }, *exact);
    p_exact = exact_last = now.p;
    from_exact.add(std::hypot((p - p_exact).norm(), up), t, horizon_fraction * size);
    if (kind == Sliding::pushed && push) {
      lateral = std::max(lateral, std::abs(push->x() * p.y() - push->y() * p.x()));
      if (t <= push_from + step / 2) creep_before = std::max(creep_before, distance);
      constexpr double settle = 0.3;  // s after the last push
      if (t >= push_to + settle - step / 2 && now.v.isZero(0)) {
        if (!p_settled) p_settled = p_last;
        creep_after = std::max(creep_after, (p_last - *p_settled).norm());
      }
    }
  }
  if (polygon) {
    polygon_last = std::visit([this](auto& slider) { return slider.at(t); }, *polygon).p;
    from_polygon.add(std::hypot((p - polygon_last).norm(), up), t, horizon_fraction * size);
  }

  if (kind == Sliding::round && exact && period > 0) {
    if (t > static_cast<double>(turns + 1) * period && in_turn > 0) {
      last_shift = run_turn.mean(in_turn) - exact_turn.mean(in_turn);
      if (turns == 0) first_shift = last_shift;
      radius_error = std::abs(run_turn.radius(in_turn) - exact_turn.radius(in_turn));
      ++turns;
      in_turn = 0;
      run_turn = exact_turn = Turn();
    }
    run_turn.add(p);
    exact_turn.add(p_exact);
    ++in_turn;
  }
}

void SlidingMeasure::report(Values& out) const {
  const bool ended = t >= duration - step / 2;
  const Vec3 d = p_last - p0;
  const Vec2 p(d.dot(plane.t1), d.dot(plane.t2));
  if (kind == Sliding::on_slope) {
    if (ended) out.emplace_back("displacement_final_m", d.norm());
    out.emplace_back("displacement_linf_m", displacement);
    if (ended && have_half) out.emplace_back("creep_rate_m_per_s", (p_last - p_half).norm() / (duration / 2));
    const char* names[] = {"first_past_1nm_s", "first_past_1um_s", "first_past_1mm_s"};
    for (int i = 0; i < 3; ++i)
      if (first_past[i]) out.emplace_back(names[i], *first_past[i]);
    out.emplace_back("tilt_linf_rad", tilt);
  }
  const auto relative = [&](const char* what, const Vec2& reference) {
    if (!ended || !push) return;
    const double x = push->dot(reference);
    if (x > 0) out.emplace_back(what, std::abs(push->dot(p) - x) / x);
  };
  if (kind == Sliding::pushed && exact) relative("x_final_relative", exact_last);
  from_exact.report("", ended, out);
  if (kind == Sliding::pushed && exact && push) {
    if (push_from > step / 2) out.emplace_back("creep_before_push_m", creep_before);
    if (p_settled) out.emplace_back("creep_after_stop_m", creep_after);
    out.emplace_back("lateral_drift_m", lateral);
  }
  if (kind == Sliding::round && turns > 0) {
    out.emplace_back("radius_error_m", radius_error);
    out.emplace_back("centre_error_m", last_shift.norm());
    if (turns > 1)
      out.emplace_back("drift_per_turn_m", (last_shift - first_shift).norm() / static_cast<double>(turns - 1));
  }
  if (kind != Sliding::on_slope) out.emplace_back("lift_linf_m", lift);
  if (kind == Sliding::pushed && polygon) relative("polygon_x_final_relative", polygon_last);
  from_polygon.report("polygon_", ended, out);
}

// --- a sphere that falls on a plane
// -------------------------------------------------------------------------------------

struct SphereMeasure {
  OnPlane plane;
  SphereBody sphere;
  double duration, step, rotate_cone;
  int k;
  std::optional<SphereFlight> flight;
  Distance from_exact;
  double t = 0;

  struct Recorded {
    double t, speed, rolls_after, velocity_error, spin_error, energy_error, energy_before;
    std::optional<double> polygon_velocity, polygon_spin, polygon_energy;
  };
  std::optional<Recorded> impact;
  std::optional<double> t_roll;
  double energy_rise = 0, energy_rise_relative = 0;

  SphereMeasure(const Scenario& scenario, const SimulationOptions& options, int edges, const OnPlane& on)
      : plane(on),
        sphere{scenario.model.bodies[0].mass, scenario.model.bodies[0].inertia.x(), scenario.shapes[on.shape].radius},
        duration(options.duration),
        step(options.step),
        rotate_cone(scenario.rotate_cone),
        k(edges) {
    const Vec3& g = scenario.gravity.constant;
    const bool straight_down =
        !scenario.gravity.varies() && scenario.forces.empty() && (g + g.norm() * plane.n).norm() <= 1e-12 * g.norm();
    if (straight_down && plane.law.restitution == 0 && plane.gap >= 0)
      flight.emplace(sphere, scenario.initial.pose[0], velocity_of(scenario.initial, 0), spin_of(scenario.initial, 0),
                     plane.gap, plane.n, g.norm(), plane.law.mu);
  }
  void event(const EventRecord& event);
  void observe(const State& state) {
    t = state.t;
    if (flight) from_exact.add((state.pose[0].p - flight->position(t)).norm(), t, horizon_fraction * 2 * sphere.radius);
  }
  void report(Values& out) const;
};

void SphereMeasure::event(const EventRecord& event) {
  if (event.contacts.empty() || event.problem.nv() != 6) return;
  energy_rise = std::max(energy_rise, event.residuals.energy_gain);
  if (event.residuals.energy_before > 0)
    energy_rise_relative = std::max(energy_rise_relative, event.residuals.energy_gain / event.residuals.energy_before);
  const Vec3 v_plus(event.v_plus.data()), w_plus(event.v_plus.data() + 3);

  if (!impact) {
    const Vec3 v(event.problem.v_minus.data()), w(event.problem.v_minus.data() + 3);
    if (plane.n.dot(v) >= 0) return;
    const auto errors = [&](const Impact& expected, auto& velocity, auto& spin, auto& energy) {
      velocity = (v_plus - expected.v).norm();
      spin = (w_plus - expected.w).norm();
      energy = std::abs(sphere.kinetic_energy(v_plus, w_plus) - sphere.kinetic_energy(expected.v, expected.w));
    };
    Recorded recorded{};
    recorded.t = event.t;
    recorded.speed = std::max(v.norm(), sphere.radius * w.norm());
    recorded.energy_before = sphere.kinetic_energy(v, w);
    const Impact expected = sphere_impact(sphere, v, w, plane.n, plane.law.mu, plane.law.restitution);
    errors(expected, recorded.velocity_error, recorded.spin_error, recorded.energy_error);
    if (k >= 3 && plane.law.restitution == 0)
      errors(sphere_impact_polygon(sphere, v, w, plane.n, plane.law.mu, k, rotate_cone), recorded.polygon_velocity,
             recorded.polygon_spin, recorded.polygon_energy);
    // Rolling as it follows from the recorded impact's exact outcome.
    recorded.rolls_after = flight && std::isfinite(flight->t_roll)
                               ? SphereFlight(sphere, Pose(), v, w, 0, plane.n, flight->gravity(), plane.law.mu).t_roll
                               : std::numeric_limits<double>::infinity();
    impact = recorded;
  }
  constexpr double rolling = 1e-6;  // slip over the speed before the impact
  if (!t_roll && sphere.slip(v_plus, w_plus, plane.n).norm() <= rolling * impact->speed) t_roll = event.t;
}

void SphereMeasure::report(Values& out) const {
  if (impact) {
    out.emplace_back("velocity_after_impact_m_per_s", impact->velocity_error);
    out.emplace_back("spin_after_impact_rad_per_s", impact->spin_error);
    out.emplace_back("ke_after_impact_j", impact->energy_error);
    if (impact->energy_before > 0)
      out.emplace_back("ke_after_impact_relative", impact->energy_error / impact->energy_before);
    if (impact->polygon_velocity) {
      out.emplace_back("polygon_velocity_after_impact_m_per_s", *impact->polygon_velocity);
      out.emplace_back("polygon_spin_after_impact_rad_per_s", *impact->polygon_spin);
      out.emplace_back("polygon_ke_after_impact_j", *impact->polygon_energy);
    }
  }
  out.emplace_back("energy_rise_linf_j", energy_rise);
  out.emplace_back("energy_rise_relative", energy_rise_relative);
  if (impact && flight) {
    out.emplace_back("impact_time_error_s", std::abs(impact->t - flight->t_impact));
    if (t_roll && std::isfinite(impact->rolls_after))
      out.emplace_back("rolling_start_error_s", std::abs(*t_roll - impact->t - impact->rolls_after));
  }
  from_exact.report("", t >= duration - step / 2, out);
}

// --- a stack at rest
// ----------------------------------------------------------------------------------------------------

struct StackMeasure {
  double duration, step;
  std::vector<int> level;  ///< per body: 0 is the lowest
  std::vector<int> body_of_shape;
  std::vector<double> carried;  ///< per interface (below the body of that level): m g h of all above, N s
  double total = 0;
  bool at_rest = true;      ///< have the interface sums a closed form?
  std::vector<double> sum;  ///< of this step
  bool neighbours = true;   ///< do all contacts join neighbouring levels?
  std::vector<Pose> start_pose;
  double displacement = 0, displacement_now = 0, tilt = 0, penetration = 0, sum_error = 0, total_error = 0;
  double t = 0;
  bool events = false;

  StackMeasure(const Scenario& scenario, const SimulationOptions& options)
      : duration(options.duration), step(options.step) {
    const std::size_t n = scenario.model.bodies.size();
    const Vec3& g = scenario.gravity.constant;
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return g.dot(scenario.initial.pose[a].p) > g.dot(scenario.initial.pose[b].p);
    });
    level.resize(n);
    carried.resize(n);
    sum.resize(n);
    double weight = 0;
    for (std::size_t i = n; i-- > 0;) {
      level[order[i]] = static_cast<int>(i);
      weight += scenario.model.bodies[order[i]].mass * g.norm() * step;
      carried[i] = weight;
      total += weight;
    }
    for (const Shape& shape : scenario.shapes) body_of_shape.push_back(shape.body);
    at_rest = !scenario.gravity.varies() && scenario.forces.empty() && weight > 0 &&
              std::all_of(scenario.initial.v.begin(), scenario.initial.v.end(), [](double x) { return x == 0; });
    for (const PairLaw& law : scenario.pairs.laws) at_rest &= law.restitution == 0;
  }
  void event(const EventRecord& event) {
    if (!at_rest) return;
    events = true;
    for (std::size_t c = 0; c < event.contacts.size(); ++c) {
      const int a = body_of_shape[event.contacts[c].shape_a], b = body_of_shape[event.contacts[c].shape_b];
      const int level_a = a < 0 ? -1 : level[a], level_b = b < 0 ? -1 : level[b];
      neighbours &= std::abs(level_a - level_b) == 1;
      sum[std::max(level_a, level_b)] += event.solution.impulse[3 * c];
    }
  }
  void observe(const State& state, const StepRecord& record) {
    t = state.t;
    penetration = std::max(penetration, record.max_penetration);
    displacement_now = 0;
    for (std::size_t b = 0; b < start_pose.size(); ++b) {
      displacement_now = std::max(displacement_now, (state.pose[b].p - start_pose[b].p).squaredNorm());
      tilt = std::max(tilt, turned(start_pose[b].q, state.pose[b].q));
    }
    displacement_now = std::sqrt(displacement_now);
    displacement = std::max(displacement, displacement_now);
    if (!at_rest) return;
    double all = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum_error = std::max(sum_error, std::abs(sum[i] - carried[i]) / carried[i]);
      all += sum[i];
      sum[i] = 0;
    }
    total_error = std::max(total_error, std::abs(all - total) / total);
  }
  void report(Values& out) const {
    out.emplace_back("displacement_linf_m", displacement);
    if (t >= duration - step / 2) out.emplace_back("displacement_final_m", displacement_now);
    out.emplace_back("tilt_linf_rad", tilt);
    if (at_rest && neighbours && events) {
      out.emplace_back("interface_sum_relative", sum_error);
      out.emplace_back("interface_total_relative", total_error);
    }
    out.emplace_back("penetration_linf_m", penetration);
  }
};

}  // namespace

struct SceneErrors::Measure {
  std::variant<std::monostate, SlidingMeasure, SphereMeasure, StackMeasure, DriveErrors, GraspErrors> scene;
  bool observed = false;
};

SceneErrors::SceneErrors(const Scenario& scenario, const SimulationOptions& options, int k)
    : measure_(std::make_unique<Measure>()) {
  if (scenario.reference.kind != ReferenceKind::analytic) return;
  const std::string& name = scenario.reference.name;
  auto& scene = measure_->scene;
  if (name == "stack" && !scenario.model.bodies.empty()) {
    scene.emplace<StackMeasure>(scenario, options);
  } else if (name == "impacting_sphere") {
    if (const auto on = body_on_plane(scenario, ShapeKind::sphere))
      scene.emplace<SphereMeasure>(scenario, options, k, *on);
  } else if (name == "mobile_robot") {
    if (const auto robot = wheeled_robot(scenario)) scene.emplace<DriveErrors>(scenario, options, *robot);
  } else if (name == "grasp") {
    if (auto grasp = GraspErrors::of(scenario, options)) scene.emplace<GraspErrors>(std::move(*grasp));
  } else if (name == "sliding_box" || name == "sticking_box" || name == "circular_sliding") {
    const Sliding kind = name == "sliding_box"    ? Sliding::pushed
                         : name == "sticking_box" ? Sliding::on_slope
                                                  : Sliding::round;
    if (const auto on = body_on_plane(scenario, ShapeKind::box))
      scene.emplace<SlidingMeasure>(scenario, options, k, kind, *on);
  }
}

SceneErrors::~SceneErrors() = default;
SceneErrors::SceneErrors(SceneErrors&&) noexcept = default;

void SceneErrors::observe_start(const State& state) {
  if (auto* sliding = std::get_if<SlidingMeasure>(&measure_->scene)) sliding->start(state);
  if (auto* stack = std::get_if<StackMeasure>(&measure_->scene)) stack->start_pose = state.pose;
}

void SceneErrors::observe_event(const EventRecord& event) {
  if (auto* sphere = std::get_if<SphereMeasure>(&measure_->scene)) sphere->event(event);
  if (auto* stack = std::get_if<StackMeasure>(&measure_->scene)) stack->event(event);
  if (auto* drive = std::get_if<DriveErrors>(&measure_->scene)) drive->observe_event(event);
}

void SceneErrors::observe_step(const State& state, const StepRecord& record) {
  measure_->observed = true;
  if (auto* sliding = std::get_if<SlidingMeasure>(&measure_->scene)) sliding->observe(state);
  if (auto* sphere = std::get_if<SphereMeasure>(&measure_->scene)) sphere->observe(state);
  if (auto* stack = std::get_if<StackMeasure>(&measure_->scene)) stack->observe(state, record);
  if (auto* drive = std::get_if<DriveErrors>(&measure_->scene)) drive->observe_step(state);
  if (auto* grasp = std::get_if<GraspErrors>(&measure_->scene)) grasp->observe_step(state);
}

Values SceneErrors::finish() const {
  Values out;
  if (!measure_->observed) return out;
  if (const auto* sliding = std::get_if<SlidingMeasure>(&measure_->scene)) sliding->report(out);
  if (const auto* sphere = std::get_if<SphereMeasure>(&measure_->scene)) sphere->report(out);
  if (const auto* stack = std::get_if<StackMeasure>(&measure_->scene)) stack->report(out);
  if (const auto* drive = std::get_if<DriveErrors>(&measure_->scene)) drive->report(out);
  if (const auto* grasp = std::get_if<GraspErrors>(&measure_->scene)) grasp->report(out);
  return out;
}

}  // namespace cb
