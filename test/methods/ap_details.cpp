// Anitescu and Potra's LCP in its details: starts from an event at rest or from the one before, and what --regularise
// adds, in closed form.

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <vector>

#include "contact/referee.h"
#include "methods/registry.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// The method with warm start, given one event after another; the referee judges every answer.
struct Warm {
  explicit Warm(int k) {
    MethodOptions options;
    options.k = k;
    options.warm_start = true;
    options.warm_starts = accepted;
    method = find_method("ap")->make(options);
  }
  void meets(const ContactProblem& problem) {
    method(problem, solution);
    CHECK(solution.status == Status::ok);
    std::vector<double> v_plus;
    CHECK(Referee::holds(Referee().check(problem, solution, anitescu_potra_law(), v_plus), 1e-9));
  }

  std::shared_ptr<Counter> accepted = std::make_shared<Counter>(0);
  ContactMethod method;
  ContactSolution solution;
};

}  // namespace

// Friction is split over the two directions of the polygon beside it, in every one of its sectors.
TEST_CASE("a box that friction holds starts warm whichever way it is pushed", "[warm_start]") {
  for (const int k : {4, 6, 8})
    for (int way = 0; way < 12; ++way) {
      const double angle = 0.1 + 2 * M_PI * way / 12;
      INFO(k << " edges, pushed at " << angle);
      Warm warm(k);
      for (const double fall : {0.0098, 0.0098 + 1e-7})
        warm.meets(box(0.5, {1e-3 * std::cos(angle), -fall, 1e-3 * std::sin(angle)}));
      CHECK(*warm.accepted == 1);
    }
}

// Nothing but its normals is to stop: it rests on the ground while it goes on along it.
TEST_CASE("a box that slides on ice starts warm with ap, and its slip is bounded as the law asks", "[warm_start]") {
  for (const int k : {4, 8}) {
    INFO(k << " edges");
    Warm warm(k);
    for (int step = 0; step < 3; ++step) warm.meets(box(0, {1 + 0.01 * step, -0.0098, 0.3}));
    CHECK(*warm.accepted == 2);
  }
}

TEST_CASE("an answer that the event before has led to takes no pivot of its own", "[warm_start]") {
  Warm warm(4);
  warm.meets(box(0.3, {1, -0.0098, 0}));
  CHECK(warm.solution.iterations > 0);
  warm.meets(box(0.3, {1.01, -0.0098, 0}));
  CHECK(*warm.accepted == 1);
  CHECK(warm.solution.iterations == 0);
}

// A sphere of radius 1 has W = diag(1, 3.5, 3.5) / m; with E on the diagonal of all rows, c_t against the slip s:
//   (W_n + E) c_n = v_n;   sticks: (W_t + E) c_t = s;   slips: lam = s - (W_t + E) c_t, c_t = mu c_n + E lam
// One is solved densely (6 unknowns), twenty that do not touch each other with velocities as unknowns (120).
TEST_CASE("regularisation gives way by what it says along the normal, in friction and in its bound, dense and sparse") {
  const double E = 0.01, m = 4.0 / 3.0 * M_PI, W_n = 1 / m, W_t = 3.5 / m, v_n = 2, mu = 0.5;
  for (const int spheres : {1, 20})
    for (const double slip : {0.05, 20.0}) {
      INFO(spheres << " spheres, slip " << slip);
      ContactProblem p;
      for (int b = 0; b < spheres; ++b) {
        add_body(p, m, Vector3d::Constant(0.4 * m), {slip, -v_n, 0});
        add_contact(p, b, {0, -1, 0}, -1, {}, ground_axes(), mu);
      }
      MethodOptions options;
      options.regularise = E;
      ContactSolution s;
      find_method("ap")->make(options)(p, s);
      CHECK(s.status == Status::ok);
      const double c_n = v_n / (W_n + E), sticks = slip / (W_t + E);
      const double c_t = sticks <= mu * c_n ? sticks : (mu * c_n + E * slip) / (1 + E * (W_t + E));
      CHECK((c_t < sticks) == (slip > 1));
      REQUIRE(s.impulse.size() == 3 * static_cast<std::size_t>(spheres));
      for (std::size_t c = 0; c < static_cast<std::size_t>(spheres); ++c) {
        CHECK(s.impulse[3 * c] == Approx(c_n).epsilon(1e-9));
        CHECK(s.impulse[3 * c + 1] == Approx(-c_t).epsilon(1e-9));
        CHECK(s.impulse[3 * c + 2] == Approx(0).margin(1e-12));
      }
    }
}
