// Contacts that give way: closed forms of one contact, and what regularisation does to more of them.

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "contact/softness.h"
#include "methods/registry.h"
#include "methods/soft_contacts.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double m = 4.0 / 3 * M_PI, W_n = 1 / m, W_t = 3.5 / m;  // of the sphere in problems.h, radius 1

double rms() { return std::sqrt(W_n * W_n + 2 * W_t * W_t) / 3; }

/// Standard options but for some.
template <class Change>
MethodOptions with(const Change& change) {
  MethodOptions options;
  change(options);
  return options;
}
MethodOptions sap(double sigma = 1e-3, double beta = 1) {
  return with([=](MethodOptions& o) {
    o.sigma = sigma;
    o.beta = beta;
  });
}
MethodOptions variant(const char* name) {
  return with([=](MethodOptions& o) { o.variant = name; });
}

struct Answer {
  ContactSolution solution;
  std::vector<double> v_plus, u_plus;
  Residuals residuals;
};

Answer answer(const ContactProblem& p, const MethodOptions& options, const char* method = "soft") {
  Answer out;
  const MethodRow& row = *find_method(method);
  row.make(options)(p, out.solution);
  out.residuals = Referee().check(p, out.solution, row.law, out.v_plus);
  CHECK(out.solution.status == Status::ok);
  CHECK(Referee::holds(out.residuals, 1e-9));
  contact_velocity(p, out.v_plus, out.u_plus);
  return out;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace

// W = diag(W_n, W_t, W_t): r_n (W_n + R_n) = v_n, r_t (W_t + R_t) = -v_t, and u = -R r is left.
TEST_CASE("a sphere that sticks goes on by R r") {
  const double v_n = 2, v_t = 0.3;
  const double R_n = rms() / (4 * M_PI * M_PI), R_t = 1e-3 * rms();
  const Answer got = answer(sphere({v_t, -v_n, 0}, {0, 0, 0}), sap());
  CHECK(got.solution.impulse[0] == Approx(v_n / (W_n + R_n)).epsilon(1e-13));
  CHECK(got.solution.impulse[1] == Approx(-v_t / (W_t + R_t)).epsilon(1e-13));
  CHECK(got.u_plus[0] == Approx(-R_n * v_n / (W_n + R_n)).epsilon(1e-9));
  CHECK(got.u_plus[1] == Approx(R_t * v_t / (W_t + R_t)).epsilon(1e-9));

  const double d = 0.8, impratio = 5, R = (1 - d) / d * W_n;
  const Answer other = answer(sphere({v_t, -v_n, 0}, {0, 0, 0}), with([&](MethodOptions& o) {
                                o.variant = "mujoco";
                                o.impedance = d;
                                o.impratio = impratio;
                              }));
  CHECK(other.solution.impulse[0] == Approx(v_n / (W_n + R)).epsilon(1e-13));
  CHECK(other.solution.impulse[1] == Approx(-v_t / (W_t + R / impratio)).epsilon(1e-13));
}

// r = r_n (1, -mu) with r.((W + R) r + q) = 0: r_n = (v_n + mu v_t) / (W_n + R_n + mu^2 (W_t + R_t)). It presses by mu
// v_t more than Coulomb's law, and leaves the ground with u_n = mu u_t - R_n r_n - mu^2 R_t r_n.
TEST_CASE("a sphere that slides is lifted") {
  const double v_n = 1, v_t = 20, mu = 0.4;
  const Answer got = answer(sphere({v_t, -v_n, 0}, {0, 0, 0}, mu), sap());
  const double R_n = rms() / (4 * M_PI * M_PI), R_t = 1e-3 * rms();
  const double r_n = (v_n + mu * v_t) / (W_n + R_n + mu * mu * (W_t + R_t));
  CHECK(got.solution.impulse[0] == Approx(r_n).epsilon(1e-13));
  CHECK(got.solution.impulse[1] == Approx(-mu * r_n).epsilon(1e-13));
  CHECK(got.u_plus[0] > 0);
  CHECK(got.u_plus[0] == Approx(mu * got.u_plus[1] - (R_n + mu * mu * R_t) * r_n).epsilon(1e-9));
}

TEST_CASE("a contact that is given twice gives way half as much") {
  ContactProblem twice = sphere({0.3, -2, 0}, {0, 0, 0});
  add_contact(twice, 0, {0, -1, 0}, -1, {}, ground_axes(), 0.60581);
  const Answer got = answer(twice, sap());
  const double R_n = rms() / (4 * M_PI * M_PI);
  CHECK(got.solution.impulse[0] == Approx(got.solution.impulse[3]).epsilon(1e-13));
  CHECK(2 * got.solution.impulse[0] == Approx(2 / (W_n + R_n / 2)).epsilon(1e-12));
}

// Poisson: r_n of the first phase times 1 + e; then nothing approaches, and R r_n is no matter.
TEST_CASE("a soft contact gives back e of what it took") {
  const double v_n = 2, e = 0.5, R_n = rms() / (4 * M_PI * M_PI);
  const Answer got = answer(sphere({0, -v_n, 0}, {0, 0, 0}, 0.5, e), sap());
  const double r_n = (1 + e) * v_n / (W_n + R_n);
  CHECK(got.solution.impulse[0] == Approx(r_n).epsilon(1e-13));
  CHECK(got.u_plus[0] == Approx(r_n * W_n - v_n).epsilon(1e-12));
}

TEST_CASE("a limit of a joint gives way as its W_nn says, and R is no matter of the tangents that it has not") {
  ContactProblem p;
  const int b = p.M.add_block(1);
  p.M.block(b)(0, 0) = 0.25;
  p.v_minus.push_back(-1);
  p.J.add_band();
  p.J.entry(p.J.add_entry(b, 1))(0, 0) = 1;
  p.offset.assign(3, 0.0);
  p.mu.push_back(0);
  p.restitution.push_back(0);
  const Answer got = answer(p, sap());
  CHECK(got.u_plus[0] == Approx(-1 / (1 + 4 * M_PI * M_PI)).epsilon(1e-12));
}

TEST_CASE("a compliance that is asked for is the least that contacts have") {
  const Answer got = answer(sphere({0, -1, 0}, {0, 0, 0}), with([](MethodOptions& o) { o.compliance = 3 * W_n; }));
  CHECK(got.u_plus[0] == Approx(-0.75).epsilon(1e-12));
}

// (2) of soft.cpp tends to the program of `convex` without the bound as R goes to zero, by an amount in proportion.
TEST_CASE("as R goes to zero the motion tends to that of the convex program without a bound, in proportion to R") {
  for (const ContactProblem& p : {box(0.5, {0.3, -1, 0.1}, {0.2, 0.5, -0.3}), stack(3, 0.4, {0.5, -1, 0}, 0.3)}) {
    const Answer rigid = answer(p, with([](MethodOptions& o) { o.compression_bound = false; }), "convex");
    double last = 0;
    for (const double part : {1e-3, 1e-4, 1e-5}) {
      const Answer soft = answer(p, sap(part, 2 * M_PI * std::sqrt(part)));
      const double apart = distance(soft.v_plus, rigid.v_plus);
      CHECK(apart > 0);
      if (last > 0) CHECK(apart / last == Approx(0.1).epsilon(0.15));
      last = apart;
    }
  }
}

TEST_CASE("a soft answer is the only one: other orders and units of the same event give it again") {
  const ContactProblem p = stack(6, 0.4, {0.4, -1, 0.2}, 0.5, 3);
  const Answer first = answer(p, sap());
  // Contacts from the last to the first.
  ContactProblem turned = p;
  turned.J.clear();
  for (int c = p.nc() - 1; c >= 0; --c) {
    turned.J.add_band();
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e)
      turned.J.entry(turned.J.add_entry(p.J.block[e], 6)) = p.J.entry(e);
  }
  const Answer other = answer(turned, sap());
  CHECK(distance(first.v_plus, other.v_plus) <= 1e-12);
  for (int c = 0; c < p.nc(); ++c)
    for (int i = 0; i < 3; ++i)
      CHECK(first.solution.impulse[3 * c + i] == Approx(other.solution.impulse[3 * (p.nc() - 1 - c) + i]).margin(1e-9));
  // Masses in tonnes; velocities in furlongs a fortnight.
  ContactProblem units = p;
  for (double& x : units.M.values) x *= 1e-3;
  for (double& x : units.v_minus) x *= 6012;
  const Answer scaled = answer(units, sap());
  for (std::size_t i = 0; i < first.v_plus.size(); ++i)
    CHECK(scaled.v_plus[i] / 6012 == Approx(first.v_plus[i]).margin(1e-12));
}

TEST_CASE("soft solves stacks of any height, at rest and perturbed, and mass ratios of a million") {
  for (const char* rule : {"sap", "mujoco"})
    for (const int boxes : {1, 16, 64})
      for (const double random : {0.0, 0.3}) {
        INFO(rule << ", " << boxes << " boxes, " << random << " m/s");
        const Answer got = answer(stack(boxes, 0.5, {0, -0.0098, 0}, random), variant(rule));
        CHECK(got.solution.iterations <= (random == 0 ? 1 : 20));  // 18 at most
        CHECK(got.residuals.energy_gain <= 0);
      }
  for (const double ratio : {1e6, 1e-6}) {
    ContactProblem p = stack(2, 0.5, {0, -0.0098, 0});
    p.M.block(1) *= ratio;
    answer(p, sap());
  }
}

TEST_CASE("the referee computes R itself: what was solved with another one is refused") {
  Answer got = answer(box(0.5, {0.3, -1, 0.1}), sap());
  std::vector<double> v;
  got.solution.as<SoftWitness>().softness.sigma = 1.1e-3;
  const ContactProblem p = box(0.5, {0.3, -1, 0.1});
  CHECK_FALSE(Referee::holds(Referee().check(p, got.solution, soft_law(), v), 1e-9));
  got.solution.witness = NoWitness{};  // the standard terms
  CHECK(Referee::holds(Referee().check(p, got.solution, soft_law(), v), 1e-9));
}

// A limit of a joint that rests by rounding hides behind its own size how far from an answer the contact beside it is.
TEST_CASE("a soft contact is solved beside a limit at which there is nothing but rounding") {
  const ContactProblem p = read_contact_problem(TEST_DATA "/events/limit_beside_push.hdf5").problem;
  for (const char* rule : {"sap", "mujoco"}) CHECK(answer(p, variant(rule)).solution.iterations <= 12);
}

TEST_CASE(
    "impulses that lead astray begin anew: stiff stacks with much friction take no more than some tens of steps") {
  const Answer got = answer(stack(32, 1.2, {0.2, -0.3, 0.1}, 1, 8), sap(1e-3, 0.01));
  CHECK(got.solution.iterations <= 48);
}

// Of two spheres one comes at 1e6 m/s, and the other's normal impulse is off by a millionth.
TEST_CASE("what an island's impulses are off by is held against that island, however fast another one is") {
  ContactProblem p;
  for (const double speed : {1e6, 1e-2}) add_body(p, m, Vector3d::Constant(0.4 * m), {0, -speed, 0});
  for (const int body : {0, 1}) add_contact(p, body, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  std::vector<double> impulse = answer(p, sap()).solution.impulse, weight, v, u_minus, u_plus;
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  contact_weights(p, factor, weight);
  SoftContacts contacts;
  contacts.describe(p, factor, weight, Softness{});
  contact_velocity(p, p.v_minus, u_minus);
  const std::vector<double> open(2, 0.0);
  const auto residual = [&] {
    apply_impulse(p, factor, impulse, v);
    contact_velocity(p, v, u_plus);
    return contacts.residual(impulse, u_plus, u_minus, open);
  };
  CHECK(residual() < 1e-9);
  impulse[3] *= 1 + 1e-6;
  CHECK(residual() > 1e-7);  // 1e-14 of what the other one is about
}

// A ball under another of three times its mass, both at 2 m/s, without friction; the ground returns e, the balls
// between them nothing. Of (W + R) r = (2, 0) with W = [1 -1; -1 4/3] the ground's r_1 is given back by theta e:
//   E(theta) = r.(u_c + u-) / 2 + theta e r_1 u_1 + (theta e r_1)^2 / 2,   u_c = -R r
// which at e = 1 is zero at theta = 0.67, and nowhere from 0 to 1 at e = 0.5.
TEST_CASE("what soft contacts give back is scaled by what gains no energy on the way, where they have given way") {
  const double R = std::sqrt(1 + 2 * 3.5 * 3.5) / 3 / (4 * M_PI * M_PI), R_1 = R, R_2 = 4. / 3 * R;
  const double determinant = (1 + R_1) * (4. / 3 + R_2) - 1, r_1 = 2 * (4. / 3 + R_2) / determinant,
               r_2 = 2 / determinant;
  const double constant = 0.5 * (r_1 * (-R_1 * r_1 - 2) - r_2 * R_2 * r_2), linear = -R_1 * r_1 * r_1,
               quadratic = 0.5 * r_1 * r_1;
  const double scale = (-linear + std::sqrt(linear * linear - 4 * quadratic * constant)) / (2 * quadratic);
  CHECK(scale == Approx(0.67).margin(0.01));
  for (const double e : {1.0, 0.5}) {
    ContactProblem p;
    for (const double mass : {1.0, 3.0}) add_body(p, mass, Vector3d::Constant(0.4 * mass), {0, -2, 0});
    add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0, e);
    add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, ground_axes(), 0, 0);
    ContactSolution solution;
    find_method("soft")->make({})(p, solution);
    INFO("e = " << e);
    CHECK(solution.status == Status::ok);
    CHECK(solution.restitution_scale == Approx(e == 1 ? scale : 1).epsilon(1e-9));
  }
}

TEST_CASE("velocities whose squares overflow are no answer of soft, which says so and gives no impulse") {
  ContactSolution solution;
  find_method("soft")->make({})(sphere({1e200, -1e200, 0}, {0, 0, 0}), solution);
  CHECK(solution.status == Status::not_finite);
  CHECK(solution.reason == "overflow in Newton's method");
  CHECK(solution.impulse == std::vector<double>(3, 0.0));
}

TEST_CASE("soft begins with the event before, and not with one before an event with restitution") {
  MethodOptions options;
  options.warm_start = true;
  options.warm_starts = std::make_shared<Counter>(0);
  const ContactMethod method = find_method("soft")->make(options);
  const auto starts = [&](double slip, double e) {
    ContactSolution solution;
    const long before = *options.warm_starts;
    method(sphere({slip, -0.5, 0}, {0, 0, 0}, 0.2, e), solution);
    CHECK(solution.status == Status::ok);
    return *options.warm_starts - before;
  };
  CHECK(starts(2, 0) == 0);
  starts(1.9, 0.5);
  CHECK(starts(1.8, 0) == 0);
  CHECK(starts(1.7, 0) == 1);
}
