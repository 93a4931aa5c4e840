// Closed forms of bodies that are no unit ones: each length, mass and axis counts by itself.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "evaluation/scene_errors.h"
#include "evaluation/sphere_impact.h"

using namespace cb;
using std::numbers::pi;

namespace {

using Errors = std::map<std::string, double>;

Errors named(const SceneErrors& errors) {
  Errors out;
  for (const auto& [name, value] : errors.finish()) out[name] = value;
  return out;
}

/// A thick shell of 2 kg, 0.5 m of radius and 0.1 kg m^2: a unit of tangential impulse takes 1/2 + 1/4 / 0.1 = 3 of
/// slip.
constexpr SphereBody shell{2, 0.1, 0.5};

/// A body of `mass` on a plane with normal `turn` y, its shape `turn` turned as the plane.
Scenario on_plane(const std::string& reference, const Shape& shape, double mass, double mu, const Quat& turn) {
  Scenario scenario;
  scenario.reference = {ReferenceKind::analytic, reference, {}};
  scenario.model.bodies = {{"body", mass, Vec3::Constant(0.1)}};
  Shape plane;
  plane.kind = ShapeKind::half_space;
  plane.local.q = turn;
  scenario.shapes = {plane, shape};
  scenario.shapes[1].body = 0;
  scenario.pairs.group = {0, 1};
  scenario.pairs.groups = 2;
  scenario.pairs.index = {-1, 0, 0, -1};
  scenario.pairs.laws = {{mu, 0}};
  scenario.initial.pose.resize(1);
  scenario.initial.pose[0].q = turn;
  scenario.initial.v.assign(6, 0);
  return scenario;
}

Shape brick(const Vec3& half_extents) {
  Shape shape;
  shape.kind = ShapeKind::box;
  shape.half_extents = half_extents;
  return shape;
}

/// Errors of a body that goes by `moved(t)` from where it starts.
template <class Moved>
Errors errors_of(const Scenario& scenario, double duration, double h, int k, const Moved& moved) {
  SimulationOptions options;
  options.step = h;
  options.duration = duration;
  SceneErrors errors(scenario, options, k);
  errors.observe_start(scenario.initial);
  State state = scenario.initial;
  for (long n = 1; n <= std::lround(duration / h); ++n) {
    state.t = static_cast<double>(n) * h;
    state.pose[0].p = scenario.initial.pose[0].p + moved(state.t);
    errors.observe_step(state, StepRecord());
  }
  return named(errors);
}

bool has_exact(const Errors& errors) { return errors.count("position_linf_m") == 1; }

}  // namespace

TEST_CASE("An impact of a shell is what its own mass, radius and moment make of it") {
  const Vec3 up(0, 1, 0), v(3, -4, 0), none = Vec3::Zero();
  // r_n = 1.5 * 2 * 4 = 12. Of 3 m/s of slip 1 N s takes all: at mu = 0.25, 3 N s are there.
  const SphereImpact sticks = sphere_impact(shell, v, none, up, 0.25, 0.5);
  CHECK(sticks.sticks);
  CHECK((sticks.impulse - Vec3(-1, 12, 0)).norm() < 1e-14);
  CHECK((sticks.v - Vec3(2.5, 2, 0)).norm() < 1e-14);
  CHECK((sticks.w - Vec3(0, 0, -5)).norm() < 1e-14);
  CHECK(shell.slip(sticks.v, sticks.w, up).norm() < 1e-14);
  const SphereImpact slides = sphere_impact(shell, v, none, up, 0.05, 0.5);
  CHECK_FALSE(slides.sticks);
  CHECK((slides.impulse - Vec3(-0.6, 12, 0)).norm() < 1e-14);
  CHECK((slides.v - Vec3(2.7, 2, 0)).norm() < 1e-14);
  CHECK((slides.w - Vec3(0, 0, -3)).norm() < 1e-14);
  CHECK(shell.kinetic_energy(slides.v, slides.w) == Approx(0.5 * (2 * (2.7 * 2.7 + 4) + 0.1 * 9)).epsilon(1e-14));
}

TEST_CASE("A shell's friction impulse is the polygon's nearest to what would stop it, however the polygon is turned") {
  const Vec3 up(0, 1, 0), none = Vec3::Zero();
  // r_n = 8, mu r_n = 0.4; t1 is x, t2 is -z. Slip (3, 0.3) along x and z asks for (-1, 0.1) along t1 and t2.
  const Vec3 v(3, -4, 0.3);
  const auto impulse = [&](double turn) { return sphere_impact_polygon(shell, v, none, up, 0.05, 4, turn).impulse; };
  CHECK((impulse(0) - Vec3(-0.4, 8, 0)).norm() < 1e-14);                                      // a vertex
  CHECK((impulse(pi / 4) - Vec3(-0.4 * std::sqrt(0.5), 8, -0.1)).norm() < 1e-14);             // on an edge
  CHECK((impulse(0.2) - Vec3(-0.4 * std::cos(0.2), 8, 0.4 * std::sin(0.2))).norm() < 1e-14);  // vertices turn to t2
  const SphereImpact sticks = sphere_impact_polygon(shell, v, none, up, 0.5, 6, 0.2);
  CHECK(sticks.sticks);
  CHECK((sticks.impulse - Vec3(-1, 8, -0.1)).norm() < 1e-14);
  CHECK(shell.slip(sticks.v, sticks.w, up).norm() < 1e-14);
}

TEST_CASE("A shell flies, slides and rolls by the closed form, on a plane of any slope") {
  // g = 10, let go 1.25 m above the plane with 2 m/s along it: down at 0.5 s with 5 m/s, r_n = 10. mu = 0.05: it leaves
  // with 1.75 m/s, -2.5 rad/s and 0.5 m/s of slip, which friction takes within 1/6 s, 0.5 m/s^2 of it off its speed.
  const double t_roll = 0.5 + 1.0 / 6;
  const auto along = [&](double t) {
    if (t <= 0.5) return 2 * t;
    const double sliding = std::min(t, t_roll) - 0.5, rolling = std::max(0.0, t - t_roll);
    return 1 + 1.75 * sliding - 0.25 * sliding * sliding + (1.75 - 0.5 / 6) * rolling;
  };
  for (const Quat& turn : {Quat::Identity(), Quat(Eigen::AngleAxisd(0.7, Vec3(0.3, 0.5, -1).normalized()))}) {
    Pose start;
    start.p = Vec3(4, 5, 6);
    const Vec3 n = turn * Vec3(0, 1, 0), ahead = turn * Vec3(1, 0, 0);
    const SphereFlight flight(shell, start, 2 * ahead, Vec3::Zero(), 1.25, n, 10, 0.05);
    CHECK(flight.t_impact == Approx(0.5).epsilon(1e-14));
    CHECK(flight.t_roll == Approx(t_roll).epsilon(1e-14));
    for (const double t : {0.2, 0.5, 0.6, 0.7, 1.5}) {
      const double fall = std::min(t, 0.5);
      CHECK((flight.position(t) - (start.p + along(t) * ahead - 5 * fall * fall * n)).norm() < 1e-13);
    }
    // Thrown up with 1 m/s: (1 + sqrt(1 + 20 * 1.2)) / 10.
    CHECK(SphereFlight(shell, start, n, Vec3::Zero(), 1.2, n, 10, 0.05).t_impact == Approx(0.6).epsilon(1e-14));
    // Without friction it never rolls; away from gravity it never comes down.
    CHECK(std::isinf(SphereFlight(shell, start, ahead, Vec3::Zero(), 1, n, 10, 0).t_roll));
    CHECK(std::isinf(SphereFlight(shell, start, n, Vec3::Zero(), 1, n, 0, 0.5).t_impact));
  }
}

TEST_CASE("A shell's run is measured against the cone and against the polygon, each by its own outcome") {
  Shape ball;
  ball.kind = ShapeKind::sphere;
  ball.radius = 0.5;
  Scenario scenario = on_plane("impacting_sphere", ball, 2, 0.05, Quat::Identity());
  scenario.gravity.constant = Vec3(0, -10, 0);
  scenario.rotate_cone = 0.2;
  scenario.initial.pose[0].p = Vec3(0, 0.5 + 0.8, 0);
  scenario.initial.v = {3, 0, 0, 0, 0, 0};
  SimulationOptions options;
  options.duration = 1;
  options.step = 0.1;
  SceneErrors errors(scenario, options, 4);
  errors.observe_start(scenario.initial);
  // It comes down at 0.4 s with 4 m/s. The recorded impact is the polygon's.
  ContactProblem problem;
  problem.M.add_block(6);
  problem.v_minus = {3, -4, 0, 0, 0, 0};
  ContactSolution solution;
  Residuals residuals;
  const std::vector<ContactPoint> contacts(1);
  const SphereImpact turned = sphere_impact_polygon(shell, Vec3(3, -4, 0), Vec3::Zero(), Vec3(0, 1, 0), 0.05, 4, 0.2);
  const auto show = [&](double t, double gain, double before, const SphereImpact& after) {
    residuals.energy_gain = gain;
    residuals.energy_before = before;
    const std::vector<double> v_plus = {after.v.x(), after.v.y(), after.v.z(), after.w.x(), after.w.y(), after.w.z()};
    errors.observe_event(EventRecord{t, problem, solution, residuals, v_plus, contacts});
  };
  show(0.4, 2, 20, turned);
  show(0.5, 1, 2, turned);     // a smaller gain, of less
  show(0.6, 0.5, 20, turned);  // neither is the last one
  // Impulses of the cone and of the polygon: 0.4 (-1, 0) and 0.4 (-cos, sin) along x and z; over 2 kg, and by 0.5 /
  // 0.1.
  const double apart = 0.4 * 2 * std::sin(0.1);
  State state = scenario.initial;
  for (int n = 1; n <= 4; ++n) {
    state.t = 0.1 * n;
    const double fall = std::min(state.t, 0.4);
    // 0.06 m off at 0.2 s, 0.11 m from 0.3 s on: a tenth of the diameter is 0.1 m.
    state.pose[0].p = Vec3(3 * fall, 1.3 - 5 * fall * fall, 0) + (n >= 3 ? 0.11 : n == 2 ? 0.06 : 0) * Vec3(0, 0, 1);
    errors.observe_step(state, StepRecord());
  }
  const Errors out = named(errors);
  CHECK(out.at("polygon_velocity_after_impact_m_per_s") < 1e-14);
  CHECK(out.at("polygon_spin_after_impact_rad_per_s") < 1e-14);
  CHECK(out.at("polygon_ke_after_impact_j") < 1e-13);
  CHECK(out.at("velocity_after_impact_m_per_s") == Approx(apart / 2));
  CHECK(out.at("spin_after_impact_rad_per_s") == Approx(5 * apart));
  // Energies: 2.8 along x and -2 rad/s, against what the polygon's impulse leaves.
  const double c = 0.4 * std::cos(0.2), s = 0.4 * std::sin(0.2);
  const double cone = 0.5 * (2 * 2.8 * 2.8 + 0.1 * 4);
  const double polygon = (3 - c / 2) * (3 - c / 2) + s * s / 4 + 0.05 * 25 * 0.16;
  CHECK(out.at("ke_after_impact_j") == Approx(std::abs(polygon - cone)));
  CHECK(out.at("ke_after_impact_relative") == Approx(std::abs(polygon - cone) / 25));
  CHECK(out.at("energy_rise_linf_j") == 2);
  CHECK(out.at("energy_rise_relative") == 0.5);
  CHECK(out.at("impact_time_error_s") == Approx(0).margin(1e-14));
  CHECK(out.at("horizon_s") == Approx(0.3));
  CHECK(out.at("position_linf_m") == Approx(0.11));
  CHECK(out.at("position_l2_m") == Approx(std::sqrt((2 * 0.11 * 0.11 + 0.06 * 0.06) / 4)));
  CHECK(out.count("position_final_m") == 0);  // it ended early
}

TEST_CASE("A box's push is its force over its mass, and its horizon a tenth of its longest side") {
  // 2 N on 2 kg from 1 to 5 s, mu g = 0.98: 0.02 m/s^2, then 0.08 m/s that 0.98 m/s^2 stop.
  Scenario scenario = on_plane("sliding_box", brick({0.4, 0.1, 0.2}), 2, 0.1, Quat::Identity());
  scenario.initial.pose[0].p.y() = 0.1;
  scenario.forces = {{0, Vec3(0, 0, -2), 1, 5}};
  const auto way = [](double t) {
    const double tau = std::clamp(t - 5, 0.0, 0.08 / 0.98), pushed = std::clamp(t, 1.0, 5.0) - 1;
    return 0.01 * pushed * pushed + 0.08 * tau - 0.49 * tau * tau;
  };
  const Errors exact = errors_of(scenario, 6, 1e-2, 0, [&](double t) { return Vec3(0, 0, -way(t)); });
  CHECK(exact.at("x_final_relative") < 1e-12);
  CHECK(exact.at("position_linf_m") < 1e-13);
  const Errors off = errors_of(scenario, 6, 1e-2, 0, [&](double t) { return Vec3(0.02 * t, 0, -way(t)); });
  CHECK(off.at("horizon_s") == Approx(4.01));  // 0.08 m are passed after 4 s
  CHECK(off.at("lateral_drift_m") == Approx(0.12));
  // A harmonic without a frequency is one more constant: 4 cos(pi / 3) = 2 m/s^2.
  scenario.forces.clear();
  scenario.gravity.harmonic[0] = {4, 0, pi / 3};
  const Errors steady = errors_of(scenario, 1, 1e-2, 0, [](double t) { return Vec3(0.51 * t * t, 0, 0); });
  CHECK(steady.at("position_linf_m") < 1e-12);
}

TEST_CASE("A box slides down the steepest line of a plane that leans both ways") {
  const Quat turn(Eigen::AngleAxisd(0.5, Vec3(2, 0, 1).normalized()));  // a slope of 0.5 rad
  Scenario scenario = on_plane("sticking_box", brick({0.3, 0.1, 0.2}), 3, 0.25, turn);
  const Vec3 n = turn * Vec3(0, 1, 0), down = (Vec3(0, -1, 0) + n.y() * n).normalized();
  scenario.initial.pose[0].p = 0.1 * n;
  const double a = 9.8 * (std::sin(0.5) - 0.25 * std::cos(0.5));
  const auto slides = [&](double t) -> Vec3 { return (a / 2 * t * t) * down; };
  const Errors exact = errors_of(scenario, 1, 1e-2, 0, slides);
  CHECK(exact.at("position_linf_m") < 1e-12);
  CHECK(exact.at("displacement_final_m") == Approx(a / 2));
  // From T/2 on: a (1 - 1/4) / 2 over half a second.
  CHECK(exact.at("creep_rate_m_per_s") == Approx(0.75 * a));
  CHECK(exact.at("first_past_1mm_s") == Approx(0.03));  // 2.55 m/s^2: 1 mm is passed at 0.028 s
  // The same by steps to an accuracy, none of which ends at T/2.
  SimulationOptions options;
  options.duration = 1;
  options.stepping = Stepping::accuracy;
  SceneErrors errors(scenario, options, 0);
  State state = scenario.initial;
  errors.observe_start(state);
  for (const double t : {0.2, 0.4, 1.0}) {
    state.t = t;
    state.pose[0].p = scenario.initial.pose[0].p + slides(t);
    Eigen::Map<Vec3>(state.v.data()) = a * t * down;
    errors.observe_step(state, StepRecord());
  }
  CHECK(named(errors).at("creep_rate_m_per_s") == Approx(0.75 * a));
  const Errors back = errors_of(scenario, 1, 1e-2, 0, [&](double t) -> Vec3 { return t * (1 - t) * down; });
  CHECK(back.at("displacement_linf_m") == Approx(0.25));
  CHECK(back.at("displacement_final_m") == Approx(0).margin(1e-15));
}

TEST_CASE("A box has a closed form as long as the side it stands on keeps it from tipping over") {
  // 0.8 m x 0.2 m x 0.4 m: flat it tips beyond mu = 2, on its narrow end beyond 1/4. It slides from the start.
  for (const auto& [on_end, most] : {std::pair(false, 2.0), {true, 0.25}}) {
    Scenario scenario = on_plane("sliding_box", brick({0.4, 0.1, 0.2}), 2, 0, Quat::Identity());
    if (on_end) scenario.initial.pose[0].q = Quat(Eigen::AngleAxisd(pi / 2, Vec3::UnitZ()));
    scenario.initial.pose[0].p.y() = on_end ? 0.4 : 0.1;
    scenario.initial.v[0] = 1;
    for (const double mu : {0.99 * most, 1.01 * most}) {
      scenario.pairs.laws[0].mu = mu;
      CHECK(has_exact(errors_of(scenario, 0.1, 1e-2, 0, [](double) { return Vec3(0, 0, 0); })) == (mu < most));
    }
    // At rest it has to withstand no more than what pushes it.
    scenario.initial.v[0] = 0;
    scenario.pairs.laws[0].mu = 10;
    for (const double push : {0.99 * most, 1.01 * most}) {
      scenario.forces = {{0, Vec3(2 * 9.8 * push, 0, 0), 0, 1}};
      CHECK(has_exact(errors_of(scenario, 0.1, 1e-2, 0, [](double) { return Vec3(0, 0, 0); })) == (push < most));
    }
    // All that pushes at once.
    for (const double share : {0.49, 0.51}) {
      const Force half{0, Vec3(2 * 9.8 * share * most, 0, 0), 0, 1};
      scenario.forces = {half, half};
      CHECK(has_exact(errors_of(scenario, 0.1, 1e-2, 0, [](double) { return Vec3(0, 0, 0); })) == (share < 0.5));
    }
    // And of what swings, too.
    scenario.forces.clear();
    for (const double swing : {0.99 * most, 1.01 * most}) {
      scenario.gravity.harmonic[2] = {9.8 * swing, 1, 0};
      CHECK(has_exact(errors_of(scenario, 0.1, 1e-2, 0, [](double) { return Vec3(0, 0, 0); })) == (swing < most));
    }
    // Along both axes at once.
    for (const double share : {0.49, 0.51}) {
      scenario.gravity.harmonic[0] = scenario.gravity.harmonic[2] = {9.8 * share * most, 1, 0};
      CHECK(has_exact(errors_of(scenario, 0.1, 1e-2, 0, [](double) { return Vec3(0, 0, 0); })) == (share < 0.5));
    }
  }
}

TEST_CASE("A box that starts above its plane, into it or turning has no closed form; one that rests on it has") {
  const auto exact = [](double gap, double into, double spin) {
    Scenario scenario = on_plane("sliding_box", brick({0.4, 0.1, 0.2}), 2, 0.1, Quat::Identity());
    scenario.initial.pose[0].p.y() = 0.1 + gap;
    scenario.initial.v = {1, into, 0, 0, spin, 0};
    return has_exact(errors_of(scenario, 0.1, 1e-2, 0, [](double) { return Vec3(0, 0, 0); }));
  };
  CHECK(exact(0, 0, 0));
  for (const double sign : {1.0, -1.0}) {
    CHECK(exact(sign * 0.7e-6, 0, 0));  // 1e-6 of 0.8 m
    CHECK_FALSE(exact(sign * 0.9e-6, 0, 0));
    CHECK_FALSE(exact(0, sign * 1e-6, 0));
    CHECK_FALSE(exact(0, 0, sign * 1e-6));
  }
}

TEST_CASE("A turn is that of all harmonics of the drive, and there is none where they differ") {
  Scenario scenario = on_plane("circular_sliding", brick({0.2, 0.1, 0.2}), 2, 0, Quat::Identity());
  scenario.initial.pose[0].p.y() = 0.1;
  scenario.gravity.harmonic[0] = {1, 2 * pi, 0};
  scenario.gravity.harmonic[2] = {1, 2 * pi, -pi / 2};
  const auto still = [](double) { return Vec3(0, 0, 0); };
  // Turns of 1 s, of which 3.5 s hold three; a run of one turn has no drift.
  CHECK(errors_of(scenario, 3.5, 1e-2, 0, still).count("drift_per_turn_m") == 1);
  CHECK(errors_of(scenario, 1.5, 1e-2, 0, still).at("radius_error_m") > 0.01);  // of the exact one, if it stands still
  CHECK(errors_of(scenario, 1.5, 1e-2, 0, still).count("drift_per_turn_m") == 0);
  CHECK(errors_of(scenario, 0.9, 1e-2, 0, still).count("radius_error_m") == 0);
  scenario.gravity.harmonic[2].frequency = 4 * pi;
  CHECK(errors_of(scenario, 3.5, 1e-2, 0, still).count("radius_error_m") == 0);
}

namespace {

/// Crates of 1, 2 and 4 kg on each other, from the lowest, which the file lists as third, first and second; gravity
/// points along -x.
constexpr int listed[] = {2, 0, 1};
Scenario crates() {
  Scenario scenario;
  scenario.reference = {ReferenceKind::analytic, "stack", {}};
  scenario.gravity.constant = Vec3(-10, 0, 0);
  Shape ground;
  ground.kind = ShapeKind::half_space;
  scenario.shapes = {ground};
  for (int b = 0; b < 3; ++b) {
    const auto level = static_cast<int>(std::find(listed, listed + 3, b) - listed);
    scenario.model.bodies.push_back({"crate", std::pow(2.0, level), Vec3::Constant(1)});
    Shape shape = brick({0.5, 0.5, 0.5});
    shape.body = b;
    scenario.shapes.push_back(shape);
    scenario.initial.pose.push_back({Vec3(0.5 + level, 0, 0), Quat::Identity()});
  }
  scenario.pairs.laws = {{0.5, 0}, {0.25, 0}};
  scenario.initial.v.assign(18, 0);
  return scenario;
}

/// Of two steps of 0.1 s, in the second of which the loads are these times what they should be.
Errors loaded(const Scenario& scenario, const Vec3& factors, bool across = false) {
  SimulationOptions options;
  options.duration = 0.2;
  options.step = 0.1;
  SceneErrors errors(scenario, options, 4);
  errors.observe_start(scenario.initial);
  State state = scenario.initial;
  for (int n = 1; n <= 2; ++n) {
    // What carries 7, 6 and 4 kg: 7, 6 and 4 N s; the first in two events.
    const Vec3 load = n == 2 ? Vec3(7 * factors[0], 6 * factors[1], 4 * factors[2]) : Vec3(7, 6, 4);
    for (int part = 0; part < 2; ++part) {
      ContactProblem problem;
      ContactSolution solution;
      Residuals residuals;
      const std::vector<double> v_plus;
      std::vector<ContactPoint> contacts;
      for (int level = 0; level < 3; ++level) {
        if (part == 1 && level > 0) continue;
        const int beneath = across && level == 2 ? 0 : level - 1;
        contacts.push_back({Vec3::Zero(), Vec3(1, 0, 0), 0, 1 + listed[level], beneath < 0 ? 0 : 1 + listed[beneath]});
        solution.impulse.insert(solution.impulse.end(), {level == 0 ? load[0] / 2 : load[level], 50, 60});
      }
      errors.observe_event(EventRecord{0, problem, solution, residuals, v_plus, contacts});
    }
    state.t = 0.1 * n;
    errors.observe_step(state, StepRecord());
  }
  return named(errors);
}

}  // namespace

TEST_CASE("Each interface of a stack carries the weight above it, whatever the weights and whichever way is down") {
  const Errors exact = loaded(crates(), Vec3(1, 1, 1));
  CHECK(exact.at("interface_sum_relative") < 1e-15);
  CHECK(exact.at("interface_total_relative") < 1e-15);
  for (int level = 0; level < 3; ++level) {
    Vec3 factors(1, 1, 1);
    factors[level] = 0.75;
    const Errors off = loaded(crates(), factors);
    CHECK(off.at("interface_sum_relative") == Approx(0.25));
    const double carried[] = {7, 6, 4};
    CHECK(off.at("interface_total_relative") == Approx(0.25 * carried[level] / 17));
  }
  // One that carries too much and one too little.
  const Errors both = loaded(crates(), Vec3(1, 1.5, 0.25));
  CHECK(both.at("interface_sum_relative") == Approx(0.75));
  CHECK(both.at("interface_total_relative") == Approx(0).margin(1e-15));
}

TEST_CASE("What carries a stack has no closed form where it moves, bounces or leans on what is not beneath") {
  const auto measured = [](const Errors& errors) { return errors.count("interface_sum_relative") == 1; };
  CHECK(measured(loaded(crates(), Vec3(1, 1, 1))));
  CHECK_FALSE(measured(loaded(crates(), Vec3(1, 1, 1), true)));
  Scenario moving = crates(), bouncing = crates(), swinging = crates(), pushed = crates();
  moving.initial.v[15] = 1e-3;
  bouncing.pairs.laws[1].restitution = 0.5;
  swinging.gravity.harmonic[1] = {1, 1, 0};
  pushed.forces = {{1, Vec3(0, 1, 0), 0, 1}};
  for (const Scenario& scenario : {moving, bouncing, swinging, pushed}) {
    const Errors errors = loaded(scenario, Vec3(1, 1, 1));
    CHECK_FALSE(measured(errors));
    CHECK(errors.at("displacement_linf_m") == 0);  // that is measured all the same
  }
}
