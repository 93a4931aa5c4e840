#include "methods/newton.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <limits>

#include "contact/referee.h"
#include "methods/impacts.h"

using namespace cb;
using Eigen::Vector3d;

namespace {

constexpr double g = 9.8, h = 1e-3;

ContactMethod newton(const char* variant) {
  MethodOptions options;
  options.variant = variant;
  return newton_row().make(options);
}

ContactSolution solve(const ContactMethod& method, const ContactProblem& problem) {
  ContactSolution solution;
  method(problem, solution);
  return solution;
}

}  // namespace

TEST_CASE("an uncapped impact changes a sphere's energy by the factor of the closed form") {
  // Solid sphere, e = 0, no spin: j = m v_n, friction mu j whatever the slip. With s = rho v_n the velocity becomes
  // s - mu v_n and the spin r w = 2.5 mu v_n, so KE+ = m/2 v_n^2 ((rho - mu)^2 + 0.4 (2.5 mu)^2).
  for (const char* variant : {"", "uncapped"})
    for (double mu : {0.1, 0.5, 0.60581, 1.7})
      for (double rho : {1e-3, 0.05, 0.1, 0.2348, 0.3, 1.0, 3.0, 20.0}) {
        const ContactProblem p = test::sphere({10 * rho * 0.6, -10, 10 * rho * 0.8}, Vector3d::Zero(), mu);
        const ContactSolution solution = solve(newton(variant), p);
        CHECK(solution.status == Status::ok);
        const test::Outcome out = test::outcome(p, solution.impulse);
        const double factor = 1 + (3.5 * mu * mu - 1 - 2 * mu * rho) / (1 + rho * rho);
        CHECK(std::abs(0.5 * quadratic_form(p.M, out.v) / out.energy_before / factor - 1) < 1e-12);
      }
}

TEST_CASE("the paper's sphere gains 16 % uncapped and ends with the exact 1.496 J when sticking is tested") {
  const ContactProblem p = test::sphere({1, -10, 0}, Vector3d::Zero());
  const test::Outcome uncapped = test::outcome(p, solve(newton("uncapped"), p).impulse);
  CHECK(uncapped.energy_before == Approx(211.5339053417127).epsilon(1e-14));
  CHECK(0.5 * quadratic_form(p.M, uncapped.v) / uncapped.energy_before == Approx(1.161741).epsilon(1e-6));
  const test::Outcome tested = test::outcome(p, solve(newton("stick-tested"), p).impulse);
  CHECK(0.5 * quadratic_form(p.M, tested.v) == Approx(1.495996501709425).epsilon(1e-12));
}

TEST_CASE("with the test for sticking a sphere's impact is the exact one for any restitution") {
  // s = slip: sticks iff s <= 3.5 mu (1 + e) v_n, then J_t = (2/7) m s, else mu m (1 + e) v_n; J_n = m (1 + e) v_n.
  for (double e : {0.0, 0.3, 1.0})
    for (const Vector3d& v : {Vector3d(5, -10, 0), Vector3d(20, -3, 0), Vector3d(3, -2, 1), Vector3d(30, -1, -7)}) {
      const ContactProblem p = test::sphere(v, {0.2, 1, -0.3}, 0.4, e);
      const ContactSolution solution = solve(newton("stick-tested"), p);
      std::vector<double> u;
      contact_velocity(p, p.v_minus, u);
      const double m = p.M.block(0)(0, 0), slip = std::hypot(u[1], u[2]);
      const double j_n = m * (1 + e) * -u[0], j_t = std::min(2.0 / 7.0 * m * slip, 0.4 * j_n);
      CHECK(solution.impulse[0] == Approx(j_n).epsilon(1e-12));
      CHECK(solution.impulse[1] == Approx(-j_t * u[1] / slip).epsilon(1e-12));
      CHECK(solution.impulse[2] == Approx(-j_t * u[2] / slip).epsilon(1e-12));
    }
}

TEST_CASE("a box corner obeys u_n+ = -e u_n- although friction and the normal impulse are coupled") {
  // Unit cube on one corner, arm (0.5, -0.5, 0.3): K_nt != 0.
  for (const char* variant : {"uncapped", "stick-tested"})
    for (double mu : {0.0, 0.1, 0.5, 1.0, 2.0})
      for (double e : {0.0, 0.5, 1.0}) {
        ContactProblem p;
        test::add_body(p, 1, Vector3d::Constant(1.0 / 6), {1, -2, 0.5});
        test::add_contact(p, 0, {0.5, -0.5, 0.3}, -1, {}, test::ground_axes(), mu, e);
        const ContactSolution solution = solve(newton(variant), p);
        const test::Outcome out = test::outcome(p, solution.impulse);
        CHECK(std::abs(out.u[0] + e * out.u_minus[0]) < 1e-14);
        CHECK(std::hypot(solution.impulse[1], solution.impulse[2]) <= mu * solution.impulse[0] * (1 + 1e-14));
      }
}

TEST_CASE("a frictionless box corner receives (1 + e) v_n / K_nn") {
  // K_nn = 1/m + (r x n).I^-1 (r x n) = 1 + 6 (0.3^2 + 0.5^2) = 3.04.
  ContactProblem p;
  test::add_body(p, 1, Vector3d::Constant(1.0 / 6), {1, -2, 0.5});
  test::add_contact(p, 0, {0.5, -0.5, 0.3}, -1, {}, test::ground_axes(), 0, 0.25);
  for (const char* variant : {"uncapped", "stick-tested"})
    CHECK(solve(newton(variant), p).impulse[0] == Approx(1.25 * 2 / 3.04).epsilon(1e-14));
}

TEST_CASE("spheres that meet centrally exchange velocities as Newton's law says") {
  // m = 1 and 3, v = 1 and -1: u_n- = -2, j = (1 + e) 2 / (1 + 1/3).
  for (double e : {0.0, 0.5, 1.0}) {
    ContactProblem p;
    test::add_body(p, 1, Vector3d::Constant(0.4), {0, 1, 0});
    test::add_body(p, 3, Vector3d::Constant(1.2), {0, -1, 0});
    test::add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, test::ground_axes(), 0.5, e);
    for (const char* variant : {"uncapped", "stick-tested"}) {
      const test::Outcome out = test::outcome(p, solve(newton(variant), p).impulse);
      CHECK(out.v[1] == Approx(1 - 1.5 * (1 + e)).margin(1e-15));
      CHECK(out.v[7] == Approx(-1 + 0.5 * (1 + e)).margin(1e-15));
    }
  }
}

TEST_CASE("with the test for sticking 1000 random impacts obey Newton's law inside the cone and gain no energy") {
  std::mt19937 generator(7);
  const ContactMethod method = newton("stick-tested");
  int stuck = 0, slid = 0, cut = 0;
  for (int i = 0; i < 1000; ++i) {
    const ContactProblem p = test::random_impact(generator);
    const ContactSolution solution = solve(method, p);
    REQUIRE(solution.status == Status::ok);
    const test::Outcome out = test::outcome(p, solution.impulse);
    const double r_t = std::hypot(solution.impulse[1], solution.impulse[2]);
    CHECK(std::abs(out.u[0] + p.restitution[0] * out.u_minus[0]) <= 1e-12 * -out.u_minus[0]);
    CHECK(r_t <= p.mu[0] * solution.impulse[0] * (1 + 1e-12));
    CHECK(out.energy_change <= 1e-13 * out.energy_before);
    const bool sticks = std::hypot(out.u[1], out.u[2]) < 1e-10 * std::hypot(out.u_minus[1], out.u_minus[2]);
    stuck += sticks;
    slid += !sticks && r_t > p.mu[0] * solution.impulse[0] * (1 - 1e-12);
    cut += !sticks && r_t < p.mu[0] * solution.impulse[0] * (1 - 1e-12);
  }
  // All three branches of the law are met.
  CHECK(stuck > 100);
  CHECK(slid > 100);
  CHECK(cut > 5);
}

TEST_CASE("where full friction would gain energy the variant that tests for sticking stops at none gained") {
  // Kane and Levinson's paradox: a rod that meets the ground steeply, sliding slowly, e close to 1. The impulse that
  // stops the slip lies in the cone and gains energy: r.(u- + u+) / 2 > 0.
  ContactProblem p;
  test::add_body(p, 1, {1.0 / 12, 0.01, 1.0 / 12}, {0.5, -1, 0});
  test::add_contact(p, 0, {-0.25, -0.433, 0}, -1, {}, test::ground_axes(), 2, 0.95);
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  BlockCholesky factor;
  factor.factor(p.M);
  std::vector<Eigen::Matrix3d> K;
  diagonal_blocks(p, factor, K);
  const Vector3d u_minus(u[0], u[1], u[2]), u_plus(-0.95 * u[0], 0, 0);
  const Vector3d r = K[0].inverse() * (u_plus - u_minus);
  REQUIRE(r.tail<2>().norm() < 2 * r[0]);
  REQUIRE(0.5 * r.dot(u_minus + u_plus) > 0.01);

  const test::Outcome out = test::outcome(p, solve(newton("stick-tested"), p).impulse);
  CHECK(std::abs(out.energy_change) < 1e-14);
  CHECK(out.u[0] == Approx(-0.95 * out.u_minus[0]).epsilon(1e-13));
}

TEST_CASE("an uncapped contact that jams gets the frictionless impulse") {
  // K_nn = 1 + 12 * 0.25^2 = 1.75, K_nt = 12 * 0.25 * 0.433 = 1.299 up to sign: mu = 2 leaves no positive denominator.
  ContactProblem p;
  test::add_body(p, 1, {1.0 / 12, 1.0 / 12, 1.0 / 12}, {-0.5, -1, 0});
  test::add_contact(p, 0, {-0.25, -0.433, 0}, -1, {}, test::ground_axes(), 2, 0.5);
  const ContactSolution left = solve(newton("uncapped"), p);
  p.v_minus[0] = 0.5;
  const ContactSolution right = solve(newton("uncapped"), p);
  // One of the two directions of slip jams, the other does not.
  const bool left_jams = left.impulse[1] == 0, right_jams = right.impulse[1] == 0;
  CHECK(left_jams != right_jams);
  CHECK((left_jams ? left : right).impulse[0] == Approx(1.5 / 1.75).epsilon(1e-12));
}

TEST_CASE("resting stacks stop approaching, carry their weight and gain no energy") {
  for (const char* variant : {"uncapped", "stick-tested"})
    for (int n : {1, 2, 4, 8}) {
      const ContactProblem p = test::stack(n, 0.5, {0, -g * h, 0});
      const ContactSolution solution = solve(newton(variant), p);
      CHECK(solution.status == Status::ok);
      CHECK(solution.claimed_residual <= 1e-10);
      Referee referee;
      std::vector<double> v_plus;
      const Residuals residuals = referee.check(p, solution, newton_law(), v_plus);
      CHECK(residuals.approach <= 1.1e-10 * g * h);
      CHECK(residuals.cone_violation <= 1e-14);
      if (variant == std::string("stick-tested")) {
        CHECK(residuals.energy_gain <= 0);
      }
      double ground = 0;
      for (int c = 0; c < 4; ++c) ground += solution.impulse[3 * c];
      CHECK(ground >= n * g * h * (1 - 1e-9));
    }
}

TEST_CASE("with the test for sticking tumbling stacks with restitution gain no energy") {
  for (double e : {0.0, 0.5, 0.9})
    for (unsigned seed : {1u, 2u, 3u}) {
      ContactProblem p = test::stack(4, 0.5, {0, -1, 0}, 1, seed);
      std::fill(p.restitution.begin(), p.restitution.end(), e);
      const ContactSolution solution = solve(newton("stick-tested"), p);
      CHECK(solution.status == Status::ok);
      const test::Outcome out = test::outcome(p, solution.impulse);
      CHECK(out.energy_change <= 0);
      for (int c = 0; c < p.nc(); ++c) CHECK(out.u[3 * c] > -1e-8);
    }
}

TEST_CASE("a sweep limit that is too short is a nonconverged ending and says so") {
  NewtonOptions options;
  options.sweep_limit = 3;
  const ContactProblem p = test::stack(8, 0.5, {0, -g * h, 0});
  const ContactSolution solution = solve(make_newton(options), p);
  CHECK(solution.status == Status::nonconverged);
  CHECK(solution.iterations == 3);
  CHECK_FALSE(solution.reason.empty());
  CHECK(solution.claimed_residual > 1e-10);
  // One sweep is enough for one contact: a limit that is reached without an approach left is no failure.
  options.sweep_limit = 1;
  CHECK(solve(make_newton(options), test::sphere({1, -10, 0}, Vector3d::Zero())).status == Status::ok);
}

TEST_CASE("a wedge that elastic impacts can never leave ends at the sweep limit") {
  // A sphere squeezed between two walls that both approach it: no velocity separates both.
  NewtonOptions options;
  options.sweep_limit = 200;
  ContactProblem p;
  test::add_body(p, 1, Vector3d::Constant(0.4), {0.1, 0, 0});
  test::add_contact(p, 0, {-1, 0, 0}, -1, {}, test::axes_of({1, 0, 0}), 0, 1);
  test::add_contact(p, 0, {1, 0, 0}, -1, {}, test::axes_of({-1, 0, 0}), 0, 1);
  p.offset[0] = p.offset[3] = -1;
  CHECK(solve(make_newton(options), p).status == Status::nonconverged);
}

TEST_CASE("no contact, a separating contact and a resting one ask Newton for no impulse") {
  for (const char* variant : {"uncapped", "stick-tested"}) {
    ContactProblem none;
    test::add_body(none, 1, Vector3d::Ones(), {0, -1, 0});
    const ContactSolution nothing = solve(newton(variant), none);
    CHECK(nothing.status == Status::ok);
    CHECK(nothing.impulse.empty());
    for (const Vector3d& v : {Vector3d(3, 1, 0), Vector3d(3, 0, 1)}) {
      const ContactSolution solution = solve(newton(variant), test::sphere(v, Vector3d::Zero()));
      CHECK(solution.status == Status::ok);
      CHECK(solution.impulse == std::vector<double>(3, 0.0));
    }
  }
}

TEST_CASE("NaN or infinity anywhere in the data ends Newton's sweeps as not_finite without an impulse") {
  for (double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (int place = 0; place < 6; ++place) {
      ContactProblem p = test::sphere({1, -10, 0}, Vector3d::Zero());
      (place == 0   ? p.M.values[0]
       : place == 1 ? p.J.values[0]
       : place == 2 ? p.v_minus[1]
       : place == 3 ? p.offset[0]
       : place == 4 ? p.mu[0]
                    : p.restitution[0]) = bad;
      const ContactSolution solution = solve(newton("uncapped"), p);
      CHECK(solution.status == Status::not_finite);
      CHECK(solution.impulse == std::vector<double>(3, 0.0));
      CHECK_FALSE(solution.reason.empty());
    }
  ContactProblem p = test::sphere({1, -10, 0}, Vector3d::Zero());
  p.M.values[0] = -1;
  CHECK(solve(newton("uncapped"), p).status == Status::singular);
}

TEST_CASE("Newton's answer does not change with the units or with a turn of the tangents") {
  for (const char* variant : {"uncapped", "stick-tested"}) {
    const ContactProblem p = test::stack(3, 0.3, {0.02, -g * h, 0.01}, 0.02, 5);
    const test::Outcome out = test::outcome(p, solve(newton(variant), p).impulse);

    ContactProblem grams = p;  // masses x 1000, time x 10: velocities / 10
    for (double& m : grams.M.values) m *= 1000;
    for (double& v : grams.v_minus) v /= 10;
    const test::Outcome other = test::outcome(grams, solve(newton(variant), grams).impulse);
    for (int i = 0; i < p.nv(); ++i) CHECK(std::abs(10 * other.v[i] - out.v[i]) < 1e-12);

    ContactProblem turned = p;
    const double c = std::cos(0.7), s = std::sin(0.7);
    for (int e = 0; e < static_cast<int>(turned.J.block.size()); ++e) {
      auto J = turned.J.entry(e);
      const Eigen::RowVectorXd t1 = J.row(1), t2 = J.row(2);
      J.row(1) = c * t1 + s * t2;
      J.row(2) = c * t2 - s * t1;
    }
    const test::Outcome rotated = test::outcome(turned, solve(newton(variant), turned).impulse);
    for (int i = 0; i < p.nv(); ++i) CHECK(std::abs(rotated.v[i] - out.v[i]) < 1e-10);
  }
}

TEST_CASE("Newton's answer is the same whether bodies come as blocks of their own or as one tree") {
  for (const char* variant : {"uncapped", "stick-tested"}) {
    const ContactProblem p = test::stack(3, 0.3, {0.02, -g * h, 0.01}, 0.02, 5);
    const test::Outcome apart = test::outcome(p, solve(newton(variant), p).impulse);
    const ContactProblem tree = test::one_block(p);
    const test::Outcome together = test::outcome(tree, solve(newton(variant), tree).impulse);
    for (int i = 0; i < p.nv(); ++i) CHECK(std::abs(apart.v[i] - together.v[i]) < 1e-12);
  }
}

TEST_CASE("the referee upholds every claim of Newton's method and refutes a disturbed one") {
  Referee referee;
  std::vector<double> v_plus;
  std::mt19937 generator(2);
  for (const char* variant : {"uncapped", "stick-tested"}) {
    const ContactMethod method = newton(variant);
    for (int i = 0; i < 100; ++i) {
      const ContactProblem p = i < 90 ? test::random_impact(generator) : test::stack(1 + i % 5, 0.5, {0, -1, 0}, 1, i);
      ContactSolution solution = solve(method, p);
      REQUIRE(solution.status == Status::ok);
      CHECK(Referee::holds(referee.check(p, solution, newton_law(), v_plus), 1e-9));
      for (double& r : solution.impulse) r *= 1 - 1e-6;
      CHECK_FALSE(Referee::holds(referee.check(p, solution, newton_law(), v_plus), 1e-9));
    }
  }
}

TEST_CASE("bodies a million times apart in mass stop approaching all the same") {
  for (const char* variant : {"uncapped", "stick-tested"}) {
    ContactProblem p = test::stack(2, 0.5, {0, -g * h, 0});
    p.M.block(0) *= 1e6;
    const ContactSolution solution = solve(newton(variant), p);
    CHECK(solution.status == Status::ok);
    Referee referee;
    std::vector<double> v_plus;
    CHECK(referee.check(p, solution, newton_law(), v_plus).model <= 1e-9);
  }
}

TEST_CASE("velocities beyond the range of doubles are not passed off as an answer") {
  for (const char* variant : {"uncapped", "stick-tested"}) {
    const ContactProblem p = test::sphere({1e200, -1e200, 0}, Vector3d::Zero());
    const ContactSolution solution = solve(newton(variant), p);
    for (double r : solution.impulse) CHECK(std::isfinite(r));
  }
  ContactProblem p = test::sphere({1, -1.7e308, 0}, Vector3d::Zero(), 0.5, 1);
  const ContactSolution solution = solve(newton("uncapped"), p);
  CHECK(solution.status == Status::not_finite);
  CHECK(solution.impulse == std::vector<double>(3, 0.0));
}

TEST_CASE("Newton's method solves the same problem twice to the last bit, after others as before") {
  const ContactProblem p = test::stack(4, 0.5, {0, -g * h, 0}, 0.01);
  const ContactMethod method = newton("stick-tested");
  const std::vector<double> first = solve(method, p).impulse;
  solve(method, test::sphere({1, -10, 0}, Vector3d::Zero()));
  CHECK(solve(method, p).impulse == first);
}

TEST_CASE("an approach that is left is claimed as a fraction of the fastest before, be it the body's or the ground's") {
  // One sweep over the corners of a box that lands tilted leaves some.
  ContactProblem falls = test::box(0.3, {0.1, -2, 0}, {0.5, 0, -1}), risen = falls;
  risen.v_minus[1] = 0;
  for (int c = 0; c < 4; ++c) risen.offset[3 * c] = -2;
  for (const ContactProblem& p : {falls, risen}) {
    NewtonOptions options;
    options.sweep_limit = 1;
    ContactSolution solution;
    make_newton(options)(p, solution);
    CHECK(solution.status == Status::nonconverged);
    const test::Outcome after = test::outcome(p, solution.impulse);
    double before = 0, left = 0;
    for (int c = 0; c < 4; ++c) {
      before = std::max(before, -after.u_minus[3 * c]);
      left = std::max(left, -after.u[3 * c]);
    }
    CHECK(before == Approx(2 + 0.5 * 0.5 + 0.5));  // corners half a metre out, that come down by the spins, too
    CHECK(left > 0.01);
    CHECK(solution.claimed_residual == Approx(left / before));
  }
}
