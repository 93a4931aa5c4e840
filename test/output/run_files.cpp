#include "output/run_files.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <sstream>

#include "output/temporary.h"

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
    // Directions that are turned by 0.3 rad about the direction from the wheel to the ground: t1 is cos x + sin z.
    RunFiles files(directory.path(), model, 1, {ground, wheel}, 0.3);
    files.start(state_at(0));
    solution.impulse = {1, 0, 0, 1, 2, 0};
    files.event(EventRecord{0, problem, solution, residuals, v_plus, contacts});
    files.step(state_at(0.5), record_at(1, 0.5));
  }
  const auto turned = cells(lines(read_file(directory.path() / "loads.csv")).at(1));
  CHECK(std::stod(turned[4]) == Approx(2 * std::cos(0.3)));
  CHECK(std::stod(turned[5]) == 0);
  CHECK(std::stod(turned[6]) == Approx(2 * std::sin(0.3)));
  { RunFiles files(directory.path(), two_bodies(), 1, {ground, wheel}, 0); }
  CHECK_FALSE(std::filesystem::exists(directory.path() / "loads.csv"));
}
