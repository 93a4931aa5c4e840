// Robots from URDF files that have several of a kind: shapes after one that is left out, meshes, parts without inertia
// between links, and another robot of the same file.

#ifdef CONTACTBENCH_HAVE_URDFDOM

#include <catch2/catch.hpp>
#include <limits>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

const std::string inertial =
    "<inertial><mass value=\"2\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial>";
const std::string limit = "<limit lower=\"-1\" upper=\"1\" effort=\"5\" velocity=\"0\"/>";

/// An arm of these shapes that turns on a post.
std::string arm(const std::string& collisions) {
  return "<robot name=\"r\"><link name=\"post\"/><link name=\"arm\">" + inertial + collisions +
         "</link>\n<joint name=\"turn\" type=\"revolute\"><parent link=\"post\"/><child link=\"arm\"/>"
         "<axis xyz=\"0 0 1\"/>" +
         limit + "</joint></robot>";
}
std::string collision(const std::string& geometry) {
  return "<collision><geometry>" + geometry + "</geometry></collision>\n";
}

Scenario load(const std::string& urdf, const std::string& robots = "<robot name=\"robot\" urdf=\"r.urdf\"/>") {
  const TextFile robot(urdf, "r.urdf");
  return load_text(R"(<scenario title="t"><simulation step="1e-3" duration="1"/><reference kind="missing"/>
<gravity constant="0 -9.8 0"/><bodies>)" +
                   robots + "</bodies></scenario>");
}

}  // namespace

TEST_CASE("A capsule is one and a cylinder is none, though a mesh before them is left out") {
  const Scenario s =
      load(arm(collision("<mesh filename=\"nowhere.obj\"/>") + collision("<capsule radius=\"0.02\" length=\"0.3\"/>") +
               collision("<cylinder radius=\"0.03\" length=\"0.1\"/>")));
  CHECK(s.left_out.size() == 1);
  REQUIRE(s.shapes.size() == 2);
  CHECK(s.shapes[0].name == "arm");
  CHECK(s.shapes[0].kind == ShapeKind::capsule);
  CHECK(s.shapes[0].half_extents == Vec3(0.02, 0.15, 0.02));
  CHECK(s.shapes[1].name == "arm_2");
  CHECK(s.shapes[1].kind == ShapeKind::cylinder);
  CHECK(s.shapes[1].half_extents == Vec3(0.03, 0.05, 0.03));
}

TEST_CASE("Each mesh of a robot is a hull of its own, and each of their files is one of the scene's") {
  const TextFile small("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", "small.obj");
  const TextFile large("v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\n", "large.obj");
  const std::string small_mesh = collision("<mesh filename=\"small.obj\"/>");
  const Scenario s = load(arm(small_mesh + collision("<mesh filename=\"large.obj\"/>") + small_mesh));
  CHECK(s.left_out.empty());
  REQUIRE(s.shapes.size() == 3);
  const double volumes[] = {1 / 6., 8 / 6., 1 / 6.};
  for (std::size_t i = 0; i < 3; ++i) {
    REQUIRE(s.shapes[i].kind == ShapeKind::hull);
    CHECK(s.shapes[i].hull->volume == Approx(volumes[i]).epsilon(1e-12));
  }
  REQUIRE(s.files.size() == 4);
  CHECK_THAT(s.files[1], Catch::EndsWith("r.urdf"));
  CHECK_THAT(s.files[2], Catch::EndsWith("small.obj"));
  CHECK_THAT(s.files[3], Catch::EndsWith("large.obj"));
}

TEST_CASE("What hangs on a part without inertia hangs where that part is fixed, to the world or to a link") {
  const std::string quarter = "rpy=\"0 0 1.5707963267948966\"/></joint>\n";
  const Scenario s =
      load("<robot name=\"r\"><link name=\"base\"/><link name=\"post\"/><link name=\"arm\">" + inertial +
           "</link><link name=\"adapter\"/><link name=\"hand\">" + inertial +
           "</link>\n<joint name=\"stand\" type=\"fixed\"><parent link=\"base\"/><child link=\"post\"/>"
           "<origin xyz=\"0 0 1\" " +
           quarter +
           "<joint name=\"turn\" type=\"revolute\"><parent link=\"post\"/><child link=\"arm\"/><origin xyz=\"1 0 0\"/>"
           "<axis xyz=\"0 0 1\"/>" +
           limit +
           "</joint>\n<joint name=\"flange\" type=\"fixed\"><parent link=\"arm\"/><child link=\"adapter\"/>"
           "<origin xyz=\"0.5 0 0\" " +
           quarter +
           "<joint name=\"slide\" type=\"prismatic\"><parent link=\"adapter\"/><child link=\"hand\"/>"
           "<origin xyz=\"0.25 0 0\"/><axis xyz=\"1 0 0\"/>" +
           limit + "</joint></robot>");
  REQUIRE(s.model.bodies.size() == 2);
  // Each of the two parts is a quarter turn about z: the arm looks along y, the hand along -x.
  CHECK((s.initial.pose[0].p - Vec3(0, 1, 1)).norm() < 1e-14);
  CHECK((s.initial.pose[1].p - Vec3(-0.25, 1.5, 1)).norm() < 1e-14);
  REQUIRE(s.model.trees[0].joints.size() == 2);
  const Joint& slide = s.model.trees[0].joints[1];
  CHECK(slide.parent == 0);
  CHECK((s.initial.pose[1].q * slide.axis_C - Vec3(-1, 0, 0)).norm() < 1e-14);
}

TEST_CASE("Of two robots of one file each has a free joint by its own name, and what is left out is told of both") {
  const std::string puck = "<robot name=\"r\"><link name=\"puck\">" + inertial +
                           "<visual><geometry><sphere radius=\"1\"/></geometry></visual></link></robot>";
  const Scenario s = load(puck,
                          "<robot name=\"one\" urdf=\"r.urdf\" base=\"free\"/>"
                          "<robot name=\"two\" urdf=\"r.urdf\" base=\"free\" prefix=\"b_\" position=\"5 0 0\"/>");
  REQUIRE(s.model.trees.size() == 2);
  CHECK(s.model.trees[0].joints[0].name == "base_free");
  CHECK(s.model.trees[1].joints[0].name == "b_base_free");
  CHECK(s.left_out.size() == 2);
}

TEST_CASE("A mesh of another kind beside the robot is left out, as one that is not there is") {
  const TextFile other("<COLLADA/>", "part.dae");
  const Scenario s = load(arm(collision("<mesh filename=\"part.dae\"/>") + collision("<sphere radius=\"0.1\"/>")));
  REQUIRE(s.shapes.size() == 1);
  CHECK(s.shapes[0].name == "arm");
  REQUIRE(s.left_out.size() == 1);
  CHECK_THAT(s.left_out[0], Catch::StartsWith("<mesh> of a <collision> "));
}

TEST_CASE("Words between the elements of a robot are none of them; what of a joint is not used is told") {
  const std::string text = arm("");
  const Scenario plain = load(text);
  CHECK(plain.left_out.empty());
  for (const std::string place : {"<robot name=\"r\">", "<link name=\"arm\">", "type=\"revolute\">"})
    CHECK(load(replaced(text, place, place + "a remark")).left_out.empty());
  const Scenario geared = load(replaced(text, limit, "<gearbox/>" + limit));
  REQUIRE(geared.left_out.size() == 1);
  CHECK_THAT(geared.left_out[0], Catch::StartsWith("<gearbox> at ") && Catch::Contains("r.urdf:2:"));
}

TEST_CASE("A continuous joint needs no <limit>; without one its motor is as strong as it takes") {
  const Scenario s = load(replaced(replaced(arm(""), limit, ""), "\"revolute\"", "\"continuous\""));
  const Joint& turn = s.model.trees.at(0).joints.at(0);
  CHECK(turn.torque_limit == std::numeric_limits<double>::infinity());
  CHECK(turn.upper == std::numeric_limits<double>::infinity());
}

TEST_CASE("A loop is told at a joint of it, not at one that hangs on it, and joints without a child are no loop") {
  const auto said = [](const std::string& urdf) {
    const TextFile robot(urdf, "r.urdf");
    const TextFile file(
        "<scenario title=\"t\"><simulation step=\"1e-3\" duration=\"1\"/><reference kind=\"missing\"/>"
        "<gravity constant=\"0 -9.8 0\"/><bodies><robot name=\"robot\" urdf=\"r.urdf\"/></bodies></scenario>");
    return message_of(file.path());
  };
  const auto joint = [](const std::string& name, const std::string& ends) {
    return "<joint name=\"" + name + "\" type=\"fixed\">" + ends + "</joint>\n";
  };
  const std::string links = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\n";
  const std::string loop = said(links + joint("hangs", "<parent link=\"b\"/><child link=\"a\"/>") +
                                joint("there", "<parent link=\"c\"/><child link=\"b\"/>") +
                                joint("back", "<parent link=\"b\"/><child link=\"c\"/>") + "</robot>");
  CHECK_THAT(loop, Catch::Contains("r.urdf:3:2: joint there is part of a loop: going from b to parents comes back"));
  const std::string childless =
      said(links + joint("one", "<parent link=\"a\"/>") + joint("two", "<parent link=\"a\"/>") + "</robot>");
  CHECK_THAT(childless, Catch::Contains("liburdfdom: ") && Catch::Contains("missing a parent and/or child link"));
}

TEST_CASE("A joint that floats has no position to start at, and none is taken for it") {
  const std::string puck = "<robot name=\"r\"><link name=\"puck\">" + inertial + "</link><link name=\"arm\">" +
                           inertial + "</link><joint name=\"turn\" type=\"revolute\"><parent link=\"puck\"/>" +
                           "<child link=\"arm\"/>" + limit + "</joint></robot>";
  const auto start = [](const std::string& name) {
    return "<robot name=\"robot\" urdf=\"r.urdf\" base=\"free\"><start joint=\"" + name + "\" velocity=\"2\"/></robot>";
  };
  CHECK(load(puck, start("turn")).initial.qd == std::vector<double>{0, 0, 0, 0, 0, 0, 2});
  CHECK_THROWS_WITH(load(puck, start("base_free")),
                    Catch::Contains("the robot has no joint \"base_free\" that moves; these it has: turn"));
}

#endif
