#include "methods/mirtich.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "contact/referee.h"
#include "methods/impacts.h"

using namespace cb;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double g = 9.8, h = 1e-3;

ContactSolution solve(const ContactProblem& problem, const MirtichOptions& options = {}) {
  ContactSolution solution;
  make_mirtich(options)(problem, solution);
  return solution;
}

Vector3d vec(const nlohmann::json& j) { return {j[0].get<double>(), j[1].get<double>(), j[2].get<double>()}; }

/// K of a body with K_nt and a turned K_tt.
Matrix3d corner(const Vector3d& arm, double mass, const Vector3d& inertia) {
  Matrix3d cross;
  cross << 0, -arm[2], arm[1], arm[2], 0, -arm[0], -arm[1], arm[0], 0;
  const Matrix3d world = Matrix3d::Identity() / mass - cross * inertia.cwiseInverse().asDiagonal() * cross;
  const Matrix3d axes = test::ground_axes();
  return axes * world * axes.transpose();
}

}  // namespace

TEST_CASE("all 90 reference impacts are met to 1e-9: velocities, spins, impulse, works and modes") {
  std::ifstream file(TEST_DATA "/stronge.json");
  const nlohmann::json cases = nlohmann::json::parse(file);
  REQUIRE(cases.size() == 90);
  int stuck = 0, from_rest = 0;
  for (const auto& c : cases) {
    CAPTURE(c["name"].get<std::string>(), c["mu"].get<double>(), c["e"].get<double>());
    ContactProblem p;
    test::add_body(p, c["m"].get<double>(), Vector3d::Ones(), vec(c["v0"]), vec(c["w0"]));
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) p.M.block(0)(3 + i, 3 + k) = c["I"][i][k].get<double>();
    test::add_contact(p, 0, vec(c["r"]), -1, {}, test::ground_axes(), c["mu"].get<double>(), c["e"].get<double>());
    const ContactSolution solution = solve(p);
    REQUIRE(solution.status == Status::ok);
    const test::Outcome out = test::outcome(p, solution.impulse);
    CHECK((test::linear(out.v) - vec(c["v"])).norm() <= 1e-9 * vec(c["v"]).norm());
    CHECK((test::angular(out.v) - vec(c["w"])).norm() <= 1e-9 * vec(c["w"]).norm());
    const Vector3d r = solution.impulse[0] * vec(c["n"]) +
                       test::ground_axes().transpose() * Vector3d(0, solution.impulse[1], solution.impulse[2]);
    CHECK((r - vec(c["impulse"])).norm() <= 1e-9 * vec(c["impulse"]).norm());
    const double stored = -c["Wc"].get<double>();
    CHECK(std::abs(solution.as<WorkWitness>().compression[0] + stored) <= 1e-9 * stored);
    CHECK(std::abs(solution.as<WorkWitness>().restitution[0] - c["Wr"].get<double>()) <= 1e-9 * stored);
    CHECK(std::abs(out.energy_change - c["dKE"].get<double>()) <= 1e-9 * stored);

    Impact impact;
    BlockCholesky factor;
    factor.factor(p.M);
    std::vector<Matrix3d> K;
    diagonal_blocks(p, factor, K);
    integrate_impact(K[0], Vector3d(out.u_minus[0], out.u_minus[1], out.u_minus[2]), p.mu[0], p.restitution[0], 1e-14,
                     0, {}, impact);
    const auto passed = [&](const char* mode) {
      return std::find(c["modes"].begin(), c["modes"].end(), mode) != c["modes"].end();
    };
    CHECK(impact.slid == (passed("slide-c") || passed("slide-r")));
    CHECK(impact.stuck == passed("stick"));
    CHECK(impact.diverged == passed("slip-from-stick"));
    stuck += impact.stuck;
    from_rest += impact.diverged;
  }
  CHECK(stuck > 20);
  CHECK(from_rest > 5);
}

TEST_CASE("a sphere sticks exactly where its slip is at most 3.5 mu (1 + e) times its speed of approach") {
  // K is diagonal: sliding ends after J_t = (2/7) m s, if mu m (1 + e) v_n reaches that.
  for (double e : {0.0, 0.5, 1.0})
    for (double share : {0.2, 0.999, 1.001, 3.0}) {
      const double mu = 0.3, v_n = 4, s = share * 3.5 * mu * (1 + e) * v_n, m = 4.0 / 3.0 * M_PI;
      const ContactProblem p = test::sphere({0.6 * s, -v_n, 0.8 * s}, Vector3d::Zero(), mu, e);
      const test::Outcome out = test::outcome(p, solve(p).impulse);
      const double j_t = std::min(2.0 / 7.0 * m * s, mu * m * (1 + e) * v_n);
      CHECK(out.u[0] == Approx(e * v_n).margin(1e-13));
      CHECK(std::hypot(out.u[1], out.u[2]) == Approx(s - 3.5 * j_t / m).margin(1e-12));
      if (share < 1) CHECK(std::hypot(out.u[1], out.u[2]) < 1e-12);
    }
}

TEST_CASE("a frictionless impact returns e times the approach, whatever the arms") {
  // mu = 0: u_n linear in p, W = -u_n^2 / (2 K_nn): u_n+ = -e u_n-, r_n = (1 + e) |u_n| / K_nn, K_nn = 3.04.
  for (double e : {0.0, 0.25, 1.0}) {
    ContactProblem p;
    test::add_body(p, 1, Vector3d::Constant(1.0 / 6), {1, -2, 0.5});
    test::add_contact(p, 0, {0.5, -0.5, 0.3}, -1, {}, test::ground_axes(), 0, e);
    const ContactSolution solution = solve(p);
    CHECK(solution.impulse[0] == Approx((1 + e) * 2 / 3.04).epsilon(1e-14));
    CHECK(solution.as<WorkWitness>().compression[0] == Approx(-4 / (2 * 3.04)).epsilon(1e-14));
    CHECK(solution.as<WorkWitness>().friction[0] == 0);
  }
}

TEST_CASE("spheres that meet centrally exchange velocities as Stronge's law says") {
  for (double e : {0.0, 0.5, 1.0}) {
    ContactProblem p;
    test::add_body(p, 1, Vector3d::Constant(0.4), {0, 1, 0});
    test::add_body(p, 3, Vector3d::Constant(1.2), {0, -1, 0});
    test::add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, test::ground_axes(), 0.5, e);
    const test::Outcome out = test::outcome(p, solve(p).impulse);
    CHECK(out.v[1] == Approx(1 - 1.5 * (1 + e)).margin(1e-14));
    CHECK(out.v[7] == Approx(-1 + 0.5 * (1 + e)).margin(1e-14));
  }
}

TEST_CASE("1000 random impacts return e^2 of the work stored, lose what friction takes, and never gain energy") {
  std::mt19937 generator(11);
  const ContactMethod method = mirtich_row().make({});
  ContactSolution solution;
  int curved = 0, diverged = 0, locked = 0;
  for (int i = 0; i < 1000; ++i) {
    CAPTURE(i);
    const ContactProblem p = test::random_impact(generator);
    method(p, solution);
    REQUIRE(solution.status == Status::ok);
    CHECK(solution.iterations == 1);
    const test::Outcome out = test::outcome(p, solution.impulse);
    const double stored = -solution.as<WorkWitness>().compression[0], e = p.restitution[0];
    CHECK(stored > 0);
    CHECK(out.u[0] >= -1e-12 * -out.u_minus[0]);
    CHECK(std::hypot(solution.impulse[1], solution.impulse[2]) <= p.mu[0] * solution.impulse[0] * (1 + 1e-12));
    CHECK(std::abs(solution.as<WorkWitness>().restitution[0] - e * e * stored) <= 1e-12 * stored);
    CHECK(solution.as<WorkWitness>().friction[0] <= 1e-12 * stored);
    const double works = solution.as<WorkWitness>().compression[0] + solution.as<WorkWitness>().restitution[0] +
                         solution.as<WorkWitness>().friction[0];
    CHECK(std::abs(out.energy_change - works) <= 1e-9 * (stored - solution.as<WorkWitness>().friction[0]));
    CHECK(out.energy_change <= 1e-13 * out.energy_before);

    Impact impact;
    BlockCholesky factor;
    factor.factor(p.M);
    std::vector<Matrix3d> K;
    diagonal_blocks(p, factor, K);
    integrate_impact(K[0], Vector3d(out.u_minus[0], out.u_minus[1], out.u_minus[2]), p.mu[0], e, 1e-13, 0, {}, impact);
    curved += impact.steps > 3;
    diverged += impact.diverged;
    locked += impact.locked;
  }
  CHECK(curved > 300);
  CHECK(diverged > 0);
  CHECK(locked > 20);
}

TEST_CASE("a tighter tolerance of the integration does not change the impact beyond the looser one") {
  std::mt19937 generator(3);
  MirtichOptions loose, tight;
  loose.impact.integration = 1e-8;
  tight.impact.integration = 1e-13;
  for (int i = 0; i < 100; ++i) {
    CAPTURE(i);
    const ContactProblem p = test::random_impact(generator);
    const test::Outcome a = test::outcome(p, solve(p, loose).impulse), b = test::outcome(p, solve(p, tight).impulse);
    for (int k = 0; k < 3; ++k) CHECK(std::abs(a.u[k] - b.u[k]) < 1e-5 * std::abs(a.u_minus[0]) + 1e-6);
  }
}

TEST_CASE("friction that drives the contact further in stores until the slip has stopped") {
  // Planar self-locking, slip along the axis with K_n + mu K_t < 0: u_n falls at rate a_n = K_nn - mu |K_nt| while the
  // slip falls at a_t; then it sticks. All of it is linear: closed form.
  const Matrix3d K = corner({-0.25, -0.6, 0}, 1, {0.05, 1, 0.02});
  const double sign = K(0, 1) > 0 ? 1 : -1;  // slip for which friction pulls u_n down: -mu sign K_nt < 0
  const double mu = 3, k = std::abs(K(0, 1));
  const double a_n = K(0, 0) - mu * k, a_t = k - mu * K(1, 1);
  REQUIRE(a_n < 0);
  REQUIRE(a_t < 0);
  REQUIRE(k / K(1, 1) < mu);
  const double u_n = -1, slip = 2, p_1 = -slip / a_t;
  const double u_1 = u_n + a_n * p_1;  // where the slip stops
  const double stick = K(0, 0) - k * k / K(1, 1);
  const double p_2 = -u_1 / stick;  // from there to the end of compression
  const double stored = -(0.5 * (u_n + u_1) * p_1 + 0.5 * u_1 * p_2);
  for (double e : {0.0, 0.7, 1.0}) {
    const double p_3 = std::sqrt(2 * e * e * stored / stick);
    Impact impact;
    integrate_impact(K, {u_n, sign * slip, 0}, mu, e, 1e-14, 0, {}, impact);
    CHECK(impact.status == Status::ok);
    CHECK(impact.locked);
    CHECK(impact.stuck);
    CHECK(impact.r[0] == Approx(p_1 + p_2 + p_3).epsilon(1e-12));
    CHECK(-impact.compression_work == Approx(stored).epsilon(1e-12));
    const Vector3d u = Vector3d(u_n, sign * slip, 0) + K * impact.r;
    CHECK(std::abs(u[0] - stick * p_3) < 1e-12);
    CHECK(std::abs(u[1]) < 1e-12);
  }
}

TEST_CASE("an impact that friction drives in a second time returns e^2 of all the work that it stored") {
  // Long arms, small moments and much friction: one in two hundred is compressed again while it parts.
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 4000; ++i) {
    const Vector3d arm(uniform(generator), uniform(generator), uniform(generator));
    Vector3d inertia;
    for (double& part : inertia) part = std::pow(10, -2 + 1.2 * std::abs(uniform(generator)));
    const Vector3d u(-std::abs(uniform(generator)) - 0.05, 5 * uniform(generator), 5 * uniform(generator));
    const double mu = 0.2 + 4 * std::abs(uniform(generator)), e = 0.3 + 0.6 * std::abs(uniform(generator));
    Impact impact;
    integrate_impact(corner(arm, 1, inertia), u, mu, e, 1e-14, 0, {}, impact);
    INFO(i);
    REQUIRE(impact.status == Status::ok);
    CHECK(impact.restitution_work == Approx(-e * e * impact.compression_work).epsilon(1e-8));
  }
}

TEST_CASE("where sticking is not stable the contact slides off along the one diverging ray") {
  // From rest u+ = K xi p with xi = (1, -mu t): the slip must point along t, and friction against it at full strength.
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    const Matrix3d K = corner({uniform(generator), uniform(generator), uniform(generator)}, 1,
                              Vector3d(0.05, 0.1, 0.08) + 0.04 * Vector3d(uniform(generator), uniform(generator), 0));
    const Vector3d x = K.inverse().col(0) / K.inverse()(0, 0);
    const double mu = 0.7 * x.tail<2>().norm();  // the cone is too narrow to stick
    Impact impact;
    integrate_impact(K, {-1, 0, 0}, mu, 0.5, 1e-14, 0, {}, impact);
    if (!(mu > 1e-6)) continue;
    ++found;
    REQUIRE(impact.diverged);
    const Vector3d u = Vector3d(-1, 0, 0) + K * impact.r;
    const double slip = u.tail<2>().norm();
    CHECK(slip > 0);
    CHECK((impact.r.tail<2>() + mu * impact.r[0] * u.tail<2>() / slip).norm() < 1e-10 * mu * impact.r[0]);
    // and just inside a cone that is wide enough it sticks
    integrate_impact(K, {-1, 0, 0}, x.tail<2>().norm() * (1 + 1e-9), 0.5, 1e-14, 0, {}, impact);
    CHECK(impact.stuck);
    CHECK((K * impact.r).tail<2>().norm() < 1e-12);
  }
  CHECK(found > 250);
}

TEST_CASE("slip that reverses in the plane stops, and slides off the other way, in closed form") {
  // Planar: K_tn pulls the slip back harder than friction can hold: after the stop the ray diverges the other way.
  const Matrix3d K = corner({-0.35, -0.35, 0}, 1, {0.05, 1, 1.0 / 12});
  const double k = std::abs(K(0, 1)), mu = 0.3;
  const double sign = K(0, 1) > 0 ? -1 : 1;  // slip against the drift that the normal impulse brings
  REQUIRE(k / K(1, 1) > mu);
  const double slip = 0.1, u_n = -1;
  const double a_t = k + mu * K(1, 1), a_n = K(0, 0) + mu * k;  // before: friction and coupling both against the slip
  const double b_t = k - mu * K(1, 1), b_n = K(0, 0) - mu * k;  // after the reversal
  const double p_1 = slip / a_t, u_1 = u_n + a_n * p_1;
  REQUIRE(u_1 < 0);
  REQUIRE(b_n > 0);
  const double p_2 = -u_1 / b_n;
  Impact impact;
  integrate_impact(K, {u_n, sign * slip, 0}, mu, 0, 1e-14, 0, {}, impact);
  const Vector3d u = Vector3d(u_n, sign * slip, 0) + K * impact.r;
  CHECK(impact.diverged);
  CHECK(impact.r[0] == Approx(p_1 + p_2).epsilon(1e-12));
  CHECK(u[1] == Approx(-sign * b_t * p_2).epsilon(1e-12));
}

TEST_CASE("a contact without tangential rows is a joint limit that bounces as Stronge says") {
  ContactProblem p;
  test::add_body(p, 2, Vector3d::Ones(), {0, -3, 0});
  test::add_contact(p, 0, {0, -1, 0}, -1, {}, test::ground_axes(), 0, 0.5);
  p.J.entry(0).bottomRows<2>().setZero();
  for (double mu : {0.0, 0.4}) {
    p.mu[0] = mu;
    const ContactSolution solution = solve(p);
    CHECK(solution.status == Status::ok);
    CHECK(solution.impulse[0] == Approx(9).epsilon(1e-14));
  }
}

TEST_CASE("resting stacks stop approaching through micro-impacts, and what they claim of works adds up") {
  for (int n : {1, 2, 4}) {
    const ContactProblem p = test::stack(n, 0.5, {0.01, -g * h, 0});
    const ContactSolution solution = solve(p);
    CHECK(solution.status == Status::ok);
    Referee referee;
    std::vector<double> v_plus;
    const Residuals residuals = referee.check(p, solution, mirtich_law(), v_plus);
    CHECK(residuals.approach <= 1.1e-10 * g * h);
    CHECK(residuals.cone_violation <= 1e-14);
    CHECK(residuals.energy_gain <= 0);
    double works = 0;
    for (int c = 0; c < p.nc(); ++c)
      works += solution.as<WorkWitness>().compression[c] + solution.as<WorkWitness>().restitution[c] +
               solution.as<WorkWitness>().friction[c];
    CHECK(works == Approx(residuals.energy_gain).epsilon(1e-8));
  }
}

TEST_CASE("tumbling stacks with restitution lose energy and return e^2 of the work stored at each contact") {
  for (double e : {0.0, 0.5, 0.9})
    for (unsigned seed : {1u, 2u, 3u}) {
      ContactProblem p = test::stack(4, 0.5, {0, -1, 0}, 1, seed);
      std::fill(p.restitution.begin(), p.restitution.end(), e);
      const ContactSolution solution = solve(p);
      CHECK(solution.status == Status::ok);
      const test::Outcome out = test::outcome(p, solution.impulse);
      CHECK(out.energy_change <= 0);
      for (int c = 0; c < p.nc(); ++c) {
        CHECK(out.u[3 * c] > -1e-8);
        CHECK(std::abs(solution.as<WorkWitness>().restitution[c] + e * e * solution.as<WorkWitness>().compression[c]) <=
              -1e-9 * solution.as<WorkWitness>().compression[c]);
      }
    }
}

TEST_CASE("a wheel that gives way by its spin at once and across with all of its robot is not followed spin by spin") {
  // K diagonal: over sigma each slip dies out by itself, u_i = a_i exp(-mu k_i sigma), and the normal impulse is the
  // integral of their root sum of squares. The first is gone at sigma = 8, and what is left is a closed form.
  const double mu = 1.7, k1 = 4, k2 = 1e-3, normal = 1e-3, approach = 9.8e-3, a1 = 0.5, a2 = 0.018;
  const double rate = mu * k2, gone = 8, p = approach / normal;
  const auto slip = [&](double sigma) {
    return std::hypot(a1 * std::exp(-mu * k1 * sigma), a2 * std::exp(-rate * sigma));
  };
  const int intervals = 20000;
  double until_gone = 0;
  for (int i = 0; i < intervals; ++i) {
    const double dx = gone / intervals, x = i * dx;
    until_gone += dx / 6 * (slip(x) + 4 * slip(x + dx / 2) + slip(x + dx));
  }
  const double across = a2 * std::exp(-rate * gone) - rate * (p - until_gone);

  Impact impact;
  const Matrix3d K = Vector3d(normal, k1, k2).asDiagonal();
  const Vector3d u(-approach, a1, a2);
  integrate_impact(K, u, mu, 0, 1e-14, approach, {}, impact);
  REQUIRE(impact.status == Status::ok);
  CHECK(impact.steps < 1000);
  const Vector3d after = u + K * impact.r;
  CHECK(std::abs(after[0]) < 1e-10 * approach);
  CHECK(std::abs(after[1]) < 1e-9 * approach);
  CHECK(across > 0.05 * a2);
  CHECK(std::abs(after[2] - across) < 1e-8 * approach);
  const double lost = (a1 * a1 / k1 + (a2 * a2 - across * across) / k2 + approach * approach / normal) / 2;
  CHECK(-impact.compression_work - impact.friction_work == Approx(lost).epsilon(1e-7));
}

TEST_CASE("what Mirtich's method claims is no less than the approach that it leaves") {
  int leaves = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const ContactProblem p = test::stack(3, 0.3, {0.02, -g * h, 0.01}, 0.02, seed);
    const ContactSolution s = solve(p);
    REQUIRE(s.status == Status::ok);
    std::vector<double> before, after;
    contact_velocity(p, p.v_minus, before);
    contact_velocity(p, test::outcome(p, s.impulse).v, after);
    double fastest = 0, left = 0;
    for (int c = 0; c < p.nc(); ++c) {
      fastest = std::max(fastest, -before[3 * c]);
      left = std::max(left, -after[3 * c]);
    }
    // Beyond the rounding of v+, 1e-16.
    if (left < 1e-12) continue;
    ++leaves;
    CHECK(s.claimed_residual >= 0.99 * left / fastest);
  }
  CHECK(leaves > 0);
}

TEST_CASE("limits on micro-impacts and on steps are nonconverged endings and say so") {
  MirtichOptions options;
  options.impact_limit = 2;
  const ContactProblem stack = test::stack(4, 0.5, {0, -g * h, 0});
  const ContactSolution few = solve(stack, options);
  CHECK(few.status == Status::nonconverged);
  CHECK(few.iterations == 2 * stack.nc());
  CHECK_FALSE(few.reason.empty());

  options = {};
  options.impact.step_limit = 2;
  ContactProblem p;
  test::add_body(p, 1, Vector3d::Constant(1.0 / 6), {1, -2, 0.5});
  test::add_contact(p, 0, {0.5, -0.5, 0.3}, -1, {}, test::ground_axes(), 0.5, 0.5);
  const ContactSolution cut = solve(p, options);
  CHECK(cut.status == Status::nonconverged);
  CHECK_FALSE(cut.reason.empty());
  for (double r : cut.impulse) CHECK(std::isfinite(r));
}

TEST_CASE("no contact, a separating contact and a resting one ask Mirtich for no impulse") {
  ContactProblem none;
  test::add_body(none, 1, Vector3d::Ones(), {0, -1, 0});
  CHECK(solve(none).status == Status::ok);
  for (const Vector3d& v : {Vector3d(3, 1, 0), Vector3d(3, 0, 1)}) {
    const ContactSolution solution = solve(test::sphere(v, Vector3d::Zero()));
    CHECK(solution.status == Status::ok);
    CHECK(solution.impulse == std::vector<double>(3, 0.0));
    CHECK(solution.as<WorkWitness>().compression == std::vector<double>(1, 0.0));
  }
}

TEST_CASE("NaN or infinity anywhere in the data ends Mirtich's impacts as not_finite without an impulse") {
  for (double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (int place = 0; place < 6; ++place) {
      ContactProblem p = test::sphere({1, -10, 0}, Vector3d::Zero());
      (place == 0   ? p.M.values[0]
       : place == 1 ? p.J.values[0]
       : place == 2 ? p.v_minus[1]
       : place == 3 ? p.offset[0]
       : place == 4 ? p.mu[0]
                    : p.restitution[0]) = bad;
      const ContactSolution solution = solve(p);
      CHECK(solution.status == Status::not_finite);
      CHECK(solution.impulse == std::vector<double>(3, 0.0));
    }
}

TEST_CASE("Mirtich's answer does not change with the units or with a turn of the tangents") {
  const ContactProblem p = test::stack(3, 0.3, {0.02, -g * h, 0.01}, 0.02, 5);
  const test::Outcome out = test::outcome(p, solve(p).impulse);

  ContactProblem grams = p;
  for (double& m : grams.M.values) m *= 1000;
  for (double& v : grams.v_minus) v /= 10;
  const test::Outcome other = test::outcome(grams, solve(grams).impulse);
  for (int i = 0; i < p.nv(); ++i) CHECK(std::abs(10 * other.v[i] - out.v[i]) < 1e-9);

  ContactProblem turned = p;
  const double c = std::cos(0.7), s = std::sin(0.7);
  for (int e = 0; e < static_cast<int>(turned.J.block.size()); ++e) {
    auto J = turned.J.entry(e);
    const Eigen::RowVectorXd t1 = J.row(1), t2 = J.row(2);
    J.row(1) = c * t1 + s * t2;
    J.row(2) = c * t2 - s * t1;
  }
  const test::Outcome rotated = test::outcome(turned, solve(turned).impulse);
  for (int i = 0; i < p.nv(); ++i) CHECK(std::abs(rotated.v[i] - out.v[i]) < 1e-8);
}

TEST_CASE("Mirtich's answer is the same whether bodies come as blocks of their own or as one tree") {
  const ContactProblem p = test::stack(3, 0.3, {0.02, -g * h, 0.01}, 0.02, 5);
  const test::Outcome apart = test::outcome(p, solve(p).impulse);
  const ContactProblem tree = test::one_block(p);
  const test::Outcome together = test::outcome(tree, solve(tree).impulse);
  for (int i = 0; i < p.nv(); ++i) CHECK(std::abs(apart.v[i] - together.v[i]) < 1e-9);
}

TEST_CASE("the referee upholds every claim of Mirtich's method and refutes a disturbed one") {
  Referee referee;
  std::vector<double> v_plus;
  std::mt19937 generator(2);
  const ContactMethod method = mirtich_row().make({});
  ContactSolution solution;
  for (int i = 0; i < 100; ++i) {
    const ContactProblem p = i < 90 ? test::random_impact(generator) : test::stack(1 + i % 4, 0.5, {0, -1, 0}, 1, i);
    method(p, solution);
    REQUIRE(solution.status == Status::ok);
    CHECK(Referee::holds(referee.check(p, solution, mirtich_law(), v_plus), 1e-9));
    ContactSolution disturbed = solution;
    for (double& r : disturbed.impulse) r *= 1.01;
    CHECK_FALSE(Referee::holds(referee.check(p, disturbed, mirtich_law(), v_plus), 1e-9));
    disturbed = solution;
    disturbed.as<WorkWitness>().compression[0] -= 1e-6 * test::outcome(p, solution.impulse).energy_before;
    CHECK_FALSE(Referee::holds(referee.check(p, disturbed, mirtich_law(), v_plus), 1e-9));
  }
}

TEST_CASE("a slow approach beside a slip a million times faster is integrated as exactly as any") {
  // Coulomb friction over so short an impact keeps its direction: r = r_n (1, -mu u_t / |u_t|) up to the turn of the
  // slip, which is of the order of 1e-6; Newton's and Stronge's restitution agree then.
  for (double e : {0.0, 0.5, 1.0}) {
    ContactProblem p;
    test::add_body(p, 1, Vector3d::Constant(1.0 / 6), {1000, -1e-3, 500});
    test::add_contact(p, 0, {0.5, -0.5, 0.3}, -1, {}, test::ground_axes(), 0.4, e);
    const ContactSolution solution = solve(p);
    REQUIRE(solution.status == Status::ok);
    const test::Outcome out = test::outcome(p, solution.impulse);
    CHECK(out.u[0] == Approx(e * 1e-3).margin(1e-8));
    const double slip = std::hypot(out.u_minus[1], out.u_minus[2]);
    for (int t : {1, 2})
      CHECK(solution.impulse[t] == Approx(-0.4 * solution.impulse[0] * out.u_minus[t] / slip).epsilon(1e-5));
  }
}

TEST_CASE("velocities beyond the range of doubles never come back as an answer that is ok") {
  for (const Vector3d& v : {Vector3d(1e200, -1e200, 0), Vector3d(1, -1.7e308, 0), Vector3d(1e300, -1, 0)}) {
    ContactProblem p = test::sphere(v, Vector3d::Zero(), 0.5, 1);
    const ContactSolution solution = solve(p);
    for (double r : solution.impulse) CHECK(std::isfinite(r));
    if (solution.status == Status::ok) {
      const test::Outcome out = test::outcome(p, solution.impulse);
      CHECK(out.u[0] >= -1e-9 * v.cwiseAbs().maxCoeff());
    }
  }
}

namespace {

/// Points in a row that fall on the ground and on each other, without friction, all with restitution e.
struct Row {
  ContactProblem problem;
  std::vector<double> mass, v;
  double e;

  Row(std::vector<double> masses, std::vector<double> velocities, double restitution)
      : mass(std::move(masses)), v(std::move(velocities)), e(restitution) {
    for (int i = 0; i < static_cast<int>(mass.size()); ++i) {
      test::add_body(problem, mass[i], Vector3d::Ones(), {0, v[i], 0});
      test::add_contact(problem, i, {}, i - 1, {}, test::ground_axes(), 0, e);
    }
  }
  double approach(int c) const { return v[c] - (c > 0 ? v[c - 1] : 0); }
  /// Newton's restitution, which is Stronge's where nothing couples.
  void hit(int c) {
    const double w = 1 / mass[c] + (c > 0 ? 1 / mass[c - 1] : 0), r = -(1 + e) * approach(c) / w;
    v[c] += r / mass[c];
    if (c > 0) v[c - 1] -= r / mass[c - 1];
  }
};

}  // namespace

TEST_CASE("of the contacts that approach the fastest is hit, again and again") {
  for (const double e : {0.9, 1.0}) {
    const Row start({1, 2, 0.7}, {-1, -4, -4.5}, e);
    Row fastest = start, slowest = start;
    const auto run = [](Row& row, double sign) {
      int hits = 0;
      for (;; ++hits) {
        int next = -1;
        for (int c = 0; c < 3; ++c)
          if (row.approach(c) < -1e-9 && (next < 0 || sign * row.approach(c) < sign * row.approach(next))) next = c;
        if (next < 0) return hits;
        row.hit(next);
      }
    };
    const int hits = run(fastest, 1);
    run(slowest, -1);
    // The order has a say in what comes of it.
    REQUIRE(std::abs(fastest.v[2] - slowest.v[2]) > 1e-3);
    const ContactSolution solution = solve(start.problem);
    CHECK(solution.status == Status::ok);
    CHECK(solution.iterations == hits);
    const test::Outcome out = test::outcome(start.problem, solution.impulse);
    for (int i = 0; i < 3; ++i) CHECK(out.v[6 * i + 1] == Approx(fastest.v[i]).margin(1e-12));
  }
}

TEST_CASE("of contacts that approach equally fast up to round-off the first is hit first") {
  // A body in a groove whose walls are at 30 degrees to the ground: what one does the other feels.
  const auto impulses = [](double ahead) {
    ContactProblem p;
    test::add_body(p, 1, Vector3d::Ones(), {0, -1, 0});
    for (const double x : {0.5, -0.5})
      test::add_contact(p, 0, {}, -1, {}, test::axes_of({x, std::sqrt(0.75), 0}), 0, 0.5);
    p.offset[3] = -ahead;
    const ContactSolution solution = solve(p);
    CHECK(solution.status == Status::ok);
    return Eigen::Vector2d(solution.impulse[0], solution.impulse[3]);
  };
  const Eigen::Vector2d first = impulses(0);
  REQUIRE(std::abs(first[0] - first[1]) > 1e-2);
  CHECK((impulses(1e-14) - first).norm() < 1e-9);
  CHECK((impulses(-1e-14) - first).norm() < 1e-9);
  CHECK((impulses(-1e-6) - first).norm() < 1e-4);
  CHECK((impulses(1e-6) - first.reverse()).norm() < 1e-4);
}

TEST_CASE("an approach that Mirtich's method leaves at its limit is claimed as a fraction of the fastest before") {
  MirtichOptions options;
  options.impact_limit = 1;
  const ContactProblem p = test::stack(4, 0.5, {0, -g * h, 0}, 1e-3, 4);
  const ContactSolution solution = solve(p, options);
  CHECK(solution.status == Status::nonconverged);
  CHECK(solution.reason == "contacts still approach after 16 micro-impacts");
  const test::Outcome out = test::outcome(p, solution.impulse);
  double before = 0, left = 0;
  for (int c = 0; c < p.nc(); ++c) {
    before = std::max(before, -out.u_minus[3 * c]);
    left = std::max(left, -out.u[3 * c]);
  }
  REQUIRE(left > 0.01 * before);
  CHECK(solution.claimed_residual == Approx(left / before));
  // A limit that is reached with nothing left is no failure.
  const ContactSolution one = solve(test::sphere({1, -10, 0}, Vector3d::Zero(), 0.5, 0.7), options);
  CHECK(one.status == Status::ok);
  CHECK(one.iterations == 1);
  CHECK(one.claimed_residual < 1e-14);
}

TEST_CASE("works of a contact that is hit more than once are those of all of its impacts") {
  // The lower of two points is hit by the ground, by the upper one, and by the ground again.
  const Row row({1, 1}, {-1, -2}, 1);
  const ContactSolution solution = solve(row.problem);
  REQUIRE(solution.status == Status::ok);
  // Equal masses that exchange velocities: the ground stops 1 and 2 m/s, each of 1 kg; between the two 1 + 3 or 3 + 1
  // differences of velocity end, with half a kilogramme.
  const WorkWitness& work = solution.as<WorkWitness>();
  CHECK(work.compression[0] == Approx(-0.5 * (1 + 4)));
  CHECK(work.restitution[0] == Approx(0.5 * (1 + 4)));
  CHECK(work.compression[1] == Approx(-0.25 * (1 + 9)));
  CHECK(work.restitution[1] == Approx(0.25 * (1 + 9)));
  CHECK(solution.size == 6);
}

TEST_CASE("a slow impact is integrated as exactly beside what is fast on another island as alone") {
  const auto add_point = [](ContactProblem& p, const Matrix3d& K, const Vector3d& v) {
    const int block = p.M.add_block(3);
    p.M.block(block) = K.inverse();
    p.J.add_band();
    p.J.entry(p.J.add_entry(block, 3)) = Matrix3d::Identity();
    p.v_minus.insert(p.v_minus.end(), v.begin(), v.end());
    p.offset.insert(p.offset.end(), 3, 0.0);
    p.mu.push_back(0.3);
    p.restitution.push_back(0.5);
  };
  Matrix3d K;
  K << 2.5, 0.6, 0.4, 0.6, 1.8, 0.3, 0.4, 0.3, 1.2;
  const Vector3d v(-0.01, 0.006, -0.004);  // whose slip turns
  ContactProblem both, alone;
  add_point(both, Matrix3d::Identity(), {-100, 0, 0});
  add_point(both, K, v);
  add_point(alone, K, v);
  const ContactSolution beside = solve(both), lone = solve(alone);
  REQUIRE(beside.status == Status::ok);
  REQUIRE(lone.status == Status::ok);
  for (int i = 0; i < 3; ++i) CHECK(std::abs(beside.impulse[3 + i] - lone.impulse[i]) <= 1e-12 * lone.impulse[0]);

  // Its works add up to its change of energy: by the errors of what approaches at 100 m/s they missed it by 1.9e-8.
  const test::Outcome out = test::outcome(both, beside.impulse);
  const WorkWitness& work = beside.as<WorkWitness>();
  double missed = work.compression[1] + work.restitution[1] + work.friction[1], r2 = 0, u2 = 0, q2 = 0;
  for (int i = 3; i < 6; ++i) {
    missed -= 0.5 * beside.impulse[i] * (out.u[i] + out.u_minus[i]);
    r2 += beside.impulse[i] * beside.impulse[i];
    u2 += out.u[i] * out.u[i];
    q2 += out.u_minus[i] * out.u_minus[i];
  }
  const double w = K.trace() / 3;
  CHECK(std::abs(missed) <= 1e-12 * std::max({w * r2, u2 / w, q2 / w}));
  std::vector<double> v_plus;
  CHECK(Referee::holds(Referee().check(both, beside, mirtich_law(), v_plus), 1e-9));
}

TEST_CASE("each contact has its own friction and its own restitution") {
  // Balls that slide fast: r = (1 + e) m v_n (1, -mu d), d the direction of the slip.
  const double mu[] = {0.1, 0.4, 0.2}, e[] = {0.2, 0.9, 0.5}, m = 2, v_n = 3;
  ContactProblem p;
  for (int b = 0; b < 3; ++b) {
    test::add_body(p, m, Vector3d::Constant(0.4 * m), {60, -v_n, 0});
    test::add_contact(p, b, {0, -1, 0}, -1, {}, test::ground_axes(), mu[b], e[b]);
  }
  const ContactSolution solution = solve(p);
  REQUIRE(solution.status == Status::ok);
  for (int b = 0; b < 3; ++b) {
    const double r = (1 + e[b]) * m * v_n;
    CHECK(solution.impulse[3 * b] == Approx(r).epsilon(1e-12));
    CHECK(solution.impulse[3 * b + 1] == Approx(-mu[b] * r).epsilon(1e-12));
    CHECK(std::abs(solution.impulse[3 * b + 2]) < 1e-12);
    CHECK(solution.as<WorkWitness>().restitution[b] == Approx(0.5 * e[b] * e[b] * m * v_n * v_n).epsilon(1e-12));
  }
}

TEST_CASE("an impact without an end is told from one that takes too many steps; neither leaves an impulse of its own") {
  // Rows n and t1 are one: where the contact sticks no normal impulse moves it.
  ContactProblem p;
  test::add_body(p, 1, Vector3d::Ones(), {0, -1, 0});
  test::add_contact(p, 0, {}, -1, {}, test::ground_axes(), 2, 0.5);
  p.J.entry(0).row(1) = p.J.entry(0).row(0).eval();
  p.offset[1] = 1;  // no slip
  const ContactSolution endless = solve(p);
  CHECK(endless.status == Status::singular);
  CHECK(endless.reason == "an impact without end: the contact's inertia is singular");
  CHECK(endless.impulse == std::vector<double>(3, 0.0));
  CHECK(endless.iterations == 1);

  MirtichOptions options;
  options.impact.step_limit = 0;
  const ContactSolution cut = solve(test::sphere({1, -10, 0}, Vector3d::Zero()), options);
  CHECK(cut.status == Status::nonconverged);
  CHECK(cut.reason == "one impact took more steps than the limit");
  CHECK(cut.impulse == std::vector<double>(3, 0.0));
  CHECK(cut.iterations == 1);
  CHECK(cut.claimed_residual == 1);
}

TEST_CASE("impulses or works beyond the range of doubles are no answer, and none of either is left") {
  for (const double e : {0.0, 1.0})
    for (const double v_n : {-1e200, -1.7e308}) {
      const ContactSolution solution = solve(test::sphere({0, v_n, 0}, Vector3d::Zero(), 0, e));
      CHECK(solution.status == Status::not_finite);
      CHECK(solution.reason == "the impulses grew beyond all bounds");
      CHECK(solution.impulse == std::vector<double>(3, 0.0));
      const WorkWitness& work = solution.as<WorkWitness>();
      for (const auto* of : {&work.compression, &work.restitution, &work.friction})
        CHECK(*of == std::vector<double>(1, 0.0));
    }
  // An impulse has no square, but is a number.
  CHECK(solve(test::sphere({0, -1e200, 0}, Vector3d::Zero(), 0, 0)).status == Status::not_finite);
}

TEST_CASE("what Mirtich's method claims of one impact is what its works miss e^2 by") {
  std::mt19937 generator(17);
  int misses = 0;
  for (int i = 0; i < 100; ++i) {
    const ContactProblem p = test::random_impact(generator);
    const double e = p.restitution[0];
    if (!(e > 0.05)) continue;  // what is left of the approach is another claim
    const ContactSolution solution = solve(p);
    const WorkWitness& work = solution.as<WorkWitness>();
    const double stored = -work.compression[0], missed = std::abs(work.restitution[0] - e * e * stored) / stored;
    CHECK(std::abs(solution.claimed_residual - missed) <= 1e-3 * missed);
    CHECK(missed < 1e-12);
    misses += missed > 0;
  }
  CHECK(misses > 20);
}

TEST_CASE("by default an event has 20,000 micro-impacts a contact, and one of these 5,000 steps") {
  // Two walls that close in on a point which bounces between them: no velocity parts it from both.
  ContactProblem p;
  test::add_body(p, 1, Vector3d::Constant(0.4), {0.1, 0, 0});
  test::add_contact(p, 0, {-1, 0, 0}, -1, {}, test::axes_of({1, 0, 0}), 0, 1);
  test::add_contact(p, 0, {1, 0, 0}, -1, {}, test::axes_of({-1, 0, 0}), 0, 1);
  p.offset[0] = p.offset[3] = -1;
  const ContactSolution endless = solve(p);
  CHECK(endless.status == Status::nonconverged);
  CHECK(endless.iterations == 2 * 20000);

  // No step is exact enough for one who asks for no error at all.
  ImpactOptions options;
  options.integration = 0;
  Impact impact;
  integrate_impact(corner({0.5, -0.5, 0.3}, 1, {0.1, 0.2, 0.3}), {-1, 1, 2}, 0.5, 0.5, 1e-14, 0, options, impact);
  CHECK(impact.status == Status::nonconverged);
  CHECK(std::abs(impact.steps - 5000) <= 1);
}
