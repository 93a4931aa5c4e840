#include "contact/referee.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "problems.h"

using namespace cb;
using Eigen::Vector3d;

namespace {

constexpr double g = 9.8, h = 1e-3;

/// The exact answer of a solid sphere's impact (lib/evaluation/sphere_impact.h): s = slip, v_n = approach.
/// Sticks iff |s| <= 3.5 mu v_n with J_t = (2/7) m |s|, else J_t = mu m v_n; always J_n = m v_n.
std::vector<double> sphere_impulse(const ContactProblem& p) {
  const double m = p.M.block(0)(0, 0), mu = p.mu[0];
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  const double slip = std::hypot(u[1], u[2]), v_n = -u[0];
  const double J_t = slip <= 3.5 * mu * v_n ? 2.0 / 7.0 * m * slip : mu * m * v_n;
  return {m * v_n, slip > 0 ? -J_t * u[1] / slip : 0, slip > 0 ? -J_t * u[2] / slip : 0};
}

double law_residual(const ContactProblem& p, const std::vector<double>& r) {
  ContactSolution solution;
  solution.impulse = r;
  std::vector<double> v_plus;
  Referee referee;
  return referee.check(p, solution, newton_law(), v_plus).law.value();
}

/// A cube that slides along t1 at speed v on four corners during one step: each carries m g h / 4.
struct SlidingBox {
  ContactProblem problem;
  ContactSolution solution;
};
SlidingBox sliding_box(double v, double mu) {
  SlidingBox box{test::box(mu, {v, -g * h, 0}), {}};
  // The friction at the base, 0.5 m below the centre, tips the box: torque mu m g h / 2 about -z is balanced by moving
  // load to the front pair (x = +0.5): front + rear = m g h, (front - rear) / 2 = mu m g h / 2.
  const double front = (g * h + mu * g * h) / 4, rear = (g * h - mu * g * h) / 4;
  for (int c = 0; c < 4; ++c) {
    const double n = c < 2 ? rear : front;
    box.solution.impulse.insert(box.solution.impulse.end(), {n, -mu * n, 0});
  }
  return box;
}

}  // namespace

TEST_CASE("the exact impact of a sphere satisfies Coulomb's law, sticking and sliding") {
  for (const Vector3d& v : {Vector3d(5, -10, 0), Vector3d(20, -3, 0), Vector3d(3, -2, 1)}) {
    const ContactProblem p = test::sphere(v, {0, 0, -0.3});
    CHECK(law_residual(p, sphere_impulse(p)) < 1e-15);
  }
}

TEST_CASE("what a referee found of one event says nothing of the next, of other masses or contacts") {
  const ContactProblem p = test::sphere({5, -10, 0}, {0, 0, -0.3});
  ContactProblem heavy = p, long_arm = p;
  for (double& x : heavy.M.values) x *= 2;
  for (std::size_t i = 0; i < p.J.values.size(); i += 2) long_arm.J.values[i] *= 2;
  Referee kept;
  const ContactProblem* const events[] = {&p, &heavy, &long_arm, &p};
  for (const ContactProblem* next : events) {
    ContactSolution solution;
    solution.impulse = sphere_impulse(p);
    solution.impulse[0] *= 1.01;
    std::vector<double> v_kept, v_new;
    const Residuals again = kept.check(*next, solution, newton_law(), v_kept);
    const Residuals afresh = Referee().check(*next, solution, newton_law(), v_new);
    CHECK(again.law.value() == afresh.law.value());
    CHECK(again.model == afresh.model);
    CHECK(v_kept == v_new);
  }
}

TEST_CASE("friction that is 0.1 % too strong does not pass") {
  const ContactProblem sphere = test::sphere({20, -3, 0}, {0, 0, 0});
  std::vector<double> r = sphere_impulse(sphere);
  r[1] *= 1.001;
  CHECK(law_residual(sphere, r) > 1e-5);

  SlidingBox box = sliding_box(0.05, 0.1);
  CHECK(law_residual(box.problem, box.solution.impulse) < 1e-14);
  for (int c = 0; c < 4; ++c) box.solution.impulse[3 * c + 1] *= 1.001;
  CHECK(law_residual(box.problem, box.solution.impulse) > 1e-5);
}

TEST_CASE("any perturbed impulse is found out in proportion") {
  const ContactProblem p = test::sphere({20, -3, 0}, {0, 0, 0});
  const std::vector<double> exact = sphere_impulse(p);
  for (int i = 0; i < 3; ++i)
    for (double d : {1e-3, 1e-6, 1e-9}) {
      std::vector<double> r = exact;
      r[i] += d * exact[0];
      const double residual = law_residual(p, r);
      CHECK(residual > 0.02 * d);
      CHECK(residual < 10 * d);
    }
}

TEST_CASE("the law residual does not depend on the units of mass, length and time") {
  const double mass = 1e3, length = 1e-3, time = 60;
  ContactProblem p = test::sphere({20, -3, 0}, {0, 0, -0.3});
  std::vector<double> r = sphere_impulse(p);
  r[1] *= 1.01;
  const double reference = law_residual(p, r);
  auto M = p.M.block(0);
  M.topLeftCorner<3, 3>() *= mass;
  M.bottomRightCorner<3, 3>() *= mass * length * length;
  p.J.entry(0).rightCols<3>() *= length;
  for (int i = 0; i < 3; ++i) p.v_minus[i] *= length / time;
  for (int i = 3; i < 6; ++i) p.v_minus[i] /= time;
  for (double& x : r) x *= mass * length / time;
  CHECK(law_residual(p, r) == Approx(reference).epsilon(1e-12));
}

TEST_CASE("energy change is the difference of the kinetic energies") {
  ContactProblem p = test::stack(3, 0.5, {0.1, -1, 0.2}, 0.3);
  ContactSolution solution;
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(0, 0.1);
  for (int i = 0; i < 3 * p.nc(); ++i) solution.impulse.push_back(uniform(generator));
  std::vector<double> v_plus;
  const Residuals out = Referee().check(p, solution, newton_law(), v_plus);
  CHECK(out.energy_gain ==
        Approx(0.5 * quadratic_form(p.M, v_plus) - 0.5 * quadratic_form(p.M, p.v_minus)).epsilon(1e-12));
  CHECK(out.momentum < 1e-14);
}

TEST_CASE("a sliding box passes as the convex program's optimum, with its certificate, and fails when spoiled") {
  const double mu = 0.1, v = 0.05;
  SlidingBox box = sliding_box(v, mu);
  ContactSolution& s = box.solution;
  // y must vanish along the impulse: y_n = mu |y_t| on every corner. eta = 0, s = mu |u_t| does it, as u_n = 0.
  ConvexWitness& proof = s.as<ConvexWitness>();
  proof.bounded = true;
  proof.eta.assign(4, 0.0);
  proof.frictionless.assign(4, g * h / 4);
  proof.kappa_dual = {0, 1, 0, 0, 0, 0};  // lifting the box at 1 m/s: N z = 1, so every f has the same sum
  proof.epsilon = 1e-12;
  std::vector<double> v_plus;
  Referee referee;
  Residuals out = referee.check(box.problem, s, convex_law(), v_plus);
  CHECK(Referee::holds(out, 1e-9));
  CHECK(std::abs(*out.gap) < 1e-17);
  CHECK(*out.infeasibility < 1e-14);
  CHECK(v_plus[0] == Approx(v - mu * g * h).epsilon(1e-12));

  SECTION("frictionless impulses are feasible but not optimal: the gap is mu m g h |u_t|") {
    ContactSolution frictionless = s;
    for (int c = 0; c < 4; ++c) {
      frictionless.impulse[3 * c] = g * h / 4;
      frictionless.impulse[3 * c + 1] = 0;
    }
    out = referee.check(box.problem, frictionless, convex_law(), v_plus);
    CHECK(*out.gap == Approx(mu * g * h * v).epsilon(1e-10));
    CHECK_FALSE(Referee::holds(out, 1e-9));
  }
  SECTION("friction beyond the cone is infeasible") {
    for (int c = 0; c < 4; ++c) s.impulse[3 * c + 1] *= 1.001;
    out = referee.check(box.problem, s, convex_law(), v_plus);
    CHECK_FALSE(Referee::holds(out, 1e-9));
  }
  SECTION("more normal impulse than the frictionless sum is infeasible") {
    for (int c = 0; c < 4; ++c) s.impulse[3 * c] *= 1.001;
    out = referee.check(box.problem, s, convex_law(), v_plus);
    CHECK(*out.infeasibility > 1e-5);
  }
  SECTION("a bound that is not the least sum is found out") {
    s.as<ConvexWitness>().frictionless.assign(4, 1.01 * g * h / 4);
    out = referee.check(box.problem, s, convex_law(), v_plus);
    CHECK(*out.infeasibility > 1e-5);
  }
  SECTION("a proof of the least sum must not count touching contacts too dearly") {
    s.as<ConvexWitness>().kappa_dual[1] = 1.01;  // N z = 1.01 > 1 on all four
    out = referee.check(box.problem, s, convex_law(), v_plus);
    CHECK(*out.infeasibility > 1e-3);
  }
  SECTION("NaN is never accepted") {
    s.impulse[4] = std::nan("");
    out = referee.check(box.problem, s, convex_law(), v_plus);
    CHECK_FALSE(out.finite);
    CHECK_FALSE(Referee::holds(out, 1e-9));
  }
}

TEST_CASE("the proof of the least sum says nothing of contacts that separate") {
  // A cube at rest on four corners, and a second contact point per body that already moves apart: z lifts the cube at
  // 1 m/s, and any value of N z is right where the frictionless answer separates.
  ContactProblem p = test::box(0.1, {0, -g * h, 0});
  test::add_body(p, 1, Vector3d::Ones(), {0, 1, 0});
  test::add_contact(p, 1, {0, -0.5, 0}, -1, {}, test::ground_axes(), 0.1);
  ContactSolution s;
  s.as<ConvexWitness>().bounded = true;
  s.impulse = std::vector<double>(15, 0.0);
  for (int c = 0; c < 4; ++c) s.impulse[3 * c] = g * h / 4;
  s.as<ConvexWitness>().eta.assign(5, 0.0);
  s.as<ConvexWitness>().frictionless = {g * h / 4, g * h / 4, g * h / 4, g * h / 4, 0};
  s.as<ConvexWitness>().kappa_dual = {0, 1, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0};
  s.as<ConvexWitness>().epsilon = 1e-12;
  std::vector<double> v_plus;
  const Residuals out = Referee().check(p, s, convex_law(), v_plus);
  CHECK(Referee::holds(out, 1e-9));
}

TEST_CASE("a contact opens where its velocity is beyond rounding, and touches where f itself is no better") {
  // A cube at rest on four corners beside a wall that it leaves at 3e-10 of its size; z counts the wall for 2.
  ContactProblem p = test::box(0.1, {0, -g * h, 0});
  test::add_contact(p, 0, {0, -0.5, 0}, -1, {}, test::ground_axes(), 0.1);
  p.J.entry(p.J.band[4]).row(0).setZero();
  p.J.entry(p.J.band[4])(0, 0) = 1;
  p.offset[12] = 3e-10 * g * h;
  ContactSolution s;
  s.as<ConvexWitness>().bounded = true;
  s.impulse = std::vector<double>(15, 0.0);
  s.as<ConvexWitness>().eta.assign(5, 0.0);
  s.as<ConvexWitness>().frictionless = {g * h / 4, g * h / 4, g * h / 4, g * h / 4, 0};
  for (int c = 0; c < 4; ++c) s.impulse[3 * c] = s.as<ConvexWitness>().frictionless[c];
  s.as<ConvexWitness>().kappa_dual = {2, 1, 0, 0, 0, 0};
  s.as<ConvexWitness>().epsilon = 1e-12;
  std::vector<double> v_plus;
  CHECK(Referee::holds(Referee().check(p, s, convex_law(), v_plus), 1e-9));
  // Impulses that leave the cube with 7e-10 of it prove nothing of what is slower.
  for (int c = 0; c < 4; ++c) s.as<ConvexWitness>().frictionless[c] *= 1 + 7e-10;
  CHECK_FALSE(Referee::holds(Referee().check(p, s, convex_law(), v_plus), 1e-9));
}

TEST_CASE("the polygon's answer of a sliding box passes, and 0.1 % more friction does not") {
  const double mu = 0.1, v = 0.05;
  SlidingBox box = sliding_box(v, mu);
  ContactSolution& s = box.solution;
  s.as<PolygonWitness>().k = 8;
  s.as<PolygonWitness>().z.assign(10 * 4, 0.0);
  for (int c = 0; c < 4; ++c) {
    s.as<PolygonWitness>().z[c] = s.impulse[3 * c];
    s.as<PolygonWitness>().z[4 + 8 * c + 4] = mu * s.impulse[3 * c];  // direction 4 of 8 is -t1
    s.as<PolygonWitness>().z[36 + c] = v - mu * g * h;                // lam = slip speed afterwards
  }
  std::vector<double> v_plus;
  Referee referee;
  Residuals out = referee.check(box.problem, s, anitescu_potra_law(), v_plus);
  CHECK(out.model < 1e-14);
  for (int c = 0; c < 4; ++c) {
    s.as<PolygonWitness>().z[4 + 8 * c + 4] *= 1.001;
    s.impulse[3 * c + 1] *= 1.001;
  }
  out = referee.check(box.problem, s, anitescu_potra_law(), v_plus);
  CHECK(out.model > 1e-5);
}

TEST_CASE("islands are the connected components, numbered by their first contact") {
  ContactProblem p;
  for (int b = 0; b < 5; ++b) test::add_body(p, 1, Vector3d::Ones(), Vector3d::Zero());
  const auto axes = test::ground_axes();
  test::add_contact(p, 3, {0, -1, 0}, -1, {}, axes, 0.5);
  test::add_contact(p, 4, {0, -1, 0}, 1, {0, 1, 0}, axes, 0.5);
  test::add_contact(p, 0, {0, -1, 0}, 3, {0, 1, 0}, axes, 0.5);
  Islands islands;
  find_islands(p, islands);
  CHECK(islands.count == 2);
  CHECK(islands.of_contact == std::vector<int>{0, 1, 0});
  CHECK(islands.of_block == std::vector<int>{0, 1, -1, 0, 1});

  ContactProblem one;
  one.M.add_block(6);
  for (int c = 0; c < 2; ++c) {
    one.J.add_band();
    one.J.add_entry(0, 6);
    one.mu.push_back(0.5);
  }
  find_islands(one, islands);
  CHECK(islands.count == 1);
  CHECK(islands.of_contact == std::vector<int>{0, 0});
  CHECK(islands.of_block == std::vector<int>{0});
  one.J.add_band();  // between fixed bodies
  one.mu.push_back(0.5);
  find_islands(one, islands);
  CHECK(islands.count == 2);
  CHECK(islands.of_contact == std::vector<int>{0, 0, 1});
  CHECK(islands.of_block == std::vector<int>{0});
}

TEST_CASE("the Delassus matrix and its diagonal blocks are J M^-1 J^T") {
  const ContactProblem p = test::stack(3, 0.5, {0, -1, 0}, 0.1);
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * p.nc(), p.nv()), M = Eigen::MatrixXd::Zero(p.nv(), p.nv());
  for (int b = 0; b < p.M.blocks(); ++b) M.block(p.M.first[b], p.M.first[b], 6, 6) = p.M.block(b);
  for (int c = 0; c < p.nc(); ++c)
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e) J.block(3 * c, p.M.first[p.J.block[e]], 3, 6) = p.J.entry(e);
  const Eigen::MatrixXd expected = J * M.inverse() * J.transpose();
  Eigen::MatrixXd W;
  delassus(p, factor, W);
  CHECK((W - expected).norm() < 1e-13 * expected.norm());
  std::vector<Eigen::Matrix3d> diagonal;
  diagonal_blocks(p, factor, diagonal);
  for (int c = 0; c < p.nc(); ++c)
    CHECK((diagonal[c] - expected.block<3, 3>(3 * c, 3 * c)).norm() < 1e-13 * expected.norm());
}

TEST_CASE("a contact's weight is the mean of its diagonal entries of W, whatever it joins, and W_nn without tangents") {
  ContactProblem p;
  for (const int size : {6, 9, 1, 6}) {
    const int b = p.M.add_block(size);
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j) p.M.block(b)(i, j) = i == j ? 4 + i : 1.0 / (1 + i + j);
  }
  const std::vector<std::vector<int>> joins = {{0}, {0, 1}, {1, 3}, {3}, {1}};
  for (const std::vector<int>& blocks : joins) {
    p.J.add_band();
    for (const int b : blocks) {
      auto J = p.J.entry(p.J.add_entry(b, p.M.block_size(b)));
      for (int i = 0; i < J.size(); ++i) J(i % 3, i / 3) = std::cos(7.0 * i + b + static_cast<double>(blocks.size()));
    }
  }
  p.J.add_band();  // a joint at its limit
  p.J.entry(p.J.add_entry(1, 9))(0, 4) = -1;
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  std::vector<Eigen::Matrix3d> W;
  diagonal_blocks(p, factor, W);
  std::vector<double> weight;
  contact_weights(p, factor, weight);
  REQUIRE(static_cast<int>(weight.size()) == p.nc());
  for (int c = 0; c < 5; ++c) CHECK(weight[c] == Approx(W[c].trace() / 3).epsilon(1e-14));
  CHECK(weight[5] == Approx(W[5](0, 0)).epsilon(1e-14));
}

TEST_CASE(
    "with restitution a convex answer holds where nothing approaches and impulses are in their cones, and not else") {
  ContactProblem p = test::sphere({0, -10, 0}, {0, 0, 0});
  p.restitution[0] = 0.5;
  const double m = p.M.block(0)(0, 0);
  ContactSolution solution;
  std::vector<double> v_plus;
  Referee referee;
  solution.impulse = {1.5 * m * 10, 0, 0};
  CHECK(Referee::holds(referee.check(p, solution, convex_law(), v_plus), 1e-9));
  CHECK(v_plus[1] == Approx(5));
  solution.impulse = {0.99 * m * 10, 0, 0};  // goes on into the ground
  CHECK_FALSE(Referee::holds(referee.check(p, solution, convex_law(), v_plus), 1e-9));
  solution.impulse = {1.5 * m * 10, 1.6 * p.mu[0] * m * 10, 0};  // outside the cone
  CHECK_FALSE(Referee::holds(referee.check(p, solution, convex_law(), v_plus), 1e-9));
}

namespace {

/// A problem and its exact answer under each of the laws.
struct Claims {
  ContactProblem problem;
  std::vector<ContactSolution> of = std::vector<ContactSolution>(laws().size());
};
/// Appends what `law` claims of sphere c, alone on the ground, which impulse r slides on along x.
void claim(ContactSolution& s, const Law& law, const ContactProblem& p, int c, const std::vector<double>& r) {
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  const double m = p.M.block(c)(0, 0), slip = u[3 * c + 1] + r[1] * 3.5 / m;
  s.impulse.insert(s.impulse.end(), r.begin(), r.end());
  if (law == mirtich_law()) {
    s.as<WorkWitness>().compression.push_back(0.5 * r[0] * u[3 * c]);
    s.as<WorkWitness>().restitution.push_back(0);
    s.as<WorkWitness>().friction.push_back(0.5 * r[1] * (u[3 * c + 1] + slip));
  }
  if (law == convex_law()) {
    s.as<ConvexWitness>().bounded = true;
    s.as<ConvexWitness>().eta.push_back(0);
    s.as<ConvexWitness>().frictionless.push_back(r[0]);
    s.as<ConvexWitness>().kappa_dual.insert(s.as<ConvexWitness>().kappa_dual.end(), {0, 1, 0, 0, 0, 0});
  }
  if (law == anitescu_potra_law()) s.as<PolygonWitness>().k = 4;
}
/// ap's z from impulses along t1 and the slips left.
void polygon(ContactSolution& s, const ContactProblem& p) {
  const int nc = p.nc();
  std::vector<double> v_plus, u;
  BlockCholesky factor;
  factor.factor(p.M);
  apply_impulse(p, factor, s.impulse, v_plus);
  contact_velocity(p, v_plus, u);
  s.as<PolygonWitness>().z.assign(6 * static_cast<std::size_t>(nc), 0.0);
  for (int c = 0; c < nc; ++c) {
    const double r_t = s.impulse[3 * c + 1];
    s.as<PolygonWitness>().z[c] = s.impulse[3 * c];
    s.as<PolygonWitness>().z[nc + 4 * c + (r_t > 0 ? 0 : 2)] = std::abs(r_t);
    s.as<PolygonWitness>().z[5 * nc + c] = std::abs(u[3 * c + 1]);
  }
}

/// A heavy sphere that slides without friction at `fast` m/s, and one of 1 g that lands with slip beside it.
Claims light_beside_heavy(double fast) {
  Claims out;
  ContactProblem& p = out.problem;
  const double masses[] = {1e3, 1e-3}, mus[] = {0, 0.5};
  const Vector3d v[] = {{fast, -0.1, 0}, {2, -0.1, 0}};
  for (int b = 0; b < 2; ++b) {
    test::add_body(p, masses[b], Vector3d::Constant(0.4 * masses[b]), v[b]);
    test::add_contact(p, b, {0, -1, 0}, -1, {}, test::ground_axes(), mus[b]);
  }
  for (int l = 0; l < 4; ++l) {
    for (int b = 0; b < 2; ++b)
      claim(out.of[l], laws()[l], p, b, {-masses[b] * v[b][1], mus[b] * masses[b] * v[b][1], 0});
    if (laws()[l] == anitescu_potra_law()) polygon(out.of[l], p);
  }
  return out;
}

bool held(const ContactProblem& p, const ContactSolution& s, Law law, Residuals* out = nullptr) {
  std::vector<double> v_plus;
  const Residuals residuals = Referee().check(p, s, law, v_plus);
  if (out != nullptr) *out = residuals;
  return Referee::holds(residuals, 1e-9);
}

}  // namespace

TEST_CASE(
    "an error of 1e-6 of a light island's own impulses is found beside one that is heavy and fast, at every speed") {
  for (const double fast : {0.0, 1.0, 1e2, 1e4, 1e6}) {
    for (int l = 0; l < 4; ++l) {
      INFO("law " << l << " at " << fast << " m/s");
      Claims claims = light_beside_heavy(fast);
      ContactSolution& s = claims.of[l];
      Residuals out;
      CHECK(held(claims.problem, s, laws()[l], &out));
      s.impulse[3] *= 1 - 1e-6;  // goes on into the ground
      s.impulse[4] *= 1 - 1e-6;
      if (laws()[l] == anitescu_potra_law()) polygon(s, claims.problem);
      CHECK_FALSE(held(claims.problem, s, laws()[l], &out));
      if (laws()[l] != mirtich_law()) CHECK(out.worst_contact == 1);  // whose balance of works is the island's
      CHECK(out.worst_island == 1);
    }
  }
}

TEST_CASE("friction 1 % too weak on a light island is found by its own gap, whatever moves beside it") {
  for (const double fast : {0.0, 1.0, 1e2, 1e4, 1e6}) {
    Claims claims = light_beside_heavy(fast);
    ContactSolution& s = claims.of[3];
    s.as<ConvexWitness>().epsilon = 1e-12;
    CHECK(held(claims.problem, s, convex_law()));
    s.impulse[4] *= 0.99;  // in the cone, but not the least energy
    Residuals out;
    CHECK_FALSE(held(claims.problem, s, convex_law(), &out));
    CHECK(out.infeasibility.value() < 1e-12);
    CHECK(out.worst_island == 1);
    CHECK(out.island_gap == Approx(0.01 * 0.5 * 1e-3 * 0.1 * (2 - 3.5 * 0.99 * 0.5 * 0.1)).epsilon(1e-6));
  }
}

TEST_CASE("a light box does not hide an error of 1e-6 of its own velocity among heavy ones in its island") {
  ContactProblem p = test::stack(6, 0.5, {0, -g * h, 0});
  for (int b = 0; b < 5; ++b) p.M.block(b) *= 1e6;
  ContactSolution newton, ap;
  for (int c = 0; c < p.nc(); ++c)
    newton.impulse.insert(newton.impulse.end(), {(1 + 1e6 * (5 - c / 4)) * g * h / 4, 0, 0});
  ap = newton;
  ap.as<PolygonWitness>().k = 4;
  polygon(ap, p);
  CHECK(held(p, newton, newton_law()));
  CHECK(held(p, ap, anitescu_potra_law()));
  for (std::size_t c = 20; c < 24; ++c) newton.impulse[3 * c] *= 1 - 1e-6;  // sinks into the box below
  ap.impulse = newton.impulse;
  polygon(ap, p);
  CHECK_FALSE(held(p, newton, newton_law()));
  Residuals out;
  CHECK_FALSE(held(p, ap, anitescu_potra_law(), &out));
  CHECK(out.worst_contact >= 20);
}

TEST_CASE("what the last bits of a common velocity of 1e6 m/s make of an exact answer is no error, in any units") {
  for (const double mass : {1.0, 1e3})
    for (const double time : {1.0, 1.0 / 60})
      for (int l = 0; l < 4; ++l) {
        INFO("law " << l << ", " << mass << " kg, " << time << " s");
        // Two spheres meet at 1e-3 m/s, their common velocity along no axis.
        const double V = 1e6 / time, approach = 1e-3 / time, slip = 2e-3 / time, mu = 0.25;
        const Vector3d n = Vector3d(1, 2, 3).normalized(), t = n.cross(Vector3d::UnitX()).normalized();
        Eigen::Matrix3d axes;
        axes << n.transpose(), t.transpose(), n.cross(t).transpose();
        const auto problem = [&](const Vector3d& common) {
          ContactProblem p;
          for (int b = 0; b < 2; ++b)
            test::add_body(p, mass, Vector3d::Constant(0.4 * mass), common + (1 - b) * (slip * t - approach * n));
          test::add_contact(p, 0, -n, 1, n, axes, mu);
          return p;
        };
        const double r_n = mass * approach / 2, r_t = -mu * r_n, slip_after = slip + 7 * r_t / mass;
        const auto answer = [&](double normal) {
          ContactSolution s;
          s.impulse = {normal * r_n, normal * r_t, 0};
          if (laws()[l] == mirtich_law())
            s.witness = WorkWitness{{-0.5 * r_n * approach}, {0}, {0.5 * r_t * (slip + slip_after)}};
          if (laws()[l] == anitescu_potra_law())
            s.witness = PolygonWitness{4, 0, {normal * r_n, 0, 0, -normal * r_t, 0, slip_after}};
          if (laws()[l] == convex_law()) {
            ConvexWitness proof{true, 0, {}, {0}, {r_n}, std::vector<double>(12, 0.0)};
            Eigen::Map<Vector3d>(&proof.kappa_dual[0]) = n / 2;
            Eigen::Map<Vector3d>(&proof.kappa_dual[6]) = -n / 2;
            s.witness = proof;
          }
          return s;
        };
        const Vector3d common = V * Vector3d(0.6, -0.48, 0.64);
        Residuals still, moving;
        CHECK(held(problem(Vector3d::Zero()), answer(1), laws()[l], &still));
        CHECK(still.model < 1e-14);
        CHECK(held(problem(common), answer(1), laws()[l], &moving));
        CHECK(moving.model > 100 * still.model);  // the bits are lost, and excused
        CHECK_FALSE(held(problem(common), answer(0.99), laws()[l]));
      }
}

TEST_CASE("what epsilon allows is looked at as closely as what it does not") {
  // Two spheres that meet head-on at 1e-3 m/s and then part by what the last bits of 1e6 m/s are in doubt of.
  const auto residuals = [](double common, double epsilon) {
    const Vector3d v = common * Vector3d(0.6, -0.48, 0.64), n = Vector3d(1, 2, 3).normalized();
    Eigen::Matrix3d axes;
    axes << n.transpose(), n.unitOrthogonal().transpose(), n.cross(n.unitOrthogonal()).transpose();
    ContactProblem p;
    test::add_body(p, 1, Vector3d::Constant(0.4), v - 1e-3 * n);
    test::add_body(p, 1, Vector3d::Constant(0.4), v);
    test::add_contact(p, 0, -n, 1, n, axes, 0.25);
    ContactSolution s;
    s.impulse = {0.5e-3 * (1 + 1e-6), 0, 0};
    s.witness = ConvexWitness{false, epsilon, {}, {0}, {}, {}};
    Residuals out;
    CHECK(held(p, s, convex_law(), &out) == (common > 0 || epsilon > 0));
    CHECK(out.infeasibility.value() <= Referee::accepted);
    return out;
  };
  for (const double epsilon : {0.0, 1.0}) {
    CHECK(residuals(0, epsilon).model ==
          Approx(3e-6 / 8).epsilon(1e-3));  // r u / (w r^2), w = 16/3: no bits are in doubt
    CHECK(residuals(1e6, epsilon).model <= Referee::accepted);
  }
}
