#include "output/contact_file.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "problems.h"
#include "temporary.h"

using namespace cb;

namespace {

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) out.push_back(line);
  return out;
}

/// A box on the ground, and what an event of it looks like: three contacts at its corners, v+ given.
struct Scene {
  Scenario scenario;
  ContactProblem problem;
  ContactSolution solution;
  Residuals residuals;
  std::vector<double> v_plus;
  std::vector<ContactPoint> contacts;

  Scene() {
    scenario.model.bodies.push_back({"box", 1, Vec3(1, 1, 1)});
    Shape ground, box;
    ground.kind = ShapeKind::half_space;
    ground.name = "the ground, flat";
    box.kind = ShapeKind::box;
    box.body = 0;
    box.half_extents = Vec3(0.5, 0.25, 1);
    box.name = "box";
    scenario.shapes = {ground, box};
    test::add_body(problem, 1, Vec3(1, 1, 1), Vec3(0, -1, 0));
    for (const double x : {-0.5, 0.5, 0.0}) {
      test::add_contact(problem, 0, Vec3(x, -0.25, 0), -1, Vec3::Zero(), test::ground_axes(), 0.5);
      contacts.push_back({Vec3(x, 0, 0), Vec3(0, 1, 0), 0, 1, 0});
    }
  }
  EventRecord event(double t) const { return {t, problem, solution, residuals, v_plus, contacts}; }
  StepRecord step(long number) const {
    StepRecord record;
    record.step = number;
    return record;
  }
};

}  // namespace

TEST_CASE("a contact that bears nothing is open, one that bears sticks where it does not move", "[output]") {
  const double bears[] = {1, 0.1, 0}, none[] = {1e-7, 0, 0}, still[] = {0, 1e-7, 0}, moving[] = {0, 0, 2e-6};
  CHECK(contact_mode(bears, still, 1, 1) == ContactMode::stick);
  CHECK(contact_mode(bears, moving, 1, 1) == ContactMode::slip);
  CHECK(contact_mode(none, still, 1, 1) == ContactMode::open);
  // Other units: what counts is the share of the event.
  CHECK(contact_mode(none, still, 1e-7, 1) == ContactMode::stick);
  CHECK(contact_mode(bears, moving, 1, 10) == ContactMode::stick);
  // Where nothing is borne and nothing moves.
  const double zero[] = {0, 0, 0};
  CHECK(contact_mode(zero, zero, 0, 0) == ContactMode::open);
}

TEST_CASE("what an event stops to rounding sticks: speeds before count, too", "[output]") {
  TemporaryDirectory directory;
  Scene scene;  // approaches at 1 m/s
  {
    ContactFile file(directory.path(), scene.scenario, true, 1);
    scene.v_plus = {1e-15, 0, 0, 0, 0, 0};
    scene.solution.impulse = {1, 0, 0, 1,   0, 0,
                              1, 0, 0, 1e9, 0, 0};  // the last of a joint's limit, which is no contact
    file.event(scene.event(0.1));
    file.step(scene.step(1));
  }
  const auto rows = lines(read_file(directory.path() / "contacts.csv"));
  REQUIRE(rows.size() == 4);
  for (int c = 1; c < 4; ++c) CHECK(rows[c].ends_with(",stick"));
}

TEST_CASE("the contacts of a recorded step are rows in world axes", "[output]") {
  TemporaryDirectory directory;
  Scene scene;
  {
    ContactFile file(directory.path(), scene.scenario, true, 2);
    // Turns about y at 2 rad/s: the corner at x = 0.5 moves along -z by 1 m/s, the middle stays.
    scene.v_plus = {0, 0, 0, 0, 2, 0};
    // t1 is x, t2 is y x x = -z.
    scene.solution.impulse = {0, 0, 0, 1, 0, 0.5, 2, 0.25, 0};
    file.event(scene.event(0.1));  // of step 1, which is not kept
    file.step(scene.step(1));
    file.event(scene.event(0.25));
    file.step(scene.step(2));
    CHECK(file.ok());
  }
  const auto rows = lines(read_file(directory.path() / "contacts.csv"));
  REQUIRE(rows.size() == 4);
  CHECK(rows[0] + "\n" == contacts_header);
  CHECK(rows[1] == "0.25,2,box,\"the ground, flat\",-0.5,0,0,0,1,0,0,0,1,0,0,0,open");
  CHECK(rows[2] == "0.25,2,box,\"the ground, flat\",0.5,0,0,0,1,0,0,0,-1,0,1,-0.5,slip");
  CHECK(rows[3] == "0.25,2,box,\"the ground, flat\",0,0,0,0,1,0,0,0,0,0.25,2,0,stick");

  const auto shapes = lines(read_file(directory.path() / "shapes.csv"));
  REQUIRE(shapes.size() == 3);
  CHECK(shapes[0] + "\n" == shapes_header);
  CHECK(shapes[1] == "\"the ground, flat\",,half_space,0,0,0,1,0,0,0,0,0,0,0");
  CHECK(shapes[2] == "box,box,box,0,0,0,1,0,0,0,0,0.5,0.25,1");

  // A run that is not asked for them removes them.
  ContactFile none(directory.path(), scene.scenario, false, 1);
  none.event(scene.event(0));
  CHECK(none.ok());
  CHECK_FALSE(std::filesystem::exists(directory.path() / "contacts.csv"));
  CHECK_FALSE(std::filesystem::exists(directory.path() / "shapes.csv"));
}

TEST_CASE("the velocity of an open contact is without what its gap over the step adds to the problem's", "[output]") {
  TemporaryDirectory directory;
  Scene scene;  // comes down at 1 m/s
  {
    ContactFile file(directory.path(), scene.scenario, true, 1);
    // The first point is 0.03 m up in a step of 0.04 s, and lands at its end: w_n = 0.75 m/s.
    const std::vector<double> gaps = {0.75, 0, 0};
    scene.problem.offset[0] = 0.75;
    scene.v_plus = {1e-7, -0.75, 0, 0, 0, 0};
    scene.solution.impulse = {1, 0, 0, 1, 0, 0, 1, 0, 0};
    EventRecord event = scene.event(0.25);
    event.gap_speed = gaps;
    file.event(event);
    // Of an event without them the offset is a belt's speed, which is one.
    file.event(scene.event(0.5));
  }
  const auto rows = lines(read_file(directory.path() / "contacts.csv"));
  REQUIRE(rows.size() == 7);
  CHECK(rows[1] == "0.25,1,box,\"the ground, flat\",-0.5,0,0,0,1,0,1e-07,-0.75,0,0,1,0,stick");
  CHECK(rows[2] == "0.25,1,box,\"the ground, flat\",0.5,0,0,0,1,0,1e-07,-0.75,0,0,1,0,stick");
  CHECK(rows[4] == "0.5,1,box,\"the ground, flat\",-0.5,0,0,0,1,0,1e-07,0,0,0,1,0,stick");
}

TEST_CASE("contacts whose tangents a scene turns are in world axes as well", "[output]") {
  // Turned by 0.3 rad about the normal from a to b, here -y: t1, t2 of the event are cos 0.3, -sin 0.3 of x and -z.
  TemporaryDirectory directory;
  Scene scene;
  scene.scenario.rotate_cone = 0.3;
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (int contact = 0; contact < 3; ++contact) {  // the event has these tangents, too
    auto J = scene.problem.J.entry(scene.problem.J.band[contact]);
    const Eigen::MatrixXd rows = J;
    J.row(1) = c * rows.row(1) - s * rows.row(2);
    J.row(2) = c * rows.row(2) + s * rows.row(1);
  }
  {
    ContactFile file(directory.path(), scene.scenario, true, 1);
    scene.v_plus = {3, 0, 4, 0, 0, 0};
    scene.solution.impulse = {0, 0, 0, 1, 0.5, 0, 2, 0, 0.25};
    file.event(scene.event(0.5));
  }
  const auto rows = lines(read_file(directory.path() / "contacts.csv"));
  REQUIRE(rows.size() == 4);
  const auto numbers = [](const std::string& row) {
    std::vector<double> out;
    std::istringstream stream(row.substr(row.find("flat\",") + 6));
    for (std::string cell; std::getline(stream, cell, ',');) out.push_back(std::strtod(cell.c_str(), nullptr));
    REQUIRE(out.size() == 13);
    return out;
  };
  for (int contact = 1; contact < 4; ++contact) {
    const auto row = numbers(rows[contact]);  // p, n, u, r and the mode
    CHECK(row[6] == Approx(3));
    CHECK(row[7] == Approx(0).margin(1e-15));
    CHECK(row[8] == Approx(4));
  }
  const auto second = numbers(rows[2]), third = numbers(rows[3]);
  CHECK(second[9] == Approx(0.5 * c));
  CHECK(second[10] == 1);
  CHECK(second[11] == Approx(0.5 * s));
  CHECK(third[9] == Approx(0.25 * s));
  CHECK(third[10] == 2);
  CHECK(third[11] == Approx(-0.25 * c));
}

TEST_CASE("a shape's row has its place on its body, its turn, its radius and its half extents", "[output]") {
  TemporaryDirectory directory;
  Scene scene;
  scene.scenario.model.bodies.push_back({"the other, \"left\"", 1, Vec3(1, 1, 1)});
  Shape post;
  post.kind = ShapeKind::cylinder;
  post.name = "post";
  post.body = 1;
  post.local.p = Vec3(1, 2, 3);
  post.local.q = Quat(0.1, 0.7, -0.5, 0.5);
  post.radius = 4;
  post.half_extents = Vec3(4, 5, 4.5);
  scene.scenario.shapes.push_back(post);
  const ContactFile file(directory.path(), scene.scenario, true, 1);
  const auto shapes = lines(read_file(directory.path() / "shapes.csv"));
  REQUIRE(shapes.size() == 4);
  CHECK(shapes[3] == "post,\"the other, \"\"left\"\"\",cylinder,1,2,3,0.1,0.7,-0.5,0.5,4,4,5,4.5");
}

TEST_CASE("a contact sticks or slips by its speed along the plane in both directions, whatever its normal one is",
          "[output]") {
  const double bears[] = {1, 0, 0}, across[] = {0, 3e-7, 8e-7}, normal[] = {5, 0, 0}, second[] = {0, 0, 2e-6};
  CHECK(contact_mode(bears, across, 1, 1) == ContactMode::stick);  // 8.5e-7
  CHECK(contact_mode(bears, normal, 1, 1) == ContactMode::stick);  // parts
  CHECK(contact_mode(bears, second, 1, 1) == ContactMode::slip);
  const double pulls[] = {-1, 0, 0};
  CHECK(contact_mode(pulls, across, 1, 1) == ContactMode::open);
}

TEST_CASE("a contact file that fails names the file, be it that of the contacts or that of the shapes", "[output]") {
  for (const char* name : {"shapes.csv", "contacts.csv"}) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory.path() / name);  // stands in its way
    const Scene scene;
    const ContactFile file(directory.path(), scene.scenario, true, 1);
    CHECK_FALSE(file.ok());
    CHECK(file.failed_path() == (directory.path() / name).string());
  }
}
