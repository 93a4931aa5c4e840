// What the sections of a file mean where the small scene of format.cpp takes one way of several.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double pi = std::numbers::pi;

/// Sections beside the default ones, each in place of its own.
struct Sections {
  std::string parameters, simulation = "step=\"1e-3\" duration=\"1\"", reference = "kind=\"missing\"",
                          gravity = "<gravity constant=\"0 -9.8 0\"/>",
                          bodies = "<sphere name=\"ball\" radius=\"1\" mass=\"1\" position=\"0 0 0\"/>", after;
  std::string text() const {
    return "<scenario title=\"t\">" + parameters + "<simulation " + simulation + "/>\n<reference " + reference +
           "/>\n" + gravity + "\n<bodies>" + bodies + "</bodies>" + after + "</scenario>";
  }
  Scenario load(const Overrides& overrides = {}) const { return load_text(text(), overrides); }
  std::string message(const Overrides& overrides = {}) const { return message_of(TextFile(text()).path(), overrides); }
};

Sections simulation(const std::string& more) {
  Sections s;
  s.simulation = "step=\"0.25\" duration=\"8\" " + more;
  return s;
}
Sections bodies(const std::string& text) {
  Sections s;
  s.bodies = text;
  return s;
}

}  // namespace

TEST_CASE("What a simulation is not told stays open, and each switch has two sides") {
  const Scenario plain = simulation("").load();
  CHECK(plain.step == 0.25);
  CHECK(plain.duration == 8);
  CHECK_FALSE(plain.k.has_value());
  CHECK_FALSE(plain.compression_bound.has_value());
  CHECK(plain.rotate_cone == 0);
  CHECK_FALSE(plain.implicit_joints);
  CHECK(simulation("compression_bound=\"on\"").load().compression_bound == true);
  CHECK(simulation("compression_bound=\"off\"").load().compression_bound == false);
  CHECK(simulation("joint_forces=\"implicit\"").load().implicit_joints);
  CHECK_FALSE(simulation("joint_forces=\"explicit\"").load().implicit_joints);
  for (const int k : {4, 6, 4096}) CHECK(simulation("k=\"" + std::to_string(k) + "\"").load().k == k);
  for (const int k : {2, 3, 4098}) {
    INFO(k);
    CHECK_THAT(simulation("k=\"" + std::to_string(k) + "\"").message(),
               Catch::Contains("k is " + std::to_string(k) + "; it has to be an integer from 4 to 4096"));
  }
  CHECK_THAT(simulation("k=\"7\"").message(), Catch::Contains("k is 7; the friction polygon has an even number"));
  // A scene that only shows its start.
  Sections still;
  still.simulation = "step=\"1e-3\" duration=\"0\"";
  CHECK(still.load().duration == 0);
}

TEST_CASE("A reference is of one of three kinds; the analytic one has a name, and says where that stands") {
  Sections s;
  s.reference = "kind=\"certified\"";
  CHECK(s.load().reference.kind == ReferenceKind::certified);
  CHECK(s.load().reference.name.empty());
  s.reference = "kind=\"certified\" name=\"stack\"";
  CHECK_THAT(s.message(), Catch::Contains(":2:29: a certified reference has no name"));
  s.reference = "kind=\"missing\" name=\"stack\"";
  CHECK_THAT(s.message(), Catch::Contains("a missing reference has no name"));
  s.reference = "kind=\"analytic\" name=\"some_name\"";
  const TextFile file(s.text());
  const Scenario read = load_scenario(file.path(), {});
  CHECK(read.reference.kind == ReferenceKind::analytic);
  CHECK(read.reference.name == "some_name");
  CHECK(read.reference.where == file.path() + ":2:34");
  s.reference = "kind=\"analytic\" name=\"no name\"";
  CHECK_THAT(s.message(), Catch::Contains("\"no name\" is no name of a reference"));
}

TEST_CASE("Each axis of gravity has a constant part and a harmonic of its own: amplitude, frequency and phase") {
  Sections s;
  s.gravity =
      "<gravity constant=\"1 -2 3\"><harmonic axis=\"z\" amplitude=\"5\" frequency=\"0.5\" phase=\"0.25\"/>"
      "<harmonic axis=\"y\" amplitude=\"7\" frequency=\"2\"/></gravity>";
  const Gravity gravity = s.load().gravity;
  CHECK(gravity.varies());
  for (const double t : {0.0, 0.3, 4.0})
    CHECK((gravity.at(t) - Vec3(1, -2 + 7 * std::cos(2 * t), 3 + 5 * std::cos(0.5 * t + 0.25))).norm() < 1e-14);
  s.gravity = "<gravity constant=\"1 -2 3\"/>";
  CHECK_FALSE(s.load().gravity.varies());
  CHECK(s.load().gravity.at(2) == Vec3(1, -2, 3));
  for (const char* axis : {"x", "y", "z"}) {
    s.gravity = "<gravity constant=\"0 0 0\"><harmonic axis=\"" + std::string(axis) +
                "\" amplitude=\"-1\" frequency=\"2\"/></gravity>";
    CHECK(s.load().gravity.varies());
    CHECK(s.load().gravity.at(0)[axis[0] - 'x'] == -1);
  }
  s.gravity = "<gravity constant=\"0 0 0\"><harmonic axis=\"x\" amplitude=\"1\" frequency=\"-2\"/></gravity>";
  CHECK_THAT(s.message(), Catch::Contains("frequency is -2; it has to be at least 0"));
}

TEST_CASE("What a parameter takes, its unit, default and meaning are told, and derived values are not") {
  Sections s;
  s.parameters =
      R"(<parameters><parameter name="up" type="number" default="4" maximum="5" unit="m" description="how high"/>
<parameter name="count" type="integer" default="-2" minimum="-3" unit="-" description="how many"/>
<parameter name="any" type="number" default="7" description="what"/>
<parameter name="whole" type="integer" default="8" description="which"/>
<parameter name="way" type="word" default="b" choices="a b c" description="which way"/>
<derived name="sum" value="${up + count}"/></parameters>)";
  s.bodies = R"(<sphere name="ball" radius="${any}" mass="${whole}" position="0 ${sum} ${if(way = b, 0, 1)}"/>)";
  const Scenario read = s.load({{"up", "3"}, {"way", "c"}});
  CHECK(read.parameters == std::vector<std::pair<std::string, std::string>>{
                               {"up", "3"}, {"count", "-2"}, {"any", "7"}, {"whole", "8"}, {"way", "c"}});
  const std::vector<ParameterNote> expected = {{"a number, at most 5", "m", "4", "how high"},
                                               {"an integer, at least -3", "-", "-2", "how many"},
                                               {"a number", "", "7", "what"},
                                               {"an integer", "", "8", "which"},
                                               {"one of: a, b, c", "", "b", "which way"}};
  REQUIRE(read.parameter_notes.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    INFO(read.parameters[i].first);
    CHECK(read.parameter_notes[i].takes == expected[i].takes);
    CHECK(read.parameter_notes[i].unit == expected[i].unit);
    CHECK(read.parameter_notes[i].default_value == expected[i].default_value);
    CHECK(read.parameter_notes[i].description == expected[i].description);
  }
  CHECK(read.initial.pose[0].p == Vec3(0, 1, 1));
  CHECK(s.load({{"up", "5"}}).initial.pose[0].p == Vec3(0, 3, 0));
  CHECK_THAT(s.message({{"up", "5.001"}}),
             Catch::Contains("--set up=5.001: out of range; up takes a number, at most 5"));
  CHECK_THAT(s.message({{"sum", "5"}}), Catch::Contains("declares no parameter \"sum\""));
  CHECK_THAT(bodies("<sphere name=\"ball\" radius=\"1\" mass=\"1\" position=\"0 0 0\"/>").message({{"up", "5"}}),
             Catch::Contains("it declares none"));
}

TEST_CASE("All overrides that had a hand in a value that is refused are named, those behind a derived one too") {
  Sections s;
  s.parameters =
      R"(<parameters><parameter name="a" type="number" default="1" description="a"/>
<parameter name="b" type="number" default="1" description="b"/>
<parameter name="c" type="number" default="1" description="c"/>
<derived name="ab" value="${a + b}"/></parameters>)";
  s.bodies = R"(<sphere name="ball" radius="${ab - 1}" mass="${c}" position="0 0 0"/>)";
  CHECK_THAT(s.message({{"b", "-2"}, {"c", "3"}, {"a", "1/4"}}),
             Catch::EndsWith("radius is -2.75; it has to be more than 0 [with a = 1/4, b = -2 from --set]"));
  CHECK_THAT(s.message({{"c", "-3"}, {"a", "4"}}),
             Catch::EndsWith("mass is -3; it has to be more than 0 [with c = -3 from --set]"));
  // Of an attribute with several expressions, those in all of them.
  s.bodies = R"(<box name="ball" size="${a} ${b} 1" mass="${c}" position="0 0 0"/>)";
  CHECK_THAT(s.message({{"b", "-2"}, {"c", "3"}, {"a", "1/4"}}),
             Catch::EndsWith("all three edges have to be more than 0 [with a = 1/4, b = -2 from --set]"));
}

TEST_CASE("Forces act on the bodies that they name, from when until when, in the file's order") {
  Sections s = bodies(
      R"(<half_space name="ground" point="0 0 0" normal="0 1 0"/>
<sphere name="first" radius="1" mass="1" position="0 0 0"/><box name="wall" size="1 1 1" fixed="yes" position="9 0 0"/>
<sphere name="second" radius="1" mass="1" position="0 5 0"/>)");
  s.after = R"(<forces><force body="second" force="1 2 3" from="4" to="5"/>
<force body="first" force="-6 -7 -8" from="9" to="9"/></forces>)";
  const std::vector<Force> forces = s.load().forces;
  REQUIRE(forces.size() == 2);
  CHECK(forces[0].body == 1);
  CHECK(forces[0].force == Vec3(1, 2, 3));
  CHECK(forces[0].from == 4);
  CHECK(forces[0].to == 5);
  CHECK(forces[1].body == 0);
  CHECK(forces[1].force == Vec3(-6, -7, -8));
  CHECK(forces[1].from == 9);
  CHECK(forces[1].to == 9);
  s.after = R"(<forces><force body="*" force="1 2 3" from="4" to="5"/></forces>)";
  CHECK_THAT(s.message(), Catch::Contains("a force acts on one body"));
}

TEST_CASE("Copies of an array stand where their index and the offset say, counted from 0; outside there is no index") {
  const Scenario s = bodies(
                         R"(<array count="3" offset="0 0 2"><box name="b" size="1 2 ${1 + index}" mass="${4 - index}"
position="${10*index} 1 0" velocity="0 ${index} 0" angular_velocity="0 0 ${-index}"/></array>)")
                         .load();
  REQUIRE(s.model.bodies.size() == 3);
  for (int i = 0; i < 3; ++i) {
    CHECK(s.model.bodies[i].name == "b_" + std::to_string(i + 1));
    CHECK(s.initial.pose[i].p == Vec3(10 * i, 1, 2 * i));
    CHECK(s.model.bodies[i].mass == 4 - i);
    CHECK(s.shapes[i].half_extents == Vec3(0.5, 1, 0.5 * (1 + i)));
    CHECK(s.initial.v[6 * i + 1] == i);
    CHECK(s.initial.v[6 * i + 5] == -i);
  }
  CHECK_THAT(bodies(R"(<array count="1"><sphere name="b" radius="1" mass="1" position="0 0 0"/></array>
<sphere name="c" radius="1" mass="1" position="${index} 0 0"/>)")
                 .message(),
             Catch::Contains("no parameter \"index\""));
  // One copy needs no step, and where the index places them none is needed either.
  CHECK(
      bodies(R"(<array count="1"><sphere name="b" radius="1" mass="1" position="0 0 0"/></array>)").message().empty());
  CHECK(bodies(R"(<array count="2"><sphere name="b" radius="1" mass="1" position="${index} 0 0"/></array>)")
            .message()
            .empty());
}

TEST_CASE("A box keeps the points that its edges are given; a body that is said not to be fixed moves") {
  const Scenario s = bodies(R"(<box name="a" size="1 1 1" mass="1" position="0 0 0" contact_grid="5"/>
<box name="b" size="1 1 1" mass="1" fixed="no" position="3 0 0"/>)")
                         .load();
  CHECK(s.shapes[0].contact_grid == 5);
  CHECK(s.shapes[1].contact_grid == 2);
  CHECK(s.shapes[1].body == 1);
  const auto grid = [](int points) {
    return bodies("<box name=\"a\" size=\"1 1 1\" mass=\"1\" position=\"0 0 0\" contact_grid=\"" +
                  std::to_string(points) + "\"/>")
        .message();
  };
  CHECK(grid(256).empty());
  for (const int points : {1, 257}) CHECK_THAT(grid(points), Catch::Contains("an integer from 2 to 256"));
  for (const char* what : {"velocity", "angular_velocity", "density"})
    CHECK_THAT(
        bodies("<box name=\"a\" size=\"1 1 1\" fixed=\"yes\" position=\"0 0 0\" " + std::string(what) + "=\"1\"/>")
            .message(),
        Catch::Contains(std::string("a fixed body has no ") + what));
}

TEST_CASE("A file that several hulls are read from is one file, and each has its own scale") {
  const TextFile part("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", "part.obj");
  const Scenario s = bodies(R"(<hull name="a" file="part.obj" density="6" position="0 0 0"/>
<hull name="b" file="part.obj" scale="2" density="6" position="5 0 0"/>
<hull name="c" points="0 0 0  1 0 0  0 1 0  0 0 1" scale="3" density="6" position="9 0 0"/>
<hull name="d" file="part.obj" density="6" position="0 5 0"/>)")
                         .load();
  CHECK(s.files.size() == 2);
  const double masses[] = {1, 8, 27, 1};  // a tetrahedron of 1/6 m^3
  for (int b = 0; b < 4; ++b) {
    CHECK(s.model.bodies[b].mass == Approx(masses[b]).epsilon(1e-14));
    CHECK(s.shapes[b].hull->volume == Approx(masses[b] / 6).epsilon(1e-14));
  }
  CHECK(s.shapes[0].hull == s.shapes[3].hull);
  CHECK((s.initial.pose[1].p - Vec3(5.5, 0.5, 0.5)).norm() < 1e-15);
}

TEST_CASE("Moments of boxes and balls are those of their sides, each about its own axis") {
  const Scenario s = bodies(R"(<box name="a" size="1 2 3" mass="24" position="0 0 0"/>
<sphere name="b" radius="2" mass="5" position="9 0 0" quaternion="0 0 3 0"/>)")
                         .load();
  CHECK((s.model.bodies[0].inertia - 2 * Vec3(4 + 9, 9 + 1, 1 + 4)).norm() < 1e-14);
  CHECK((s.model.bodies[1].inertia - Vec3::Constant(8)).norm() < 1e-14);
  CHECK(s.initial.pose[1].q.coeffs() == Quat(0, 0, 1, 0).coeffs());
  const Scenario turned =
      bodies("<sphere name=\"b\" radius=\"2\" mass=\"5\" position=\"9 0 0\" quaternion=\"1 2 4 10\"/>").load();
  CHECK((turned.initial.pose[0].q.coeffs() - Quat(1 / 11., 2 / 11., 4 / 11., 10 / 11.).coeffs()).norm() < 1e-15);
}

// Prisms stand below their triangles; a field's rows go along x, one for each step along z.
TEST_CASE("Heights stand row by row along x, and the ground is as deep as it is told or its widest triangle") {
  const auto field = [](const std::string& more) {
    return bodies(
               "<heightfield name=\"g\" position=\"1 2 3\" axis=\"0 1 0\" angle=\"${pi/2}\" columns=\"3\" "
               "spacing=\"0.5 2\" "
               "heights=\"0 0.01 0.02  0.03 0.04 0.05\" " +
               more + "/><sphere name=\"ball\" radius=\"1\" mass=\"1\" position=\"0 9 0\"/>")
        .load();
  };
  for (const auto& [more, depth] : {std::pair("", 2.0), std::pair("depth=\"0.25\"", 0.25)}) {
    const Scenario s = field(more);
    REQUIRE(s.shapes.size() == 5);  // two triangles a cell, and the ball
    for (int i = 0; i < 4; ++i) CHECK(s.shapes[i].name == "g_" + std::to_string(i + 1));
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 3; ++i) {
        const double height = 0.01 * (3 * j + i);
        // A quarter turn about y takes x to -z and z to x.
        const Vec3 top = Vec3(1, 2, 3) + Vec3(2 * j, height, -0.5 * i);
        double nearest = 1, lowest = 1;
        for (const Shape& shape : s.shapes) {
          if (!shape.hull) continue;
          for (const Vec3& x : shape.hull->polytope.vertices) {
            nearest = std::min(nearest, (shape.local * x - top).norm());
            lowest = std::min(lowest, (shape.local * x - (top - Vec3(0, depth, 0))).norm());
          }
        }
        INFO(i << ' ' << j);
        CHECK(nearest < 1e-14);
        CHECK(lowest < 1e-14);
      }
  }
}

TEST_CASE("Of a mesh what looks up is the ground, scaled and turned; how much does not is told") {
  // Two triangles look up, one down, two stand upright.
  const TextFile mesh("v 0 0 0\nv 0 0 1\nv 1 0 0\nv 1 0.5 1\nv 0 1 0\nf 1 2 3\nf 3 2 4\nf 1 3 2\nf 1 5 2\nf 1 3 5\n",
                      "ground.obj");
  const Sections scene = bodies(
      R"(<mesh name="g" file="ground.obj" position="1 2 3" axis="0 1 0" angle="${pi}" scale="2" depth="0.5"/>
<sphere name="ball" radius="1" mass="1" position="0 9 0"/>)");
  const TextFile file(scene.text());
  const Scenario s = load_scenario(file.path(), {});
  REQUIRE(s.shapes.size() == 3);
  REQUIRE(s.left_out.size() == 1);
  CHECK_THAT(s.left_out[0], Catch::StartsWith("3 of 5 triangles of ") && Catch::Contains("ground.obj"));
  CHECK(s.files.size() == 2);
  double nearest = 1, below = 1;
  for (const Vec3& x : s.shapes[1].hull->polytope.vertices) {
    nearest = std::min(nearest, (s.shapes[1].local * x - (Vec3(1, 2, 3) + 2 * Vec3(-1, 0.5, -1))).norm());
    below = std::min(below, (s.shapes[1].local * x - (Vec3(1, 2, 3) + 2 * Vec3(-1, 0.25, -1))).norm());
  }
  CHECK(nearest < 1e-14);
  CHECK(below < 1e-14);  // the depth is in the scene's metres, not the file's
}

TEST_CASE("What stands fixed has no pair with what stands fixed, though one pattern means both and what moves") {
  Sections s = bodies(
      R"(<box name="a" size="1 1 1" fixed="yes" position="0 0 0"/><box name="b" size="1 1 1" mass="1" position="2 0 0"/>
<box name="c" size="1 1 1" fixed="yes" position="4 0 0"/><box name="d" size="1 1 1" mass="1" position="6 0 0"/>)");
  s.after = R"(<contacts><pair a="*" b="*" mu="0.5"/></contacts>)";
  const Scenario read = s.load();
  const auto is_fixed = [](int i) { return i % 2 == 0; };
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      if (i == j) continue;
      INFO(i << ' ' << j);
      CHECK((read.pairs.find(i, j) == nullptr) == (is_fixed(i) && is_fixed(j)));
      CHECK(read.can_touch(i, j) == !(is_fixed(i) && is_fixed(j)));
    }
}

TEST_CASE("Shapes of one link keep their distance, and do not touch though a pattern means both") {
  Sections s = bodies(R"(<robot name="r"><link name="hand" mass="1" position="0 0 0" inertia="1 1 1">
<box name="palm" size="1 1 1" position="0 0 0"/><sphere name="thumb" radius="1" position="1 0 0"/></link>
<joint name="slide" kind="prismatic" parent="world" child="hand" axis="1 0 0"/></robot>
<sphere name="ball" radius="1" mass="1" position="5 0 0"/>)");
  s.after = R"(<contacts><pair a="*" b="*" mu="0.5"/></contacts>)";
  const Scenario read = s.load();
  CHECK_FALSE(read.can_touch(0, 1));
  CHECK(read.can_touch(0, 2));
  CHECK(read.can_touch(2, 1));
}

TEST_CASE("A place that no number tells is refused by the name of what would be there, moving or fixed") {
  for (const char* how : {"mass=\"1\"", "fixed=\"yes\""}) {
    const std::string array =
        "<sphere name=\"ball\" radius=\"1\" mass=\"1\" position=\"0 0 0\"/>"
        "<array count=\"3\" offset=\"0 1e308 0\"><sphere name=\"s\" radius=\"1\" position=\"0 0 0\" ";
    CHECK_THAT(bodies(array + how + "/></array>").message(),
               Catch::Contains("s_3 would be at a place that is not finite"));
  }
}
