// Robots that are written out: every attribute has another value, so that none can stand for another.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double pi = std::numbers::pi;

/// `after`: sections after the bodies.
std::string scene(const std::string& bodies, const std::string& after = "") {
  return R"(<scenario title="t"><simulation step="1e-3" duration="1"/><reference kind="missing"/>
<gravity constant="0 -9.8 0"/><bodies>)" +
         bodies + "</bodies>" + after + "</scenario>";
}

const char* cart = R"(<robot name="first"><link name="cart" mass="5" position="0 0 0" inertia="1 1 1"/>
<joint name="rail" kind="prismatic" parent="world" child="cart" axis="1 0 0" position="0.25" velocity="-3"/></robot>)";

// The second robot is a quarter turn about z, and names its joints from the tip to the base.
const char* arm = R"(<robot name="second" position="1 2 3" axis="0 0 1" angle="${pi/2}">
<link name="lower" mass="3" position="1 0.5 0" inertia="0.5 0.6 0.7">
  <box name="pad" size="0.2 0.4 0.6" position="1 0.75 0.1" axis="0 1 0" angle="${pi/2}"/></link>
<link name="upper" mass="2" position="0.5 0 0" axis="1 0 0" angle="${pi/2}" inertia="0.2 0.3 0.4"
  products="0.01 0.02 0.03"/>
<joint name="elbow" kind="prismatic" parent="upper" child="lower" axis="0 2 0" lower="-0.5" upper="0.75"
  limit_rate="0.125" damping="4" stiffness="5" rest="0.0625" torque_limit="6" position="0.1875" velocity="7"/>
<joint name="hip" kind="revolute" parent="world" child="upper" anchor="0.1 0.2 0.3" axis="0 0 1" velocity="0.5"/></robot>)";

Mat3 in_world(const Scenario& s, int body) {
  const Mat3 R = s.initial.pose[static_cast<std::size_t>(body)].q.toRotationMatrix();
  return R * s.model.bodies[static_cast<std::size_t>(body)].inertia.asDiagonal() * R.transpose();
}
Vec3 linear(const Scenario& s, int body) { return Vec3(&s.initial.v[6 * static_cast<std::size_t>(body)]); }
Vec3 angular(const Scenario& s, int body) { return Vec3(&s.initial.v[6 * static_cast<std::size_t>(body) + 3]); }

}  // namespace

TEST_CASE("Joints come parents first, and what is said of each is its own: limits, spring, damping, motor, start") {
  const Scenario s = load_text(scene(std::string(cart) + arm));
  REQUIRE(s.model.trees.size() == 2);
  CHECK(s.model.trees[0].name == "first");
  CHECK(s.model.trees[1].name == "second");
  CHECK(s.model.trees[0].nv == 1);
  CHECK(s.model.trees[1].nv == 2);
  CHECK(s.model.trees[1].v == 1);
  REQUIRE(s.model.trees[1].joints.size() == 2);
  const Joint &hip = s.model.trees[1].joints[0], &elbow = s.model.trees[1].joints[1];
  CHECK(hip.name == "hip");
  CHECK(hip.kind == JointKind::revolute);
  CHECK(hip.parent == -1);
  CHECK(hip.up == -1);
  CHECK(hip.body == 1);
  CHECK(hip.q == 1);
  CHECK(hip.v == 1);
  // What is not said of it.
  CHECK(hip.lower == -HUGE_VAL);
  CHECK(hip.upper == HUGE_VAL);
  CHECK(hip.torque_limit == HUGE_VAL);
  for (const double none : {hip.limit_rate, hip.damping, hip.stiffness, hip.rest}) CHECK(none == 0);
  CHECK(elbow.name == "elbow");
  CHECK(elbow.kind == JointKind::prismatic);
  CHECK(elbow.parent == 1);
  CHECK(elbow.up == 0);
  CHECK(elbow.body == 2);
  CHECK(elbow.q == 2);
  CHECK(elbow.v == 2);
  CHECK(elbow.lower == -0.5);
  CHECK(elbow.upper == 0.75);
  CHECK(elbow.limit_rate == 0.125);
  CHECK(elbow.damping == 4);
  CHECK(elbow.stiffness == 5);
  CHECK(elbow.rest == 0.0625);
  CHECK(elbow.torque_limit == 6);
  CHECK(s.initial.q == std::vector<double>{0.25, 0, 0.1875});
  CHECK(s.initial.qd == std::vector<double>{-3, 0.5, 7});
  const char* names[] = {"cart", "upper", "lower"};
  const double masses[] = {5, 2, 3};
  for (int b = 0; b < 3; ++b) {
    CHECK(s.model.bodies[b].name == names[b]);
    CHECK(s.model.bodies[b].mass == masses[b]);
    CHECK(s.model.bodies[b].tree == (b == 0 ? 0 : 1));
  }
}

TEST_CASE("Links, their shapes and their motion at the start are where joints and the turned robot put them") {
  const Scenario s = load_text(scene(std::string(cart) + arm));
  const auto& pose = s.initial.pose;
  // A quarter turn about z takes (x, y, z) to (-y, x, z); the elbow has slid by 0.1875 along -x.
  CHECK((pose[0].p - Vec3(0.25, 0, 0)).norm() < 1e-15);
  CHECK((pose[1].p - Vec3(1, 2.5, 3)).norm() < 1e-15);
  CHECK((pose[2].p - Vec3(1 - 0.5 - 0.1875, 2 + 1, 3)).norm() < 1e-14);
  CHECK((linear(s, 0) - Vec3(-3, 0, 0)).norm() < 1e-15);
  // About the hip's anchor at (1 - 0.2, 2 + 0.1, 3 + 0.3).
  const Vec3 spin(0, 0, 0.5), hip(0.8, 2.1, 3.3);
  CHECK((linear(s, 1) - spin.cross(Vec3(1, 2.5, 3) - hip)).norm() < 1e-14);
  CHECK((linear(s, 2) - (spin.cross(Vec3(0.3125, 3, 3) - hip) + Vec3(-7, 0, 0))).norm() < 1e-14);
  for (const int b : {1, 2}) CHECK((angular(s, b) - spin).norm() < 1e-15);
  // Moments and products as written are about the link's own axes.
  Mat3 I;
  I << 0.2, 0.01, 0.02, 0.01, 0.3, 0.03, 0.02, 0.03, 0.4;
  const Mat3 Z = Eigen::AngleAxisd(pi / 2, Vec3::UnitZ()).toRotationMatrix();
  const Mat3 R = Z * Eigen::AngleAxisd(pi / 2, Vec3::UnitX()).toRotationMatrix();
  CHECK((in_world(s, 1) - R * I * R.transpose()).norm() < 1e-15);
  CHECK((in_world(s, 2) - Z * Vec3(0.5, 0.6, 0.7).asDiagonal() * Z.transpose()).norm() < 1e-15);
  REQUIRE(s.shapes.size() == 1);
  CHECK(s.shapes[0].name == "pad");
  CHECK(s.shapes[0].body == 2);
  CHECK(s.shapes[0].half_extents == Vec3(0.1, 0.2, 0.3));
  CHECK((pose[2] * s.shapes[0].local.p - Vec3(1 - 0.75 - 0.1875, 2 + 1, 3.1)).norm() < 1e-14);
  const Quat q = pose[2].q * s.shapes[0].local.q;
  CHECK((q * Vec3::UnitX() - Vec3(0, 0, -1)).norm() < 1e-15);  // by the box's own turn; the robot's leaves z
  CHECK((q * Vec3::UnitY() - Vec3(-1, 0, 0)).norm() < 1e-15);
}

TEST_CASE("What moves with a link of a turned robot turns by what the link has turned since its zero pose") {
  const Scenario s = load_text(scene(
      R"(<robot name="r" axis="1 0 0" angle="${pi/2}"><link name="bar" mass="3" position="0.5 0 0" inertia="1 1 1"/>
<joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 1 0" position="${pi/2}"/></robot>
<box name="box" size="0.1 0.2 0.3" mass="1" position="1.5 0.25 0" axis="0 1 0" angle="${pi/2}" moves_with="bar"/>)"));
  // The hinge's axis y is the world's z: x goes to y, y to -x.
  CHECK((s.initial.pose[1].p - Vec3(-0.25, 1.5, 0)).norm() < 1e-15);
  const Quat q = s.initial.pose[1].q;
  CHECK((q * Vec3::UnitX() - Vec3(0, 0, -1)).norm() < 1e-15);
  CHECK((q * Vec3::UnitZ() - Vec3(0, 1, 0)).norm() < 1e-15);
}

TEST_CASE("Each of two robots carries what moves with its links from its own zero pose, however many come after it") {
  const auto box = [](const std::string& name, const std::string& position, const std::string& link) {
    return "<box name=\"" + name + "\" size=\"1 1 1\" mass=\"1\" position=\"" + position + "\" moves_with=\"" + link +
           "\"/>";
  };
  const Scenario s =
      load_text(scene(std::string(cart) + arm + box("a", "0 1 0", "cart") + box("b", "0.5 4 3", "lower")));
  REQUIRE(s.model.bodies.size() == 5);
  // The cart stands 0.25 m along x of where it is at 0; the elbow has slid by 0.1875 m along -x.
  CHECK((s.initial.pose[3].p - Vec3(0.25, 1, 0)).norm() < 1e-15);
  CHECK((linear(s, 3) - Vec3(-3, 0, 0)).norm() < 1e-15);
  CHECK((s.initial.pose[4].p - Vec3(0.3125, 4, 3)).norm() < 1e-14);
  CHECK((linear(s, 4) - linear(s, 2) - Vec3(0, 0, 0.5).cross(Vec3(0, 1, 0))).norm() < 1e-14);
}

TEST_CASE("A joint may start at either of its limits and not beyond, and a plate's moments may just add up") {
  const std::string one = R"(<robot name="r"><link name="a" mass="1" position="0 0 0" inertia="0.1 0.2 LARGEST"/>
<joint name="j" kind="prismatic" parent="world" child="a" axis="1 0 0" lower="-0.5" upper="0.25" position="START"/></robot>)";
  const auto said = [&](const std::string& start, const std::string& largest = "0.3") {
    return message_of(TextFile(scene(replaced(replaced(one, "START", start), "LARGEST", largest))).path());
  };
  CHECK(said("-0.5").empty());
  CHECK(said("0.25").empty());
  for (const char* beyond : {"-0.50001", "0.25001"}) {
    INFO(beyond);
    CHECK_THAT(said(beyond), Catch::Contains("joint j starts at " + std::string(beyond)) &&
                                 Catch::Contains("outside its limits from -0.5 to 0.25"));
  }
  // Three digits of each moment may be missing.
  CHECK(said("0", "0.302").empty());
  CHECK_THAT(said("0", "0.304"), Catch::Contains("moments of inertia 0.1 0.2 0.304"));
  // Whichever axis the largest is about.
  for (const std::string moments : {"0.304 0.1 0.2", "0.2 0.304 0.1"})
    CHECK_THAT(message_of(TextFile(scene(replaced(replaced(one, "START", "0"), "0.1 0.2 LARGEST", moments))).path()),
               Catch::Contains("moments of inertia 0.1 0.2 0.304"));
}

TEST_CASE("A robot's names are its own: those of another, of a body or of the world are refused") {
  const auto said = [](const std::string& from, const std::string& to) {
    const std::string ball = "<sphere name=\"ball\" radius=\"1\" mass=\"1\" position=\"9 9 9\"/>";
    return message_of(TextFile(scene(cart + ball + replaced(arm, from, to))).path());
  };
  CHECK_THAT(said("name=\"second\"", "name=\"first\""), Catch::Contains("a second robot named first"));
  CHECK_THAT(said("name=\"hip\"", "name=\"rail\""), Catch::Contains("the robot first has a joint named rail too"));
  CHECK_THAT(said("name=\"hip\"", "name=\"elbow\""), Catch::Contains("a second joint named elbow"));
  CHECK_THAT(said("name=\"pad\"", "name=\"ball\""), Catch::Contains("a second body named ball"));
  CHECK_THAT(said("name=\"lower\" mass", "name=\"ball\" mass"), Catch::Contains("a body named ball already"));
  CHECK_THAT(said("name=\"lower\" mass", "name=\"world\" mass"), Catch::Contains("\"world\" is what does not move"));
  CHECK_THAT(said("child=\"upper\"", "child=\"world\""), Catch::Contains("swap parent and child"));
  CHECK_THAT(message_of(TextFile(scene(std::string(cart) + "<sphere name=\"cart\" radius=\"1\" mass=\"1\" "
                                                           "position=\"9 9 9\"/>"))
                            .path()),
             Catch::Contains("a link named cart already"));
}

TEST_CASE("A controller's numbers go by their names, whatever their order, to the joints and the robot that it names") {
  const Scenario s = load_text(scene(std::string(cart) + arm, R"(<controllers>
<controller kind="computed_torque" kd="8" robot="second" kp="9" gains="torque">
  <close joint="hip" acceleration="-1.5"/>
  <track joint="elbow" kv="6" kp="5" phase="4" frequency="3" amplitude="2" offset="1"/></controller>
<controller kind="computed_torque" robot="first"><track joint="rail"/></controller></controllers>)"));
  REQUIRE(s.controllers.size() == 2);
  const ControllerSpec &one = s.controllers[0], &other = s.controllers[1];
  CHECK(one.row->name == "computed_torque");
  CHECK(one.tree == 1);
  CHECK(one.gains == std::vector<double>{9, 8});  // kp, kd
  CHECK(one.words == std::vector<int>{1});
  REQUIRE(one.joints.size() == 2);
  CHECK(one.joints[0].role == 1);
  CHECK(one.joints[0].joint == 0);
  CHECK(one.joints[0].gains == std::vector<double>{-1.5});
  CHECK(one.joints[1].role == 0);
  CHECK(one.joints[1].joint == 1);
  CHECK(one.joints[1].gains == std::vector<double>{1, 2, 3, 4, 5, 6});
  CHECK(other.tree == 0);
  CHECK(other.gains == std::vector<double>{100, 20});
  CHECK(other.words == std::vector<int>{0});  // computed
  REQUIRE(other.joints.size() == 1);
  CHECK(other.joints[0].gains == std::vector<double>(6, 0.0));
  // Gains that would drive what they are to hold are refused.
  const auto said = [](const std::string& numbers, const std::string& of_joint) {
    return message_of(
        TextFile(scene(cart, "<controllers><controller kind=\"computed_torque\" robot=\"first\" " + numbers +
                                 "><track joint=\"rail\" " + of_joint + "/></controller></controllers>"))
            .path());
  };
  CHECK(said("kp=\"0\" kd=\"0\"", "kp=\"0\" kv=\"0\" amplitude=\"-1\"").empty());
  for (const char* gain : {"kp=\"-1\"", "kd=\"-1\""}) CHECK_THAT(said(gain, ""), Catch::Contains("at least 0"));
  for (const char* gain : {"kp=\"-1\"", "kv=\"-1\""}) CHECK_THAT(said("", gain), Catch::Contains("at least 0"));
}

TEST_CASE("A figure eight's wheels are the left and the right one by name, its numbers in the order of its row") {
  const char* rover = R"(<robot name="rover"><link name="base" mass="4" position="0 0 0" inertia="1 1 1"/>
<link name="wheel_a" mass="1" position="-1 0 0" inertia="1 1 1"/>
<link name="wheel_b" mass="1" position="1 0 0" inertia="1 1 1"/>
<joint name="float" kind="free" parent="world" child="base"/>
<joint name="a" kind="revolute" parent="base" child="wheel_a" anchor="-1 0 0" axis="1 0 0"/>
<joint name="b" kind="revolute" parent="base" child="wheel_b" anchor="1 0 0" axis="1 0 0"/></robot>)";
  const auto of = [&](const std::string& numbers, const std::string& children) {
    return scene(rover, "<controllers><controller kind=\"figure_eight\" robot=\"rover\" " + numbers + ">" + children +
                            "</controller></controllers>");
  };
  const Scenario s = load_text(
      of(R"(kv="1" axle="8" wheel_radius="7" velocity_gain="6" gain="5" rate="4" z_amplitude="3" x_amplitude="2")",
         R"(<right joint="a"/><left joint="b"/>)"));
  REQUIRE(s.controllers.size() == 1);
  CHECK(s.controllers[0].gains == std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8});
  REQUIRE(s.controllers[0].joints.size() == 2);
  CHECK(s.controllers[0].joints[0].role == 1);  // right
  CHECK(s.controllers[0].joints[0].joint == 1);
  CHECK(s.controllers[0].joints[1].role == 0);
  CHECK(s.controllers[0].joints[1].joint == 2);
  // What is left out is the law's own.
  const Scenario few = load_text(of("kv=\"1\"", R"(<left joint="a"/><right joint="b"/>)"));
  CHECK(few.controllers[0].gains == std::vector<double>{1, 4, 4, 0.1, 1, 1e-3, 0.0825, 0.3206});
  const auto said = [&](const std::string& numbers, const std::string& children) {
    return message_of(TextFile(of(numbers, children)).path());
  };
  CHECK_THAT(said("kv=\"1\"", "<left joint=\"a\"/>"),
             Catch::Contains("0 <right> in a figure_eight controller; it takes 1"));
  CHECK_THAT(said("kv=\"-1\"", "<left joint=\"a\"/><right joint=\"b\"/>"), Catch::Contains("at least 0"));
  for (const char* length : {"axle=\"0\"", "wheel_radius=\"0\""})
    CHECK_THAT(said(std::string("kv=\"1\" ") + length, "<left joint=\"a\"/><right joint=\"b\"/>"),
               Catch::Contains("at least 1e-06"));
  CHECK_THAT(said("kv=\"1\"", "<left joint=\"a\"/><right joint=\"float\"/>"),
             Catch::Contains("no joint \"float\" that a motor can drive; did you mean") ||
                 Catch::Contains("these it has: a, b"));
}

TEST_CASE("A free joint takes no coordinate, and the joints below it begin after its six rates") {
  const Scenario s = load_text(scene(
      R"(<robot name="r"><link name="base" mass="4" position="1 2 3" inertia="1 1 1"/>
<link name="tail" mass="1" position="2 2 3" inertia="1 1 1"/>
<joint name="tip" kind="revolute" parent="base" child="tail" anchor="1.5 2 3" axis="0 0 1" position="0.5" velocity="9"/>
<joint name="float" kind="free" parent="world" child="base" velocity="1 2 3" angular_velocity="4 5 6"/></robot>)"));
  const auto& joints = s.model.trees[0].joints;
  REQUIRE(joints.size() == 2);
  CHECK(joints[0].name == "float");
  CHECK(joints[0].q == -1);
  CHECK(joints[0].v == 0);
  CHECK(joints[1].q == 0);
  CHECK(joints[1].v == 6);
  CHECK(s.model.trees[0].nv == 7);
  CHECK(s.initial.q == std::vector<double>{0.5});
  CHECK(s.initial.qd == std::vector<double>{1, 2, 3, 4, 5, 6, 9});
  CHECK((linear(s, 0) - Vec3(1, 2, 3)).norm() < 1e-15);
  CHECK((angular(s, 0) - Vec3(4, 5, 6)).norm() < 1e-15);
  CHECK((angular(s, 1) - Vec3(4, 5, 15)).norm() < 1e-14);
}

TEST_CASE("A link's hull stands where its points are said to be, though its frame is that of its own moments") {
  const Scenario s = load_text(scene(R"(<robot name="r"><link name="l" mass="5" position="1 2 3" inertia="1 1 1">
<hull name="h" points="0 0 0  2 0 0  0 3 0  0 0 4" position="5 6 7" axis="0 0 1" angle="${pi/2}"/></link>
<joint name="rail" kind="prismatic" parent="world" child="l" axis="1 0 0"/></robot>)"));
  REQUIRE(s.shapes.size() == 1);
  const Shape& shape = s.shapes[0];
  const Pose& link = s.initial.pose[0];
  // A quarter turn about z: (x, y, z) to (-y, x, z), then on by (5, 6, 7).
  for (const Vec3& corner : {Vec3(5, 6, 7), Vec3(5, 8, 7), Vec3(2, 6, 7), Vec3(5, 6, 11)}) {
    double nearest = HUGE_VAL;
    for (const Vec3& x : shape.hull->polytope.vertices) {
      const Vec3 in_link = shape.local.p + shape.local.q * x;
      nearest = std::min(nearest, (link.p + link.q * in_link - corner).norm());
    }
    INFO(corner.transpose());
    CHECK(nearest < 1e-12);
  }
}
