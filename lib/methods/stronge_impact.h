#pragma once

#include <Eigen/Core>

#include "contact/problem.h"

namespace cb {

struct ImpactOptions {
  /// Local error of a step of the integration, as a fraction of the fastest approach of its island before the event
  /// (velocities; works: of its energy), -. Looser: slip directions and works are less exact by about that much.
  double integration = 1e-10;
  /// The same as a fraction of the approach of the micro-impact at hand: late ones are slow, and the bound above no
  /// bound.
  double integration_own = 1e-4;
  /// Local error of the direction of sliding, rad: binds where the slip is about to stop and errors of the velocity no
  /// longer do. Its effect on the impulse shrinks with the slip. Looser: steps that are too long to be stable.
  double turn = 1e-3;
  int step_limit = 5000;  ///< accepted and rejected steps of one micro-impact; beyond: nonconverged
};

/// One impact at one contact: what came of it.
struct Impact {
  Status status = Status::ok;                   ///< ok, nonconverged (step limit), singular (K) or not_finite
  Eigen::Vector3d r = Eigen::Vector3d::Zero();  ///< N s: n, t1, t2
  double compression_work = 0;                  ///< J, <= 0: of the normal impulse while u_n < 0
  double restitution_work = 0;                  ///< J, >= 0: of the normal impulse while u_n > 0
  double friction_work = 0;                     ///< J, <= 0
  bool slid = false, stuck = false, diverged = false, locked = false;  ///< modes that it passed through
  int steps = 0;
};

/// Integrates one impact in impulse space. K (3 x 3, 1/kg), u (m/s, u_n < 0), `no_slip`: slip below is none, m/s;
/// `event_approach`: the fastest approach of its island before the event, m/s, which the errors of the integration are
/// measured against.
void integrate_impact(const Eigen::Matrix3d& K, const Eigen::Vector3d& u, double mu, double e, double no_slip,
                      double event_approach, const ImpactOptions& options, Impact& impact);

}  // namespace cb
