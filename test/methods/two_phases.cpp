// Restitution in two phases: a ball that lands under another, both at 2 m/s, without friction. Compression stops both;
// the ground gives back theta e of (m + M) 2 m/s to the lower, which the upper then takes its part of.

#include <catch2/catch.hpp>
#include <cmath>

#include "contact/referee.h"
#include "methods/registry.h"
#include "methods/restitution.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double speed = 2;

/// The ground returns e, the balls between them nothing.
ContactProblem falling(double lower, double upper, double e) {
  ContactProblem p;
  for (const double m : {lower, upper}) add_body(p, m, Vector3d::Constant(0.4 * m), {0, -speed, 0});
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0, e);
  add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, ground_axes(), 0, 0);
  return p;
}

struct Answer {
  ContactSolution solution;
  std::vector<double> v_plus;
};
Answer answer(const char* method, const ContactProblem& p) {
  Answer out;
  const MethodRow& row = *find_method(method);
  row.make({})(p, out.solution);
  CHECK(out.solution.status == Status::ok);
  CHECK(Referee::holds(Referee().check(p, out.solution, row.law, out.v_plus), 1e-9));
  return out;
}

}  // namespace

// Before the second phase the lower ball has theta^2 e^2 (m + M)^2 / m of energy, of (m + M) that came: no more than
// that asks for theta e <= sqrt(m / (m + M)), a half here. What ap gives back it bounds by what there is at the end.
TEST_CASE("what the ground gives back moves both balls on, scaled where there would be more energy on the way") {
  for (const double e : {0.25, 0.8, 1.0})
    for (const char* method : {"convex", "coulomb", "ap"}) {
      INFO(method << ", e = " << e);
      const bool scaled = method != std::string("ap") && e > 0.5;
      const double given = scaled ? 0.5 : e;
      const Answer got = answer(method, falling(1, 3, e));
      CHECK(got.solution.restitution_scale == Approx(given / e));
      for (const int body : {0, 1}) CHECK(got.v_plus[6 * body + 1] == Approx(given * speed));
      // The ground's impulse turns the momentum of both, the upper ball's its own.
      CHECK(got.solution.impulse[0] == Approx(4 * speed * (1 + given)));
      CHECK(got.solution.impulse[3] == Approx(3 * speed * (1 + given)));
    }
}

TEST_CASE("where nothing approaches again there is one phase, and friction is that of compression") {
  const double m = 4. / 3 * M_PI;
  const Answer one = answer("coulomb", sphere({20, -3, 0}, {0, 0, 0}, 0.1, 0.5));
  CHECK(one.solution.restitution_scale == 1);
  CHECK(one.solution.impulse[0] == Approx(1.5 * 3 * m));
  CHECK(one.solution.impulse[1] == Approx(-0.1 * 3 * m));
  CHECK(one.solution.size == 3);
  // Two phases are two problems.
  CHECK(answer("coulomb", falling(1, 3, 0.25)).solution.size == 12);
  CHECK(answer("coulomb", falling(1, 3, 0)).solution.size == 6);
}

// A ball that lands at 400 m/s; one between two walls is thrown by the first against the second at 1e-10 m/s.
TEST_CASE("what approaches again is stopped, however fast other islands are, and theirs is one phase") {
  ContactProblem p;
  add_body(p, 1, Vector3d::Constant(0.4), {0, -400, 0});
  add_body(p, 1, Vector3d::Constant(0.4), {-2e-10, 0, 0});
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0, 0.5);
  for (const double side : {1.0, -1.0}) {
    Matrix3d axes;
    axes << side, 0, 0, 0, 1, 0, 0, 0, side;
    add_contact(p, 1, {-side, 0, 0}, -1, {}, axes, 0, 0.5);
  }
  const Answer got = answer("coulomb", p);
  CHECK(got.v_plus[1] == Approx(200));
  CHECK(std::abs(got.v_plus[6]) < 1e-19);  // 1e-10, and refused, where all islands have one measure
  CHECK(got.solution.size == 9 + 6);
}

// The same between its walls weighs 1000 t, and a milligram that hits it leaves at 100 m/s: the fastest of the island
// by m/s, and next to nothing by energy.
TEST_CASE("what approaches again is stopped, however fast something light is that touches it") {
  ContactProblem p;
  add_body(p, 1e6, Vector3d::Constant(0.4e6), {-1.9e-10, 0, 0});
  add_body(p, 1e-6, Vector3d::Constant(0.4e-6), {0, -200, 0});
  add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, ground_axes(), 0, 0.5);
  for (const double side : {1.0, -1.0}) {
    Matrix3d axes;
    axes << side, 0, 0, 0, 1, 0, 0, 0, side;
    add_contact(p, 0, {-side, 0, 0}, -1, {}, axes, 0, 0.5);
  }
  const Answer got = answer("coulomb", p);
  CHECK(got.v_plus[7] == Approx(100));
  CHECK(std::abs(got.v_plus[0]) < 1e-19);  // 9.5e-11, and refused, where m/s are the only measure
}

// r = 8 and 6 N s stop both balls of 1 and 3 kg: E_0 = -8 J, and e r_n = 8 e on the lower makes 32 e^2 J of it.
TEST_CASE("restitution is scaled by its own event alone, whatever it was scaled by before") {
  Restitution kept;
  const auto scale = [&](double e, bool bounded) {
    const ContactProblem p = falling(1, 3, e);
    BlockCholesky factor;
    REQUIRE(factor.factor(p.M));
    Islands islands;
    find_islands(p, islands);
    std::vector<double> impulse = {8, 0, 0, 6, 0, 0};
    return kept.give_back(p, factor, islands, {bounded ? char{1} : char{0}}, impulse);
  };
  CHECK(scale(0.25, true) == 1);
  CHECK(scale(1, true) == Approx(0.5));
  CHECK(scale(1, true) == Approx(0.5));
  CHECK(scale(1, false) == 1);
  CHECK(scale(0.8, true) == Approx(0.625));
  CHECK(scale(0.5, true) == Approx(1));
}
