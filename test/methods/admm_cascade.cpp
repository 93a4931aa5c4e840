// Two more ways to exact Coulomb friction: they end where the law holds, wherever they come from.

#include <catch2/catch.hpp>
#include <cmath>

#include "contact/referee.h"
#include "methods/registry.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

struct Answer {
  ContactSolution solution;
  std::vector<double> v_plus;
  Residuals residuals;
};

Answer answer(const ContactProblem& p, const char* solver) {
  Answer out;
  const MethodRow& row = *find_method("coulomb");
  MethodOptions options;
  options.solver = solver;
  row.make(options)(p, out.solution);
  out.residuals = Referee().check(p, out.solution, row.law, out.v_plus);
  return out;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

/// The same event in other units: masses in tonnes, velocities in furlongs a fortnight.
constexpr double furlongs = 6012;
ContactProblem in_other_units(ContactProblem p) {
  for (double& x : p.M.values) x *= 1e-3;
  for (double& x : p.v_minus) x *= furlongs;
  return p;
}

}  // namespace

TEST_CASE("admm and cascade find the motion that Newton's method finds", "[ncp]") {
  for (const ContactProblem& p :
       {sphere({20, -3, 0}, {0, 0, 0}), sphere({1, -10, 0}, {0, 2, 0}), box(0.1, {0.5, -0.0098, 0.2}),
        box(0.5, {0.3, -1, 0.1}, {0.2, 0.5, -0.3}), stack(2, 0.4, {0.5, -1, 0.2}), stack(4, 0.5, {0, -0.0098, 0})}) {
    const Answer law = answer(p, "newton");
    REQUIRE(law.solution.status == Status::ok);
    REQUIRE(Referee::holds(law.residuals, 1e-9));
    // A stack of two that is hit while it slides: 1e-12 of the law, where Newton's method ends, leaves 5e-9 m/s.
    const double near = p.nc() == 8 ? 1e-8 : 1e-9;
    for (const char* solver : {"admm", "cascade"}) {
      INFO(solver << ": " << p.nc() << " contacts");
      const Answer got = answer(p, solver);
      CHECK(got.solution.status == Status::ok);
      CHECK(Referee::holds(got.residuals, 1e-9));
      CHECK(distance(got.v_plus, law.v_plus) < near);
    }
  }
}

// On the edge of the cone, with a slip of zero. Where friction of a patch is not parallel (penalties of admm that
// differ within it), the law to 1e-12 leaves (1e-12)^(2/3) = 1e-8 of a slip, and an iteration that is linear no longer
// falls.
TEST_CASE("a stack that is hit while it slides goes on as one, slower by mu times the hit", "[ncp]") {
  for (const Vector3d& v : {Vector3d(0.5, -1, 0.2), Vector3d(0.3, -0.5, 0.7), Vector3d(-0.9, -2, 0.1)}) {
    const double left = 1 + 0.4 * v[1] / std::hypot(v[0], v[2]);
    for (const char* solver : {"admm", "cascade"}) {
      INFO(solver << ": " << v.transpose());
      const Answer got = answer(stack(2, 0.4, v), solver);
      CHECK(got.solution.status == Status::ok);
      std::vector<double> expected(got.v_plus.size(), 0.0);
      for (int b = 0; b < 2; ++b) {
        expected[6 * b] = v[0] * left;
        expected[6 * b + 2] = v[2] * left;
      }
      CHECK(distance(got.v_plus, expected) < 1e-8);
    }
  }
}

// Of cones mu |x_t| <= x_n with mu = 0.5: sliding without tipping, the answer is v_n = 0 and v_t less mu v_n.
TEST_CASE("a box that slides is not lifted by a cascade, though each of its programs alone would lift it", "[ncp]") {
  const Answer got = answer(box(0.5, {2, -0.01, 0}), "cascade");
  CHECK(got.v_plus[0] == Approx(2 - 0.5 * 0.01).epsilon(1e-9));
  CHECK(got.v_plus[1] == Approx(0).margin(1e-10));
}

TEST_CASE("a cascade counts the steps of all its programs", "[ncp]") {
  // A box that sticks takes one program, by the interior point method, as there is no answer before.
  CHECK(answer(box(0.5, {0, -1, 0}), "cascade").solution.iterations >= 2);
}

TEST_CASE("admm counts its iterations, not how often it looks at them", "[ncp]") {
  const Answer got = answer(box(0.5, {0, -1, 0}), "admm");
  CHECK(got.solution.status == Status::ok);
  CHECK(got.solution.iterations >= 10);  // it looks after each ten
  CHECK(got.solution.iterations % 10 == 0);
}

TEST_CASE("admm takes the same steps whatever the units, since contacts are scaled", "[ncp]") {
  const ContactProblem p = stack(3, 0.4, {0.4, -1, 0.2}, 0.3, 5);
  const Answer here = answer(p, "admm"), there = answer(in_other_units(p), "admm");
  CHECK(here.solution.status == Status::ok);
  CHECK(there.solution.iterations == here.solution.iterations);
  for (std::size_t i = 0; i < here.v_plus.size(); ++i)
    CHECK(there.v_plus[i] / furlongs == Approx(here.v_plus[i]).margin(1e-9));
}

TEST_CASE("what admm and cascade cannot do they say, and what they say is true", "[ncp]") {
  for (const double ratio : {1e3, 1e6, 1e-6})
    for (const double random : {0.0, 0.3}) {
      ContactProblem p = stack(2, 0.5, {0, -0.0098, 0}, random);
      p.M.block(1) *= ratio;
      for (const char* solver : {"admm", "cascade"}) {
        INFO(solver << ": ratio " << ratio << ", " << random << " m/s");
        const Answer got = answer(p, solver);
        if (got.solution.status == Status::ok)
          CHECK(Referee::holds(got.residuals, 1e-9));
        else
          CHECK_FALSE(got.solution.reason.empty());
        if (random == 0 && std::string(solver) == "cascade") CHECK(got.solution.status == Status::ok);
      }
    }
}
