// Robots from URDF files: the same robot as its elements give, and what is wrong with a file by file and line.

#ifdef CONTACTBENCH_HAVE_URDFDOM

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double pi = std::numbers::pi;

// Every link's frame is turned and shifted against its parent's, the inertia against the link's.
const char* arm = R"(<?xml version="1.0"?>
<robot name="two_links">
  <link name="mount"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <link name="arm">
    <inertial><origin xyz="0.5 0 0" rpy="0 0 0.3"/><mass value="2"/>
      <inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.25"/></inertial>
    <visual><geometry><mesh filename="arm.stl"/></geometry></visual>
    <collision><geometry><mesh filename="arm.stl"/></geometry></collision>
  </link>
  <link name="hand">
    <inertial><origin xyz="0 0.1 0"/><mass value="1"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><origin xyz="0 0.2 0"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision>
  </link>
  <link name="tip"><collision><origin xyz="0 0.1 0"/><geometry><sphere radius="0.03"/></geometry></collision></link>
  <joint name="shoulder" type="revolute">
    <parent link="mount"/><child link="arm"/><origin xyz="0 0 0.2" rpy="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1.5" effort="20" velocity="3"/><dynamics damping="0.4" friction="0.1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="arm"/><child link="hand"/><origin xyz="1 0 0" rpy="0 0.4 0"/><axis xyz="1 0 0"/>
    <limit lower="-0.1" upper="0.2" effort="5" velocity="1"/><mimic joint="shoulder"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="hand"/><child link="tip"/><origin xyz="0 0.3 0" rpy="0.2 0 0"/></joint>
</robot>
)";

const char* scene = R"(<scenario title="t">
  <simulation step="1e-3" duration="1"/>
  <reference kind="missing"/>
  <gravity constant="0 -9.8 0"/>
  <bodies>
    <half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <robot name="robot" urdf="arm.urdf" position="1 2 3" axis="1 0 0" angle="${-pi/2}"/>
  </bodies>
</scenario>
)";

Scenario load(const std::string& urdf, const std::string& text = scene) {
  const TextFile robot(urdf, "arm.urdf");
  return load_text(text);
}
std::string message(const std::string& urdf, const std::string& text = scene) {
  const TextFile robot(urdf, "arm.urdf");
  const TextFile file(text);
  return message_of(file.path());
}
Quat about(const Vec3& axis, double angle) { return Quat(Eigen::AngleAxisd(angle, axis)); }
const Shape& shape(const Scenario& s, const std::string& name) {
  for (const Shape& candidate : s.shapes)
    if (candidate.name == name) return candidate;
  throw std::logic_error("no shape " + name);
}

}  // namespace

TEST_CASE("Principal axes are right-handed, however a link's products of inertia turn them") {
  // 0.1, 0.2 and 0.25 kg m^2 about axes that are turned about (1, 2, 3).
  for (int i = 1; i < 24; ++i) {
    INFO(i);
    const Mat3 R = about(Vec3(1, 2, 3).normalized(), i * pi / 12).toRotationMatrix();
    const Mat3 I = R * Vec3(0.1, 0.2, 0.25).asDiagonal() * R.transpose();
    std::ostringstream text;
    text.precision(17);
    const char* names[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
    int k = 0;
    for (int row = 0; row < 3; ++row)
      for (int column = row; column < 3; ++column) text << ' ' << names[k++] << "=\"" << I(row, column) << '"';
    const Scenario s = load(replaced(arm, R"( ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.25")", text.str()));
    const Quat q = about(Vec3::UnitX(), -pi / 2) * about(Vec3::UnitZ(), 0.5 + 0.3);
    const Mat3 Q = q.toRotationMatrix(), P = s.initial.pose[0].q.toRotationMatrix();
    CHECK((Q * I * Q.transpose() - P * s.model.bodies[0].inertia.asDiagonal() * P.transpose()).norm() < 1e-15);
  }
}

TEST_CASE("A robot from a URDF file stands where a product of its frames says, turned as the scene turns it") {
  const Scenario s = load(arm);
  REQUIRE(s.model.bodies.size() == 2);
  REQUIRE(s.model.trees.size() == 1);
  const std::vector<Joint>& joints = s.model.trees[0].joints;
  REQUIRE(joints.size() == 2);

  const Quat up = about(Vec3::UnitX(), -pi / 2), q_arm = up * about(Vec3::UnitZ(), 0.5);
  const Vec3 base(1, 2, 3), p_arm = base + up * Vec3(0, 0, 0.2);
  const Quat q_hand = q_arm * about(Vec3::UnitY(), 0.4);
  const Vec3 p_hand = p_arm + q_arm * Vec3(1, 0, 0);
  const Pose &arm_now = s.initial.pose[0], &hand_now = s.initial.pose[1];
  CHECK(s.model.bodies[0].name == "arm");
  CHECK(s.model.bodies[0].mass == 2);
  CHECK((arm_now.p - (p_arm + q_arm * Vec3(0.5, 0, 0))).norm() < 1e-15);
  CHECK((hand_now.p - (p_hand + q_hand * Vec3(0, 0.1, 0))).norm() < 1e-15);
  // The inertia in the world, whatever its principal axes: turned by 0.3 against the link.
  Mat3 I;
  I << 0.1, 0.01, 0, 0.01, 0.2, 0, 0, 0, 0.25;
  const Mat3 R = (q_arm * about(Vec3::UnitZ(), 0.3)).toRotationMatrix(), P = arm_now.q.toRotationMatrix();
  CHECK((R * I * R.transpose() - P * s.model.bodies[0].inertia.asDiagonal() * P.transpose()).norm() < 1e-15);

  CHECK(joints[0].kind == JointKind::revolute);
  CHECK(joints[0].lower == -1);
  CHECK(joints[0].upper == 1.5);
  CHECK(joints[0].damping == 0.4);
  CHECK(joints[0].torque_limit == 20);
  CHECK((arm_now.q * joints[0].axis_C - q_arm * Vec3::UnitY()).norm() < 1e-15);
  CHECK((arm_now * joints[0].anchor_C - p_arm).norm() < 1e-15);
  CHECK(joints[1].kind == JointKind::prismatic);
  CHECK((hand_now.q * joints[1].axis_C - q_hand * Vec3::UnitX()).norm() < 1e-15);

  // A cylinder's axis is z in the file. The tip has no mass: a part of the hand. The mount is a part of the world.
  const Shape &rod = shape(s, "hand"), &tip = shape(s, "tip"), &mount = shape(s, "mount");
  CHECK(rod.kind == ShapeKind::cylinder);
  CHECK(rod.half_extents == Vec3(0.05, 0.2, 0.05));
  CHECK(((hand_now.q * rod.local.q) * Vec3::UnitY() - q_hand * Vec3::UnitZ()).norm() < 1e-15);
  // Places some metres out, through two products of frames each: a dozen roundings, however they are ordered.
  CHECK((hand_now * rod.local.p - (p_hand + q_hand * Vec3(0, 0.2, 0))).norm() < 1e-14);
  CHECK(tip.body == 1);
  const Vec3 in_hand = Vec3(0, 0.3, 0) + about(Vec3::UnitX(), 0.2) * Vec3(0, 0.1, 0);
  CHECK((hand_now * tip.local.p - (p_hand + q_hand * in_hand)).norm() < 1e-14);
  CHECK(mount.body == -1);
  CHECK((mount.local.p - Vec3(1, 2.1, 3)).norm() < 1e-15);
  CHECK((mount.local.q.coeffs() - up.coeffs()).norm() < 1e-15);
}

TEST_CASE("Of the shapes of a link the first has its name, the others a number besides") {
  const std::string ball = "<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>";
  const Scenario s = load(replaced(arm, "<link name=\"tip\">", "<link name=\"tip\">" + ball + ball));
  CHECK(shape(s, "tip").radius == 0.01);
  CHECK(shape(s, "tip_2").radius == 0.01);
  CHECK(shape(s, "tip_3").radius == 0.03);
}

TEST_CASE("A capsule of a URDF file lies along z, and a mesh beside it counts as its hull") {
  const std::string cube =
      "# a cube and a point inside\no cube\nv 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0.2 0.2 0\nv 0 0 0.2\nv 0.2 0 "
      "0.2\nv 0 0.2 0.2\nv 0.2 0.2 0.2\nv 0.1 0.1 0.1\nf 1 2 3\n";
  const auto beside = [&] { return TextFile(cube, "cube.obj"); };
  std::string text =
      replaced(arm, "<cylinder radius=\"0.05\" length=\"0.4\"/>", "<capsule radius=\"0.05\" length=\"0.4\"/>");
  text = replaced(text, "<collision><geometry><mesh filename=\"arm.stl\"/>",
                  "<collision><origin xyz=\"0.1 0 0\"/><geometry><mesh filename=\"cube.obj\" scale=\"1 2 1\"/>");
  const TextFile mesh = beside();
  const Scenario s = load(text);
  const Scenario with_cylinder = load(arm);
  const Shape &rod = shape(s, "hand"), &tin = shape(with_cylinder, "hand");
  CHECK(rod.kind == ShapeKind::capsule);
  CHECK(rod.half_extents == tin.half_extents);
  CHECK(rod.local.p == tin.local.p);
  CHECK(rod.local.q.coeffs() == tin.local.q.coeffs());
  const Shape& block = shape(s, "arm");
  REQUIRE(block.kind == ShapeKind::hull);
  CHECK(block.hull->polytope.vertices.size() == 8);
  CHECK(block.hull->volume == Approx(0.2 * 0.4 * 0.2));
  // Centre (0.1, 0.2, 0.1) of the mesh, 0.1 along x in the link's frame, which is where the shoulder's joint puts it.
  const Quat up = about(Vec3::UnitX(), -pi / 2), q_arm = up * about(Vec3::UnitZ(), 0.5);
  const Vec3 p_arm = Vec3(1, 2, 3) + up * Vec3(0, 0, 0.2);
  CHECK((s.initial.pose[0] * block.local.p - (p_arm + q_arm * Vec3(0.2, 0.2, 0.1))).norm() < 1e-14);
  CHECK(s.files.size() == 3);
  const TextFile again = beside();
  CHECK_THAT(message(replaced(text, "scale=\"1 2 1\"", "scale=\"1 0 1\"")),
             Catch::Contains("all points are in one plane"));
  const TextFile named = beside();
  const Scenario by_url = load(replaced(text, "filename=\"cube.obj\"", "filename=\"file://cube.obj\""));
  CHECK(shape(by_url, "arm").kind == ShapeKind::hull);
}

TEST_CASE("A capsule that is only seen is left out as other visuals are, and a collision stays what it is") {
  const std::string seen = "<visual><geometry><capsule radius=\"0.05\" length=\"0.4\"/></geometry></visual>";
  const std::string text = replaced(arm, "<visual><geometry><mesh filename=\"arm.stl\"/></geometry></visual>", seen);
  const Scenario s = load(text);
  CHECK(s.shapes.size() == load(arm).shapes.size());
  CHECK(shape(s, "hand").kind == ShapeKind::cylinder);
  CHECK(s.left_out == load(arm).left_out);
  const Scenario both =
      load(replaced(text, "<cylinder radius=\"0.05\" length=\"0.4\"/>", "<capsule radius=\"0.05\" length=\"0.4\"/>"));
  CHECK(shape(both, "hand").kind == ShapeKind::capsule);
}

TEST_CASE("A shape of a URDF file whose name is taken is told of at the robot's name in the scene") {
  const std::string text = message(arm, replaced(scene, "name=\"ground\"", "name=\"hand\""));
  CHECK_THAT(text, Catch::Contains("written_by_test.xml:7:18: a second body named hand"));
  CHECK_THAT(text, Catch::Contains("written_by_test.xml:6:23)"));
  const char* again = "    <robot name=\"robot\" urdf=\"arm.urdf\" prefix=\"b_\"/>\n  </bodies>";
  CHECK_THAT(message(arm, replaced(scene, "  </bodies>", again)),
             Catch::Contains("written_by_test.xml:8:18: a second robot named robot"));
}

TEST_CASE("What a simulation does not use of a URDF file is told, each kind with its number and first place") {
  const Scenario s = load(std::string(arm));
  const auto told = [&s](const std::string& what) {
    for (const std::string& line : s.left_out)
      if (line.find(what) != std::string::npos) return true;
    return false;
  };
  CHECK(told("<visual> at"));
  CHECK(told("arm.urdf:7:"));  // the visual
  CHECK(told("<mesh> of a <collision>"));
  CHECK(told("2 velocity of a <limit>, the first at"));
  for (const std::string& line : s.left_out)
    if (line.starts_with("2 velocity")) CHECK_THAT(line, Catch::EndsWith("arm.urdf:18:6"));
  CHECK(told("dry friction"));
  CHECK(told("<mimic> (the joint moves on its own)"));
  CHECK(s.left_out.size() == 5);
  // A limit of 0, which is none to this format, and no friction are not said to be left out.
  std::string none = replaced(arm, "friction=\"0.1\"", "friction=\"0\"");
  none = replaced(replaced(none, " velocity=\"3\"", " velocity=\"0\""), " velocity=\"1\"", " velocity=\"0\"");
  CHECK(load(none).left_out.size() == 3);
}

TEST_CASE("The base floats where the scene says so, and continuous joints have no limits") {
  const std::string inertial =
      "<inertial><mass value=\"3\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial>";
  std::string text = replaced(arm, "<link name=\"mount\">", "<link name=\"mount\">" + inertial);
  text = replaced(text, "type=\"revolute\"", "type=\"continuous\"");
  const Scenario s =
      load(text, replaced(scene, "urdf=\"arm.urdf\"", "urdf=\"arm.urdf\" base=\"free\" prefix=\"left_\""));
  REQUIRE(s.model.bodies.size() == 3);
  CHECK(s.model.bodies[0].name == "left_mount");
  CHECK(s.model.trees[0].nv == 8);
  CHECK(s.model.trees[0].joints[0].kind == JointKind::free);
  CHECK(std::isinf(s.model.trees[0].joints[1].upper));
  CHECK(s.model.trees[0].joints[1].torque_limit == 20);
  CHECK((s.initial.pose[0].p - Vec3(1, 2, 3)).norm() < 1e-15);
  CHECK_THAT(message(arm, replaced(scene, "urdf=\"arm.urdf\"", "urdf=\"arm.urdf\" base=\"free\"")),
             Catch::Contains("arm.urdf:3:") && Catch::Contains("free but has no <inertial>"));
}

TEST_CASE("A URDF file that two robots are of is one of the scene's files once") {
  const char* again = "    <robot name=\"other\" urdf=\"arm.urdf\" prefix=\"b_\" position=\"9 2 3\"/>\n  </bodies>";
  const Scenario s = load(arm, replaced(scene, "  </bodies>", again));
  CHECK(s.model.trees.size() == 2);
  REQUIRE(s.files.size() == 2);
  CHECK_THAT(s.files[0], Catch::EndsWith("written_by_test.xml"));
  CHECK_THAT(s.files[1], Catch::EndsWith("arm.urdf"));
}

TEST_CASE("A joint starts where the scene says") {
  const auto with = [](const std::string& start) {
    return replaced(scene, "angle=\"${-pi/2}\"/>", "angle=\"${-pi/2}\">" + start + "</robot>");
  };
  const Scenario s = load(arm, with("<start joint=\"shoulder\" position=\"0.5\" velocity=\"-2\"/>"));
  CHECK(s.initial.q == std::vector<double>{0.5, 0});
  CHECK(s.initial.qd == std::vector<double>{-2, 0});
  for (const char* beyond : {"2", "-2"})  // told in the scene, which says so, not in the robot's file
    CHECK_THAT(message(arm, with("<start joint=\"shoulder\" position=\"" + std::string(beyond) + "\"/>")),
               Catch::Contains("written_by_test.xml:7:") && Catch::Contains("outside its limits from -1 to 1.5"));
  CHECK_THAT(message(arm, with("<start joint=\"shoulder\"/><start joint=\"shoulder\" position=\"0.1\"/>")),
             Catch::Contains("already; keep one"));
  CHECK_THAT(message(arm, with("<start joint=\"sholder\"/>")), Catch::Contains("did you mean \"shoulder\"?"));
  CHECK_THAT(message(arm, with("<begin/>")), Catch::Contains("it holds: start"));
}

TEST_CASE("Each joint of a URDF file has its own limits and effort, and each collision its own form") {
  std::string text = replaced(arm, "<collision><origin xyz=\"0 0.2 0\"/>",
                              "<collision><geometry><sphere radius=\"0.07\"/></geometry></collision>"
                              "<collision><geometry><capsule radius=\"0.02\" length=\"0.3\"/></geometry></collision>"
                              "<collision><origin xyz=\"0 0.2 0\"/>");
  text = replaced(text, "<geometry><box size=\"0.2 0.2 0.2\"/>", "<geometry><box size=\"0.2 0.4 0.6\"/>");
  const Scenario s = load(text);
  const Joint& slide = s.model.trees[0].joints[1];
  CHECK(slide.name == "slide");
  CHECK(slide.lower == -0.1);
  CHECK(slide.upper == 0.2);
  CHECK(slide.torque_limit == 5);
  CHECK(slide.damping == 0);
  const Vec3 base(1, 2, 3);
  const Quat q_arm = about(Vec3::UnitX(), -pi / 2) * about(Vec3::UnitZ(), 0.5);
  const Vec3 p_hand = base + Vec3(0, 0.2, 0) + q_arm * Vec3(1, 0, 0);
  CHECK((s.initial.pose[1] * slide.anchor_C - p_hand).norm() < 1e-14);
  CHECK((s.initial.pose[0] * slide.anchor_P - p_hand).norm() < 1e-14);
  CHECK(shape(s, "mount").half_extents == Vec3(0.1, 0.2, 0.3));
  CHECK(shape(s, "hand").kind == ShapeKind::sphere);
  CHECK(shape(s, "hand").radius == 0.07);
  CHECK(shape(s, "hand_2").kind == ShapeKind::capsule);
  CHECK(shape(s, "hand_2").half_extents == Vec3(0.02, 0.15, 0.02));
  CHECK(shape(s, "hand_3").kind == ShapeKind::cylinder);
  CHECK(shape(s, "hand_3").half_extents == Vec3(0.05, 0.2, 0.05));
  CHECK(s.initial.q == std::vector<double>{0, 0});
  const Scenario started = load(arm, replaced(scene, "angle=\"${-pi/2}\"/>",
                                              "angle=\"${-pi/2}\"><start joint=\"slide\" velocity=\"3\" "
                                              "position=\"0.15\"/></robot>"));
  CHECK(started.initial.q == std::vector<double>{0, 0.15});
  CHECK(started.initial.qd == std::vector<double>{0, 3});
}

TEST_CASE("What is fixed to the base stands, what is fixed to a link is a link where it has inertia") {
  const std::string inertial =
      "<inertial><origin xyz=\"0 0 0.01\"/><mass value=\"3\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" "
      "iyz=\"0\" izz=\"1\"/></inertial>";
  std::string text = replaced(arm, "<link name=\"tip\">", "<link name=\"tip\">" + inertial);
  text = replaced(text, "<link name=\"mount\">", "<link name=\"mount\">" + inertial);
  text = replaced(text, "</robot>",
                  "<link name=\"plate\">" + inertial +
                      "<collision><geometry><sphere radius=\"0.5\"/></geometry></collision></link>"
                      "<joint name=\"bolts\" type=\"fixed\"><parent link=\"mount\"/><child link=\"plate\"/>"
                      "<origin xyz=\"0 0 -1\"/></joint></robot>");
  const Scenario s = load(text);
  REQUIRE(s.model.trees[0].joints.size() == 3);
  CHECK(s.model.trees[0].nv == 2);
  const Joint& flange = s.model.trees[0].joints[2];
  CHECK(flange.name == "flange");
  CHECK(flange.kind == JointKind::fixed);
  CHECK(flange.parent == 1);
  CHECK(s.model.bodies[2].name == "tip");
  CHECK(s.model.bodies[2].mass == 3);
  CHECK(shape(s, "tip").body == 2);
  CHECK(shape(s, "plate").body == -1);
  CHECK((shape(s, "plate").local.p - Vec3(1, 1, 3)).norm() < 1e-15);
  int told = 0;
  for (const std::string& line : s.left_out) {
    told += line.starts_with("the <inertial> of the base, which stands still at ") ? 1 : 0;
    told += line.starts_with("the <inertial> of what is fixed to the base, which stands still at ") ? 2 : 0;
  }
  CHECK(told == 3);
}

TEST_CASE("Names of a URDF file become names of a scene, the prefix before each; a floating joint is a free one") {
  std::string text = replaced(arm, "<joint name=\"flange\"", "<joint name=\"the flange\"");
  text = replaced(text, "<link name=\"tip\">", "<link name=\"tip-1.b\">");
  text = replaced(text, "<child link=\"tip\"/>", "<child link=\"tip-1.b\"/>");
  text = replaced(text, "type=\"revolute\"", "type=\"floating\"");
  const Scenario s = load(text, replaced(scene, "urdf=\"arm.urdf\"", "urdf=\"arm.urdf\" prefix=\"left_\""));
  const std::vector<Joint>& joints = s.model.trees[0].joints;
  REQUIRE(joints.size() == 2);
  CHECK(joints[0].name == "left_shoulder");
  CHECK(joints[0].kind == JointKind::free);
  CHECK(joints[0].parent == -1);
  CHECK(joints[1].name == "left_slide");
  CHECK(s.model.trees[0].nv == 7);
  CHECK(s.model.bodies[1].name == "left_hand");
  CHECK(shape(s, "left_tip_1_b").radius == 0.03);
  CHECK(shape(s, "left_mount").body == -1);
  CHECK((s.initial.pose[0].p -
         (Vec3(1, 2.2, 3) + about(Vec3::UnitX(), -pi / 2) * about(Vec3::UnitZ(), 0.5) * Vec3(0.5, 0, 0)))
            .norm() < 1e-15);
  // Without the prefix what begins with a digit is no name.
  const std::string digit = replaced(replaced(arm, "<link name=\"hand\">", "<link name=\"2nd\">"),
                                     "<child link=\"hand\"/>", "<child link=\"2nd\"/>");
  CHECK(load(replaced(digit, "<parent link=\"hand\"/>", "<parent link=\"2nd\"/>")).model.bodies[1].name == "link_2nd");
  CHECK_THAT(message(arm, replaced(scene, "urdf=\"arm.urdf\"", "urdf=\"arm.urdf\" prefix=\"2_\"")),
             Catch::Contains("a prefix is a letter"));
}

TEST_CASE("A broken URDF file ends in one line with file and line") {
  struct Row {
    const char *from, *to;
    int line;
    const char* fragment;
  };
  for (const Row& row : {
           Row{"</robot>", "", 25, "not well formed XML"},
           Row{"<robot name=\"two_links\">", "<robots>", 25, "not well formed XML"},
           Row{"<parent link=\"mount\"/><child link=\"arm\"/>", "<child link=\"arm\"/>", 16, "shoulder"},
           Row{"<parent link=\"mount\"/><child link=\"arm\"/>", "<parent link=\"mount\"/><child link=\"am\"/>", 16,
               "am"},
           Row{"<parent link=\"hand\"/><child link=\"tip\"/>", "<parent link=\"hand\"/><child link=\"arm\"/>", 24,
               "arm is the child of joint shoulder already"},
           Row{"<parent link=\"mount\"/><child link=\"arm\"/>", "<parent link=\"tip\"/><child link=\"arm\"/>", 16,
               "is part of a loop"},
           Row{"<limit lower=\"-1\" upper=\"1.5\" effort=\"20\" velocity=\"3\"/>", "", 16, "limits"},
           Row{"lower=\"-1\" upper=\"1.5\"", "lower=\"2\" upper=\"1.5\"", 16, "beyond its upper one"},
           Row{"type=\"prismatic\"", "type=\"planar\"", 20, "planar"},
           Row{"type=\"prismatic\"", "type=\"hinge\"", 20, "hinge"},
           Row{"<mass value=\"2\"/>", "<mass value=\"two\"/>", 4, "two"},
           Row{"<mass value=\"2\"/>", "<mass value=\"0\"/>", 4, "a mass of 0 kg"},
           Row{"<mass value=\"2\"/>", "<mass value=\"-1\"/>", 4, "a mass of -1 kg"},
           Row{"<mass value=\"2\"/>", "", 4, "mass"},
           Row{"izz=\"0.25\"", "izz=\"0.4\"", 4, "at most the sum of the other two"},
           Row{"radius=\"0.05\" length=\"0.4\"", "radius=\"0\" length=\"0.4\"", 10, "no size"},
           Row{"<cylinder radius=\"0.05\" length=\"0.4\"/>", "<capsule radius=\"0.05\" length=\"-0.04\"/>", 10,
               "no size"},
           Row{"damping=\"0.4\"", "damping=\"-1\"", 16, "at least 0"},
           Row{"effort=\"5\"", "effort=\"-5\"", 20, "effort -5; both have to be at least 0"},
           Row{"<link name=\"tip\">", "<link name=\"hand\">", 15, "a second link named hand"},
           Row{"<joint name=\"slide\"", "<joint name=\"shoulder\"", 20, "a second joint named shoulder (first at "},
           Row{"<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>", 16, "the axis of shoulder is 0 0 0"},
           Row{"type=\"fixed\"", "type=\"continuous\"", 15, "tip moves with joint flange but has no <inertial>"},
       }) {
    INFO(row.from << " -> " << row.to);
    const std::string text = message(replaced(arm, row.from, row.to));
    CHECK_THAT(text, Catch::Contains("arm.urdf:" + std::to_string(row.line) + ":"));
    CHECK_THAT(text, Catch::Contains(row.fragment));
    CHECK(text.find('\n') == std::string::npos);
  }
  CHECK_THAT(message(arm, replaced(scene, "arm.urdf", "leg.urdf")), Catch::Contains("there is no file"));
}

TEST_CASE("The arm on the table holds its palm level over the table, where its joints say") {
  const Scenario s = load_scenario(find_scenario("urdf_arm"), {});
  const Shape& palm = shape(s, "palm");
  const Vec3 p = s.initial.pose[palm.body] * palm.local.p;
  // Shoulder at height 0.35; links of 0.4, 0.3 and 0.1 m at angles -0.1, 1.5 and 0 below the horizontal.
  CHECK(p.x() == Approx(0.4 * std::cos(0.1) + 0.3 * std::cos(1.5) + 0.1).epsilon(1e-14));
  CHECK(p.y() == Approx(0.35 + 0.4 * std::sin(0.1) - 0.3 * std::sin(1.5)).epsilon(1e-14));
  CHECK(std::abs(p.z()) < 1e-15);
  CHECK(s.model.trees[0].joints.size() == 4);
}

#endif
