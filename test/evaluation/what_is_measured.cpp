// Which runs and scenes closed forms are for: of a run that ends early, or that does not begin, and of scenes that are
// not what their reference is about, nothing is told that is not so.

#include <catch2/catch.hpp>
#include <map>
#include <string>

#include "evaluation/references.h"
#include "evaluation/scene_errors.h"

using namespace cb;

namespace {

using Errors = std::map<std::string, double>;

/// A body of 1 kg that rests on a level plane, 0.5 m below its middle.
Scenario on_the_ground(const std::string& reference, ShapeKind kind = ShapeKind::box) {
  Scenario scenario;
  scenario.reference = {ReferenceKind::analytic, reference, {}};
  scenario.model.bodies = {{"body", 1, Vec3::Constant(0.1)}};
  Shape plane, shape;
  plane.kind = ShapeKind::half_space;
  shape.kind = kind;
  shape.body = 0;
  shape.radius = 0.5;
  shape.half_extents.setConstant(0.5);
  scenario.shapes = {plane, shape};
  scenario.pairs.group = {0, 1};
  scenario.pairs.groups = 2;
  scenario.pairs.index = {-1, 0, 0, -1};
  scenario.pairs.laws = {{0.5, 0}};
  scenario.initial.pose = {{Vec3(0, 0.5, 0), Quat::Identity()}};
  scenario.initial.v.assign(6, 0);
  return scenario;
}

/// Of bodies that stay where they are for so many steps of a run of ten.
Errors errors_of(const Scenario& scenario, int steps) {
  SimulationOptions options;
  options.step = 0.1;
  options.duration = 1;
  SceneErrors errors(scenario, options, 8);
  errors.observe_start(scenario.initial);
  State state = scenario.initial;
  for (int n = 1; n <= steps; ++n) {
    state.t = 0.1 * n;
    errors.observe_step(state, StepRecord());
  }
  Errors out;
  for (const auto& [name, value] : errors.finish()) out[name] = value;
  return out;
}

}  // namespace

TEST_CASE("Of a run that ends early no error of its end is told, and of one without a step none at all") {
  for (const char* reference : {"sliding_box", "sticking_box", "circular_sliding", "stack"}) {
    INFO(reference);
    const Scenario scenario = on_the_ground(reference);
    const Errors whole = errors_of(scenario, 10), early = errors_of(scenario, 9);
    int of_the_end = 0;
    for (const auto& [name, value] : whole) {
      const bool at_the_end = name.find("_final_") != std::string::npos || name == "creep_rate_m_per_s";
      of_the_end += at_the_end;
      INFO(name);
      CHECK(early.count(name) == (at_the_end ? 0 : 1));
    }
    CHECK(of_the_end > 0);
    CHECK(errors_of(scenario, 0).empty());
  }
}

TEST_CASE("A box on a plane is measured where there is nothing else, it may touch the plane, and it is a box") {
  const auto measured = [](const auto& change) {
    Scenario scenario = on_the_ground("sliding_box");
    change(scenario);
    return !errors_of(scenario, 10).empty();
  };
  CHECK(measured([](Scenario&) {}));
  CHECK_FALSE(measured([](Scenario& s) { s.pairs.index.assign(4, -1); }));  // it falls through
  CHECK_FALSE(measured([](Scenario& s) { s.shapes[1].kind = ShapeKind::sphere; }));
  CHECK_FALSE(measured([](Scenario& s) { s.shapes[1].local.p.x() = 0.1; }));  // its mass is to one side
  CHECK_FALSE(measured([](Scenario& s) { s.shapes[1].body = -1; }));          // a wall, and a body without a shape
  CHECK_FALSE(measured([](Scenario& s) {
    Shape wall = s.shapes[1];
    wall.body = -1;
    s.shapes.push_back(wall);
    s.pairs.group.push_back(0);
  }));
  CHECK_FALSE(measured([](Scenario& s) {
    s.model.bodies.push_back(Body{"another", 1, Vec3::Constant(0.1)});
    s.initial.pose.emplace_back();
    s.initial.v.resize(12, 0);
  }));
}

TEST_CASE("A sphere's flight is measured where it starts above its plane and gravity points straight down on that") {
  const auto flies = [](double slope, double gap) {
    Scenario scenario = on_the_ground("impacting_sphere", ShapeKind::sphere);
    scenario.shapes[0].local.q = Quat(Eigen::AngleAxisd(slope, Vec3::UnitZ()));
    scenario.initial.pose[0].p = (0.5 + gap) * (scenario.shapes[0].local.q * Vec3(0, 1, 0));
    return errors_of(scenario, 1).count("position_linf_m") == 1;
  };
  CHECK(errors_of(on_the_ground("impacting_sphere", ShapeKind::box), 1).empty());
  CHECK(flies(0, 0.2));
  CHECK_FALSE(flies(0.1, 0.2));
  CHECK_FALSE(flies(-1e-3, 0.2));
  CHECK_FALSE(flies(0, -0.1));
}

TEST_CASE("a scene that names a reference which there is not is refused, one that names none is not", "[references]") {
  Scenario scenario;
  for (const ReferenceRow& row : references()) {
    const std::string name(row.name);
    scenario.reference = {ReferenceKind::analytic, name, "scene.xml:7"};
    CHECK_NOTHROW(check_reference(scenario));
    for (const std::string& other :
         {name.substr(0, name.size() - 1), name + "s", std::string(name, 1), std::string()}) {
      CAPTURE(other);
      scenario.reference.name = other;
      CHECK_THROWS_WITH(check_reference(scenario),
                        Catch::StartsWith("scene.xml:7: there is no reference \"" + other + "\"; "));
      scenario.reference.kind = ReferenceKind::certified;
      CHECK_NOTHROW(check_reference(scenario));
      scenario.reference.kind = ReferenceKind::analytic;
    }
  }
}
