// Between two impacts: velocities, what counts as an approach, who is touched by whom.

#include "methods/impact_state.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "contact/laws.h"
#include "contact/referee.h"
#include "impacts.h"
#include "methods/mirtich.h"
#include "methods/newton.h"

using namespace cb;
using namespace cb::test;

namespace {

/// Points of 4, 1 and 9 kg: the first on the ground, the second on the first, the third on the ground elsewhere.
ContactProblem points() {
  ContactProblem p;
  const double masses[] = {4, 1, 9};
  for (const double m : masses) p.M.block(p.M.add_block(3)) = m * Matrix3d::Identity();
  p.v_minus = {-2, 0.5, 0, -6, 0, 0, -1, 0, 7};
  const auto contact = [&](int below, int body, double offset) {
    p.J.add_band();
    if (below >= 0) p.J.entry(p.J.add_entry(below, 3)) = -Matrix3d::Identity();
    p.J.entry(p.J.add_entry(body, 3)) = Matrix3d::Identity();
    p.offset.insert(p.offset.end(), {offset, 0, 0});
    p.mu.push_back(0.5);
    p.restitution.push_back(0);
  };
  contact(-1, 0, -1);
  contact(0, 1, 0);
  contact(-1, 2, 0.5);
  return p;
}

}  // namespace

TEST_CASE("velocities between impacts are those of the problem and of the impulses since, offset and all") {
  const ContactProblem p = points();
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(p, {}, reason) == Status::ok);
  CHECK(state.nc() == 3);
  CHECK(state.velocity(0) == Vector3d(-3, 0.5, 0));
  CHECK(state.velocity(1) == Vector3d(-4, -0.5, 0));
  CHECK(state.velocity(2) == Vector3d(-0.5, 0, 7));
  for (int c = 0; c < 3; ++c) CHECK(state.normal_velocity(c) == state.velocity(c)[0]);
  for (int c = 0; c < 3; ++c) CHECK(state.approach_before(c) == (c < 2 ? 4 : 0.5));
  CHECK((state.K(0) - 0.25 * Matrix3d::Identity()).norm() < 1e-15);
  CHECK((state.K(1) - 1.25 * Matrix3d::Identity()).norm() < 1e-15);
  state.apply(1, {2, 0, -4});
  CHECK((state.velocity(0) - Vector3d(-3.5, 0.5, 1)).norm() < 1e-15);
  CHECK((state.velocity(1) - Vector3d(-1.5, -0.5, -5)).norm() < 1e-15);
  CHECK(state.velocity(2) == Vector3d(-0.5, 0, 7));
  state.restart({12, 0, 0, 0, 0, 0, 0, 0, 9});
  CHECK((state.velocity(0) - Vector3d(0, 0.5, 0)).norm() < 1e-15);
  CHECK((state.velocity(2) - Vector3d(-0.5, 0, 8)).norm() < 1e-15);
  const auto neighbours = [&](int c) {
    return std::vector<int>(state.neighbours(c).begin(), state.neighbours(c).end());
  };
  CHECK(neighbours(0) == std::vector<int>{0, 1});
  CHECK(neighbours(1) == std::vector<int>{0, 1});
  CHECK(neighbours(2) == std::vector<int>{2});
  // Another problem of as many contacts has neighbours of its own.
  ContactProblem other = p;
  other.J.block = {0, 0, 1, 0};
  REQUIRE(state.start(other, {}, reason) == Status::ok);
  CHECK(neighbours(2) == std::vector<int>{0, 1, 2});
}

TEST_CASE("an approach is over by a part of the island's fastest, in m/s and beside its weight, or by rounding") {
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(points(), {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
  // 3 m/s at a weight of 1/4 are 6 sqrt(J), of which 1/2 is 3 m/s; 4 m/s are the fastest of both.
  CHECK(state.approach_tolerance(0) == Approx(0.03));
  CHECK(state.approach_tolerance(1) == Approx(0.04));
  CHECK(state.approach_tolerance(2) == Approx(0.005));
  // Terms of the largest row: 6 + 2 of the second contact, 7 along the third.
  CHECK(state.slip_rounding(0) == Approx(8e-4));
  CHECK(state.slip_rounding(1) == Approx(8e-4));
  CHECK(state.slip_rounding(2) == Approx(7e-4));
  REQUIRE(state.start(points(), {.approach = 1e-10, .rounding = 1e-2}, reason) == Status::ok);
  CHECK(state.approach_tolerance(0) == Approx(0.08));
  CHECK(state.approach_tolerance(2) == Approx(0.07));
}

TEST_CASE("by default an approach is over at 1e-10 of the fastest, and 2e-14 of a row's terms are round-off") {
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(points(), {}, reason) == Status::ok);
  CHECK(state.approach_tolerance(1) == Approx(4e-10));
  CHECK(state.slip_rounding(0) == Approx(2e-14 * 8));
}

TEST_CASE("what drives a contact is a term of its velocity along each of its axes, and of what is round-off there") {
  for (int row = 0; row < 3; ++row)
    for (const double sign : {1.0, -1.0}) {
      ContactProblem p = points();
      p.offset[6 + row] = sign * 20;  // of the third, whose own terms are 1, 0 and 7
      ImpactState state;
      std::string reason;
      REQUIRE(state.start(p, {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
      Vector3d u(row == 0 ? -1 : -0.5, 0, 7);
      u[row] += row == 0 ? sign * 20 : p.offset[6 + row];
      CHECK(state.velocity(2) == u);
      CHECK(state.normal_velocity(2) == u[0]);
      CHECK(state.slip_rounding(2) == Approx(1e-4 * (20 + (row == 0 ? 1 : row == 1 ? 0 : 7))));
      CHECK(state.slip_rounding(0) == Approx(8e-4));
      CHECK(state.approach_before(2) == (row > 0 ? 0.5 : sign < 0 ? 21 : 0));
    }
}

namespace {

/// Coordinates of 4, 1 and 1/7 kg; a limit of the first, and a contact of the second whose tangents give way more.
ContactProblem limit_and_contact(double v_limit, double v_contact) {
  ContactProblem p;
  p.M.block(p.M.add_block(3)) = Vector3d(4, 1, 1.0 / 7).asDiagonal();
  p.v_minus = {v_limit, v_contact, 0};
  const auto contact = [&](const Matrix3d& rows) {
    p.J.add_band();
    p.J.entry(p.J.add_entry(0, 3)) = rows;
    p.offset.insert(p.offset.end(), 3, 0.0);
    p.mu.push_back(0);
    p.restitution.push_back(0);
  };
  Matrix3d limit = Matrix3d::Zero(), whole;
  limit(0, 0) = 1;
  whole << 0, 1, 0, 0, 0, 1, 0, 0, 1;
  contact(limit);
  contact(whole);
  return p;
}

}  // namespace

TEST_CASE("a joint's limit is weighed by its normal row alone, a contact by the mean of its three") {
  // A limit of 4 kg: w = 1/4. A contact of 1 kg: w = (1 + 7 + 7) / 3.
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(limit_and_contact(-1, -1), {.approach = 1e-2, .rounding = 0}, reason) == Status::ok);
  CHECK((state.K(1) - Matrix3d(Eigen::Matrix3d{{1, 0, 0}, {0, 7, 7}, {0, 7, 7}})).norm() < 1e-14);
  CHECK(state.measure_of(0) == Approx(2));
  CHECK(state.measure_of(1) == Approx(1 / std::sqrt(5)));
  // Fastest in sqrt(J): the limit, 2, which are 1 of its own and more of the contact's.
  CHECK(state.approach_tolerance(0) == Approx(1e-2));
  CHECK(state.approach_tolerance(1) == Approx(1e-2));
  // 0.02 of the limit are 0.04 sqrt(J), the contact's 0.1 m/s are 0.1 / sqrt(5): the contact's tolerance is its own.
  REQUIRE(state.start(limit_and_contact(-0.02, -0.1), {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
  CHECK(state.approach_tolerance(0) == Approx(2e-4));
  CHECK(state.approach_tolerance(1) == Approx(1e-3));
  CHECK(state.approach_before(0) == 0.02);
  CHECK(state.approach_before(1) == 0.1);
}

TEST_CASE("a limit, which may turn, has its own approach and rounding, and a contact beside it none of that") {
  ImpactState state;
  ContactProblem p;
  std::string reason;
  const ImpactState::Tolerances tolerances{.approach = 1e-2, .rounding = 1e-4};
  p = limit_and_contact(-100, -0.1);
  REQUIRE(state.start(p, tolerances, reason) == Status::ok);
  CHECK(state.approach_tolerance(0) == Approx(1));
  CHECK(state.approach_tolerance(1) == Approx(1e-3));
  CHECK(state.slip_rounding(0) == Approx(1e-2));
  CHECK(state.slip_rounding(1) == Approx(1e-5));
  p = limit_and_contact(1e-9, -0.1);
  REQUIRE(state.start(p, tolerances, reason) == Status::ok);
  CHECK(state.approach_before(0) == 0);
  CHECK(state.approach_tolerance(0) == Approx(1e-13));
  // What impulses stop counts too, w r_n, until the event starts anew: 0.25 of 0.01 N s; 5 of 2e-2 and more are more
  // than the fastest in sqrt(J), which is 0.1 m/s.
  state.apply(0, {0.01, 0, 0});
  CHECK(state.approach_tolerance(0) == Approx(1e-2 * 0.0025));
  state.apply(1, {0.012, 0, 0});
  CHECK(state.approach_tolerance(1) == Approx(1e-3));
  state.restart(std::vector<double>(6, 0.0));
  CHECK(state.approach_tolerance(0) == Approx(1e-13));
  p = limit_and_contact(-100, -0.1);
  REQUIRE(state.start(p, tolerances, reason) == Status::ok);
  state.apply(1, {0.2, 0, 0});
  CHECK(state.approach_tolerance(1) == Approx(1e-2));
  // Without a limit a contact is about the island's velocities alone.
  p = points();
  REQUIRE(state.start(p, tolerances, reason) == Status::ok);
  state.apply(0, {1e3, 0, 0});
  CHECK(state.approach_tolerance(0) == Approx(0.03));
  CHECK(state.measure_of(0) == 1);
}

TEST_CASE("what is left is told as a part of what was: of contacts the fastest, of a limit its own") {
  ImpactState state;
  ContactProblem p;
  std::string reason;
  p = limit_and_contact(-100, -0.1);
  REQUIRE(state.start(p, {}, reason) == Status::ok);
  CHECK(state.approach_left() == 1);
  state.apply(0, {300, 0, 0});  // 25 are left
  CHECK(state.approach_left() == 1);
  state.apply(1, {0.08, 0, 0});
  CHECK(state.approach_left() == Approx(0.25));
  state.apply(0, {100, 0, 0});
  CHECK(state.approach_left() == Approx(0.05));  // 0.02 m/s, of 5 times 0.08
  p = limit_and_contact(0, 1);
  REQUIRE(state.start(p, {}, reason) == Status::ok);
  CHECK(state.approach_left() == 0);
  state.apply(0, {4e-3, 0, 0});
  state.apply(0, {-6e-3, 0, 0});
  CHECK(state.approach_left() == 1);
  p = points();
  REQUIRE(state.start(p, {}, reason) == Status::ok);
  state.apply(1, {2.4, 0, 0});  // 1 m/s of 4
  CHECK(state.approach_left() == Approx(3.6 / 4));
}

// Rates of joints in units of 1e-6 to 1e6 rad: another J, M and v of the same event.
TEST_CASE("what unit a limit's velocity is in changes no impulse of newton and mirtich, and no answer is refused") {
  std::mt19937 generator(8);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int k = 0; k < 20; ++k) {
    Eigen::Matrix4d half = Eigen::Matrix4d::NullaryExpr([&] { return uniform(generator); });
    const Eigen::Matrix4d M = half * half.transpose() + 0.3 * Eigen::Matrix4d::Identity();
    const Eigen::Matrix<double, 3, 4> rows =
        Eigen::Matrix<double, 3, 4>::NullaryExpr([&] { return uniform(generator); });
    const Eigen::Vector4d v = Eigen::Vector4d::NullaryExpr([&] { return uniform(generator); });
    const auto problem = [&](double unit) {  // the last two coordinates turn
      const Eigen::Vector4d units(1, 1, unit, unit);
      ContactProblem p;
      p.M.block(p.M.add_block(4)) = units.cwiseInverse().asDiagonal() * M * units.cwiseInverse().asDiagonal();
      p.v_minus.resize(4);
      Eigen::Map<Eigen::Vector4d>(p.v_minus.data()) = units.cwiseProduct(v);
      for (int c = 0; c < 3; ++c) {
        p.J.add_band();
        auto entry = p.J.entry(p.J.add_entry(0, 4));
        entry.setZero();
        if (c < 2)
          entry(0, 2 + c) = v[2 + c] < 0 ? 1 : -1;
        else
          entry = rows * units.cwiseInverse().asDiagonal();
        p.offset.insert(p.offset.end(), 3, 0.0);
        p.mu.push_back(c < 2 ? 0 : 0.3);
        p.restitution.push_back(0);
      }
      return p;
    };
    for (const bool newton : {true, false}) {
      NewtonOptions tested;
      tested.variant = NewtonOptions::Variant::stick_tested;
      const ContactMethod method = newton ? make_newton(tested) : make_mirtich({});
      ContactSolution here, there;
      std::vector<double> v_plus;
      method(problem(1), here);
      for (const double unit : {1e-6, 1e-3, 1e3, 1e6}) {
        const ContactProblem p = problem(unit);
        method(p, there);
        CAPTURE(k, newton, unit);
        REQUIRE(there.status == Status::ok);
        for (int i = 0; i < 9; ++i)
          CHECK(there.impulse[i] * (i < 6 ? unit : 1) == Approx(here.impulse[i]).epsilon(1e-7).margin(1e-8));
        CHECK(Referee().check(p, there, newton ? newton_law() : mirtich_law(), v_plus).model < 1e-9);
      }
    }
  }
}

// Rounding of an earlier event, held at 6e-15 beside a stop that moves at 0.26: 2e-14 of that is more.
TEST_CASE("a limit that approaches by rounding is stopped, however fast another limit of the robot moves") {
  ContactProblem p;
  p.M.block(p.M.add_block(2)) = Eigen::Matrix2d{{11, 0.4}, {0.4, 0.2}};
  p.v_minus = {6.47e-15, 0.26};
  for (int c = 0; c < 2; ++c) {
    p.J.add_band();
    auto entry = p.J.entry(p.J.add_entry(0, 2));
    entry.setZero();
    entry(0, c) = -1;
    p.offset.insert(p.offset.end(), {c == 1 ? 0.26 + 4e-7 : 0.0, 0, 0});
    p.mu.push_back(0);
    p.restitution.push_back(0);
  }
  for (const bool newton : {true, false}) {
    ContactSolution s;
    std::vector<double> v_plus;
    (newton ? make_newton({}) : make_mirtich({}))(p, s);
    REQUIRE(s.status == Status::ok);
    CHECK(s.impulse[0] > 0);
    CHECK(Referee().check(p, s, newton ? newton_law() : mirtich_law(), v_plus).model < 1e-9);
  }
}

TEST_CASE("a state that starts anew knows nothing of the event before") {
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(points(), {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
  state.apply(0, {1, 2, 3});
  ContactProblem parts = points();
  for (double& v : parts.v_minus) v = -v;
  parts.offset.assign(9, 0.0);
  parts.v_minus[3] = 3;  // the second goes up faster than the first below it
  REQUIRE(state.start(parts, {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
  for (int c = 0; c < 3; ++c) CHECK(state.approach_before(c) == 0);
  CHECK(state.velocity(0) == Vector3d(2, -0.5, 0));
  CHECK(state.approach_tolerance(0) == Approx(5e-4));  // round-off alone: 3 + 2 of the second contact
  CHECK(state.finite());
  state.apply(0, {HUGE_VAL, 0, 0});
  CHECK_FALSE(state.finite());
}

TEST_CASE("data that are no numbers and masses that are none are refused with the reason") {
  ImpactState state;
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    const auto refused = [&](const auto& spoil) {
      ContactProblem p = points();
      spoil(p);
      std::string reason;
      CHECK(state.start(p, {}, reason) == Status::not_finite);
      CHECK(reason == "the problem's data hold NaN or infinity");
    };
    refused([&](ContactProblem& p) { p.M.values.back() = bad; });
    refused([&](ContactProblem& p) { p.J.values.back() = bad; });
    refused([&](ContactProblem& p) { p.v_minus.back() = bad; });
    refused([&](ContactProblem& p) { p.offset.back() = bad; });
    refused([&](ContactProblem& p) { p.mu.back() = bad; });
    refused([&](ContactProblem& p) { p.restitution.back() = bad; });
  }
  ContactProblem p = points();
  p.M.block(2)(1, 1) = 0;
  std::string reason;
  CHECK(state.start(p, {}, reason) == Status::singular);
  CHECK(reason == "the mass matrix is not positive definite");
}

// Six of a free body, written out, and any number of a tree.
TEST_CASE("a contact between a body and a tree of eight has the W, the velocity and the impulse of both") {
  std::mt19937 generator(6);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto matrix = [&](int rows, int columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return uniform(generator); }).eval();
  };
  ContactProblem p;
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(14, 14), J(3, 14);
  for (const int size : {6, 8}) {
    const Eigen::MatrixXd half = matrix(size, size);
    const int b = p.M.add_block(size);
    p.M.block(b) = half * half.transpose() + Eigen::MatrixXd::Identity(size, size);
    M.block(p.M.first[b], p.M.first[b], size, size) = p.M.block(b);
  }
  p.J.add_band();
  for (int b = 0; b < 2; ++b) {
    const int size = p.M.block_size(b);
    const Eigen::MatrixXd rows = matrix(3, size);
    p.J.entry(p.J.add_entry(b, size)) = rows;
    J.middleCols(p.M.first[b], size) = rows;
  }
  const Eigen::VectorXd v = matrix(14, 1);
  p.v_minus.assign(v.begin(), v.end());
  p.offset = {0.3, -0.2, 0.1};
  p.mu = {0.5};
  p.restitution = {0};
  const Vector3d w(0.3, -0.2, 0.1), r(1, 2, -3);
  const Eigen::MatrixXd inverse = M.inverse();

  ImpactState state;
  std::string reason;
  REQUIRE(state.start(p, {.approach = 0, .rounding = 1}, reason) == Status::ok);
  CHECK((state.K(0) - J * inverse * J.transpose()).norm() < 1e-13);
  CHECK(state.K(0) == state.K(0).transpose());
  CHECK((state.velocity(0) - (J * v + w)).norm() < 1e-14);
  CHECK(state.normal_velocity(0) == Approx((J * v + w)[0]).epsilon(1e-13));
  const Vector3d terms = J.cwiseAbs() * v.cwiseAbs() + w.cwiseAbs();
  CHECK(state.slip_rounding(0) == Approx(terms.maxCoeff()));
  state.apply(0, r);
  CHECK((state.velocity(0) - (J * (v + inverse * J.transpose() * r) + w)).norm() < 1e-12);
  state.restart({r[0], r[1], r[2]});
  CHECK((state.velocity(0) - (J * (v + inverse * J.transpose() * r) + w)).norm() < 1e-12);
}

TEST_CASE("a contact that approaches and that nothing can move ends an event, one that parts does not") {
  for (const double offset : {-1.0, 1.0})
    for (const bool newton : {true, false}) {
      ContactProblem p = points();
      p.J.add_band();
      p.offset.insert(p.offset.end(), {offset, 0, 0});
      p.mu.push_back(0.5);
      p.restitution.push_back(0);
      ContactSolution s;
      (newton ? make_newton({}) : make_mirtich({}))(p, s);
      CHECK((s.status == Status::ok) == (offset > 0));
      if (offset < 0) {
        CHECK(s.status == Status::singular);
        CHECK(s.reason == "an approaching contact has no body that an impulse can move");
      }
    }
}

// The light ball's tolerance would let the heavy one sink in at 5e-5 m/s.
TEST_CASE("a light ball that hits a heavy one at a million m/s does not excuse how that approaches the ground") {
  ContactProblem p;
  add_body(p, 1e6, Vector3d::Constant(4e5), {0, -5e-5, 0});
  add_body(p, 1e-6, Vector3d::Constant(4e-7), {0, -1e6, 0});
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, ground_axes(), 0.5);
  for (const bool newton : {true, false}) {
    ContactSolution s;
    (newton ? make_newton({}) : make_mirtich({}))(p, s);
    CHECK(s.status == Status::ok);
    CHECK(outcome(p, s.impulse).v[1] > -1e-6);
  }
}
