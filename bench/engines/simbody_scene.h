#pragma once

// A scene in Simbody, in plain numbers: its headers are not C++20, so that what includes them is built by itself.

#include <memory>
#include <string>
#include <vector>

namespace simbody {

struct Pose {
  double p[3], q[4];  ///< m; w, x, y, z
};
struct Body {
  double mass, inertia[3];  ///< kg, kg m^2
  Pose pose;
  double v[3], w[3];  ///< m/s, rad/s, world
};
/// A sphere (`radius`) or a box (`half`) on a body.
struct Shape {
  int body;
  bool sphere;
  double radius, half[3];  ///< m
  Pose local;
};
struct Plane {
  double normal[3], height;  ///< unit; m along it
};
/// Contact of a shape with a plane.
struct Pair {
  int shape, plane;
  double mu, restitution;
};
struct Scene {
  std::vector<Body> bodies;
  std::vector<Shape> shapes;
  std::vector<Plane> planes;
  std::vector<Pair> pairs;
};
struct Setting {
  bool rigid, pgs;
  double stiffness, dissipation, transition_speed, accuracy, constraint_tolerance;
};

class World {
 public:
  World(const Scene& scene, const Setting& setting);
  World(World&&) noexcept;
  ~World();
  void load(int body, const double force[3]);  ///< of the next step, N
  void step_to(double t);                      ///< s
  void read(std::vector<Body>& bodies) const;  ///< pose, v and w

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

std::string version();

}  // namespace simbody
