#pragma once

// A scene in plain numbers, for the halves of adapters that speak with a library whose headers are no C++20 or align
// Eigen's types otherwise than this program: they include nothing of ours but this.

#include <vector>

namespace cb::plain {

struct Pose {
  double p[3], q[4];  ///< m; w, x, y, z
};
struct Body {
  double mass, inertia[3];  ///< kg; principal, kg m^2
  Pose pose;
  double v[3], w[3];  ///< m/s, rad/s, world
};
enum class Kind { sphere, box, cylinder, half_space };
/// On a body, or fixed where `body` is negative. Axis of a cylinder and normal of a half-space: y.
struct Shape {
  int body;
  Kind kind;
  double radius, half[3];  ///< m; half[1] of a cylinder: half its length
  Pose at;                 ///< in the body's frame
};
/// Shapes of different bodies that meet; those of no pair pass through each other.
struct Pair {
  int a, b;
  double mu, restitution;
};
struct Scene {
  std::vector<Body> bodies;
  std::vector<Shape> shapes;
  std::vector<Pair> pairs;
};

/// A contact of a step: the second body is negative where it is the world.
struct Contact {
  int body[2];
  double J[2][18];                                  ///< 3 x 6 each, row by row: n, t1, t2
  double impulse[3], offset[3], compliance[3], mu;  ///< as in OwnProblem
};
/// What the last step solved: blocks of six, column by column, and velocities of all bodies: linear and angular, in
/// frames that are the engine's.
struct Problem {
  std::vector<double> M, v_minus, v_plus;  ///< 36, 6, 6 a body
  std::vector<Contact> contacts;
};

/// What an adapter makes of a scene. Velocities are of the world, places of centres of mass.
class World {
 public:
  virtual ~World() = default;
  virtual void load(int body, const double force[3]) = 0;  ///< of the next step, N
  virtual void step(double h) = 0;
  virtual void read(std::vector<Body>& bodies) = 0;
  virtual int contacts() const = 0;                     ///< negative: it does not say
  virtual const Problem* problem() { return nullptr; }  ///< of the last step; null: it does not say
};

}  // namespace cb::plain
