#include "evaluation/measure.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// Fraction of the body's size that an error passes at the horizon.
constexpr double horizon_fraction = 0.1;

}  // namespace

void Distance::add(double distance, double t, double size) {
  last_ = distance;
  largest_ = std::max(largest_, distance);
  sum2_ += distance * distance;
  ++samples_;
  if (!horizon_ && distance > horizon_fraction * size) horizon_ = t;
}

void Distance::report(const std::string& prefix, bool ended, Values& out) const {
  if (samples_ == 0) return;
  if (ended) out.emplace_back(prefix + "position_final_m", last_);
  out.emplace_back(prefix + "position_linf_m", largest_);
  out.emplace_back(prefix + "position_l2_m", std::sqrt(sum2_ / static_cast<double>(samples_)));
  if (horizon_) out.emplace_back(prefix + "horizon_s", *horizon_);
}

Halfway::Halfway(const SimulationOptions& options)
    : half_(options.duration / 2), slack_(options.stepping == Stepping::accuracy ? 0 : options.step / 2) {}

std::optional<double> Halfway::reached(double t) {
  const double before = std::exchange(t_, t);
  if (past_ || !(t >= half_ - slack_)) return std::nullopt;
  past_ = true;
  return slack_ > 0 ? 1.0 : (half_ - before) / (t - before);
}

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
  out.cone_sign = out.shape < plane ? -1 : 1;
  const Shape& shape = scenario.shapes[out.shape];
  const Pose pose{scenario.initial.pose[0].p, scenario.initial.pose[0].q * shape.local.q};
  out.gap = separation(shape, pose, scenario.shapes[plane], scenario.shapes[plane].local);
  return out;
}

double turned(const Quat& from, const Quat& to) {
  const double sine = (from.conjugate() * to).vec().norm();
  return 2 * std::asin(std::min(1.0, sine));
}

}  // namespace cb
