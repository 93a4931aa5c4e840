#pragma once

// Scenes built in code, so that the stepper is tested without the XML loader.

#include "scenario/scenario.h"

namespace cb::test {

inline Scenario empty_scene(double step, double duration) {
  Scenario s;
  s.name = "test";
  s.step = step;
  s.duration = duration;
  return s;
}

/// All shapes collide with all others under one law.
inline void collide_all(Scenario& s, double mu, double restitution = 0) {
  s.pairs.group.assign(s.shapes.size(), 0);
  s.pairs.groups = 1;
  s.pairs.index = {0};
  s.pairs.laws = {{mu, restitution}};
}

inline int add_ground(Scenario& s, const Quat& tilt = Quat::Identity()) {
  Shape ground;
  ground.kind = ShapeKind::half_space;
  ground.name = "ground";
  ground.local.q = tilt;
  s.shapes.push_back(ground);
  return static_cast<int>(s.shapes.size()) - 1;
}

inline int add_free(Scenario& s, const Shape& shape, double mass, const Vec3& inertia, const Pose& pose, const Vec3& v,
                    const Vec3& w) {
  const int body = static_cast<int>(s.model.bodies.size());
  s.model.bodies.push_back({"body" + std::to_string(body), mass, inertia});
  s.initial.pose.push_back(pose);
  for (const Vec3& part : {v, w})
    for (int i = 0; i < 3; ++i) s.initial.v.push_back(part[i]);
  Shape attached = shape;
  attached.body = body;
  attached.name = s.model.bodies.back().name;
  s.shapes.push_back(attached);
  return body;
}

inline int add_sphere(Scenario& s, double radius, double mass, const Vec3& p, const Vec3& v = Vec3::Zero(),
                      const Vec3& w = Vec3::Zero()) {
  Shape shape;
  shape.kind = ShapeKind::sphere;
  shape.radius = radius;
  return add_free(s, shape, mass, Vec3::Constant(0.4 * mass * radius * radius), {p, Quat::Identity()}, v, w);
}

inline int add_box(Scenario& s, const Vec3& size, double mass, const Pose& pose, const Vec3& v = Vec3::Zero(),
                   const Vec3& w = Vec3::Zero()) {
  Shape shape;
  shape.kind = ShapeKind::box;
  shape.half_extents = size / 2;
  const Vec3 squares = size.cwiseAbs2();
  const Vec3 inertia = mass / 12 * Vec3(squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]);
  return add_free(s, shape, mass, inertia, pose, v, w);
}

/// A carriage of 2 kg on a rail along x, the scene's only body, at this rate (m/s) and at a stop at 0 that moves with
/// 0.5 m/s.
inline void add_carriage(Scenario& s, double rate, bool lower = true) {
  s.model.bodies.push_back({"carriage", 2, Vec3::Ones(), 0});
  Joint joint;
  joint.kind = JointKind::prismatic;
  joint.body = joint.q = joint.v = 0;
  (lower ? joint.lower : joint.upper) = 0;
  joint.limit_rate = 0.5;
  Tree tree;
  tree.joints = {joint};
  tree.nv = 1;
  s.model.trees = {tree};
  s.initial.pose.resize(1);
  s.initial.v = {rate, 0, 0, 0, 0, 0};
  s.initial.q = {0};
  s.initial.qd = {rate};
}

}  // namespace cb::test
