// Between two impacts: velocities, what counts as an approach, who is touched by whom.

#include "methods/impact_state.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

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
  CHECK(state.approach_before() == 4);
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
      CHECK(state.approach_before() == (row == 0 && sign < 0 ? 21 : 4));
    }
}

TEST_CASE("a joint's limit is weighed by its normal row alone, a contact by the mean of its three") {
  // Both approach at 1 m/s. A limit of 4 kg: w = 1/4. A contact of 1 kg whose tangents give way more: w = (1 + 7 + 7)
  // / 3.
  ContactProblem p;
  p.M.block(p.M.add_block(3)) = Vector3d(4, 1, 1.0 / 7).asDiagonal();
  p.v_minus = {-1, -1, 0};
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
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(p, {.approach = 1e-2, .rounding = 0}, reason) == Status::ok);
  CHECK((state.K(1) - Matrix3d(Eigen::Matrix3d{{1, 0, 0}, {0, 7, 7}, {0, 7, 7}})).norm() < 1e-14);
  // Fastest: 1 m/s; in sqrt(J) that of the limit, 2, which are 1 m/s at its weight and more at the other.
  CHECK(state.approach_tolerance(0) == Approx(1e-2));
  CHECK(state.approach_tolerance(1) == Approx(1e-2));
  // A slower limit: 0.02 m/s are 0.04 sqrt(J), the contact's 0.1 m/s are 0.1 / sqrt(5), and half as many m/s at the
  // limit.
  p.v_minus = {-0.02, -0.1, 0};
  REQUIRE(state.start(p, {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
  CHECK(state.approach_tolerance(0) == Approx(1e-3 / std::sqrt(20)));
  CHECK(state.approach_tolerance(1) == Approx(1e-3));
  CHECK(state.slip_rounding(0) == Approx(1e-5));
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
  CHECK(state.approach_before() == 0);
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
