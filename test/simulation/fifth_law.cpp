// A law that the program doesn't have, in one file and one row: contacts without friction and without rebound
// (Signorini),
//   0 <= r_n _|_ u_n+ >= 0,   r_t = 0
// and a method that solves it by projected Gauss and Seidel. Referee, pruning and simulation know it by its row alone.

#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

#include "contact/evidence.h"
#include "contact/referee.h"
#include "linalg/stop.h"
#include "methods/pruned.h"
#include "problems.h"
#include "simulation/left_out.h"

using namespace cb;
using Eigen::Vector3d;

namespace {

void check(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
  const auto& r = solution.impulse;
  Worst worst = feasible(problem, r, at);
  for (int c = 0; c < problem.nc(); ++c) {
    const double root_w = std::sqrt(at.weight[c]), size = std::sqrt(at.size2[c]);
    at.see(worst, std::min(r[3 * c] * root_w, at.u_plus[3 * c] / root_w), size, c);
    at.see(worst, tangential(r, c) * root_w, size, c);
  }
  worst.report(out);
}

Law smooth_law() {
  return {.name = "smooth",
          .check = []() -> LawCheck { return check; },
          .leave_out = [](const Witness&) { return LeaveOut{.corners = Corners::suffice}; }};
}

struct GaussSeidel {
  void operator()(const ContactProblem& problem, ContactSolution& solution) {
    const int nc = problem.nc();
    solution.clear();
    solution.impulse.assign(3 * nc, 0.0);
    solution.size = nc;
    contacts_seen += nc;
    if (!factor.factor(problem.M)) {
      solution.status = Status::singular;
      return;
    }
    delassus(problem, factor, W);
    contact_velocity(problem, problem.v_minus, u);
    constexpr int sweeps = 10000;
    for (double change = 1; change > 1e-15 && solution.iterations < sweeps; ++solution.iterations) {
      poll_stop();
      change = 0;
      for (int c = 0; c < nc; ++c) {
        double& r = solution.impulse[3 * c];
        double u_n = u[3 * c];
        for (int i = 0; i < nc; ++i) u_n += W(3 * c, 3 * i) * solution.impulse[3 * i];
        const double next = std::max(0.0, r - u_n / W(3 * c, 3 * c));
        change = std::max(change, std::abs(next - r));
        r = next;
      }
    }
  }
  static inline long contacts_seen = 0;
  BlockCholesky factor;
  Eigen::MatrixXd W;
  std::vector<double> u;
};

MethodRow smooth_row() {
  return {.name = "smooth",
          .summary = "contacts without friction",
          .source = "made up",
          .law = smooth_law(),
          .solvers = {},
          .variants = {},
          .options = {},
          .make = [](const MethodOptions&) -> ContactMethod { return GaussSeidel(); }};
}

/// Spheres of 2 kg over the ground, each with its own velocity.
ContactProblem spheres(const std::vector<Vector3d>& v) {
  ContactProblem p;
  for (std::size_t b = 0; b < v.size(); ++b) {
    test::add_body(p, 2, Vector3d::Constant(0.8), v[b]);
    test::add_contact(p, static_cast<int>(b), {0, -1, 0}, -1, {}, test::ground_axes(), 0.5);
  }
  return p;
}

}  // namespace

TEST_CASE("a law made up in a test is judged by its row: what is right holds, and what is wrong does not") {
  const ContactProblem p = spheres({{3, -1, 0}, {0, 2, 1}});
  ContactSolution s;
  smooth_row().make({})(p, s);
  CHECK(s.impulse[0] == Approx(2).epsilon(1e-15));
  CHECK(std::count(s.impulse.begin() + 1, s.impulse.end(), 0.0) == 5);
  Referee referee;
  std::vector<double> v_plus;
  CHECK(Referee::holds(referee.check(p, s, smooth_law(), v_plus), 1e-15));
  CHECK(v_plus[0] == 3);  // slides on
  for (const int part : {0, 1, 3, 5}) {
    ContactSolution wrong = s;
    wrong.impulse[part] += 1e-6;
    CHECK_FALSE(Referee::holds(referee.check(p, wrong, smooth_law(), v_plus), 1e-9));
  }
  // Another law of the same referee, and this one again.
  CHECK(Referee::holds(referee.check(p, s, newton_law(), v_plus), 1e-9));
  CHECK(Referee::holds(referee.check(p, s, smooth_law(), v_plus), 1e-9));
}

TEST_CASE("of a law made up in a test islands are solved apart") {
  // A stack of two boxes that falls, a sphere that lands and one that leaves.
  ContactProblem p = test::stack(2, 0.5, {0.3, -1, 0.1});
  const int boxes = p.M.blocks(), of_boxes = p.nc();
  for (const double v_y : {-1.0, 2.0}) {
    test::add_body(p, 2, Vector3d::Constant(0.8), {1, v_y, 0});
    test::add_contact(p, p.M.blocks() - 1, {0, -1, 0}, -1, {}, test::ground_axes(), 0.5);
  }
  const auto left_out = std::make_shared<LeftOut>();
  GaussSeidel::contacts_seen = 0;
  ContactSolution apart, together;
  pruned(smooth_row(), {}, left_out)(p, apart);
  CHECK(GaussSeidel::contacts_seen == of_boxes + 2);
  CHECK(left_out->islands == 3);
  smooth_row().make({})(p, together);
  Referee referee;
  std::vector<double> v_apart, v_together;
  CHECK(Referee::holds(referee.check(p, apart, smooth_law(), v_apart), 1e-9));
  CHECK(Referee::holds(referee.check(p, together, smooth_law(), v_together), 1e-9));
  for (std::size_t i = 0; i < v_apart.size(); ++i) CHECK(v_apart[i] == Approx(v_together[i]).margin(1e-9));
  CHECK(v_apart[6 * (boxes + 1) + 1] == 2);
}

TEST_CASE("under a law made up in a test a box slides on for ever, on the corners of its contacts alone") {
  Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", "4"}, {"vx", "0.5"}});
  SimulationOptions options;
  options.step = 1e-3;
  const MethodRow row = smooth_row();
  PrunedRun run(scenario, options, row, {}, true);
  constexpr int steps = 20;
  for (int i = 0; i < steps; ++i) CHECK(run.simulation.step().status == Status::ok);
  CHECK(run.simulation.state().v[0] == 0.5);
  CHECK(std::abs(run.simulation.state().v[1]) < 1e-12);
  CHECK(run.simulation.left_out().coplanar_points == steps * (16 - 4));
}
