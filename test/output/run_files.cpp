#include "output/run_files.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cmath>
#include <limits>
#include <sstream>

#include "temporary.h"

using namespace cb;

namespace {

std::vector<std::string> cells(std::string_view line) {
  if (line.ends_with('\n')) line.remove_suffix(1);
  std::vector<std::string> out(1);
  for (const char c : line) {
    if (c == ',')
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) out.push_back(line);
  return out;
}

/// The cells of a step by the names of their columns.
std::string cell(const StepRecord& record, const std::string& column) {
  char row[steps_row_room];
  const char* end = print_step(row, record);
  const auto names = cells(steps_header), values = cells({row, end});
  REQUIRE(end[-1] == '\n');
  REQUIRE(values.size() == names.size());
  const auto at = std::find(names.begin(), names.end(), column);
  REQUIRE(at != names.end());
  return values[static_cast<std::size_t>(at - names.begin())];
}

Model two_bodies() {
  Model model;
  for (const char* name : {"left", "right, far"}) {
    Body body;
    body.name = name;
    body.mass = 1;
    body.inertia = Vec3(1, 1, 1);
    model.bodies.push_back(body);
  }
  return model;
}

State state_at(double t) {
  State state;
  state.t = t;
  state.pose.resize(2);
  state.pose[1].p = Vec3(0.1, -2, 1e-17);
  state.v = {1, 2, 3, 4, 5, 6, -1, -2, -3, -4, -5, 0.3};
  return state;
}

StepRecord record_at(long step, double t) {
  StepRecord record;
  record.step = step;
  record.t = t;
  return record;
}

}  // namespace

TEST_CASE("the columns of a run's files are those that users script against", "[output]") {
  CHECK(trajectory_header == "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n");
  CHECK(steps_header ==
        "step,t,events,contacts,size,iterations,status,claimed_residual,residual,law_residual,gap,infeasibility,"
        "event_energy_gain,max_penetration,kinetic_energy,potential_energy,dynamics_s,collision_s,assembly_s,solve_s,"
        "step_s\n");
}

TEST_CASE("a step without an event has empty residuals, not zero ones", "[output]") {
  StepRecord record = record_at(3, 0.25);
  for (const char* column : {"claimed_residual", "residual", "law_residual", "gap", "infeasibility"})
    CHECK(cell(record, column).empty());
  CHECK(cell(record, "step") == "3");
  CHECK(cell(record, "t") == "0.25");
  CHECK(cell(record, "events") == "0");
  CHECK(cell(record, "status") == "ok");
  CHECK(cell(record, "event_energy_gain") == "0");

  record.events = 1;
  record.residual = 1e-12;
  record.law_residual = 0.5;
  record.status = Status::inaccurate;
  CHECK(cell(record, "claimed_residual") == "0");
  CHECK(cell(record, "residual") == "1e-12");
  CHECK(cell(record, "law_residual") == "0.5");
  CHECK(cell(record, "gap").empty());
  CHECK(cell(record, "status") == "inaccurate");
}

TEST_CASE("each number of a step stands under its name", "[output]") {
  StepRecord record;
  record.step = 1;
  record.t = 2;
  record.events = 3;
  record.contacts = 4;
  record.size = 5;
  record.iterations = 6;
  record.solves = 70;  // these are not in the row
  record.false_claims = 71;
  record.doubted = 72;
  record.event_energy_gain_relative = 73;
  record.penetration_inside = 74;
  record.penetration_displacement = 75;
  record.claimed_residual = 7;
  record.residual = 8;
  record.law_residual = 9;
  record.gap = 10;
  record.infeasibility = 11;
  record.event_energy_gain = 12;
  record.max_penetration = 13;
  record.kinetic_energy = 14;
  record.potential_energy = 15;
  record.times = {16, 17, 18, 19, 20};
  int expected = 0;
  for (const char* column : {"step",
                             "t",
                             "events",
                             "contacts",
                             "size",
                             "iterations",
                             "claimed_residual",
                             "residual",
                             "law_residual",
                             "gap",
                             "infeasibility",
                             "event_energy_gain",
                             "max_penetration",
                             "kinetic_energy",
                             "potential_energy",
                             "dynamics_s",
                             "collision_s",
                             "assembly_s",
                             "solve_s",
                             "step_s"}) {
    INFO(column);
    CHECK(cell(record, column) == std::to_string(++expected));
  }
}

TEST_CASE("a body's row is its place, its turn, its velocity and its spin", "[output]") {
  TemporaryDirectory directory;
  State state = state_at(0.5);
  state.pose[0].p = Vec3(1, 2, 3);
  state.pose[0].q = Quat(0.1, 0.7, -0.5, 0.25);
  state.v = {4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  {
    RunFiles files(directory.path(), two_bodies(), 1);
    files.step(state, record_at(1, 0.5));
  }
  const auto trajectory = lines(read_file(directory.path() / "trajectory.csv"));
  REQUIRE(trajectory.size() == 3);
  CHECK(trajectory[1] == "0.5,left,1,2,3,0.1,0.7,-0.5,0.25,4,5,6,7,8,9");
}

TEST_CASE("of stepping to an accuracy each step has its row, kept or not, and other runs leave no such file",
          "[output]") {
  TemporaryDirectory directory;
  {
    RunFiles files(directory.path(), two_bodies(), 2, {}, 0, true);
    files.start(state_at(0));
    StepRecord record = record_at(1, 0.5);
    record.accuracy = AccuracyStep{AccuracyStep::macro, 0.25, 0.125, 3, true};
    files.step(state_at(0.5), record);
    record = record_at(2, 0.75);
    record.accuracy = AccuracyStep{AccuracyStep::switched, 0.0625, 2, 0, false};
    files.step(state_at(0.75), record);
    record = record_at(3, 1);
    record.accuracy = AccuracyStep{AccuracyStep::first_order, 4, 8, 16, false};
    files.step(state_at(1), record);
    CHECK(files.ok());
  }
  CHECK(read_file(directory.path() / "stepping.csv") ==
        "step,t,kind,impact,length,refused,estimate\n"
        "1,0.5,macro,1,0.25,3,0.125\n2,0.75,switch,0,0.0625,0,2\n3,1,first_order,0,4,16,8\n");
  { RunFiles files(directory.path(), two_bodies(), 1); }
  CHECK_FALSE(std::filesystem::exists(directory.path() / "stepping.csv"));
  { RunFiles files(directory.path(), two_bodies(), 0, {}, 0, true); }
  CHECK_FALSE(std::filesystem::exists(directory.path() / "stepping.csv"));
}

TEST_CASE("the longest possible step fits its row", "[output]") {
  StepRecord record;
  const double longest = -2.2250738585072014e-308;
  record.step = std::numeric_limits<long>::min();
  record.events = record.contacts = record.size = record.iterations = std::numeric_limits<int>::min();
  record.status = Status::energy_blowup;
  record.t = record.claimed_residual = record.residual = record.event_energy_gain = record.max_penetration = longest;
  record.law_residual = record.gap = record.infeasibility = longest;
  record.kinetic_energy = record.potential_energy = longest;
  record.times = {longest, longest, longest, longest, longest};
  std::string row(2 * steps_row_room, '\0');
  CHECK(static_cast<std::size_t>(print_step(row.data(), record) - row.data()) <= steps_row_room);
}

TEST_CASE("a number that is none never reaches a file", "[output]") {
  StepRecord record;
  record.events = 1;
  record.residual = std::numeric_limits<double>::quiet_NaN();
  record.kinetic_energy = std::numeric_limits<double>::infinity();
  CHECK(cell(record, "residual").empty());
  CHECK(cell(record, "kinetic_energy").empty());
}

TEST_CASE("the trajectory has a row for each body and recorded step from t = 0 on", "[output]") {
  TemporaryDirectory directory;
  {
    RunFiles files(directory.path(), two_bodies(), 2);
    files.start(state_at(0));
    for (int n = 1; n <= 5; ++n) files.step(state_at(0.1 * n), record_at(n, 0.1 * n));
    CHECK(files.ok());
  }
  const auto trajectory = lines(read_file(directory.path() / "trajectory.csv"));
  REQUIRE(trajectory.size() == 1 + 3 * 2);  // t = 0, 0.2, 0.4
  CHECK(trajectory[1] == "0,left,0,0,0,1,0,0,0,1,2,3,4,5,6");
  CHECK(trajectory[2] == "0,\"right, far\",0.1,-2,1e-17,1,0,0,0,-1,-2,-3,-4,-5,0.3");
  CHECK(cells(trajectory[3])[0] == "0.2");
  CHECK(cells(trajectory[6])[0] == "0.4");

  const auto steps = lines(read_file(directory.path() / "steps.csv"));
  REQUIRE(steps.size() == 3);
  CHECK(cells(steps[1])[0] == "2");
  CHECK(cells(steps[2])[0] == "4");
}

TEST_CASE("the step that ends a run has its row, its unfinished state has none", "[output]") {
  TemporaryDirectory directory;
  {
    RunFiles files(directory.path(), two_bodies(), 10);
    files.start(state_at(0));
    StepRecord record = record_at(7, 0.7);
    record.status = Status::ray;
    files.last_step(record);
  }
  CHECK(lines(read_file(directory.path() / "trajectory.csv")).size() == 3);
  const auto steps = lines(read_file(directory.path() / "steps.csv"));
  REQUIRE(steps.size() == 2);
  CHECK(cells(steps[1])[6] == "ray");
}

TEST_CASE("a run that records nothing removes the rows of an earlier one", "[output]") {
  TemporaryDirectory directory;
  { RunFiles files(directory.path(), two_bodies(), 1); }
  CHECK(std::filesystem::exists(directory.path() / "trajectory.csv"));
  RunFiles files(directory.path(), two_bodies(), 0);
  files.start(state_at(0));
  files.step(state_at(1), record_at(1, 1));
  files.flush();
  CHECK(files.ok());
  CHECK_FALSE(std::filesystem::exists(directory.path() / "trajectory.csv"));
  CHECK_FALSE(std::filesystem::exists(directory.path() / "steps.csv"));
}

TEST_CASE("each joint has the torque of its rate, beside a base that floats, too", "[output]") {
  TemporaryDirectory directory;
  Model model = two_bodies();
  Tree tree;
  tree.nv = 8;
  Joint base, first, second;
  base.kind = JointKind::free;
  base.v = 0;
  first.name = "first";
  first.q = 0;
  first.v = 6;
  second.name = "second";
  second.q = 1;
  second.v = 7;
  tree.joints = {base, first, second};
  model.trees.push_back(tree);
  State state = state_at(0.5);
  state.q = {0.25, -0.25};
  state.qd = {1, 2, 3, 4, 5, 6, 7, 8};
  {
    RunFiles files(directory.path(), model, 1, {}, 0);
    files.step(state, record_at(1, 0.5), std::vector<double>{10, 20, 30, 40, 50, 60, 70, 80});
    CHECK(files.ok());
  }
  const auto joints = lines(read_file(directory.path() / "joints.csv"));
  REQUIRE(joints.size() == 3);
  CHECK(joints[1] == "0.5,first,0.25,7,70");
  CHECK(joints[2] == "0.5,second,-0.25,8,80");
}

TEST_CASE("at the start no motor has a torque, and joints that do not move have no row", "[output]") {
  TemporaryDirectory directory;
  Model model = two_bodies();
  Tree tree;
  tree.nv = 2;
  tree.joints.resize(3);
  tree.joints[0].name = "welded";
  tree.joints[1].name = "slide, long";
  tree.joints[1].q = 1;
  tree.joints[1].v = 1;
  tree.joints[2].name = "hinge";
  tree.joints[2].q = 0;
  tree.joints[2].v = 0;
  model.trees.push_back(tree);
  State state = state_at(0);
  state.q = {0.5, 0.25};
  state.qd = {3, 4};
  {
    RunFiles files(directory.path(), model, 2);
    files.start(state);
    state.t = 1;
    files.step(state, record_at(1, 1), std::vector<double>{5, 6});
    state.t = 2;
    files.step(state, record_at(2, 2), std::vector<double>{7, 8});
  }
  const auto joints = lines(read_file(directory.path() / "joints.csv"));
  CHECK(joints == std::vector<std::string>{"t,joint,q,qd,tau", "0,\"slide, long\",0.25,4,0", "0,hinge,0.5,3,0",
                                           "2,\"slide, long\",0.25,4,8", "2,hinge,0.5,3,7"});
  { RunFiles files(directory.path(), two_bodies(), 1); }
  CHECK_FALSE(std::filesystem::exists(directory.path() / "joints.csv"));
}

TEST_CASE("the file that fails is named, whichever it is", "[output]") {
  Model model = two_bodies();
  Tree tree;
  tree.nv = 1;
  tree.joints.resize(1);
  tree.joints[0].q = tree.joints[0].v = 0;
  model.trees.push_back(tree);
  for (const char* name : {"trajectory.csv", "steps.csv", "joints.csv", "loads.csv", "stepping.csv"}) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory.path() / name);  // stands in its way
    const RunFiles files(directory.path(), model, 1, {Shape()}, 0, true);
    CHECK_FALSE(files.ok());
    CHECK(files.error() == EISDIR);
    CHECK(files.failed_path() == (directory.path() / name).string());
  }
}

TEST_CASE("loads are kept pair by pair, their friction in world axes where a scene turns the tangents", "[output]") {
  TemporaryDirectory directory;
  Model model = two_bodies();
  Tree tree;
  tree.nv = 1;
  tree.joints.resize(1);
  model.trees.push_back(tree);
  Shape ground, left, right;
  ground.kind = ShapeKind::half_space;
  ground.name = "ground";
  left.name = "left, front";
  right.name = "right";
  const ContactProblem problem;
  const Residuals residuals;
  const std::vector<double> v_plus;
  ContactSolution solution;
  std::vector<ContactPoint> contacts(3);
  // Normals of a, from b: x turned to y, and -y. Of the ground and the left one both orders are pairs of their own.
  contacts[0] = {Vec3::Zero(), Vec3(0.6, 0.8, 0), 0, 1, 0};
  contacts[1] = {Vec3::Zero(), Vec3(0, -1, 0), 0, 0, 2};
  contacts[2] = {Vec3::Zero(), Vec3(0.6, 0.8, 0), 0, 1, 0};
  const double turn = 0.25, c = std::cos(turn), s = std::sin(turn);
  {
    RunFiles files(directory.path(), model, 1, {ground, left, right}, turn);
    solution.impulse = {1, 0.5, 0, 2, 0.25, 0.125, 4, 0, 1, 100, 100, 100};  // the last of a joint's limit
    files.event(EventRecord{0, problem, solution, residuals, v_plus, contacts});
    files.step(state_at(0.5), record_at(1, 0.5));
  }
  const auto loads = lines(read_file(directory.path() / "loads.csv"));
  REQUIRE(loads.size() == 3);
  CHECK(loads[1].starts_with("0.5,\"left, front\",ground,5,"));
  CHECK(loads[2].starts_with("0.5,ground,right,2,"));
  const auto numbers = [](const std::string& row) {
    const auto all = cells(row);
    return Vec3(std::stod(all[all.size() - 3]), std::stod(all[all.size() - 2]), std::stod(all.back()));
  };
  // Tangents x-wise and n x that, turned about -n as the event's: c t1 - s t2, c t2 + s t1.
  const auto friction = [&](const Vec3& t1, const Vec3& t2, double x, double y) -> Vec3 {
    return x * (c * t1 - s * t2) + y * (c * t2 + s * t1);
  };
  CHECK((numbers(loads[1]) - friction(Vec3(0.8, -0.6, 0), Vec3(0, 0, -1), 0.5, 1)).norm() < 1e-15);
  CHECK((numbers(loads[2]) - friction(Vec3(1, 0, 0), Vec3(0, 0, 1), 0.25, 0.125)).norm() < 1e-15);
}

TEST_CASE("the loads of a robot's shapes add up over a step, friction in world axes", "[output]") {
  TemporaryDirectory directory;
  Model model = two_bodies();
  Tree tree;
  tree.nv = 1;
  tree.joints.resize(2);
  model.trees.push_back(tree);
  Shape ground, wheel;
  ground.kind = ShapeKind::half_space;
  ground.name = "ground";
  wheel.body = 0;
  wheel.name = "wheel";
  const ContactProblem problem;
  const Residuals residuals;
  const std::vector<double> v_plus;
  ContactSolution solution;
  std::vector<ContactPoint> contacts(2);
  for (ContactPoint& contact : contacts) {
    contact.shape_a = 1;
    contact.shape_b = 0;
    contact.normal = Vec3(0, 1, 0);
  }
  {
    // t1 is x, t2 is y x x = -z.
    RunFiles files(directory.path(), model, 1, {ground, wheel}, 0);
    files.start(state_at(0));
    solution.impulse = {1, 0.25, 0.5, 2, 0, 0.125};
    files.event(EventRecord{0, problem, solution, residuals, v_plus, contacts});
    solution.impulse = {4, 0, 0, 0, 0.5, 0};
    files.event(EventRecord{0, problem, solution, residuals, v_plus, contacts});
    files.step(state_at(0.5), record_at(1, 0.5));
    files.step(state_at(1), record_at(2, 1));  // no event: no row
    solution.impulse = {0, 0, 0, 0, 0, 0};
    files.event(EventRecord{1, problem, solution, residuals, v_plus, contacts});
    files.step(state_at(1.5), record_at(3, 1.5));
    CHECK(files.ok());
  }
  const auto loads = lines(read_file(directory.path() / "loads.csv"));
  REQUIRE(loads.size() == 3);
  CHECK(loads[0] + "\n" == loads_header);
  CHECK(loads[1] == "0.5,wheel,ground,7,0.75,0,-0.625");
  CHECK(loads[2] == "1.5,wheel,ground,0,0,0,0");
  {
    // Of the step alone that is kept.
    RunFiles files(directory.path(), model, 2, {ground, wheel}, 0);
    files.start(state_at(0));
    for (int step = 1; step <= 4; ++step) {
      solution.impulse = {1.0 * step, 0, 0, 0, 0, 0};
      files.event(EventRecord{0.5 * step, problem, solution, residuals, v_plus, contacts});
      files.step(state_at(0.5 * step), record_at(step, 0.5 * step));
    }
  }
  const auto of_every_second = lines(read_file(directory.path() / "loads.csv"));
  REQUIRE(of_every_second.size() == 3);
  CHECK(of_every_second[1] == "1,wheel,ground,2,0,0,0");
  CHECK(of_every_second[2] == "2,wheel,ground,4,0,0,0");
  {
    // To an accuracy: of steps of first order, not of what an impact before an extrapolated one does; nor is that kept.
    RunFiles files(directory.path(), model, 1, {ground, wheel}, 0, true);
    files.start(state_at(0));
    for (int step = 1; step <= 3; ++step) {
      solution.impulse = {1.0 * step, 0, 0, 0, 0, 0};
      files.event(EventRecord{0.5 * step, problem, solution, residuals, v_plus, contacts});
      StepRecord record = record_at(step, 0.5 * step);
      record.accuracy = AccuracyStep{};
      record.accuracy->kind = step == 1   ? AccuracyStep::macro
                              : step == 2 ? AccuracyStep::switched
                                          : AccuracyStep::first_order;
      files.step(state_at(0.5 * step), record);
    }
  }
  const auto to_an_accuracy = lines(read_file(directory.path() / "loads.csv"));
  REQUIRE(to_an_accuracy.size() == 3);
  CHECK(to_an_accuracy[1] == "1,wheel,ground,2,0,0,0");
  CHECK(to_an_accuracy[2] == "1.5,wheel,ground,3,0,0,0");
  { RunFiles files(directory.path(), two_bodies(), 1, {ground, wheel}, 0); }
  CHECK_FALSE(std::filesystem::exists(directory.path() / "loads.csv"));
}
