// What the models of today are known for, as motions: softness creeps and lifts, a convex model without a bound lifts,
// friction by bisection slides too far, ten sweeps of Gauss and Seidel lose a stack, and only polygons know north.

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;  // m/s^2

Claimant soft(const std::string& variant = "sap") {
  Claimant out{"soft " + variant, "soft"};
  out.options.variant = variant;
  return out;
}

Claimant coulomb(const std::string& solver, int sweeps = 0) {
  Claimant out{"coulomb/" + solver, "coulomb"};
  out.options.solver = solver;
  out.options.sweeps = sweeps;
  return out;
}

/// Of a run whose answers may be inaccurate, as those of games are: the last state.
State left(const Scenario& s, const Claimant& who, double duration) {
  SimulationOptions options;
  options.step = s.step;
  options.duration = duration;
  Simulation run(s, options, find_method(who.method)->make(who.options), find_method(who.method)->law);
  while (!run.done()) {
    const Status status = run.step().status;
    INFO(who.name << ": " << run.reason());
    REQUIRE((status == Status::ok || status == Status::inaccurate));
  }
  return run.state();
}

/// A cube of 1 m and 1 kg on a plane that is steep by `tilt`, downhill along x; gravity is tilted, not the plane.
Scenario cube_on_plane(double tilt, double mu, double h, double speed = 0) {
  Scenario s = empty_scene(h, 10);
  s.gravity.constant = {g * std::sin(tilt), -g * std::cos(tilt), 0};
  add_ground(s);
  add_box(s, {1, 1, 1}, 1, {{0, 0.5, 0}, Quat::Identity()}, {speed, 0, 0});
  collide_all(s, mu);
  return s;
}

double along(const Scenario& s, const Claimant& who, Stepping way, double duration) {
  Stepped run(s, who, way);
  run.step(static_cast<int>(std::lround(duration / s.step)));
  return run.pose().p.x();
}
double height(const Scenario& s, const Claimant& who, Stepping way, double duration) {
  Stepped run(s, who, way);
  double highest = 0;
  for (long i = std::lround(duration / s.step); i > 0; --i) {
    run.step();
    highest = std::max(highest, run.pose().p.y() - 0.5);
  }
  return highest;
}

}  // namespace

// Each of four contacts carries a quarter of m g sin(tilt) h along the slope, under which it slips by R_t of that; and
// the front ones carry more of the weight than the rear ones, by a quarter of m g sin(tilt) h each, under which the
// cube pitches by R_n of that over its length, and its centre half a metre above moves with it. Together
//   (R_t + R_n) / 4 m g sin(tilt) h,   R_t = sigma w,   R_n = beta^2 w / (4 pi^2),   w = |W_ii| / 3.
// W_ii = 5.5 I - 6 a a^T of a cube, a = (+-1, +-1, +-1)/2: |W_ii|^2 = 3 * 4^2 + 6 * 1.5^2 = 61.5 (1/kg)^2.
TEST_CASE("soft never sticks: a cube on a slope creeps by a share of g h, half as far at half the step") {
  const double tilt = 0.4, sigma = 1e-3, w = std::sqrt(61.5) / 3;
  struct Case {
    Stepping way;
    double beta;
  };
  for (const Case& c : {Case{Stepping::events, 1}, Case{Stepping::steps, 1}, Case{Stepping::steps, 0.01}}) {
    Claimant who = soft();
    who.options.beta = c.beta;
    const double share = (sigma + c.beta * c.beta / (4 * M_PI * M_PI)) * w / 4;
    double last = 0;
    for (const double h : {4e-3, 2e-3, 1e-3}) {
      const double creep = along(cube_on_plane(tilt, 0.7, h), who, c.way, 0.4);
      INFO("beta " << c.beta << ", h " << h);
      CHECK(creep == Approx(share * g * std::sin(tilt) * h * 0.4).epsilon(0.06));
      if (last > 0) CHECK(last / creep == Approx(2).epsilon(0.03));
      last = creep;
    }
  }
  CHECK(along(cube_on_plane(tilt, 0.7, 1e-3), convex(true), Stepping::events, 0.4) == Approx(0).margin(1e-12));
}

// u_n = mu u_t as soon as it slides. Impulses that bring a cube of 1 kg up to v_y take mu v_y off its slip:
//   v_y = mu (v - mu v_y),   v_y = mu v / (1 + mu^2),
// which throws it v_y^2 / (2 g) high, but for what R and a step of gravity take of it.
TEST_CASE(
    "without a bound a convex model throws what slides, the higher the rougher and the faster; the law does not") {
  for (const Stepping way : {Stepping::events, Stepping::steps})
    for (const double mu : {0.1, 0.4})
      for (const double v : {1.0, 4.0}) {
        const double h = 1e-3, up = mu * v / (1 + mu * mu), expected = up * up / (2 * g);
        const auto high = [&](const Claimant& who) {
          return height(cube_on_plane(0, mu, h, v), who, way, 1.2 * up / g);
        };
        INFO("mu " << mu << ", " << v << " m/s");
        CHECK(high(convex(false)) == Approx(expected).epsilon(0.15));
        CHECK(high(soft()) == Approx(expected).epsilon(0.15));
        for (const Claimant& who : {convex(true), ap(), coulomb("newton"), coulomb("cascade")})
          CHECK(high(who) == Approx(0).margin(1e-9));
      }
}

// The cube's corners have W_nt: friction that leaves the least energy with u_n = 0 is not against the slip, and the
// four deviations cancel but for what is missing along the slip.
TEST_CASE("friction by bisection lets a cube slide too far; by the law itself it stops after v^2 / (2 mu g)") {
  const double mu = 0.5, v = 1, h = 1e-3, far = v * v / (2 * mu * g);
  const Scenario s = cube_on_plane(0, mu, h, v);
  const double by_law = left(s, coulomb("nsgs"), 0.4).pose[0].p.x();
  const double by_bisection = left(s, coulomb("bisection"), 0.4).pose[0].p.x();
  CHECK(by_law == Approx(far).epsilon(0.01));
  CHECK(by_bisection > 1.01 * by_law);
}

TEST_CASE("ten sweeps of Gauss and Seidel lose a stack of 64 that is held to rounding when the law is solved",
          "[.long]") {
  const auto lost = [](const std::string& solver, int sweeps) {
    Scenario s = empty_scene(1e-3, 0.5);
    s.gravity.constant = {0, -g, 0};
    add_ground(s);
    for (int i = 0; i < 64; ++i) add_box(s, {1, 1, 1}, 1, {{0, 0.5 + i, 0}, Quat::Identity()});
    collide_all(s, 0.5);
    double moved = 0;
    const State end = left(s, coulomb(solver, sweeps), 0.5);
    for (int i = 0; i < 64; ++i) moved = std::max(moved, (end.pose[i].p - Vec3(0, 0.5 + i, 0)).norm());
    return moved;
  };
  CHECK(lost("newton", 0) < 1e-9);
  CHECK(lost("nsgs", 10) > 1e-4);
}

// A cube that slides and spins, and the same with everything turned about the vertical.
TEST_CASE("motions do not depend on the heading, but those of polygons do") {
  const double yaw = 0.7, h = 2e-3;
  const Quat turn(Eigen::AngleAxisd(yaw, Vec3::UnitY()));
  const auto end = [&](const Claimant& who, const Quat& heading) {
    Scenario s = empty_scene(h, 10);
    s.gravity.constant = {0, -g, 0};
    add_ground(s);
    add_box(s, {1, 1, 1}, 1, {{0, 0.5, 0}, heading}, heading * Vec3(1, 0, 0.3), {0, 1, 0});
    collide_all(s, 0.4);
    return left(s, who, 0.1);
  };
  const auto apart = [&](const Claimant& who) {
    const State straight = end(who, Quat::Identity()), turned = end(who, turn);
    return (turn * straight.pose[0].p - turned.pose[0].p).norm();
  };
  std::vector<Claimant> isotropic = {convex(true), convex(false), soft("sap"), soft("mujoco")};
  for (const char* solver : {"newton", "nsgs", "admm", "cascade"}) isotropic.push_back(coulomb(solver));
  for (const Claimant& who : isotropic) {
    INFO(who.name);
    CHECK(apart(who) < 1e-9);
  }
  CHECK(apart(ap()) > 1e-6);
}
