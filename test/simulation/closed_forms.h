#pragma once

// Who is held against closed forms, and how a scene is run by each of them.

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "scenes.h"
#include "simulation/simulation.h"

namespace cb::test {

/// A method with the flags that decide which law it claims.
struct Claimant {
  std::string name;  ///< as a failed check prints it
  std::string method;
  MethodOptions options = {};
};

inline Claimant ap(const std::string& solver = "lemke", int k = 8) {
  Claimant out{"ap/" + solver + " k = " + std::to_string(k), "ap"};
  out.options.solver = solver;
  out.options.k = k;
  return out;
}
inline Claimant convex(bool bounded) {
  Claimant out{bounded ? "convex" : "convex without the bound", "convex"};
  out.options.compression_bound = bounded;
  return out;
}
inline Claimant newton() {
  Claimant out{"newton, stick-tested", "newton"};
  out.options.variant = "stick-tested";
  return out;
}
inline Claimant mirtich() { return {"mirtich", "mirtich"}; }

/// Coulomb's law with complementarity. Motions of the closed forms go along x, a direction of every polygon.
inline std::vector<Claimant> complementarity() { return {ap("lemke"), ap("path"), ap("ynl")}; }
inline std::vector<Claimant> operator+(std::vector<Claimant> a, const std::vector<Claimant>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Every method but those whose contacts give way.
inline std::vector<MethodRow> rigid_methods() {
  std::vector<MethodRow> out;
  for (const MethodRow& row : methods())
    if (row.law != soft_law()) out.push_back(row);
  return out;
}

/// A run that is told one step at a time; a step that does not end `ok` fails the test.
class Stepped {
 public:
  Stepped(const Scenario& scenario, const Claimant& who, Stepping way = Stepping::events)
      : scenario_(std::make_unique<Scenario>(scenario)),
        simulation_(*scenario_, options(*scenario_, way), find_method(who.method)->make(who.options),
                    find_method(who.method)->law) {}
  void step(int n = 1) {
    for (int i = 0; i < n; ++i) {
      const Status status = simulation_.step().status;
      INFO(simulation_.reason());
      REQUIRE(status == Status::ok);
    }
  }
  Vec3 velocity(int body = 0) const { return Vec3(&simulation_.state().v[6 * static_cast<std::size_t>(body)]); }
  Vec3 spin(int body = 0) const { return Vec3(&simulation_.state().v[6 * static_cast<std::size_t>(body) + 3]); }
  const Pose& pose(int body = 0) const { return simulation_.state().pose[static_cast<std::size_t>(body)]; }
  Simulation& simulation() { return simulation_; }

 private:
  static SimulationOptions options(const Scenario& s, Stepping way) {
    SimulationOptions out;
    out.stepping = way;
    out.step = s.step;
    out.duration = s.duration;
    return out;
  }
  std::unique_ptr<Scenario> scenario_;
  Simulation simulation_;
};

/// A link on a rail along x through its centre: what is driven along it. Its shape is added by the caller.
inline int add_on_rail(Scenario& s, const Shape& shape, double mass, const Vec3& p, double speed = 0) {
  const int body = add_free(s, shape, mass, Vec3::Ones(), {p, Quat::Identity()}, {speed, 0, 0}, Vec3::Zero());
  Tree tree;
  tree.name = "rail" + std::to_string(body);
  tree.v = static_cast<int>(s.initial.qd.size());
  tree.nv = 1;
  Joint joint;
  joint.name = tree.name;
  joint.kind = JointKind::prismatic;
  joint.body = body;
  joint.anchor_P = p;
  joint.q = static_cast<int>(s.initial.q.size());
  joint.v = tree.v;
  tree.joints.push_back(joint);
  s.initial.q.push_back(0);
  s.initial.qd.push_back(speed);
  s.model.bodies[static_cast<std::size_t>(body)].tree = static_cast<int>(s.model.trees.size());
  s.model.trees.push_back(tree);
  return body;
}

inline Shape box_shape(const Vec3& size) {
  Shape shape;
  shape.kind = ShapeKind::box;
  shape.half_extents = size / 2;
  return shape;
}
inline Shape sphere_shape(double radius) {
  Shape shape;
  shape.kind = ShapeKind::sphere;
  shape.radius = radius;
  return shape;
}

/// Shapes a and b, in the order in which they were added, meet with friction mu.
struct Pair {
  int a, b;
  double mu;
};
/// These pairs collide and no others.
inline void collide(Scenario& s, const std::vector<Pair>& pairs, double restitution = 0) {
  const int n = static_cast<int>(s.shapes.size());
  s.pairs = {};
  s.pairs.groups = n;
  for (int i = 0; i < n; ++i) s.pairs.group.push_back(i);
  s.pairs.index.assign(s.shapes.size() * s.shapes.size(), -1);
  for (const Pair& pair : pairs) {
    for (const int at : {pair.a * n + pair.b, pair.b * n + pair.a})
      s.pairs.index[static_cast<std::size_t>(at)] = static_cast<int>(s.pairs.laws.size());
    s.pairs.laws.push_back({pair.mu, restitution});
  }
}

}  // namespace cb::test
