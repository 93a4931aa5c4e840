// What the format means, on a small scene that uses all of it.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double pi = std::numbers::pi;

std::string small_path() { return TEST_DATA "/scenes/small.xml"; }
std::string small_text() { return file_text(small_path()); }

/// Everything a run sees is the same, bit by bit.
void check_same(const Scenario& a, const Scenario& b) {
  REQUIRE(a.model.bodies.size() == b.model.bodies.size());
  for (std::size_t i = 0; i < a.model.bodies.size(); ++i) {
    CHECK(a.model.bodies[i].name == b.model.bodies[i].name);
    CHECK(a.model.bodies[i].mass == b.model.bodies[i].mass);
    CHECK(a.model.bodies[i].inertia == b.model.bodies[i].inertia);
    CHECK(a.initial.pose[i].p == b.initial.pose[i].p);
    CHECK(a.initial.pose[i].q.coeffs() == b.initial.pose[i].q.coeffs());
  }
  CHECK(a.initial.v == b.initial.v);
  REQUIRE(a.shapes.size() == b.shapes.size());
  const int shapes = static_cast<int>(a.shapes.size());
  for (int i = 0; i < shapes; ++i) {
    CHECK(a.shapes[i].name == b.shapes[i].name);
    CHECK(a.shapes[i].local.q.coeffs() == b.shapes[i].local.q.coeffs());
    for (int j = 0; j < shapes; ++j) {
      const PairLaw *law_a = a.pairs.find(i, j), *law_b = b.pairs.find(i, j);
      REQUIRE((law_a == nullptr) == (law_b == nullptr));
      if (law_a != nullptr) CHECK(law_a->mu == law_b->mu);
    }
  }
  CHECK(a.step == b.step);
  CHECK(a.duration == b.duration);
  CHECK(a.gravity.at(1.25) == b.gravity.at(1.25));
  CHECK(a.parameters == b.parameters);
}

std::string error_of(const Overrides& overrides) { return message_of(small_path(), overrides); }

}  // namespace

TEST_CASE("A scene that uses all of the format reads as it is written") {
  const Scenario s = load_scenario(small_path(), {});
  CHECK(s.name == "small");
  CHECK(s.title == "A ball beside a small stack");
  CHECK(s.step == 1e-3);
  CHECK(s.duration == 2);
  CHECK(s.k == 8);
  CHECK(s.compression_bound == false);
  CHECK(s.rotate_cone == pi / 8);
  CHECK(s.reference.kind == ReferenceKind::missing);
  CHECK((s.gravity.at(0.3) - Vec3(0.4 * std::cos(0.6), -9.8, 0)).norm() <= 1e-15);

  // Shapes in the file's order; bodies are the free ones among them.
  REQUIRE(s.shapes.size() == 5);
  REQUIRE(s.model.bodies.size() == 3);
  const char* names[] = {"ground", "box_1", "box_2", "ball", "wall"};
  const int bodies[] = {-1, 0, 1, 2, -1};
  for (int i = 0; i < 5; ++i) {
    CHECK(s.shapes[i].name == names[i]);
    CHECK(s.shapes[i].body == bodies[i]);
    if (bodies[i] >= 0) CHECK(s.model.bodies[bodies[i]].name == names[i]);
  }
  CHECK(s.shapes[4].local.p == Vec3(5, 2, 0));
  CHECK(s.shapes[4].local.q.angularDistance(Quat(Eigen::AngleAxisd(pi / 6, Vec3::UnitY()))) <= 1e-15);
  CHECK(s.shapes[4].half_extents == Vec3(0.1, 2, 3));
  CHECK(s.model.bodies[2].mass == Approx(1000 * pi / 6).epsilon(1e-15));  // 4/3 pi / 8
  CHECK(s.initial.v == std::vector<double>{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0});
  REQUIRE(s.forces.size() == 1);
  CHECK(s.forces[0].body == 2);
  CHECK(s.forces[0].from == 0.5);
  CHECK(s.forces[0].to == 1);

  CHECK(s.parameters ==
        std::vector<std::pair<std::string, std::string>>{{"gap", "0.5"}, {"boxes", "2"}, {"start", "push"}});
  CHECK(s.parameter_notes[0].unit == "m");
  CHECK(s.parameter_notes[1].takes == "an integer, from 1 to 10");
  CHECK(s.parameter_notes[2].takes == "one of: push, rest");
}

TEST_CASE("A robot that is placed turned sets out turned: the velocities of its free joint are its own") {
  const Scenario s = load_text(R"(<scenario title="t"><simulation step="1e-3" duration="1"/>
    <reference kind="missing"/><gravity constant="0 0 0"/><bodies>
    <robot name="r" axis="0 0 1" angle="${pi/2}"><link name="a" mass="1" position="0 0 0" inertia="1 1 1"/>
    <joint name="f" kind="free" parent="world" child="a" velocity="1 0 0" angular_velocity="0 2 0"/></robot>
    </bodies></scenario>)");
  const std::vector<double> expected = {0, 1, 0, -2, 0, 0};
  REQUIRE(s.initial.qd.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(s.initial.qd[i] == Approx(expected[i]).margin(1e-15));
}

TEST_CASE("Pairs hold for the bodies that a name or a pattern selects, in either order, and for no others") {
  const Scenario s = load_scenario(small_path(), {});
  // ground, box_1, box_2, ball, wall; 0 for bodies that pass through each other.
  const double mu[5][5] = {
      {0, 0.5, 0.5, 0.3, 0}, {0.5, 0, 0.6, 0.3, 0}, {0.5, 0.6, 0, 0.3, 0}, {0.3, 0.3, 0.3, 0, 0.3}, {0, 0, 0, 0.3, 0}};
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      if (i == j) continue;
      const PairLaw* law = s.pairs.find(i, j);
      CHECK((law == nullptr ? 0 : law->mu) == mu[i][j]);
      if (law != nullptr) CHECK(law->restitution == (law->mu == 0.6 ? 0.1 : 0));
    }
  }
  REQUIRE(s.pairs.laws.size() == 3);  // in the file's order
  CHECK(s.pairs.laws[2].mu == 0.3);
}

TEST_CASE("Without contacts every body passes through every other") {
  std::string text = small_text();
  const std::size_t begin = text.find("  <contacts>"), end = text.find("  <forces>");
  const Scenario s = load_text(text.erase(begin, end - begin));
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) CHECK(s.pairs.find(i, j) == nullptr);
}

TEST_CASE("A pattern takes names before and after its star") {
  const std::string text = small_text();
  CHECK(load_text(replaced(text, "a=\"ball\" b=\"*\"", "a=\"b*l\" b=\"*l\"")).pairs.find(3, 4)->mu == 0.3);
  CHECK_THAT(message_of(TextFile(replaced(text, "a=\"ball\" b=\"*\"", "a=\"b*l*\" b=\"*\"")).path()),
             Catch::Contains("more than one *"));
  // Head and tail may not share letters: "ba*all" is no "ball".
  CHECK_THAT(message_of(TextFile(replaced(text, "a=\"ball\" b=\"*\"", "a=\"ba*all\" b=\"*\"")).path()),
             Catch::Contains("no body \"ba*all\""));
}

TEST_CASE("A mass and the density that comes to it are the same body") {
  const std::string text = small_text();
  const Scenario by_mass = load_text(replaced(text, "size=\"1 1 1\" mass=\"1\"", "size=\"1 2 4\" mass=\"16\""));
  const Scenario by_density = load_text(replaced(text, "size=\"1 1 1\" mass=\"1\"", "size=\"1 2 4\" density=\"2\""));
  check_same(by_mass, by_density);
  // Solid box: m/12 (b^2 + c^2) about each axis.
  CHECK((by_mass.model.bodies[0].inertia - 16.0 / 12 * Vec3(4 + 16, 16 + 1, 1 + 4)).norm() <= 1e-14);
}

TEST_CASE("Axis and angle, a quaternion of any length, and a normal say the same orientation") {
  const std::string turn = "axis=\"0 1 0\" angle=\"${30*deg}\"";
  const Quat q = load_scenario(small_path(), {}).shapes[4].local.q;
  for (const char* same : {"axis=\"0 7 0\" angle=\"${pi/6}\"", "axis=\"0 -1e-200 0\" angle=\"${-pi/6}\"",
                           "quaternion=\"${3*cos(15*deg)} 0 ${3*sin(15*deg)} 0\"",
                           "quaternion=\"${1e200*cos(15*deg)} 0 ${1e200*sin(15*deg)} 0\""}) {
    INFO(same);
    const Quat other = load_text(replaced(small_text(), turn, same)).shapes[4].local.q;
    CHECK((other.coeffs() - q.coeffs()).norm() <= 3e-16);
  }
  const Vec3 by_normal =
      load_text(replaced(small_text(), "normal=\"0 1 0\"", "normal=\"3 4 0\"")).shapes[0].local.q * Vec3::UnitY();
  const Vec3 by_turn = load_text(replaced(small_text(), "normal=\"0 1 0\"", "axis=\"0 0 1\" angle=\"${-acos(0.8)}\""))
                           .shapes[0]
                           .local.q *
                       Vec3::UnitY();
  CHECK((by_normal - Vec3(0.6, 0.8, 0)).norm() <= 3e-16);
  CHECK((by_turn - by_normal).norm() <= 3e-16);
  const Vec3 down =
      load_text(replaced(small_text(), "normal=\"0 1 0\"", "normal=\"0 -1 0\"")).shapes[0].local.q * Vec3::UnitY();
  CHECK((down - Vec3(0, -1, 0)).norm() <= 3e-16);
}

TEST_CASE("A cylinder's mass and moments follow from its density, radius and length; a disc needs a mass") {
  // Of radius 2 and length 3: volume 12 pi, m r^2 / 2 about its y axis, m (3 r^2 + L^2) / 12 across.
  const char* cylinder = "<cylinder name=\"ball\" radius=\"2\" length=\"3\" density=\"0.5\" ";
  const std::string text =
      replaced(replaced(small_text(), "<sphere name=\"ball\" radius=\"0.5\" density=\"1000\" ", cylinder),
               "<pair a=\"ball\" b=\"*\"", "<pair a=\"ball\" b=\"ground\"");
  const Scenario s = load_text(text);
  CHECK(s.shapes[3].kind == ShapeKind::cylinder);
  CHECK(s.shapes[3].radius == 2);
  CHECK(s.shapes[3].half_extents == Vec3(2, 1.5, 2));
  CHECK(s.model.bodies[2].mass == Approx(6 * pi).epsilon(1e-15));
  CHECK((s.model.bodies[2].inertia / (6 * pi) - Vec3(1.75, 2, 1.75)).norm() < 1e-15);
  const Scenario disc = load_text(replaced(text, "length=\"3\" density", "length=\"0\" mass"));
  CHECK((disc.model.bodies[2].inertia / 0.5 - Vec3(1, 2, 1)).norm() < 1e-15);
  CHECK_THAT(message_of(TextFile(replaced(text, "length=\"3\"", "length=\"0\"")).path()),
             Catch::Contains("the mass comes to 0 kg"));
}

TEST_CASE("A capsule's mass and moments are those of a cylinder between two half balls; without length a sphere's") {
  // Radius 2, length 3: a cylinder of 12 pi and balls of 32/3 pi. Half balls are 3/8 r off the cylinder's ends.
  const char* capsule = "<capsule name=\"ball\" radius=\"2\" length=\"3\" density=\"0.5\" ";
  const std::string text = replaced(small_text(), "<sphere name=\"ball\" radius=\"0.5\" density=\"1000\" ", capsule);
  const Scenario s = load_text(text);
  CHECK(s.shapes[3].kind == ShapeKind::capsule);
  CHECK(s.shapes[3].half_extents == Vec3(2, 1.5, 2));
  CHECK(s.shapes[3].bounding_radius() == 3.5);
  const double middle = 6 * pi, ends = 16 * pi / 3;
  CHECK(s.model.bodies[2].mass == Approx(middle + ends).epsilon(1e-15));
  const double along = middle * 2 + ends * 1.6;
  // About its own centre a half ball has (2/5 - 9/64) m r^2 across; it is l/2 + 3/8 r from the capsule's.
  const double across = middle * 1.75 + ends * ((0.4 - 9.0 / 64) * 4 + std::pow(1.5 + 0.75, 2));
  CHECK((s.model.bodies[2].inertia - Vec3(across, along, across)).norm() < 1e-13);
  const Scenario ball = load_text(replaced(text, "length=\"3\"", "length=\"0\""));
  CHECK((ball.model.bodies[2].inertia - Vec3::Constant(ends * 1.6)).norm() < 1e-14);
}

TEST_CASE("A hull of a box's corners is the box: mass, moments, place; and is shared by an array") {
  const std::string text =
      replaced(small_text(), "<box name=\"box\" size=\"1 1 1\" mass=\"1\" position=\"0 0.5 0\"/>",
               "<hull name=\"box\" density=\"2\" position=\"-0.5 0 -0.5\" points=\"0 0 0  ${1+0} 0 0  0 0 1  1 0 1  "
               "0 1 0  1 1 0  0 1 1  1 1 1  0.5 0.5 0.5\"/>");
  const Scenario s = load_text(text);
  REQUIRE(s.shapes[1].kind == ShapeKind::hull);
  CHECK(s.shapes[1].hull == s.shapes[2].hull);
  CHECK(s.shapes[1].hull->polytope.vertices.size() == 8);
  CHECK(s.model.bodies[0].mass == Approx(2).epsilon(1e-14));
  CHECK((s.model.bodies[0].inertia - Vec3::Constant(2.0 / 6)).norm() < 1e-14);
  CHECK((s.initial.pose[0].p - Vec3(0, 0.5, 0)).norm() < 1e-15);
  CHECK((s.initial.pose[1].p - Vec3(0, 1.5, 0)).norm() < 1e-15);
  CHECK(s.initial.pose[0].q.coeffs() == Quat::Identity().coeffs());
  const Scenario twice = load_text(replaced(text, "density=\"2\"", "density=\"2\" scale=\"2\""));
  CHECK(twice.model.bodies[0].mass == Approx(16).epsilon(1e-14));
}

TEST_CASE("A hull is where the scene puts its points, however its own axes lie in it") {
  const std::vector<Vec3> given{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.2, 1, 0.2)};
  for (const std::string how : {"mass=\"3\"", "fixed=\"yes\""}) {
    std::string text = small_text();
    text.insert(
        text.find("    <sphere"),
        R"(<hull name="stone" points="0 0 0  1 0 0  0 0 1  0.2 1 0.2" position="1 2 3" axis="1 1 0" angle="0.7" )");
    text.insert(text.find("    <sphere"), how + "/>");
    const Scenario s = load_text(text);
    const Shape& shape = s.shapes[3];
    REQUIRE(shape.kind == ShapeKind::hull);
    const Pose pose = shape.body < 0 ? shape.local : s.initial.pose[static_cast<std::size_t>(shape.body)];
    const Quat turned(Eigen::AngleAxisd(0.7, Vec3(1, 1, 0).normalized()));
    for (const Vec3& x : given) {
      double nearest = 1;
      for (const Vec3& v : shape.hull->polytope.vertices)
        nearest = std::min(nearest, (pose * v - (Vec3(1, 2, 3) + turned * x)).norm());
      CHECK(nearest < 1e-14);
    }
    if (shape.body >= 0) CHECK(s.model.bodies[static_cast<std::size_t>(shape.body)].mass == 3);
  }
}

TEST_CASE("How a file is laid out does not matter: line ends, mark, remarks, order of sections, quotes") {
  const std::string text = small_text();
  const Scenario s = load_text(text);
  std::string dos;
  for (const char c : text) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
  check_same(s, load_text(dos));
  check_same(s, load_text("\xEF\xBB\xBF" + text));
  check_same(s, load_text(replaced(text, "<bodies>", "<bodies><!-- <box/> -->")));
  check_same(s, load_text(replaced(text, "name=\"ball\"", "name = 'ball'")));
  check_same(s, load_text(replaced(text, "3 ${height} 0", "\n 3\t${ height }\n0 ")));
  check_same(s, load_text(replaced(text, "3 ${height} 0", "&#51; ${height} 0")));
  const std::size_t begin = text.find("  <parameters>"), end = text.find("  <simulation");
  const std::string parameters = text.substr(begin, end - begin);
  check_same(s, load_text(replaced(replaced(text, parameters, ""), "</scenario>", parameters + "</scenario>")));
}

TEST_CASE("Places count characters and lines as an editor shows them") {
  const auto fails_at = [](const std::string& text, const std::string& place) {
    const TextFile file(text);
    CHECK_THAT(message_of(file.path()), Catch::StartsWith(file.path() + ":" + place + ": "));
  };
  fails_at("<scenario title=\"\xC3\xA9\xC3\xA9\" x=\"\"/>", "1:22");  // two letters of two bytes
  fails_at("\xEF\xBB\xBF<scenario title=\"ab\" x=\"\"/>", "1:22");    // a mark takes no column
  fails_at("<scenario title=\"a\"\r\n\t x=\"\"/>", "2:3");            // a tab is one character
  fails_at("<scenario title=\"a\"><motors/></scenario>", "1:22");
}

TEST_CASE("--set puts a value in force wherever the parameter is used") {
  const Scenario s = load_scenario(small_path(), {{"boxes", "5"}, {"gap", "1/4"}, {"start", "rest"}});
  CHECK(s.model.bodies.size() == 6);
  CHECK(s.initial.pose[4].p == Vec3(0, 4.5, 0));
  CHECK(s.initial.pose[5].p == Vec3(3, 0.75, 0));
  CHECK(s.initial.v == std::vector<double>(36, 0.0));
  CHECK(s.parameters ==
        std::vector<std::pair<std::string, std::string>>{{"gap", "0.25"}, {"boxes", "5"}, {"start", "rest"}});
  CHECK(s.parameter_notes[0].default_value == "0.5");
  check_same(load_scenario(small_path(), {}), load_scenario(small_path(), {{"gap", "0.5"}}));
}

TEST_CASE("Values in force read back as the same number") {
  for (const char* value : {"0.1", "1/3", "pi", "1e-300", "1e22", "123456789.123456789"}) {
    const Scenario s = load_scenario(small_path(), {{"gap", value}});
    CHECK(std::stod(s.parameters[0].second) + 0.5 == s.initial.pose[2].p[1]);
  }
}

TEST_CASE("A wrong --set says so, and what the parameter takes") {
  struct Row {
    const char *name, *value;
    const char* fragment;
  };
  for (const Row& row :
       {Row{"boxes", "abc", "\"abc\" is no number; boxes takes an integer, from 1 to 10"},
        Row{"boxes", "2.5", "no integer"}, Row{"boxes", "0", "out of range"}, Row{"boxes", "11", "out of range"},
        Row{"boxes", "1e99", "no integer"}, Row{"boxes", "", "write a number"},
        Row{"boxes", "nan", "\"nan\" is no number"}, Row{"gap", "inf", "\"inf\" is no number"},
        Row{"gap", "-0.1", "at least 0"}, Row{"gap", "1,5", "decimal point"}, Row{"gap", "boxes", "no number"},
        Row{"gap", "1/0", "division by zero"}, Row{"start", "pull", "one of: push, rest"},
        Row{"start", "", "one of: push, rest"}, Row{"boxs", "3", "did you mean \"boxes\"?"},
        Row{"height", "3", "its parameters are: gap, boxes, start"}, Row{"", "3", "no parameter"}}) {
    const std::string message = error_of({{row.name, row.value}});
    CHECK_THAT(message, Catch::StartsWith(std::string("--set ") + row.name + "=" + row.value + ": "));
    CHECK_THAT(message, Catch::Contains(row.fragment));
    CHECK_THAT(message, Catch::Contains(small_path()));
  }
  CHECK_THAT(error_of({{"gap", "1"}, {"gap", "2"}}), Catch::Contains("set twice"));
}

TEST_CASE("A value that --set makes impossible further on names the place and the override") {
  const TextFile file(replaced(small_text(), "radius=\"0.5\"", "radius=\"${1 - height}\""));
  CHECK(message_of(file.path()) == file.path() + ":19:33: radius is 0; it has to be more than 0");
  CHECK(message_of(file.path(), {{"gap", "2"}}) ==
        file.path() + ":19:33: radius is -1.5; it has to be more than 0 [with gap = 2 from --set]");
}

TEST_CASE("The example of the reference is a scenario, and the reference tells every element of the format") {
  const std::string reference = file_text(std::string(SOURCE_ROOT) + "/docs/scenarios.md");
  const std::size_t begin = reference.find("<?xml"), end = reference.find("```", begin);
  const Scenario s = load_text(reference.substr(begin, end - begin), {{"boxes", "4"}, {"speed", "2"}});
  CHECK(s.model.bodies.size() == 5);
  CHECK(s.initial.v[6 * 4 + 5] == -4);  // rolls: w = -v/r
  for (const char* element :
       {"scenario", "parameters", "parameter",   "derived",   "simulation", "reference", "gravity",
        "harmonic", "bodies",     "half_space",  "box",       "sphere",     "cylinder",  "capsule",
        "hull",     "array",      "contacts",    "pair",      "forces",     "force",     "robot",
        "link",     "joint",      "controllers", "controller"}) {
    INFO(element);
    CHECK(reference.find(std::string("<") + element) != std::string::npos);
  }
  for (const std::string& file : bundled_scenarios())
    CHECK(reference.find(std::filesystem::path(file).stem().string()) != std::string::npos);
}

TEST_CASE("A scene is found as a path first, then by its name with or without .xml") {
  CHECK(find_scenario(small_path()) == small_path());
  CHECK(find_scenario("stack") == find_scenario("stack.xml"));
  CHECK(load_scenario(find_scenario("stack"), {}).name == "stack");
  for (const char* name : {"stak", "stak.xml"}) {
    try {
      find_scenario(name);
      FAIL("found " << name);
    } catch (const InputError& error) {
      CHECK_THAT(error.what(), Catch::StartsWith(std::string(name) + ": "));
      CHECK_THAT(error.what(), Catch::Contains("did you mean \"stack\"?"));
      CHECK_THAT(error.what(), Catch::Contains("sliding_box, stack, sticking_box"));
    }
  }
  CHECK_THROWS_AS(find_scenario("/nowhere/at_all.xml"), InputError);
  CHECK_THROWS_AS(find_scenario(""), InputError);
  CHECK_THAT(message_of(find_scenario(TEST_DATA)), Catch::Contains("is a folder"));
}
