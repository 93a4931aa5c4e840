#pragma once

// Contact problems with known answers, built without the program's own geometry.

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "contact/problem.h"

namespace cb::test {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Appends a free body: mass (kg), principal inertia (kg m^2), velocity (linear, angular).
inline int add_body(ContactProblem& p, double mass, const Vector3d& inertia, const Vector3d& v,
                    const Vector3d& w = Vector3d::Zero()) {
  const int b = p.M.add_block(6);
  p.M.block(b).diagonal().head<3>().setConstant(mass);
  p.M.block(b).diagonal().tail<3>() = inertia;
  for (int i = 0; i < 3; ++i) p.v_minus.push_back(v[i]);
  for (int i = 0; i < 3; ++i) p.v_minus.push_back(w[i]);
  return b;
}

/// Appends a contact between body a (the normal points to it) and body b (-1: the world); arms from the centres of
/// mass. Axes: rows n, t1, t2.
inline void add_contact(ContactProblem& p, int a, const Vector3d& arm_a, int b, const Vector3d& arm_b,
                        const Matrix3d& axes, double mu, double e = 0) {
  p.J.add_band();
  const auto add = [&](int body, const Vector3d& arm, double sign) {
    auto J = p.J.entry(p.J.add_entry(body, 6));
    for (int row = 0; row < 3; ++row) {
      const Vector3d d = axes.row(row);
      J.row(row).head<3>() = sign * d;
      J.row(row).tail<3>() = sign * arm.cross(d);
    }
  };
  if (b >= 0 && b < a) add(b, arm_b, -1);
  if (a >= 0) add(a, arm_a, 1);
  if (b > a) add(b, arm_b, -1);
  p.offset.insert(p.offset.end(), 3, 0.0);
  p.mu.push_back(mu);
  p.restitution.push_back(e);
}

/// Axes of a horizontal plane: n = y, t1 = x, t2 = n x t1 = -z.
inline Matrix3d ground_axes(double turn = 0) {
  Matrix3d axes;
  axes << 0, 1, 0, std::cos(turn), 0, -std::sin(turn), -std::sin(turn), 0, -std::cos(turn);
  return axes;
}

/// The same contacts with their tangents turned about the normals (rad): another basis of the same friction.
inline ContactProblem turn_tangents(ContactProblem p, double turn) {
  const Eigen::Rotation2Dd turned(turn);
  for (int c = 0; c < p.nc(); ++c)
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e) {
      const Eigen::MatrixXd rows = p.J.entry(e).bottomRows(2);
      p.J.entry(e).bottomRows(2) = turned.toRotationMatrix() * rows;
    }
  return p;
}

/// Solid sphere of the paper's first scene, touching the ground.
inline ContactProblem sphere(const Vector3d& v, const Vector3d& w, double mu = 0.60581, double e = 0) {
  ContactProblem p;
  const double m = 4.0 / 3.0 * M_PI;
  add_body(p, m, Vector3d::Constant(0.4 * m), v, w);
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), mu, e);
  return p;
}

/// n unit cubes of 1 kg on each other, four corner contacts an interface, each with velocity v plus a seeded random
/// part of the given size.
inline ContactProblem stack(int n, double mu, const Vector3d& v = Vector3d::Zero(), double random = 0,
                            unsigned seed = 1) {
  ContactProblem p;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-random, random);
  const auto noise = [&] { return Vector3d(uniform(generator), uniform(generator), uniform(generator)); };
  for (int i = 0; i < n; ++i) {
    const Vector3d linear = v + noise();
    add_body(p, 1, Vector3d::Constant(1.0 / 6), linear, noise());
  }
  for (int i = 0; i < n; ++i)
    for (double x : {-0.5, 0.5})
      for (double z : {-0.5, 0.5}) add_contact(p, i, {x, -0.5, z}, i - 1, {x, 0.5, z}, ground_axes(), mu);
  return p;
}

/// Four corner contacts of one cube.
inline ContactProblem box(double mu, const Vector3d& v, const Vector3d& w = Vector3d::Zero()) {
  ContactProblem p = stack(1, mu, v);
  for (int i = 0; i < 3; ++i) p.v_minus[3 + i] = w[i];
  return p;
}

}  // namespace cb::test
