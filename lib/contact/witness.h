#pragma once

#include <optional>
#include <variant>
#include <vector>

namespace cb {

// What proves an answer beyond its impulses, a struct a law. First what the method was asked (terms), then the proof.

/// newton, and every law that is checked on impulses and velocities alone.
struct NoWitness {
  void clear() {}
};

/// mirtich: works at each contact over all its micro-impacts. Claimed: restitution = -e^2 compression >= 0,
/// friction <= 0, and all three sum to the change of kinetic energy r.u- + 1/2 r.W r.
struct WorkWitness {
  std::vector<double> compression;  ///< nc, <= 0, J: of the normal impulse while the contact approached
  std::vector<double> restitution;  ///< nc, >= 0, J: of the normal impulse while it separated
  std::vector<double> friction;     ///< nc, <= 0, J

  void clear();
};

/// anitescu_potra: z = (c_n [nc], c_t [k nc, contact by contact], lam [nc]), with restitution once for each phase;
/// direction i of a contact is cos(2 pi i / k) t1 + sin(2 pi i / k) t2.
struct PolygonWitness {
  int k = 0;                  ///< edges of the polygon
  double regularisation = 0;  ///< added to the diagonal of the LCP
  std::vector<double> z;      ///< (k + 2) nc; c_n and c_t in N s, lam in m/s

  void clear();
};

/// convex: multipliers of N v+ >= 0, and the bound on the sum of normal impulses with its certificate.
struct ConvexWitness {
  bool bounded = false;                    ///< is the sum of normal impulses bounded per island?
  double epsilon = 0;                      ///< J, the suboptimality that the solver was allowed for this event
  std::optional<double> epsilon_relative;  ///< terms: epsilon is this fraction of the kinetic energy before the event
  std::vector<double> eta;                 ///< nc, >= 0, in m/s-dual units (N s)
  std::vector<double> frictionless;  ///< nc, f >= 0: normal impulses of the frictionless problem with least sum, N s
  std::vector<double> kappa_dual;    ///< nv, z: proves the least sum: N z <= 1 on touching contacts, f.(1 - N z) = 0

  void clear();
};

/// How contacts give way: what is asked of `soft` (contact/softness.h).
struct Softness {
  enum class Rule { sap, mujoco };
  Rule rule = Rule::sap;
  double beta = 1;         ///< sap, -: R_n = beta^2 w / (4 pi^2) where contacts are near rigid
  double sigma = 1e-3;     ///< sap, -: R_t = sigma w
  double compliance = 0;   ///< sap, 1/kg: R_n is at least this, 1 / (h (h + tau_d) k) of a contact of stiffness k
  double impedance = 0.9;  ///< mujoco, -: d, R_n = (1 - d) / d W_nn
  double impratio = 1;     ///< mujoco, -: R_t = R_n / impratio
};

/// soft: terms alone. What proves an answer is that it is optimal with the R that they give, which the check computes.
struct SoftWitness {
  Softness softness;

  void clear() { softness = {}; }
};

using Witness = std::variant<NoWitness, WorkWitness, PolygonWitness, ConvexWitness, SoftWitness>;

}  // namespace cb
