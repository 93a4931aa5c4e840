#pragma once

#include <optional>

#include "engine.h"
#include "evaluation/scene_errors.h"

namespace cb {

/// A sphere's impacts as its velocities show them, for the errors that are measured at events: engines have none.
/// An event is the steps in a row in which the velocity along the normal changes by more than twice what gravity does
/// in a step (a compliant contact takes several); a step with a lesser contact impulse is an event by itself. The
/// velocity before an event takes in what the loads do in its first step. In other scenes it sees nothing.
class ObservedImpact {
 public:
  /// `single`: are the engine's velocities of single precision?
  ObservedImpact(const Scenario& scenario, bool single);
  /// A step of h seconds from `before` to `after` under `loads`; a finished event goes to `errors`.
  void observe(const State& before, const State& after, const Loads& loads, double h, SceneErrors& errors);

 private:
  using Twist = Eigen::Matrix<double, 6, 1>;
  struct Impact {
    double t;  ///< s, start of the step in which it began
    Twist before, after;
  };
  void emit(const Impact& impact, SceneErrors& errors) const;

  std::optional<OnPlane> on_;
  double mass_ = 0, inertia_ = 0;
  double rounding_;               // of a velocity: less is no contact's push
  std::optional<Impact> impact_;  // that goes on
};

}  // namespace cb
