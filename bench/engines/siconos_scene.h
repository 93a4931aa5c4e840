#pragma once

// A scene in Siconos, in plain numbers: its headers are not C++20, so that what includes them is built by itself.

#include <memory>
#include <vector>

namespace siconos_scene {

struct Pose {
  double p[3], q[4];  ///< m; w, x, y, z
};
struct Body {
  double mass, inertia[3];  ///< kg, kg m^2
  Pose pose;
  double twist[6];  ///< velocity in the world, spin in the body's frame; m/s, rad/s
};
enum class Kind { sphere, box, cylinder, plane };
/// On a body, or fixed where `body` is negative; a plane's normal is z, a cylinder's axis y.
struct Shape {
  int body;
  Kind kind;
  double radius, size[3];  ///< m, whole lengths
  Pose at;                 ///< in the body's frame
  int group;               ///< that laws are between
};
struct Law {
  int a, b;  ///< groups
  double mu, restitution;
};
struct Scene {
  std::vector<Body> bodies;
  std::vector<Shape> shapes;
  std::vector<Law> laws;
  double gravity[3];  ///< m/s^2, in the step before the first
};
struct Setting {
  double step, theta, tolerance, newton_tolerance;
  int iterations, newton_iterations;
};

/// What the last step solved: M blocks of six, velocities of all bodies, and the contacts.
struct Contact {
  int body[2];      ///< the second negative where there is one
  double J[2][18];  ///< 3 x 6 each, row by row: n, t1, t2
  double impulse[3], mu;
};
struct Problem {
  std::vector<double> M, v_minus, v_plus;  ///< 36, 6, 6 a body
  std::vector<Contact> contacts;
};

class World {
 public:
  World(const Scene& scene, const Setting& setting);
  World(World&&) noexcept;
  ~World();
  void load(int body, const double force[3]);  ///< of the next step, N
  void step();
  void read(std::vector<Body>& bodies) const;  ///< pose and twist
  int contacts() const;
  void problem(Problem& out) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace siconos_scene
