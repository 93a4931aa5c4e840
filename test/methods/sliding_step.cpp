// Single steps along sliding against the same methods written as their authors did, for any system of five numbers.

#include "methods/sliding_step.h"

#include <Eigen/LU>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace cb;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

using Five = Eigen::Matrix<double, 5, 1>;  // r_n, r_t1, r_t2 (N s), normal work and work of friction (J)
using Jacobian = Eigen::Matrix<double, 5, 5>;

/// Sliding at one contact: (3) of stronge_impact.cpp, whose direction K turns.
struct Sliding {
  Matrix3d K;
  Vector3d start;  // m/s
  double mu;

  Vector3d velocity(const Five& y) const { return start + K * y.head<3>(); }
  Five slope(const Five& y) const {
    const Vector3d u = velocity(y);
    const double s = std::hypot(u[1], u[2]);
    Five out;
    out << s, -mu * u[1], -mu * u[2], s * u[0], -mu * s * s;
    return out;
  }
  Jacobian jacobian() const {
    const double s = std::hypot(start[1], start[2]);
    const Vector3d of_s(0, start[1] / s, start[2] / s);  // ds/du
    Eigen::Matrix<double, 5, 3> by_u;
    by_u.row(0) = of_s;
    by_u.row(1) << 0, -mu, 0;
    by_u.row(2) << 0, 0, -mu;
    by_u.row(3) = start[0] * of_s.transpose() + s * Eigen::RowVector3d(1, 0, 0);
    by_u.row(4) = -2 * mu * s * of_s;
    Jacobian out = Jacobian::Zero();
    out.leftCols<3>() = by_u * K;
    return out;
  }
};

struct Step {
  Five move, error;  // what the step adds, and how far the method of lower order is from it
};

/// Dormand and Prince 1980, table 2: both rows of weights as published.
Step dormand_prince_step(const Sliding& sliding, double h) {
  constexpr double a[7][6] = {{},
                              {1.0 / 5},
                              {3.0 / 40, 9.0 / 40},
                              {44.0 / 45, -56.0 / 15, 32.0 / 9},
                              {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                              {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                              {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
  constexpr double fifth[7] = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0};
  constexpr double fourth[7] = {5179.0 / 57600, 0,       7571.0 / 16695, 393.0 / 640, -92097.0 / 339200,
                                187.0 / 2100,   1.0 / 40};
  Five k[7];
  Step out{Five::Zero(), Five::Zero()};
  for (int i = 0; i < 7; ++i) {
    Five y = Five::Zero();
    for (int j = 0; j < i; ++j) y += h * a[i][j] * k[j];
    k[i] = sliding.slope(y);
    out.move += h * fifth[i] * k[i];
    out.error += h * (fifth[i] - fourth[i]) * k[i];
  }
  return out;
}

/// RODAS3 as a Rosenbrock method: (1 - gamma h J) k_i = h f(y + sum alpha_ij k_j) + h J sum gamma_ij k_j.
Step rodas3_step(const Sliding& sliding, double h) {
  constexpr double gamma = 1.0 / 2;
  constexpr double alphas[4][3] = {{}, {}, {1, 0}, {3.0 / 4, -1.0 / 4, 1.0 / 2}};
  constexpr double gammas[4][3] = {{}, {1}, {-1.0 / 4, -1.0 / 4}, {1.0 / 12, 1.0 / 12, -2.0 / 3}};
  constexpr double third[4] = {5.0 / 6, -1.0 / 6, -1.0 / 6, 1.0 / 2}, second[4] = {3.0 / 4, -1.0 / 4, 1.0 / 2, 0};
  const Jacobian J = sliding.jacobian();
  const Jacobian inverse = (Jacobian::Identity() - gamma * h * J).inverse();
  Five k[4];
  Step out{Five::Zero(), Five::Zero()};
  for (int i = 0; i < 4; ++i) {
    Five y = Five::Zero(), implicit = Five::Zero();
    for (int j = 0; j < i; ++j) {
      y += alphas[i][j] * k[j];
      implicit += gammas[i][j] * k[j];
    }
    k[i] = inverse * (h * sliding.slope(y) + h * J * implicit);
    out.move += third[i] * k[i];
    out.error += (third[i] - second[i]) * k[i];
  }
  return out;
}

/// A body of random size hit anywhere, sliding anyhow: nothing of K is zero.
Sliding random_sliding(std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vector3d(uniform(generator), uniform(generator), uniform(generator)); };
  Matrix3d half;
  for (int i = 0; i < 3; ++i) half.col(i) = vector();
  const double size = std::pow(10.0, uniform(generator));
  const Matrix3d K = size * (half * half.transpose() + 0.1 * Matrix3d::Identity());
  return {K, 3 * vector() + Vector3d(0, 1, 0), 0.1 + std::abs(uniform(generator))};
}

/// A point of the way there, so that steps add to what was.
ImpactPoint somewhere() {
  ImpactPoint out;
  out.r = Vector3d(0.7, -0.2, 0.4);
  out.work = -3;
  out.friction = -5;
  return out;
}

Five numbers(const ImpactPoint& of) {
  Five out;
  out << of.r, of.work, of.friction;
  return out;
}

/// Error over what is allowed, by the header.
double over(const Sliding& sliding, const Step& step, const ImpactPoint& from, const StepErrors& allowed) {
  const Vector3d du = sliding.K * step.error.head<3>(), u = sliding.velocity(step.move);
  return std::max(
      {du.cwiseAbs().maxCoeff() / allowed.velocity, std::abs(step.error[3]) / allowed.work,
       std::abs(step.error[4]) / (allowed.work + allowed.friction_relative * std::abs(from.friction + step.move[4])),
       std::hypot(du[1], du[2]) / std::hypot(u[1], u[2]) / allowed.turn});
}

// One bound at a time binds; the last leaves it open which one does.
constexpr double none = 1e30;
const StepErrors bounds[] = {{.velocity = 1e-3, .work = none, .friction_relative = none, .turn = none},
                             {.velocity = none, .work = 1e-3, .friction_relative = none, .turn = none},
                             {.velocity = none, .work = 1e-3, .friction_relative = 0, .turn = none},
                             {.velocity = none, .work = 1e-9, .friction_relative = 1e-3, .turn = none},
                             {.velocity = none, .work = none, .friction_relative = none, .turn = 1e-3},
                             {.velocity = 1e-3, .work = 2e-3, .friction_relative = 1e-4, .turn = 3e-3}};

template <class Published, class Ours>
void compare(const Published& published, const Ours& ours) {
  std::mt19937 generator(8);
  for (int i = 0; i < 60; ++i) {
    const Sliding sliding = random_sliding(generator);
    const double h = (0.5 + 0.2 * (i % 5)) / sliding.K.trace() / (1 + sliding.mu);
    const ImpactPoint from = somewhere();
    const Step step = published(sliding, h);
    for (const StepErrors& allowed : bounds) {
      ImpactPoint y;
      const double error = ours(SlidingStep(sliding.K, sliding.mu, allowed), sliding.start, h, from, y);
      const Five moved = numbers(y) - numbers(from);
      for (int k = 0; k < 5; ++k) CHECK(std::abs(moved[k] - step.move[k]) <= 1e-13 * (5 + std::abs(step.move[k])));
      CHECK(error == Approx(over(sliding, step, from, allowed)).epsilon(1e-4));
    }
  }
}

}  // namespace

TEST_CASE("an explicit step of sliding is Dormand and Prince's, and its error that of the order below") {
  compare(dormand_prince_step, [](const SlidingStep& by, const Vector3d& start, double h, const ImpactPoint& from,
                                  ImpactPoint& y) { return by.explicit_step(start, h, from, y); });
}

TEST_CASE("a stiff step of sliding is RODAS3's, and its error that of the order below") {
  compare(rodas3_step, [](const SlidingStep& by, const Vector3d& start, double h, const ImpactPoint& from,
                          ImpactPoint& y) { return by.stiff_step(start, h, from, y); });
}

TEST_CASE("a step of sliding half as long misses by a sixty-fourth, or by a sixteenth if stiff, where it was short") {
  std::mt19937 generator(4);
  for (int i = 0; i < 10; ++i) {
    const Sliding sliding = random_sliding(generator);
    const double h = 0.05 / sliding.K.trace() / (1 + sliding.mu);
    const StepErrors allowed{.velocity = 1, .work = 1, .friction_relative = 1, .turn = 1};
    const SlidingStep by(sliding.K, sliding.mu, allowed);
    // Where it would be exactly: many short steps.
    const auto missed = [&](bool stiff, double length) {
      const int parts = 50;
      ImpactPoint exact, y;
      for (int k = 0; k < parts; ++k) {
        const ImpactPoint from = exact;
        by.explicit_step(sliding.start + sliding.K * from.r, length / parts, from, exact);
      }
      if (stiff)
        by.stiff_step(sliding.start, length, {}, y);
      else
        by.explicit_step(sliding.start, length, {}, y);
      return (numbers(y) - numbers(exact)).norm();
    };
    // Of order 3 and of order 5 at the least.
    CHECK(missed(true, h) > 10 * missed(true, h / 2));
    CHECK(missed(false, 16 * h) > 30 * missed(false, 8 * h));
  }
}
