// One step along sliding whose direction turns, of an impact at one contact.
//
// Problem: (3) of stronge_impact.cpp, five numbers over sigma; h > 0 in kg m/s per m/s.
// Source: J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980);
// RODAS3: A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II, Atmos. Environ. 31
// (1997).
// Differences: none in the methods; a step is bounded by its errors in velocity, works and direction of sliding.
// Does not fail: where the data overflow the error that is returned is not finite.

#include "methods/sliding_step.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "linalg/dormand_prince.h"

namespace cb {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Local errors of the velocity, the works and the direction of sliding at the end of a step, where the slip is
// `slip`, over what is allowed.
double SlidingStep::over_allowed(const Vector3d& du, double work, double friction, double slip,
                                 const ImpactPoint& y) const {
  // The direction of sliding must be known too, to the end: without that bound the step outgrows what is stable.
  const double turn2 = (du[1] * du[1] + du[2] * du[2]) / (slip * slip * allowed_.turn * allowed_.turn);
  const double works =
      std::max(std::abs(work) / allowed_.work,
               std::abs(friction) / (allowed_.work + allowed_.friction_relative * std::abs(y.friction)));
  return std::max({du.cwiseAbs().maxCoeff() / allowed_.velocity, works, std::sqrt(turn2)});
}

// Four solves with one 3 x 3 matrix; the works follow from r.
double SlidingStep::stiff_step(const Vector3d& start, double h, const ImpactPoint& from, ImpactPoint& y) const {
  const auto slopes = [&](const Vector3d& r) {
    const Vector3d u = start + K_ * r;
    const double s = std::hypot(u[1], u[2]);
    return ImpactPoint{Vector3d(s, -mu_ * u[1], -mu_ * u[2]), s * u[0], -mu_ * s * s};
  };
  const double s0 = std::hypot(start[1], start[2]);
  const Eigen::RowVector3d slip_slope = (start[1] * K_.row(1) + start[2] * K_.row(2)) / s0;
  const Eigen::RowVector3d work_slope = start[0] * slip_slope + s0 * K_.row(0);
  const Eigen::RowVector3d friction_slope = -2 * mu_ * s0 * slip_slope;
  Matrix3d matrix = 2 / h * Matrix3d::Identity();
  matrix.row(0) -= slip_slope;
  matrix.bottomRows<2>() += mu_ * K_.bottomRows<2>();
  const Matrix3d inverse = matrix.inverse();
  // (2 / h - J) U = f(y + sum a U_j) + sum (c / h) U_j
  const auto stage = [&](const ImpactPoint& f, const ImpactPoint& c) {
    ImpactPoint U;
    U.r = inverse * (f.r + c.r / h);
    U.work = h / 2 * (f.work + c.work / h + work_slope * U.r);
    U.friction = h / 2 * (f.friction + c.friction / h + friction_slope * U.r);
    return U;
  };
  const auto sum = [](double a, const ImpactPoint& x, double b, const ImpactPoint& z) {
    return ImpactPoint{a * x.r + b * z.r, a * x.work + b * z.work, a * x.friction + b * z.friction};
  };
  const ImpactPoint f1 = slopes(Vector3d::Zero());
  const ImpactPoint U1 = stage(f1, {});
  const ImpactPoint U2 = stage(f1, sum(4, U1, 0, U1));
  const ImpactPoint U3 = stage(slopes(2 * U1.r), sum(1, U1, -1, U2));
  const ImpactPoint U4 = stage(slopes(2 * U1.r + U3.r), sum(1, sum(1, U1, -1, U2), -8.0 / 3, U3));
  const ImpactPoint move = sum(1, sum(2, U1, 1, U3), 1, U4);
  y = sum(1, from, 1, move);
  const Vector3d u = start + K_ * move.r;
  return over_allowed(K_ * U4.r, U4.work, U4.friction, std::hypot(u[1], u[2]), y);
}

// Written out in the slopes s, u_t1, u_t2 of each stage, of which all else is a combination.
double SlidingStep::explicit_step(const Vector3d& start, double h, const ImpactPoint& from, ImpactPoint& y) const {
  using namespace dormand_prince;
  struct Stage {
    double n, t1, t2, s;  // u and |u_t|
  };
  const auto at = [&](double s, double t1, double t2) {
    Stage k{start[0] + h * (column_n_[0] * s + column_1_[0] * t1 + column_2_[0] * t2),
            start[1] + h * (column_n_[1] * s + column_1_[1] * t1 + column_2_[1] * t2),
            start[2] + h * (column_n_[2] * s + column_1_[2] * t1 + column_2_[2] * t2), 0};
    k.s = std::sqrt(k.t1 * k.t1 + k.t2 * k.t2);
    return k;
  };
  const auto stage = [&](const auto& sum) { return at(sum(&Stage::s), sum(&Stage::t1), sum(&Stage::t2)); };
  const Stage k1{start[0], start[1], start[2], std::sqrt(start[1] * start[1] + start[2] * start[2])};
  const Stage k2 = stage([&](auto f) { return second(k1.*f); });
  const Stage k3 = stage([&](auto f) { return third(k1.*f, k2.*f); });
  const Stage k4 = stage([&](auto f) { return fourth(k1.*f, k2.*f, k3.*f); });
  const Stage k5 = stage([&](auto f) { return fifth(k1.*f, k2.*f, k3.*f, k4.*f); });
  const Stage k6 = stage([&](auto f) { return sixth(k1.*f, k2.*f, k3.*f, k4.*f, k5.*f); });
  const auto mean = [&](const auto& f) { return whole(f(k1), f(k3), f(k4), f(k5), f(k6)); };
  const auto s = [](const Stage& k) { return k.s; };
  const auto t1 = [](const Stage& k) { return k.t1; };
  const auto t2 = [](const Stage& k) { return k.t2; };
  const auto work = [](const Stage& k) { return k.s * k.n; };
  const auto friction = [](const Stage& k) { return k.s * k.s; };
  const double p = mean(s), q1 = mean(t1), q2 = mean(t2);
  const Stage k7 = at(p, q1, q2);
  y.r = from.r + h * Vector3d(p, -mu_ * q1, -mu_ * q2);
  y.work = from.work + h * mean(work);
  y.friction = from.friction - mu_ * h * mean(friction);

  const auto missed = [&](const auto& f) { return h * error(f(k1), f(k3), f(k4), f(k5), f(k6), f(k7)); };
  const Vector3d du = missed(s) * column_n_ + missed(t1) * column_1_ + missed(t2) * column_2_;
  return over_allowed(du, missed(work), mu_ * missed(friction), k7.s, y);
}

}  // namespace cb
