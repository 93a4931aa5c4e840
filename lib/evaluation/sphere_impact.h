#pragma once

#include "dynamics/model.h"

namespace cb {

/// A sphere whose inertia is the same about every axis.
struct SphereBody {
  double mass = 0, inertia = 0, radius = 0;  ///< kg, kg m^2, m
  double kinetic_energy(const Vec3& v, const Vec3& w) const {
    return 0.5 * (mass * v.squaredNorm() + inertia * w.squaredNorm());
  }
  /// Velocity of the point at -radius n, along the plane with normal n.
  Vec3 slip(const Vec3& v, const Vec3& w, const Vec3& n) const;
  /// Slip that one unit of tangential impulse removes: (1 + m r^2 / I) / m, 1/kg.
  double slip_per_impulse() const { return 1 / mass + radius * radius / inertia; }
};

/// State of the sphere after its impact.
struct SphereImpact {
  Vec3 v, w;     ///< m/s, rad/s
  Vec3 impulse;  ///< N s, total
  bool sticks = false;
};

/// SphereImpact of a sphere on a plane with normal n (unit, away from the plane): restitution e, Coulomb friction mu.
SphereImpact sphere_impact(const SphereBody& sphere, const Vec3& v, const Vec3& w, const Vec3& n, double mu, double e);

/// The same with the friction polygon of k vertices at `rotate_cone` about n from t1 (contact_tangents of n), as A-P
/// has it for e = 0.
SphereImpact sphere_impact_polygon(const SphereBody& sphere, const Vec3& v, const Vec3& w, const Vec3& n, double mu,
                                   int k, double rotate_cone);

/// The sphere's exact way from flight over impact (e = 0) and sliding to rolling, under constant gravity along -n.
struct SphereFlight {
  SphereFlight(const SphereBody& sphere, const Pose& start, const Vec3& v, const Vec3& w, double gap, const Vec3& n,
               double g, double mu);
  Vec3 position(double t) const;
  double t_impact = 0;  ///< s; infinite if it never comes down
  double t_roll = 0;    ///< s; infinite without friction or impact
  double gravity() const { return g_; }

 private:
  Vec3 p0_, v0_, n_, p_impact_, v_impact_, slowing_;
  double g_;
};

}  // namespace cb
