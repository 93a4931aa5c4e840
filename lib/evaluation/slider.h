#pragma once

#include <Eigen/Core>
#include <limits>
#include <variant>
#include <vector>

namespace cb {

using Vec2 = Eigen::Vector2d;

/// Acceleration that drives a point mass in a plane, without friction: a constant, harmonics, and pushes in time
/// windows.
struct Drive {
  struct Harmonic {
    Vec2 amplitude;           ///< m/s^2, times cos(frequency t + phase)
    double frequency, phase;  ///< rad/s, rad
  };
  struct Push {
    Vec2 acceleration;  ///< m/s^2, in [from, to)
    double from, to;    ///< s
  };
  Vec2 constant = Vec2::Zero();
  std::vector<Harmonic> harmonics;
  std::vector<Push> pushes;

  /// Constant part in force at t, pushes included.
  Vec2 steady(double t) const;
  Vec2 at(double t) const;
  /// First time after t at which a push sets in or ends; infinite where there is none.
  double next_change(double t) const;
  /// Integrals of the drive from t0 to t, within one window: velocity gained, and way gained beyond v(t0) (t - t0).
  void integrate(double t0, double t, Vec2& velocity, Vec2& way) const;
};

/// Where a slider is.
struct SliderState {
  Vec2 p = Vec2::Zero();  ///< m
  Vec2 v = Vec2::Zero();  ///< m/s
};

/// A point mass on a plane whose friction acceleration is the element of a regular polygon that opposes the velocity
/// most (maximum dissipation): what Anitescu and Potra's model tends to as the step goes to zero. Exact: closed form
/// between events, events to round-off.
class PolygonSlider {
 public:
  /// Polygon: k vertices at radius `friction` (m/s^2, mu times the normal acceleration), the first at `angle` (rad).
  /// k = 2 is motion along one line, where polygon and circle agree.
  PolygonSlider(Drive drive, double friction, int k, double angle, const SliderState& start);
  /// State at t >= 0; times asked for must not decrease.
  SliderState at(double t);

 private:
  enum class Mode { rest, vertex, ray };  ///< at rest; opposed by one vertex; held on the bisector of two
  void classify(double t, const SliderState& state);
  void extend();
  SliderState evaluate(double t) const;
  bool holds(double t) const;
  Vec2 direction(double turn) const;

  Drive drive_;
  double friction_, angle_, half_angle_;
  int k_;
  double scan_ = 0;     ///< s, step within which no event comes and goes unseen
  double fastest_ = 0;  ///< m/s, largest speed met, to tell zero
  Mode mode_ = Mode::rest;
  int vertex_ = 0;                          ///< Mode::vertex: which
  Vec2 ray_ = Vec2::Zero();                 ///< Mode::ray: direction of the velocity
  Vec2 force_ = Vec2::Zero();               ///< constant part of the friction in force, m/s^2
  double t0_ = 0, t_safe_ = 0, t_end_ = 0;  ///< start of the segment, checked up to, next change of the drive
  bool ends_ = false;                       ///< does the segment end at t_safe_?
  int stalled_ = 0;                         ///< segments in a row without progress in time
  SliderState start_;
};

/// A point mass on a plane under Coulomb friction of constant strength against the velocity, by an embedded Runge-Kutta
/// method (Dormand and Prince 1980) with quintic interpolation of the way between its steps; in closed form where it
/// goes straight.
class DiskSlider {
 public:
  DiskSlider(Drive drive, double friction, const SliderState& start);
  /// State at t >= 0; times asked for must not decrease.
  SliderState at(double t);

 private:
  // Each to `room` (s) beyond t0_ at most.
  void rest(double room);
  void go_straight(double room);
  void set_off(double room);
  void slide(double room);
  void advance();
  void end_step(double h);
  bool holds(double t) const;  ///< does friction hold, at rest, what drives?
  double standing() const;     ///< m/s: up to this it counts as at rest
  bool on_one_line() const;    ///< velocity and a drive that is constant up to its next change
  Vec2 acceleration(double t, const Vec2& v) const;

  Drive drive_;
  double friction_;
  double fastest_ = 0;
  double t0_ = 0, t1_ = 0;  ///< s, ends of the last step
  double trial_ = 1e-3;     ///< s, length of the next step
  SliderState s0_, s1_;
  Vec2 a0_ = Vec2::Zero(), a1_ = Vec2::Zero();
};

using Slider = std::variant<PolygonSlider, DiskSlider>;

/// The exact slider under Coulomb's circular cone: along a line in closed form where drive and velocity share one line.
Slider coulomb_slider(const Drive& drive, double friction, const SliderState& start);

}  // namespace cb
