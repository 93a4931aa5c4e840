// Errors of a box that slides or rests on a plane: pushed along a level one, on a slope, or round under a turning
// drive.
//
// The exact motion is that of a point (slider.h) as long as the box lies flat, slides without turning and is too low to
// tip over; where it may not, what has no closed form is left out.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <variant>

#include "evaluation/references.h"
#include "evaluation/slider.h"

namespace cb {

namespace {

/// The drive of a body on a plane, by gravity and forces.
struct Driven {
  Drive drive;
  double weight = 0;                  ///< normal acceleration that the plane takes up, m/s^2
  bool steady_weight = true;          ///< does it stay?
  double strongest = 0;               ///< m/s^2, at least the drive's size at any time
  double period = 0;                  ///< of the harmonics, s; 0: they have none in common
  std::optional<Vec2> push;           ///< direction of the first push
  double push_from = 0, push_to = 0;  ///< first and last time of a push, s
};

/// Components along the plane, t1 and t2.
Vec2 in_plane(const OnPlane& plane, const Vec3& x) { return {x.dot(plane.t1), x.dot(plane.t2)}; }

bool along_plane(const OnPlane& plane, const Vec3& x) { return std::abs(plane.n.dot(x)) <= 1e-12 * x.norm(); }

void add_harmonic(const Harmonic& harmonic, const Vec3& axis, const OnPlane& plane, Driven& out) {
  if (harmonic.amplitude == 0) return;
  const Vec3 amplitude = harmonic.amplitude * axis;
  out.steady_weight &= along_plane(plane, amplitude);
  if (harmonic.frequency == 0) {
    out.drive.constant += std::cos(harmonic.phase) * in_plane(plane, amplitude);
  } else {
    out.drive.harmonics.push_back({in_plane(plane, amplitude), harmonic.frequency, harmonic.phase});
    out.period = 2 * std::numbers::pi / std::abs(harmonic.frequency);
  }
  out.strongest += amplitude.norm();
}

void add_force(const Force& force, double mass, const OnPlane& plane, Driven& out) {
  const Vec3 a = force.force / mass;
  out.steady_weight &= along_plane(plane, a);
  if (force.to <= force.from) return;
  const Vec2 along = in_plane(plane, a);
  out.drive.pushes.push_back({along, force.from, force.to});
  out.strongest += a.norm();
  if (along.norm() == 0) return;
  if (!out.push || force.from < out.push_from) {
    out.push = along.normalized();
    out.push_from = force.from;
  }
  out.push_to = std::max(out.push_to, force.to);
}

Driven driven(const Scenario& scenario, const OnPlane& plane) {
  Driven out;
  out.drive.constant = in_plane(plane, scenario.gravity.constant);
  out.weight = -plane.n.dot(scenario.gravity.constant);
  out.strongest = out.drive.constant.norm();
  for (int axis = 0; axis < 3; ++axis) add_harmonic(scenario.gravity.harmonic[axis], Vec3::Unit(axis), plane, out);
  for (const Force& force : scenario.forces) add_force(force, scenario.model.bodies[0].mass, plane, out);
  for (const Drive::Harmonic& harmonic : out.drive.harmonics)
    if (harmonic.frequency != out.drive.harmonics.front().frequency) out.period = 0;
  return out;
}

/// Does the box start flush on the plane, without turning, and stay so, too low to tip over? The friction it can meet,
/// at most `most` (m/s^2), times the height of the centre must not reach beyond the base.
bool stays_flat(const Scenario& scenario, const OnPlane& plane, double weight, double most) {
  const Shape& box = scenario.shapes[plane.shape];
  const State& initial = scenario.initial;
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
  const bool flush = upright >= 0 && std::abs(plane.gap) <= 1e-6 * box.size() &&
                     std::abs(plane.n.dot(velocity_of(initial, 0))) <= 1e-9 && spin_of(initial, 0).isZero(0);
  return flush && !(most * height > weight * base * (1 + 1e-12));
}

/// A run against its exact sliders, on any plane.
class SlidingErrors : public Measure {
 public:
  SlidingErrors(const Scenario& scenario, const SimulationOptions& options, int k, const OnPlane& on)
      : duration_(options.duration),
        step_(options.step),
        size_(scenario.shapes[on.shape].size()),
        halfway_(options),
        plane_(on),
        driven_(driven(scenario, on)) {
    const Vec3 v = velocity_of(scenario.initial, 0);
    const double weight = driven_.weight, friction = plane_.law.mu * weight;
    const double most = v.norm() > 0 ? friction : std::min(friction, driven_.strongest);
    if (!driven_.steady_weight || !(weight > 0) || !stays_flat(scenario, on, weight, most)) return;
    const SliderState at_start{Vec2::Zero(), in_plane(plane_, v)};
    exact_ = coulomb_slider(driven_.drive, friction, at_start);
    if (k >= 3) polygon_ = PolygonSlider(driven_.drive, friction, k, on.cone_sign * scenario.rotate_cone, at_start);
  }
  void observe_start(const State& state) override { p0_ = p_ = state.pose[0].p; }
  void observe_step(const State& state, const StepRecord& record) override;

 protected:
  bool ended() const { return t_ >= duration_ - step_ / 2; }
  Vec2 along() const { return in_plane(plane_, p_ - p0_); }

  double duration_, step_, size_;
  Halfway halfway_;
  OnPlane plane_;
  Driven driven_;
  std::optional<Slider> exact_, polygon_;
  SliderState exact_now_, polygon_now_;
  Distance from_exact_, from_polygon_;
  double t_ = 0;
  Vec3 p0_ = Vec3::Zero(), p_ = Vec3::Zero();  ///< at the start and now
  double lift_ = 0;                            ///< m, along the normal
};

void SlidingErrors::observe_step(const State& state, const StepRecord& /*record*/) {
  t_ = state.t;
  p_ = state.pose[0].p;
  const Vec2 p = along();
  const double up = (p_ - p0_).dot(plane_.n);
  lift_ = std::max(lift_, std::abs(up));
  const auto follow = [&](std::optional<Slider>& reference, SliderState& now, Distance& from) {
    if (!reference) return;
    now = std::visit([&](auto& slider) { return slider.at(t_); }, *reference);
    from.add(std::hypot((p - now.p).norm(), up), t_, size_);
  };
  follow(exact_, exact_now_, from_exact_);
  follow(polygon_, polygon_now_, from_polygon_);
}

/// Pushed along a plane.
class PushErrors : public SlidingErrors {
 public:
  using SlidingErrors::SlidingErrors;
  void observe_step(const State& state, const StepRecord& record) override {
    SlidingErrors::observe_step(state, record);
    const std::optional<Vec2>& push = driven_.push;
    if (!exact_ || !push) return;
    const Vec2 p = along();
    const double distance = (p_ - p0_).norm();
    lateral_ = std::max(lateral_, std::abs(push->x() * p.y() - push->y() * p.x()));
    if (t_ <= driven_.push_from + step_ / 2) creep_before_ = std::max(creep_before_, distance);
    constexpr double settle = 0.3;  // s after the last push
    if (t_ >= driven_.push_to + settle - step_ / 2 && exact_now_.v.isZero(0)) {
      if (!p_settled_) p_settled_ = p_;
      creep_after_ = std::max(creep_after_, (p_ - *p_settled_).norm());
    }
  }
  void report(Values& out) const override {
    const std::optional<Vec2>& push = driven_.push;
    const auto relative = [&](const char* what, const Vec2& reference) {
      if (!ended() || !push) return;
      const double x = push->dot(reference);
      if (x > 0) out.emplace_back(what, std::abs(push->dot(along()) - x) / x);
    };
    if (exact_) relative("x_final_relative", exact_now_.p);
    from_exact_.report("", ended(), out);
    if (exact_ && push) {
      if (driven_.push_from > step_ / 2) out.emplace_back("creep_before_push_m", creep_before_);
      if (p_settled_) out.emplace_back("creep_after_stop_m", creep_after_);
      out.emplace_back("lateral_drift_m", lateral_);
    }
    out.emplace_back("lift_linf_m", lift_);
    if (polygon_) relative("polygon_x_final_relative", polygon_now_.p);
    from_polygon_.report("polygon_", ended(), out);
  }

 private:
  double lateral_ = 0, creep_before_ = 0, creep_after_ = 0;  // m
  std::optional<Vec3> p_settled_;
};

/// On a slope.
class SlopeErrors : public SlidingErrors {
 public:
  using SlidingErrors::SlidingErrors;
  void observe_start(const State& state) override {
    SlidingErrors::observe_start(state);
    q0_ = state.pose[0].q;
  }
  void observe_step(const State& state, const StepRecord& record) override {
    const Vec3 before = p_, way = (state.t - t_) * velocity_of(state, 0);  // way: with the step's last velocity
    SlidingErrors::observe_step(state, record);
    const double distance = (p_ - p0_).norm();
    displacement_ = std::max(displacement_, distance);
    for (std::size_t i = 0; i < std::size(marks); ++i)
      if (!first_past_[i] && distance > marks[i].distance) first_past_[i] = t_;
    tilt_ = std::max(tilt_, turned(q0_, state.pose[0].q));
    if (const std::optional<double> share = halfway_.reached(t_)) {
      const double rest = 1 - *share;  // of the step, in which it speeds up evenly
      p_half_ = Vec3(p_ - rest * way + rest * rest * (way - (p_ - before)));
    }
  }
  void report(Values& out) const override {
    if (ended()) out.emplace_back("displacement_final_m", (p_ - p0_).norm());
    out.emplace_back("displacement_linf_m", displacement_);
    if (ended() && p_half_) out.emplace_back("creep_rate_m_per_s", (p_ - *p_half_).norm() / (duration_ / 2));
    for (std::size_t i = 0; i < std::size(marks); ++i)
      if (first_past_[i]) out.emplace_back(marks[i].name, *first_past_[i]);
    out.emplace_back("tilt_linf_rad", tilt_);
    from_exact_.report("", ended(), out);
    from_polygon_.report("polygon_", ended(), out);
  }

 private:
  struct Mark {
    double distance;  // m
    const char* name;
  };
  static constexpr Mark marks[] = {{1e-9, "first_past_1nm_s"}, {1e-6, "first_past_1um_s"}, {1e-3, "first_past_1mm_s"}};

  Quat q0_;
  double displacement_ = 0, tilt_ = 0;
  std::optional<double> first_past_[std::size(marks)];
  std::optional<Vec3> p_half_;
};

/// Round, under a drive that turns: mean place and radius of the first and the last whole turn.
class TurnErrors : public SlidingErrors {
 public:
  using SlidingErrors::SlidingErrors;
  void observe_step(const State& state, const StepRecord& record) override {
    SlidingErrors::observe_step(state, record);
    if (!exact_ || !(driven_.period > 0)) return;
    if (t_ > static_cast<double>(turns_ + 1) * driven_.period && in_turn_ > 0) end_turn();
    run_.add(along());
    exact_turn_.add(exact_now_.p);
    ++in_turn_;
  }
  void report(Values& out) const override {
    from_exact_.report("", ended(), out);
    if (turns_ > 0) {
      out.emplace_back("radius_error_m", radius_error_);
      out.emplace_back("centre_error_m", last_shift_.norm());
      if (turns_ > 1)
        out.emplace_back("drift_per_turn_m", (last_shift_ - first_shift_).norm() / static_cast<double>(turns_ - 1));
    }
    out.emplace_back("lift_linf_m", lift_);
    from_polygon_.report("polygon_", ended(), out);
  }

 private:
  struct Turn {  // sums over the current one
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
  void end_turn() {
    last_shift_ = run_.mean(in_turn_) - exact_turn_.mean(in_turn_);
    if (turns_ == 0) first_shift_ = last_shift_;
    radius_error_ = std::abs(run_.radius(in_turn_) - exact_turn_.radius(in_turn_));
    ++turns_;
    in_turn_ = 0;
    run_ = exact_turn_ = Turn();
  }

  long turns_ = 0, in_turn_ = 0;
  Turn run_, exact_turn_;
  Vec2 first_shift_ = Vec2::Zero(), last_shift_ = Vec2::Zero();
  double radius_error_ = 0;
};

template <class Errors>
std::unique_ptr<Measure> make(const Scenario& scenario, const SimulationOptions& options, int k) {
  const auto on = body_on_plane(scenario, ShapeKind::box);
  return on ? std::make_unique<Errors>(scenario, options, k, *on) : nullptr;
}

/// These, and then the place against the polygon's own answer.
ReferenceRow::Errors and_polygon(ReferenceRow::Errors errors) {
  errors.insert(errors.end(), {{"polygon_position_final_m", "m; position_final_m against the polygon's own answer"},
                               {"polygon_position_linf_m", "m; position_linf_m against it"},
                               {"polygon_position_l2_m", "m; position_l2_m against it"},
                               {"polygon_horizon_s", "s; horizon_s against it"}});
  return errors;
}

}  // namespace

ReferenceRow sliding_box_row() {
  return {
      "sliding_box",
      "a box pushed along a plane: piecewise constant acceleration under Coulomb friction (along one line in closed "
      "form, else integrated to 1e-12), and under the polygon of the run's k edges",
      and_polygon(
          {{"x_final_relative", "-; |x - x_exact| / x_exact at the end, x along the first push"},
           {"position_final_m", "m; distance from the exact place at the end"},
           {"position_linf_m", "m; the same, largest over time"},
           {"position_l2_m", "m; the same, root mean square over time"},
           {"horizon_s", "s; first time at which it passes a tenth of the box's size"},
           {"creep_before_push_m", "m; largest displacement before the first push"},
           {"creep_after_stop_m", "m; largest displacement from the place 0.3 s after the last push, once it stops"},
           {"lateral_drift_m", "m; largest displacement along the plane across the first push"},
           {"lift_linf_m", "m; largest displacement along the plane's normal"},
           {"polygon_x_final_relative", "-; x_final_relative against the polygon's own answer"}}),
      make<PushErrors>};
}

ReferenceRow sticking_box_row() {
  return {"sticking_box",
          "a box on a slope rests where mu >= tan(slope), else slides with g (sin - mu cos); and the same for the "
          "polygon of the run's k edges",
          and_polygon({{"displacement_final_m", "m; |p(T) - p(0)|"},
                       {"displacement_linf_m", "m; largest |p(t) - p(0)|"},
                       {"creep_rate_m_per_s", "m/s; |p(T) - p(T/2)| / (T/2)"},
                       {"first_past_1nm_s", "s; first time at which |p(t) - p(0)| passes 1e-9 m"},
                       {"first_past_1um_s", "s; 1e-6 m"},
                       {"first_past_1mm_s", "s; 1e-3 m"},
                       {"tilt_linf_rad", "rad; largest angle turned from the start"},
                       {"position_final_m", "m; distance from the exact place at the end (at rest: the displacement)"},
                       {"position_linf_m", "m; the same, largest over time"},
                       {"position_l2_m", "m; the same, root mean square over time"},
                       {"horizon_s", "s; first time at which it passes a tenth of the box's size"}}),
          make<SlopeErrors>};
}

ReferenceRow circular_sliding_row() {
  return {
      "circular_sliding",
      "a box that a turning drive slides round: Coulomb's slider integrated to 1e-12 (steady: the circle with speed "
      "sqrt(a^2 - mu^2 g^2)), and the polygon's slider, exact",
      and_polygon({{"position_final_m", "m; distance from the exact place at the end"},
                   {"position_linf_m", "m; the same, largest over time"},
                   {"position_l2_m", "m; the same, root mean square over time"},
                   {"horizon_s", "s; first time at which it passes a tenth of the box's size"},
                   {"radius_error_m", "m; radius (root mean square) of the last whole turn against the exact one's"},
                   {"centre_error_m", "m; mean place over the last whole turn against the exact one's"},
                   {"drift_per_turn_m", "m; shift of that mean a turn, beyond the exact one's"},
                   {"lift_linf_m", "m; largest displacement along the plane's normal"}}),
      make<TurnErrors>};
}

}  // namespace cb
