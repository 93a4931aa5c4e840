#pragma once

// Single impacts and small scenes for the methods that take one contact at a time.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "contact/problem.h"
#include "problems.h"

namespace cb::test {

/// r.u- + 1/2 r.W r (J): change of kinetic energy that the impulses make, and what they make of the velocities.
struct Outcome {
  std::vector<double> v, u_minus, u;
  double energy_before = 0, energy_change = 0;
};
inline Outcome outcome(const ContactProblem& p, const std::vector<double>& r) {
  Outcome out;
  BlockCholesky factor;
  factor.factor(p.M);
  apply_impulse(p, factor, r, out.v);
  contact_velocity(p, p.v_minus, out.u_minus);
  contact_velocity(p, out.v, out.u);
  for (int i = 0; i < 3 * p.nc(); ++i) out.energy_change += 0.5 * r[i] * (out.u[i] + out.u_minus[i] - 2 * p.offset[i]);
  out.energy_before = 0.5 * quadratic_form(p.M, p.v_minus);
  return out;
}

/// n, t1, t2 for any unit normal.
inline Matrix3d axes_of(const Vector3d& n) {
  const Vector3d t1 = n.unitOrthogonal();
  Matrix3d axes;
  axes.row(0) = n;
  axes.row(1) = t1;
  axes.row(2) = n.cross(t1);
  return axes;
}

/// Two bodies of random mass (up to 1e4 apart), inertia, arms and velocities that meet at one contact.
inline ContactProblem random_impact(std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-1, 1), fraction(0, 1);
  const auto vector = [&] { return Vector3d(uniform(generator), uniform(generator), uniform(generator)); };
  ContactProblem p;
  for (int i = 0; i < 2; ++i) {
    const double m = std::pow(10.0, 2 * uniform(generator));
    // Moments of a box: the triangle inequality holds.
    const Vector3d side = Vector3d(0.2, 0.2, 0.2) + vector().cwiseAbs();
    const Vector3d squares = side.cwiseAbs2();
    add_body(p, m, m / 12 * (Vector3d::Constant(squares.sum()) - squares), 3 * vector(), 3 * vector());
  }
  const double mu = fraction(generator) < 0.1 ? 0 : 10 * std::pow(fraction(generator), 3);
  const double draw = fraction(generator);
  const double e = draw < 0.1 ? 0 : draw > 0.9 ? 1 : fraction(generator);
  add_contact(p, 0, vector(), 1, vector(), axes_of(vector().normalized()), mu, e);
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  if (u[0] > 0)
    for (double& v : p.v_minus) v = -v;
  return p;
}

/// The same problem with all bodies in one block of M, as an articulated tree would have it.
inline ContactProblem one_block(const ContactProblem& p) {
  ContactProblem out = p;
  out.M.clear();
  out.M.add_block(p.nv());
  for (int b = 0; b < p.M.blocks(); ++b)
    out.M.block(0).block(p.M.first[b], p.M.first[b], p.M.block_size(b), p.M.block_size(b)) = p.M.block(b);
  out.J.clear();
  for (int c = 0; c < p.nc(); ++c) {
    out.J.add_band();
    auto J = out.J.entry(out.J.add_entry(0, p.nv()));
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e)
      J.middleCols(p.M.first[p.J.block[e]], p.J.entry(e).cols()) = p.J.entry(e);
  }
  return out;
}

inline Vector3d linear(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }
inline Vector3d angular(const std::vector<double>& v) { return {v[3], v[4], v[5]}; }

}  // namespace cb::test
