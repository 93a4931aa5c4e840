#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulation/simulation.h"

namespace cb {

/// Names (references()) and values, in the order in which they are reported.
using Values = std::vector<std::pair<std::string, double>>;

/// What gathers the errors of one run against a closed form, as the run goes. A hook that it has no use for stays
/// empty.
class Measure {
 public:
  virtual ~Measure() = default;
  virtual void observe_start(const State& /*state*/) {}
  virtual void observe_event(const EventRecord& /*event*/) {}
  virtual void observe_step(const State& /*state*/, const StepRecord& /*record*/) {}
  virtual void report(Values& out) const = 0;
};

/// Distance from a reference over time.
class Distance {
 public:
  /// `size` of the body, m: the horizon is the first time at which the distance passes a tenth of it.
  void add(double distance, double t, double size);
  /// position_final_m (where the run `ended`), position_linf_m, position_l2_m and horizon_s, behind `prefix`.
  void report(const std::string& prefix, bool ended, Values& out) const;

 private:
  double last_ = 0, largest_ = 0, sum2_ = 0;
  long samples_ = 0;
  std::optional<double> horizon_;
};

/// When a run is half over. Of equal steps the end of one counts; one to an accuracy may begin long before and end long
/// after.
class Halfway {
 public:
  Halfway() = default;
  explicit Halfway(const SimulationOptions& options);
  /// Of a step that ends at t, s: where in it T/2 is, as a fraction of the step; none but in the first that reaches it.
  std::optional<double> reached(double t);

 private:
  double half_ = 0, slack_ = 0, t_ = 0;  // s
  bool past_ = false;
};

/// A body on a plane: the one moving body of a scene and the one half-space.
struct OnPlane {
  int shape = -1;  ///< the body's
  Vec3 n, t1, t2;  ///< normal of the plane, in-plane axes at cone angle 0
  /// Times rotate_cone: the angle about n by which events turn t1, t2 (about the normal away from what is listed
  /// first).
  double cone_sign = 1;
  double gap = 0;  ///< of the shape at the start, m
  PairLaw law;
};
/// None where the scene is another, or the body's shape is not of this kind.
std::optional<OnPlane> body_on_plane(const Scenario& scenario, ShapeKind kind);

inline Vec3 velocity_of(const State& state, std::size_t body) { return Vec3(&state.v[6 * body]); }
inline Vec3 spin_of(const State& state, std::size_t body) { return Vec3(&state.v[6 * body + 3]); }
/// Angle between two orientations, exact near zero, rad.
double turned(const Quat& from, const Quat& to);

}  // namespace cb
