#include "evaluation/scene_errors.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <numbers>

#include "evaluation/references.h"
#include "evaluation/slider.h"
#include "evaluation/sphere_impact.h"

using namespace cb;
using std::numbers::pi;

namespace {

using Errors = std::map<std::string, double>;

// A body on a half-space, as the scenes have it.
Scenario on_plane(const std::string& reference, ShapeKind kind, double mu, double tilt = 0) {
  Scenario scenario;
  scenario.reference = {ReferenceKind::analytic, reference, {}};
  scenario.model.bodies = {{"body", 1.0, Vec3::Constant(1.0 / 6)}};
  Shape plane;
  plane.kind = ShapeKind::half_space;
  plane.local.q = Quat(Eigen::AngleAxisd(-tilt, Vec3::UnitZ()));
  Shape shape;
  shape.kind = kind;
  shape.body = 0;
  shape.radius = 1;
  shape.half_extents = Vec3::Constant(0.5);
  scenario.shapes = {plane, shape};
  scenario.pairs.group = {0, 1};
  scenario.pairs.groups = 2;
  scenario.pairs.index = {-1, 0, 0, -1};
  scenario.pairs.laws = {{mu, 0}};
  scenario.initial.pose.resize(1);
  scenario.initial.pose[0].q = plane.local.q;
  scenario.initial.pose[0].p = plane.local.q * Vec3(0, 0.5, 0);
  scenario.initial.v.assign(6, 0);
  return scenario;
}

Scenario sliding_box(double push_angle = 0) {
  Scenario scenario = on_plane("sliding_box", ShapeKind::box, 0.1);
  scenario.forces = {{0, Vec3(std::cos(push_angle), 0, -std::sin(push_angle)), 1, 5}};
  return scenario;
}

Scenario circle() {
  Scenario scenario = on_plane("circular_sliding", ShapeKind::box, 0.02);
  scenario.gravity.harmonic[0] = {0.4, 1, 0};
  scenario.gravity.harmonic[2] = {0.4, 1, -pi / 2};
  return scenario;
}

// Are all these errors in the reference's row of the table?
bool listed(std::string_view reference, const Errors& errors) {
  for (const ReferenceRow& row : references()) {
    if (row.name != reference) continue;
    return std::all_of(errors.begin(), errors.end(), [&](const auto& error) {
      return std::any_of(row.errors.begin(), row.errors.end(), [&](const auto& e) { return e.first == error.first; });
    });
  }
  return false;
}

// Feeds positions (and orientations) at the ends of steps, up to `until`, and returns the errors.
template <class PoseAt>
Errors errors_of(const Scenario& scenario, double duration, double h, int k, double until, const PoseAt& pose_at) {
  SimulationOptions options;
  options.step = h;
  options.duration = duration;
  SceneErrors errors(scenario, options, k);
  State state = scenario.initial;
  errors.observe_start(state);
  StepRecord record;
  for (long n = 1; static_cast<double>(n) * h <= until * (1 + 1e-12); ++n) {
    record.step = n;
    record.t = state.t = static_cast<double>(n) * h;
    state.pose[0] = pose_at(state.t);
    errors.observe_step(state, record);
  }
  Errors out;
  for (const auto& [name, value] : errors.finish()) {
    CHECK(out.count(name) == 0);
    out[name] = value;
  }
  return out;
}

Pose moved(const Scenario& scenario, const Vec3& by) {
  Pose pose = scenario.initial.pose[0];
  pose.p += by;
  return pose;
}

double box_x(double t) {
  if (t < 1) return 0;
  if (t < 5) return 0.01 * (t - 1) * (t - 1);
  const double tau = std::min(t - 5, 0.08 / 0.98);
  return 0.16 + 0.08 * tau - 0.49 * tau * tau;
}

}  // namespace

TEST_CASE("The exact sliding box has no error, in whatever direction it is pushed") {
  for (const double angle : {0.0, 0.6, -2.5}) {
    const Scenario scenario = sliding_box(angle);
    const Vec3 along(std::cos(angle), 0, -std::sin(angle));
    const Errors errors =
        errors_of(scenario, 8, 1e-3, 0, 8, [&](double t) { return moved(scenario, box_x(t) * along); });
    CHECK(errors.size() == 8);
    CHECK(errors.count("horizon_s") == 0);
    for (const auto& [name, value] : errors) {
      INFO(name);
      CHECK(std::abs(value) < 1e-13);
    }
  }
}

TEST_CASE("Pushes count by their times, in whatever order they are written") {
  Scenario scenario = sliding_box();
  const Vec3 force = scenario.forces[0].force;
  Errors in_order;
  for (const bool latest_first : {false, true}) {
    scenario.forces = {{0, force, 1, 1.5}, {0, Vec3(-force.z(), 0, force.x()), 4, 5}};  // at rest between, then across
    if (latest_first) std::swap(scenario.forces[0], scenario.forces[1]);
    const Errors errors =
        errors_of(scenario, 8, 1e-3, 0, 8, [&](double t) { return moved(scenario, Vec3(0.01 * t, 0, 0)); });
    if (!latest_first) in_order = errors;
    CHECK(errors == in_order);
  }
  CHECK(in_order.at("creep_before_push_m") == Approx(0.01));
  CHECK(in_order.at("creep_after_stop_m") == Approx(0.01 * 2.7));
  // No pushes: a force of nothing, and one that ends where it begins.
  scenario.forces = {{0, Vec3::Zero(), 0.25, 5.5}, {0, Vec3(0, 0, 1), 0.5, 0.5}, {0, force, 1, 5}};
  const Errors idle =
      errors_of(scenario, 8, 1e-2, 0, 8, [&](double t) { return moved(scenario, Vec3(box_x(t), 0, -1e-4 * t)); });
  CHECK(idle.at("x_final_relative") < 1e-10);
  CHECK(idle.at("lateral_drift_m") == Approx(8e-4));
  CHECK(idle.at("creep_before_push_m") == Approx(1e-4));
}

TEST_CASE("What a box still slides after its last push is no creep") {
  Scenario scenario = sliding_box();
  scenario.forces = {{0, Vec3(3, 0, 0), 1, 2}};  // to 2.02 m/s, from which friction takes 0.98 m/s each second
  const Errors errors = errors_of(scenario, 8, 1e-2, 0, 8, [&](double t) {
    const double pushed = std::clamp(t - 1, 0., 1.), left = std::clamp(t - 2, 0., 2.02 / 0.98);
    return moved(scenario, Vec3(1.01 * pushed * pushed + 2.02 * left - 0.49 * left * left, 0, 0));
  });
  CHECK(errors.at("position_linf_m") < 1e-11);
  CHECK(errors.at("creep_after_stop_m") < 1e-11);
}

TEST_CASE("What is added to the sliding box's way comes out as its errors") {
  const Scenario scenario = sliding_box();
  // 1 % too far, 1e-4 m/s sideways drift to -z, 2e-5 m lift at the end, creep of 1e-5 m/s over the whole time.
  const Errors errors = errors_of(scenario, 8, 1e-3, 0, 8, [&](double t) {
    return moved(scenario, Vec3(box_x(t) * 1.01, t > 7.9995 ? 2e-5 : 0, -1e-4 * t));
  });
  CHECK(errors.at("x_final_relative") == Approx(0.01).epsilon(1e-10));
  CHECK(errors.at("lateral_drift_m") == Approx(8e-4).epsilon(1e-10));
  CHECK(errors.at("lift_linf_m") == Approx(2e-5).epsilon(1e-10));
  CHECK(errors.at("creep_before_push_m") == Approx(1e-4).epsilon(1e-10));
  CHECK(errors.at("creep_after_stop_m") == Approx(std::hypot(2.7e-4, 2e-5)).epsilon(1e-9));
  CHECK(errors.at("position_final_m") == Approx(Vec3(0.01 * box_x(8), 8e-4, 2e-5).norm()).epsilon(1e-10));
  CHECK(errors.at("position_linf_m") == errors.at("position_final_m"));
  // Sunk in until 4 s, and aside by 1e-4 m for a while before the push and by 3e-4 m after it: back at the end.
  const Errors back = errors_of(scenario, 8, 1e-2, 0, 8, [&](double t) {
    const double aside = t > 0.3 && t < 0.7 ? 1e-4 : t > 6 && t < 7 ? 3e-4 : 0;
    return moved(scenario, Vec3(box_x(t), t < 4 ? -2e-5 : 0, aside));
  });
  CHECK(back.at("lift_linf_m") == Approx(2e-5).epsilon(1e-10));
  CHECK(back.at("creep_before_push_m") == Approx(std::hypot(1e-4, 2e-5)).epsilon(1e-9));
  CHECK(back.at("creep_after_stop_m") == Approx(3e-4).epsilon(1e-9));
  CHECK(back.at("lateral_drift_m") == Approx(3e-4).epsilon(1e-9));
  CHECK(back.at("position_linf_m") == Approx(3e-4).epsilon(1e-9));
  CHECK(back.at("position_final_m") < 1e-13);
  // What falls short is as wrong as what goes too far.
  const Errors shorter =
      errors_of(scenario, 8, 1e-2, 0, 8, [&](double t) { return moved(scenario, Vec3(0.99 * box_x(t), 0, 0)); });
  CHECK(shorter.at("x_final_relative") == Approx(0.01).epsilon(1e-10));
}

TEST_CASE("Root mean square and horizon of an error that grows steadily") {
  const Scenario scenario = sliding_box();
  // Error 0.05 t sideways: rms over 8 s is 0.4 / sqrt 3, a tenth of the box (0.1 m) is passed after 2 s.
  const Errors errors =
      errors_of(scenario, 8, 1e-3, 0, 8, [&](double t) { return moved(scenario, Vec3(box_x(t), 0, 0.05 * t)); });
  CHECK(errors.at("position_l2_m") == Approx(0.4 / std::sqrt(3)).epsilon(1e-3));
  CHECK(errors.at("horizon_s") == Approx(2.001).epsilon(1e-9));
}

TEST_CASE("A run that ends early reports no final errors") {
  const Scenario scenario = sliding_box();
  const Errors errors =
      errors_of(scenario, 8, 1e-3, 16, 3, [&](double t) { return moved(scenario, Vec3(box_x(t), 0, 0)); });
  for (const char* name : {"x_final_relative", "position_final_m", "polygon_x_final_relative", "creep_after_stop_m"})
    CHECK(errors.count(name) == 0);
  CHECK(errors.at("position_linf_m") < 1e-14);
}

TEST_CASE("An exact solver under the program's integrator has the step errors that the scene describes") {
  // v+ = v + h a, x+ = x + h v+ with Coulomb's law along one line.
  const Scenario scenario = sliding_box();
  const std::pair<double, double> described[] = {{1e-2, 0.163272}, {1e-3, 0.16326542}, {1e-4, 0.1632653072}};
  for (const auto& [h, x_8] : described) {
    double x = 0, v = 0;
    long n = 0;
    const Errors errors = errors_of(scenario, 8, h, 0, 8, [&](double) {
      const double push = n >= std::lround(1 / h) && n < std::lround(5 / h) ? 1 : 0;
      ++n;
      const double free = v + h * push;
      v = std::max(0.0, free - 0.98 * h);
      x += h * v;
      return moved(scenario, Vec3(x, 0, 0));
    });
    CHECK(x == Approx(x_8).epsilon(1e-9));
    CHECK(errors.at("x_final_relative") == Approx(x_8 / (8.0 / 49) - 1).epsilon(2e-3));
    CHECK(errors.at("position_linf_m") == Approx(0.040 * h).epsilon(0.05));
  }
}

TEST_CASE("A turned polygon is measured against its own answer as well") {
  Scenario scenario = sliding_box();
  scenario.rotate_cone = pi / 8;
  Drive drive;
  drive.pushes.push_back({Vec2(1, 0), 1, 5});
  PolygonSlider slider(drive, 0.98, 8, pi / 8, {});
  const Errors errors = errors_of(scenario, 8, 1e-3, 8, 8, [&](double t) {
    const Vec2 p = slider.at(t).p;  // t1 is x, t2 is -z
    return moved(scenario, Vec3(p.x(), 0, -p.y()));
  });
  CHECK(errors.at("polygon_x_final_relative") < 1e-12);
  CHECK(errors.at("polygon_position_linf_m") < 1e-12);
  CHECK(errors.at("x_final_relative") == Approx(0.835854696 / (8.0 / 49) - 1).epsilon(1e-8));
  // Turning push and cone together changes nothing.
  Scenario turned = sliding_box(0.3);
  turned.rotate_cone = pi / 8 + 0.3;
  PolygonSlider again(drive, 0.98, 8, pi / 8, {});
  const Errors same = errors_of(turned, 8, 1e-3, 8, 8, [&](double t) {
    const Vec2 p = again.at(t).p;
    return moved(turned, Eigen::AngleAxisd(0.3, Vec3::UnitY()) * Vec3(p.x(), 0, -p.y()));
  });
  CHECK(same.at("polygon_position_linf_m") < 1e-12);
  CHECK(same.at("x_final_relative") == Approx(errors.at("x_final_relative")).epsilon(1e-12));
}

TEST_CASE("The reference's polygon is turned as the events' is, whichever of body and plane is listed first") {
  for (const bool body_first : {false, true}) {
    INFO((body_first ? "body first" : "plane first"));
    Scenario scenario = sliding_box();
    if (body_first) std::swap(scenario.shapes[0], scenario.shapes[1]);
    scenario.rotate_cone = 0.2;
    const auto pose = [&](const Shape& shape) { return shape.body < 0 ? shape.local : scenario.initial.pose[0]; };
    const Shape &first = scenario.shapes[0], &second = scenario.shapes[1];
    std::vector<ContactPoint> contacts;
    contact_points(first, pose(first), 0, second, pose(second), 1, 1e-9, contacts);
    REQUIRE(!contacts.empty());
    Vec3 t1, t2;
    contact_tangents(contacts[0], scenario.rotate_cone, t1, t2);
    const double angle = std::atan2(-t1.z(), t1.x());  // about y, from x towards -z
    CHECK(angle == Approx(body_first ? -0.2 : 0.2));
    Drive drive;
    drive.pushes.push_back({Vec2(1, 0), 1, 5});
    PolygonSlider slider(drive, 0.98, 8, angle, {});
    const Errors errors = errors_of(scenario, 8, 1e-2, 8, 8, [&](double t) {
      const Vec2 p = slider.at(t).p;
      return moved(scenario, Vec3(p.x(), 0, -p.y()));
    });
    CHECK(errors.at("lateral_drift_m") > 0.1);
    CHECK(errors.at("polygon_position_linf_m") < 1e-10);
  }
}

TEST_CASE("A box that creeps down its slope reports how far, how fast and since when") {
  const double slope = pi / 6;
  const Scenario scenario = on_plane("sticking_box", ShapeKind::box, 0.7, slope);
  const Vec3 downhill(std::cos(slope), -std::sin(slope), 0);
  const Errors errors = errors_of(scenario, 5, 1e-3, 8, 5, [&](double t) {
    Pose pose = moved(scenario, (1e-5 * t) * downhill);
    pose.q = Quat(Eigen::AngleAxisd(2e-8 * t, Vec3::UnitX())) * pose.q;
    return pose;
  });
  CHECK(errors.at("displacement_final_m") == Approx(5e-5).epsilon(1e-10));
  CHECK(errors.at("displacement_linf_m") == Approx(5e-5).epsilon(1e-10));
  CHECK(errors.at("creep_rate_m_per_s") == Approx(1e-5).epsilon(1e-9));
  CHECK(errors.at("first_past_1nm_s") == Approx(1e-3));
  CHECK(errors.at("first_past_1um_s") == Approx(0.1).margin(1.1e-3));
  CHECK(errors.count("first_past_1mm_s") == 0);
  CHECK(errors.at("tilt_linf_rad") == Approx(1e-7).epsilon(1e-6));
  CHECK(errors.at("position_final_m") == Approx(5e-5).epsilon(1e-10));
  CHECK(errors.at("polygon_position_final_m") == Approx(5e-5).epsilon(1e-10));
  const Errors rocked = errors_of(scenario, 5, 1e-2, 8, 5, [&](double t) {
    Pose pose = moved(scenario, Vec3::Zero());
    pose.q = Quat(Eigen::AngleAxisd(t > 2 && t < 3 ? 1e-3 : 0.0, Vec3::UnitX())) * pose.q;
    return pose;
  });
  CHECK(rocked.at("tilt_linf_rad") == Approx(1e-3).epsilon(1e-6));
}

TEST_CASE("A box that rests on its slope has no error, to the last bit") {
  const Scenario scenario = on_plane("sticking_box", ShapeKind::box, 1.001 * std::tan(pi / 6), pi / 6);
  const Errors errors = errors_of(scenario, 5, 1e-3, 8, 5, [&](double) { return moved(scenario, Vec3::Zero()); });
  for (const char* name : {"displacement_final_m", "displacement_linf_m", "creep_rate_m_per_s", "tilt_linf_rad",
                           "position_final_m", "position_linf_m", "position_l2_m", "polygon_position_linf_m"})
    CHECK(errors.at(name) == 0);
}

TEST_CASE("A slope too steep for its friction has sliding as the exact answer, for the cone and for the polygon") {
  const double slope = pi / 6, g = 9.8;
  const Vec3 downhill(std::cos(slope), -std::sin(slope), 0);
  const auto slides = [&](double mu, int k, double turn, double a) {
    Scenario scenario = on_plane("sticking_box", ShapeKind::box, mu, slope);
    scenario.rotate_cone = turn;
    return errors_of(scenario, 5, 1e-2, k, 5, [&](double t) { return moved(scenario, (a / 2 * t * t) * downhill); });
  };
  const double a = g * (std::sin(slope) - 0.5 * std::cos(slope));
  CHECK(slides(0.5, 0, 0, a).at("position_linf_m") < 1e-12);
  // The polygon turned by pi / k slides where the cone sticks: accelerations of the scene's description.
  CHECK(slides(0.7, 4, pi / 4, 0.699125).at("polygon_position_final_m") < 1e-5);
  CHECK(slides(0.6, 8, pi / 8, 0.195394).at("polygon_position_final_m") < 1e-5);
  CHECK(slides(0.6, 4, pi / 4, 1.299250).at("polygon_position_final_m") < 1e-5);
  CHECK(slides(0.6, 16, pi / 16, 0).at("polygon_position_final_m") == 0);
  CHECK(slides(0.7, 4, pi / 4, 0.699125).at("position_final_m") == Approx(0.699125 * 12.5));
}

TEST_CASE("The circle: shift, growth and drift of the run come out turn by turn") {
  Scenario scenario = circle();
  const double radius = std::sqrt(0.16 - 0.196 * 0.196), lag = std::acos(0.49);
  const auto steady = [&](double t) -> Vec3 {
    return Vec3(radius * std::sin(t - lag), 0.5, -radius * std::cos(t - lag));
  };
  scenario.initial.pose[0].p = steady(0);
  scenario.initial.v = {radius * std::cos(lag), 0, -radius * std::sin(lag), 0, 0, 0};
  const auto run = [&](const auto& position) {
    return errors_of(scenario, 60, 1e-3, 8, 60, [&](double t) {
      Pose pose;
      pose.p = position(t);
      return pose;
    });
  };
  const Errors exact = run(steady);
  for (const char* name : {"position_final_m", "position_linf_m", "position_l2_m", "radius_error_m", "centre_error_m",
                           "drift_per_turn_m", "lift_linf_m"})
    CHECK(exact.at(name) < 1e-11);
  CHECK(exact.at("polygon_position_linf_m") > 1e-3);

  const Errors shifted =
      run([&](double t) -> Vec3 { return steady(t) + (t > 0 ? Vec3(3e-3, 0, 4e-3) : Vec3(0, 0, 0)); });
  CHECK(shifted.at("centre_error_m") == Approx(5e-3).epsilon(1e-9));
  CHECK(shifted.at("position_linf_m") == Approx(5e-3).epsilon(1e-9));
  CHECK(shifted.at("radius_error_m") < 1e-11);
  CHECK(shifted.at("drift_per_turn_m") < 1e-11);

  // 1e-4 m/s of drift along z: 2 pi 1e-4 a turn, within the sampling of a turn by steps.
  const Errors drifting = run([&](double t) -> Vec3 { return steady(t) + Vec3(0, 0, 1e-4 * t); });
  CHECK(drifting.at("drift_per_turn_m") == Approx(2 * pi * 1e-4).epsilon(1e-3));

  const Errors wider = run([&](double t) -> Vec3 {
    const Vec3 p = steady(t);
    return {1.01 * p.x(), p.y(), 1.01 * p.z()};
  });
  CHECK(wider.at("radius_error_m") == Approx(0.01 * radius).epsilon(1e-4));
}

TEST_CASE("From rest on the circle the exact sliders have no error, cone and polygon") {
  Drive drive;
  drive.harmonics.push_back({Vec2(0.4, 0), 1, 0});
  drive.harmonics.push_back({Vec2(0, -0.4), 1, -pi / 2});  // t2 is -z
  const Scenario scenario = circle();
  DiskSlider disk(drive, 0.196, {});
  PolygonSlider polygon(drive, 0.196, 8, 0, {});
  const auto place = [&](const Vec2& p) { return moved(scenario, Vec3(p.x(), 0, -p.y())); };
  const Errors as_cone = errors_of(scenario, 20, 1e-3, 8, 20, [&](double t) { return place(disk.at(t).p); });
  CHECK(as_cone.at("position_linf_m") < 1e-12);
  CHECK(as_cone.at("polygon_position_linf_m") > 0.05);
  const Errors as_polygon = errors_of(scenario, 20, 1e-3, 8, 20, [&](double t) { return place(polygon.at(t).p); });
  CHECK(as_polygon.at("polygon_position_linf_m") < 1e-12);
  CHECK(as_polygon.at("position_final_m") == Approx(as_cone.at("polygon_position_final_m")).epsilon(1e-9));
}

TEST_CASE("A turn that is shorter than a step has no mean place, and one that is not followed has none either") {
  Scenario fast = circle();
  fast.gravity.harmonic[0].frequency = fast.gravity.harmonic[2].frequency = 100;  // 16 turns a second
  const Errors errors = errors_of(fast, 1, 0.1, 0, 1, [&](double) { return moved(fast, Vec3::Zero()); });
  CHECK(errors.at("drift_per_turn_m") < 0.01);
  CHECK(errors.at("centre_error_m") < 0.01);
  Scenario above = circle();
  above.initial.pose[0].p.y() = 1;
  CHECK(errors_of(above, 8, 0.1, 8, 8, [&](double) { return moved(above, Vec3::Zero()); }).size() == 1);  // its lift
}

TEST_CASE("Scenes without the shape of their reference leave out what has no closed form") {
  // Gravity that varies along the normal; a box that would tip over; a box that starts above the ground, or on an edge;
  // nothing that holds it to the ground.
  Scenario heaving = sliding_box();
  heaving.gravity.harmonic[1] = {1, 2, 0};
  Scenario tipping = on_plane("sticking_box", ShapeKind::box, 1.5, 0.9);
  Scenario falling = sliding_box();
  falling.initial.pose[0].p.y() = 1;
  Scenario trembling = sliding_box();
  trembling.gravity.harmonic[1] = {1e-7, 2, 0};
  Scenario swaying = heaving;  // along the plane, too
  swaying.gravity.harmonic[2] = {1e-3, 2, 0};
  Scenario on_edge = sliding_box();
  on_edge.initial.pose[0].q = Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
  on_edge.initial.pose[0].p.y() = 0.5 * (std::cos(0.3) + std::sin(0.3));
  Scenario weightless = sliding_box();
  weightless.gravity.constant.setZero();
  for (const Scenario& scenario : {heaving, trembling, swaying, tipping, falling, on_edge, weightless}) {
    const Errors errors = errors_of(scenario, 8, 1e-2, 8, 8, [&](double) { return moved(scenario, Vec3::Zero()); });
    CHECK(errors.count("position_linf_m") == 0);
    CHECK(errors.count("polygon_position_linf_m") == 0);
    CHECK(errors.count("x_final_relative") == 0);
  }
  Scenario missing = sliding_box();
  missing.reference.kind = ReferenceKind::missing;
  CHECK(errors_of(missing, 8, 1e-2, 8, 8, [&](double) { return moved(missing, Vec3::Zero()); }).empty());
  // Friction that holds against the push: nothing moves, so there is no relative error either.
  Scenario held = sliding_box();
  held.pairs.laws[0].mu = 0.5;
  const Errors errors = errors_of(held, 8, 1e-2, 0, 8, [&](double) { return moved(held, Vec3::Zero()); });
  CHECK(errors.at("position_linf_m") == 0);
  CHECK(errors.count("x_final_relative") == 0);
}

namespace {

// One contact event of a single body with the given velocities before and after.
struct Event {
  ContactProblem problem;
  ContactSolution solution;
  Residuals residuals;
  std::vector<double> v_plus;
  std::vector<ContactPoint> contacts;
  std::vector<double> gap_speed;
  double t;

  Event(double time, const Vec3& v, const Vec3& w, const Vec3& v_after, const Vec3& w_after) : t(time) {
    problem.M.add_block(6);
    problem.v_minus = {v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
    v_plus = {v_after.x(), v_after.y(), v_after.z(), w_after.x(), w_after.y(), w_after.z()};
    contacts.push_back({Vec3::Zero(), Vec3(0, 1, 0), 0, 1, 0});
  }
  void show(SceneErrors& errors) const {
    errors.observe_event({t, problem, solution, residuals, v_plus, contacts, {}, false, gap_speed});
  }
};

Scenario sphere_scene(const Vec3& v, double gap) {
  Scenario scenario = on_plane("impacting_sphere", ShapeKind::sphere, 0.60581);
  scenario.model.bodies[0] = {"sphere", 4.1887902047863905, Vec3::Constant(0.4 * 4.1887902047863905)};
  scenario.initial.pose[0].p = Vec3(0, 1 + gap, 0);
  scenario.initial.v = {v.x(), v.y(), v.z(), 0, 0, 0};
  return scenario;
}

Errors named(const SceneErrors& errors) {
  Errors out;
  for (const auto& [name, value] : errors.finish()) out[name] = value;
  return out;
}

}  // namespace

TEST_CASE("By steps the outcome of an impact is that of the event that ends it") {
  const Scenario scenario = sphere_scene(Vec3(1, -10, 0), 0.5);
  SimulationOptions options;
  options.stepping = Stepping::steps;
  options.duration = 4;
  const SphereBody sphere{4.1887902047863905, 0.4 * 4.1887902047863905, 1};
  const Vec3 before(1, -10.5, 0), none = Vec3::Zero();
  const SphereImpact exact = sphere_impact(sphere, before, none, Vec3(0, 1, 0), 0.60581, 0);
  // The first event leaves 4 m/s, which close the gap within its step.
  const Vec3 between(0.5, -4, 0), spin(0, 0, -0.3);
  Event first(0.048, before, none, between, spin);
  Event second(0.049, between - Vec3(0, 9.8e-3, 0), spin, exact.v + Vec3(1e-3, 0, 0), exact.w);
  first.gap_speed = {4};
  second.gap_speed = {0};
  SceneErrors errors(scenario, options, 8);
  errors.observe_start(scenario.initial);
  first.show(errors);
  errors.observe_step(scenario.initial, StepRecord());
  CHECK(named(errors).count("velocity_after_impact_m_per_s") == 0);
  second.show(errors);
  const Errors out = named(errors);
  CHECK(out.at("velocity_after_impact_m_per_s") == Approx(1e-3));
  CHECK(out.at("spin_after_impact_rad_per_s") < 1e-12);
  CHECK(out.at("polygon_velocity_after_impact_m_per_s") == Approx(1e-3));
}

TEST_CASE("A sphere that a force pushes, or that gravity moves to and fro, has no flight to be measured against") {
  for (const bool pushed : {false, true})
    for (const bool shaken : {false, true}) {
      Scenario scenario = sphere_scene(Vec3(1, -10, 0), 0.5);
      if (pushed) scenario.forces = {{0, Vec3(1, 0, 0), 0, 5}};
      if (shaken) scenario.gravity.harmonic[0] = {0.4, 1, 0};
      SceneErrors errors(scenario, SimulationOptions(), 8);
      errors.observe_start(scenario.initial);
      errors.observe_step(scenario.initial, StepRecord());
      INFO(pushed << shaken);
      CHECK(named(errors).count("position_linf_m") == (pushed || shaken ? 0 : 1));
    }
}

TEST_CASE("A sphere's exact impact has no error, and what is added to it comes out") {
  const Scenario scenario = sphere_scene(Vec3(1, -10, 0), 0.5);
  SimulationOptions options;
  options.duration = 4;
  const SphereBody sphere{4.1887902047863905, 0.4 * 4.1887902047863905, 1};
  const double t_impact = (-10 + std::sqrt(100 + 9.8)) / 9.8;
  const Vec3 before(1, -std::sqrt(109.8), 0);
  const SphereImpact exact = sphere_impact(sphere, before, Vec3::Zero(), Vec3(0, 1, 0), 0.60581, 0);
  const Vec3 dv(1e-3, 0, 2e-3), dw(0, 3e-3, 0);
  for (const bool perturbed : {false, true}) {
    const double early = perturbed ? 1e-3 : 0;  // s, that the impact is seen before it is due
    SceneErrors errors(scenario, options, 8);
    errors.observe_start(scenario.initial);
    Event event(t_impact - early, before, Vec3::Zero(), exact.v + (perturbed ? dv : Vec3::Zero()),
                exact.w + (perturbed ? dw : Vec3::Zero()));
    event.residuals.energy_before = sphere.kinetic_energy(before, Vec3::Zero());
    event.residuals.energy_gain = perturbed ? 2.5 : -100;
    event.show(errors);
    State state = scenario.initial;
    for (int n = 1; n <= 4000; ++n) {
      state.t = n * 1e-3;
      const double after = std::max(0.0, state.t - t_impact), flight = std::min(state.t, t_impact);
      state.pose[0].p = Vec3(flight + after * exact.v.x(), 1.5 - 10 * flight - 4.9 * flight * flight, 0);
      errors.observe_step(state, StepRecord());
    }
    const Errors out = named(errors);
    CHECK(listed("impacting_sphere", out));
    CHECK(out.at("position_linf_m") < 1e-13);
    CHECK(out.at("impact_time_error_s") == Approx(early).margin(1e-15));
    if (!perturbed) {
      for (const char* name :
           {"velocity_after_impact_m_per_s", "spin_after_impact_rad_per_s", "ke_after_impact_j",
            "ke_after_impact_relative", "polygon_velocity_after_impact_m_per_s", "polygon_spin_after_impact_rad_per_s",
            "polygon_ke_after_impact_j", "energy_rise_linf_j", "energy_rise_relative", "rolling_start_error_s"}) {
        INFO(name);
        CHECK(std::abs(out.at(name)) < 1e-13);
      }
      continue;
    }
    CHECK(out.at("velocity_after_impact_m_per_s") == Approx(dv.norm()));
    CHECK(out.at("spin_after_impact_rad_per_s") == Approx(dw.norm()));
    const double gain = sphere.kinetic_energy(exact.v + dv, exact.w + dw) - sphere.kinetic_energy(exact.v, exact.w);
    CHECK(out.at("ke_after_impact_j") == Approx(gain));
    CHECK(out.at("energy_rise_linf_j") == 2.5);
    CHECK(out.at("energy_rise_relative") == Approx(2.5 / event.residuals.energy_before));
    CHECK(out.count("rolling_start_error_s") == 0);  // it never rolls
  }
}

TEST_CASE("A sphere's polygon is turned about the normal away from what is listed first") {
  for (const bool body_first : {false, true}) {
    Scenario scenario = sphere_scene(Vec3(20, -3, 0), 0);
    if (body_first) std::swap(scenario.shapes[0], scenario.shapes[1]);
    scenario.rotate_cone = 0.2;
    SceneErrors errors(scenario, SimulationOptions(), 8);
    errors.observe_start(scenario.initial);
    const SphereBody sphere{4.1887902047863905, 0.4 * 4.1887902047863905, 1};
    const Vec3 before(20, -3, 0), up(0, 1, 0);
    const auto turned = [&](double angle) {
      return sphere_impact_polygon(sphere, before, Vec3::Zero(), up, 0.60581, 8, angle);
    };
    const SphereImpact impact = turned(body_first ? -0.2 : 0.2), other = turned(body_first ? 0.2 : -0.2);
    CHECK((impact.v - other.v).norm() > 0.1);
    Event(0, before, Vec3::Zero(), impact.v, impact.w).show(errors);
    State state = scenario.initial;
    state.t = 1e-3;
    errors.observe_step(state, StepRecord());
    CHECK(named(errors).at("polygon_velocity_after_impact_m_per_s") < 1e-12);
  }
}

TEST_CASE("A sphere that slides after its impact is timed until it rolls") {
  const Scenario scenario = sphere_scene(Vec3(20, -3, 0), 0);
  SimulationOptions options;
  options.duration = 1;
  const SphereBody sphere{4.1887902047863905, 0.4 * 4.1887902047863905, 1};
  SceneErrors errors(scenario, options, 0);
  errors.observe_start(scenario.initial);
  const Vec3 before(20, -3, 0);
  const SphereImpact impact = sphere_impact(sphere, before, Vec3::Zero(), Vec3(0, 1, 0), 0.60581, 0);
  Event(0, before, Vec3::Zero(), impact.v, impact.w).show(errors);
  // Steps of 1 ms: slip falls by 3.5 mu g h a step, so it vanishes in step 657 (0.6563746689 s); that event is at
  // 0.657.
  State state = scenario.initial;
  Vec3 v = impact.v, w = impact.w;
  for (int n = 1; n <= 1000; ++n) {
    const Vec3 down = v - Vec3(0, 9.8e-3, 0);
    const SphereImpact step = sphere_impact(sphere, down, w, Vec3(0, 1, 0), 0.60581, 0);
    Event(n * 1e-3, down, w, step.v, step.w).show(errors);
    v = step.v;
    w = step.w;
    state.t = n * 1e-3;
    errors.observe_step(state, StepRecord());
  }
  CHECK(named(errors).at("rolling_start_error_s") == Approx(0.657 - 0.6563746689).margin(1e-9));
  CHECK(v.x() == Approx(14.28571429).epsilon(1e-9));
}

TEST_CASE("A sphere that rolls too early is as wrong as one that rolls too late") {
  const Scenario scenario = sphere_scene(Vec3(20, -3, 0), 0);
  const SphereBody sphere{4.1887902047863905, 0.4 * 4.1887902047863905, 1};
  const Vec3 before(20, -3, 0), none = Vec3::Zero(), rolls(14, 0, 0), spin(0, 0, -14);
  const SphereImpact impact = sphere_impact(sphere, before, none, Vec3(0, 1, 0), 0.60581, 0);
  for (const double t : {0.5, 0.8}) {  // 0.6563746689 s by the closed form
    SceneErrors errors(scenario, SimulationOptions(), 0);
    errors.observe_start(scenario.initial);
    Event(0, Vec3(20, 1, 0), none, Vec3(20, 1, 0), none).show(errors);  // it does not come down in this one
    Event(0, before, none, impact.v, impact.w).show(errors);
    Event(t, rolls - Vec3(0, 9.8e-3, 0), spin, rolls, spin).show(errors);
    errors.observe_step(scenario.initial, StepRecord());
    CHECK(named(errors).at("rolling_start_error_s") == Approx(std::abs(t - 0.6563746689)).epsilon(1e-6));
  }
}

TEST_CASE("A sphere without friction has no time at which it should roll, though it may hardly slip") {
  Scenario scenario = sphere_scene(Vec3(1e-6, -10, 0), 0.5);
  scenario.pairs.laws[0].mu = 0;
  SceneErrors errors(scenario, SimulationOptions(), 0);
  errors.observe_start(scenario.initial);
  const double fast = std::sqrt(109.8);
  Event((fast - 10) / 9.8, Vec3(1e-6, -fast, 0), Vec3::Zero(), Vec3(1e-6, 0, 0), Vec3::Zero()).show(errors);
  errors.observe_step(scenario.initial, StepRecord());
  const Errors out = named(errors);
  CHECK(out.at("impact_time_error_s") < 1e-12);
  CHECK(out.at("velocity_after_impact_m_per_s") < 1e-12);
  CHECK(out.count("rolling_start_error_s") == 0);
}

TEST_CASE("A bouncing sphere is compared with the impact that restitution prescribes") {
  Scenario scenario = sphere_scene(Vec3(3, -2, 1), 0.1);
  scenario.pairs.laws[0].restitution = 0.5;
  SceneErrors errors(scenario, SimulationOptions(), 8);
  errors.observe_start(scenario.initial);
  const SphereBody sphere{4.1887902047863905, 0.4 * 4.1887902047863905, 1};
  const Vec3 v(3, -2, 1), w(0, 0, -6);
  const SphereImpact impact = sphere_impact(sphere, v, w, Vec3(0, 1, 0), 0.60581, 0.5);
  CHECK(impact.v.y() == Approx(1));
  Event(0.05, v, w, impact.v, impact.w).show(errors);
  State state = scenario.initial;
  state.t = 1e-3;
  errors.observe_step(state, StepRecord());
  const Errors out = named(errors);
  CHECK(out.at("velocity_after_impact_m_per_s") == 0);
  CHECK(out.count("polygon_velocity_after_impact_m_per_s") == 0);
  CHECK(out.count("position_linf_m") == 0);
}

TEST_CASE("A stack's interfaces carry what is above them, and what moves is measured") {
  // Three cubes, listed from the top down to show that the order in the file does not matter.
  Scenario scenario = on_plane("stack", ShapeKind::box, 0.5);
  scenario.model.bodies.assign(3, {"cube", 1.0, Vec3::Constant(1.0 / 6)});
  scenario.shapes.resize(4, scenario.shapes[1]);
  scenario.initial.pose.assign(3, Pose());
  scenario.initial.v.assign(18, 0);
  for (int b = 0; b < 3; ++b) {
    scenario.shapes[1 + b].body = b;
    scenario.initial.pose[b].p = Vec3(0, 2.5 - b, 0);
  }
  SimulationOptions options;
  options.duration = 0.01;
  options.step = 1e-3;
  const auto run = [&](double fault, double lift) {
    SceneErrors errors(scenario, options, 4);
    errors.observe_start(scenario.initial);
    State state = scenario.initial;
    for (int n = 1; n <= 10; ++n) {
      Event event(0, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
      event.contacts.clear();
      // Interfaces (shape above, shape below, number of cubes carried), four corners each, unevenly loaded.
      const int interfaces[3][3] = {{1, 2, 1}, {2, 3, 2}, {3, 0, 3}};
      for (const auto& interface : interfaces)
        for (int corner = 0; corner < 4; ++corner) {
          event.contacts.push_back({Vec3::Zero(), Vec3(0, 1, 0), 0, interface[0], interface[1]});
          const double share = corner == 0 ? 0.7 : 0.1;
          const double factor = interface[2] == 2 && n == 4 ? 1 + fault : 1;
          event.solution.impulse.insert(event.solution.impulse.end(), {share * interface[2] * 9.8e-3 * factor, 0, 0});
        }
      event.show(errors);
      state.t = n * 1e-3;
      state.pose[1].p.x() = n == 5 ? lift : 0;
      state.pose[2].q = Quat(Eigen::AngleAxisd(n == 6 ? lift : 0, Vec3::UnitX()));
      StepRecord record;
      record.max_penetration = n == 7 ? lift / 2 : 0;
      errors.observe_step(state, record);
    }
    return named(errors);
  };
  const Errors exact = run(0, 0);
  CHECK(exact.size() == 6);
  CHECK(listed("stack", exact));
  for (const auto& [name, value] : exact) {
    INFO(name);
    CHECK(value < 1e-15);
  }
  const Errors faulty = run(0.01, 2e-6);
  CHECK(faulty.at("interface_sum_relative") == Approx(0.01).epsilon(1e-10));
  CHECK(faulty.at("interface_total_relative") == Approx(0.01 * 2 / 6).epsilon(1e-10));
  CHECK(faulty.at("displacement_linf_m") == Approx(2e-6));
  CHECK(faulty.at("displacement_final_m") == 0);
  CHECK(faulty.at("tilt_linf_rad") == Approx(2e-6));
  CHECK(faulty.at("penetration_linf_m") == Approx(1e-6));
  // To an accuracy steps are extrapolated, and have no impulses.
  options.stepping = Stepping::accuracy;
  const Errors extrapolated = run(0, 2e-6);
  CHECK(extrapolated.size() == 4);
  CHECK(extrapolated.count("interface_sum_relative") == 0);
  CHECK(extrapolated.count("interface_total_relative") == 0);
  CHECK(extrapolated.at("displacement_linf_m") == Approx(2e-6));
  // Nor is known what an interface carries of what does not rest, or has no weight.
  options.stepping = Stepping::steps;
  const Scenario rests = scenario;
  const auto carries = [&](const auto& change) {
    scenario = rests;
    change(scenario);
    return run(0, 0).count("interface_sum_relative") == 1;
  };
  CHECK(carries([](Scenario&) {}));
  CHECK_FALSE(carries([](Scenario& s) { s.forces = {{0, Vec3(1, 0, 0), 0, 5}}; }));
  CHECK_FALSE(carries([](Scenario& s) { s.gravity.harmonic[0] = {0.4, 1, 0}; }));
  CHECK_FALSE(carries([](Scenario& s) { s.gravity.constant.setZero(); }));
  CHECK_FALSE(carries([](Scenario& s) { s.initial.v[12] = 1e-3; }));
  CHECK_FALSE(carries([](Scenario& s) { s.pairs.laws[0].restitution = 0.5; }));
}

TEST_CASE("Every error that a run can report is in the table of references, with its unit") {
  // Runs that go wrong in every way, so that all measures are there.
  Scenario box = sliding_box();
  CHECK(listed("sliding_box", errors_of(box, 8, 1e-2, 8, 8, [&](double t) { return moved(box, Vec3(t, t, t)); })));
  Scenario slope = on_plane("sticking_box", ShapeKind::box, 0.7, pi / 6);
  CHECK(listed("sticking_box", errors_of(slope, 5, 1e-2, 8, 5, [&](double t) { return moved(slope, Vec3(t, t, t)); })));
  Scenario round = circle();
  const Errors errors = errors_of(round, 60, 1e-2, 8, 60, [&](double t) { return moved(round, Vec3(t, t, t)); });
  CHECK(errors.size() == 12);
  CHECK(listed("circular_sliding", errors));
  CHECK(references().size() == 7);
  for (const ReferenceRow& row : references()) {
    CHECK(!row.summary.empty());
    for (const auto& [name, meaning] : row.errors) {
      INFO(name);
      const auto ends = [&name = name](std::string_view suffix) { return name.ends_with(suffix); };
      CHECK((ends("_m") || ends("_s") || ends("_relative") || ends("_rad") || ends("_j")));
      CHECK(meaning.find(';') != std::string_view::npos);
    }
  }
}
