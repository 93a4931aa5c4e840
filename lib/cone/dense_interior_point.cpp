// Primal-dual interior point method for small cone programs in impulses, dense and in DoubleDouble.
//
// Problem: as in interior_point.cpp, scaled by the contacts' mobilities w_i and the sizes of velocities and impulses,
// U and R <= U (sqrt J), c = R / U:
//   x_i = sqrt(w_i) r_i / R,  e_i = sqrt(w_i) eta_i / U,  W with rows and columns, q with rows over sqrt(w_i),
//   d_i = 1 / sqrt(w_i);
//   y = c W x + q / U - W_n e + d s,  a = (W x + q / R)_n,  b = kappa / R - d.x_n     (all three >= 0 in their cones)
// Newton step, G^-1 the inverse of the squared scaling of a contact, c_x.. the right-hand sides of complementarity:
//   [ c W + G^-1 + P   -W_n       d  ] [dx]   [ c_x + y - (c W x + q / U - W_n e + d s) ]
//   [ W_n'             a / e      0  ] [de] = [ c_e + a - (W x + q / R)_n               ]
//   [ -d'              0        b / s] [ds]   [ c_s + b - kappa / R + d.x_n             ]
// Source: as interior_point.cpp (Nesterov-Todd scaling, predictor and corrector); the system is solved in velocities
// (dense_newton.h). Where light bodies lie between heavy ones, or contacts tilt by the last bits of the data,
// multipliers are 1e6 to 1e9 of what there is to solve, and 16 digits do not know the rest; 32 do. P is there because
// impulses are not unique, and where friction is strong the middle of the cones is far out.
// Fails with `nonconverged` (iterations), `singular`, `not_finite`; the best iterate is returned.

#include "cone/dense_interior_point.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cone/dense_newton.h"
#include "cone/interior_point.h"
#include "cone/second_order_cone.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using Real = DoubleDouble;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Vec3 = ConeVector<Real>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;

/// A point, or a step: impulses, multipliers, and their slacks.
struct Point {
  Vector x, y, e, a;
  Real s = 0, b = 0;
};

class Dense {
 public:
  Dense(const ConeProgram& program, const ConeOptions& options)
      : program_(program),
        options_(options),
        n_(program.nc()),
        below_(program.has_eta()),
        bound_(program.has_bound()),
        mu_(program.mu->begin(), program.mu->end()) {
    form(program);
  }

  void operator()(ConeSolution& solution) {
    solution = {};
    solution.r.assign(3 * n_, 0.0);
    solution.eta.assign(n_, 0.0);
    if (n_ == 0 || size_ == 0) {
      solution.status = ConeStatus::solved;
      solution.gap = solution.infeasibility = 0;
      return;
    }
    start();
    Real best_merit = HUGE_VAL;
    int since_best = 0;
    for (int k = 0; k < options_.iteration_limit; ++k) {
      poll_stop();
      const Real merit = residuals();
      if (!isfinite(merit)) {
        solution.status = ConeStatus::not_finite;
        break;
      }
      // The certificate decides between iterates, because it multiplies by mu what the impulses lose as doubles, and
      // each loses something else; as long as there is none, the merit.
      const bool nearer = merit < best_merit;
      round_off();
      if (worth(rounded_) < worth(solution) || (worth(solution) == HUGE_VAL && nearer)) {
        rounded_.iterations = solution.iterations;
        solution = rounded_;
      }
      since_best = merit < 0.5 * best_merit ? 0 : since_best + 1;
      best_merit = std::min(best_merit, merit);
      if (merit < rounding || (best_merit < near && since_best > patience)) break;
      if (merit < accepted && worth(solution) <= enough * program_.gap) break;
      if (!factor()) {
        solution.status = ConeStatus::singular;
        break;
      }
      predict();
      const Real affine = std::min<Real>(1, longest());
      // Never to the edge itself: products that fall far behind the others leave no room for the path's turns.
      correct(std::max<Real>(least_centre, (1 - affine) * (1 - affine) * (1 - affine)) * complementarity_ / cones());
      const Real alpha = std::min<Real>(1, Real(options_.step_fraction) * longest());
      if (!(alpha > 0)) {
        solution.status = ConeStatus::singular;
        break;
      }
      move(alpha);
      ++solution.iterations;
    }
    if (best_merit < accepted) solution.status = ConeStatus::solved;
  }

 private:
  // Of 1, the scaled problem's size. Where the iteration ends: looser leaves less to the certificate, which multiplies
  // by mu. What counts as solved where rounding ends it before that. From where on it is given up without progress:
  // before that it may well come back from iterates that are worse.
  static constexpr double rounding = 1e-18, accepted = 1e-12, near = 1e-9;
  // Iterations in a row that do not halve the merit.
  static constexpr int patience = 6;
  // Complementarity aimed at, of the present.
  static constexpr double least_centre = 1e-2;
  // Of the gap that is asked for: the share of an answer that another iteration need not improve.
  static constexpr double enough = 1e-2;

  void form(const ConeProgram& p) {
    q_.resize(3 * n_);
    for (int c = 0; c < n_; ++c) {
      Vec3 u = Eigen::Map<const Eigen::Vector3d>(&(*p.offset)[3 * c]).cast<Real>();
      for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
        const int b = p.J->block[e];
        u += p.J->entry(e).cast<Real>() *
             Eigen::Map<const Eigen::VectorXd>(&(*p.v0)[p.M->first[b]], p.M->block_size(b)).cast<Real>();
      }
      q_.segment<3>(3 * c) = u;
    }
    d_.resize(n_);
    for (int c = 0; c < n_; ++c) {
      d_[c] = 1 / sqrt(Real((*p.weight)[c]));
      q_.segment(3 * c, 3) *= d_[c];
    }
    has_friction_.resize(n_);
    for (int c = 0; c < n_; ++c) {
      has_friction_[c] = mu_[c] > 0;
      mean_log_weight_ += std::log((*p.weight)[c]) / n_;
      if (!has_friction_[c]) q_[3 * c + 1] = q_[3 * c + 2] = 0;  // nothing depends on it
    }
    size_ = q_.norm();
    const Real impulse = p.impulse_size * std::exp(mean_log_weight_ / 2);
    if (impulse > 0 && impulse < size_) ratio_ = impulse / size_;
    rounded_q_.resize(3 * n_);
    for (int i = 0; i < 3 * n_; ++i) rounded_q_[i] = static_cast<double>(q_[i] / d_[i / 3]);
    if (size_ > 0) q_ /= size_;
    kappa_ = bound_ && size_ > 0 ? Real(p.kappa) / (ratio_ * size_) : 0;
    share_.resize(n_);
    for (int c = 0; c < n_; ++c) share_[c] = p.share_of(c) * d_[c];
    scaling_.resize(n_);
    newton_.form(p, d_, share_, ratio_, below_, bound_);
  }

  bool inequality(int c) const { return program_.bounded_below && !program_.is_fixed(c); }
  int cones() const {
    int count = n_ + (bound_ ? 1 : 0);
    for (int c = 0; c < n_; ++c) count += inequality(c) ? 1 : 0;
    return count;
  }
  // Of a contact's normal velocity, scaled as `a`.
  Real slack(int c) const { return Real(program_.slack_of(c)) * d_[c] / (ratio_ * size_); }
  const Real* three(const Vector& x, int c) const { return x.data() + 3 * c; }

  // On the axis of each cone, at the scale of the problem.
  void start() {
    const Real start = 1 / sqrt(Real(n_));
    at_.x = at_.y = Vector::Zero(3 * n_);
    at_.e = at_.a = Vector::Zero(n_);
    for (int c = 0; c < n_; ++c)
      if (inequality(
              c)) {  // a contact that parts has its slack from the start: it may be far from the scale of the rest
        at_.a[c] = std::max(start, q_[3 * c] / ratio_);
        at_.e[c] = start * start / at_.a[c];
      }
    for (int c = 0; c < n_; ++c) at_.x[3 * c] = at_.y[3 * c] = start;
    at_.s = bound_ ? start * std::exp(mean_log_weight_ / 2) : Real(0);
    at_.b = bound_ ? std::max(start * start / at_.s, kappa_ / 10) : 0;
  }

  // What the slacks of `at` should be for its impulses and multipliers, less what they are. Without `offsets`: of a
  // step.
  void slacks(const Point& at, bool offsets, Vector& y, Vector& a, Real& b) const {
    a = Vector::Zero(n_);
    Vector u, load = ratio_ * at.x;
    if (below_) {
      newton_.columns().momentum(at.x, momentum_);
      newton_.columns().velocities(momentum_, u);
      for (int c = 0; c < n_; ++c) {
        load[3 * c] -= at.e[c];
        a[c] = offsets ? u[3 * c] + q_[3 * c] / ratio_ + slack(c) : u[3 * c];
      }
    }
    newton_.columns().momentum(load, momentum_);
    newton_.columns().velocities(momentum_, y);
    if (offsets) y += q_;
    b = offsets ? kappa_ : Real(0);
    if (bound_)
      for (int c = 0; c < n_; ++c) {
        y[3 * c] += share_[c] * at.s;
        b -= share_[c] * at.x[3 * c];
      }
  }
  // Largest of complementarity and of what the slacks are off by.
  Real residuals() {
    slacks(at_, true, off_y_, off_a_, off_b_);
    off_y_ = at_.y - off_y_;
    off_a_ = at_.a - off_a_;
    off_b_ = at_.b - off_b_;
    complementarity_ = at_.x.dot(at_.y) + at_.e.dot(at_.a) + at_.s * at_.b;
    Real worst = bound_ ? abs(off_b_) : 0;
    for (int c = 0; c < n_; ++c) {
      if (!has_friction_[c]) off_y_[3 * c + 1] = off_y_[3 * c + 2] = 0;
      worst = std::max(worst, off_y_.segment<3>(3 * c).norm());
      if (below_) worst = std::max(worst, abs(off_a_[c]));
    }
    return std::max(complementarity_, worst);
  }

  // The point as doubles in the problem's units, and what a stranger would say of it.
  void round_off() {
    rounded_.r.resize(3 * n_);
    rounded_.eta.resize(n_);
    for (int c = 0; c < n_; ++c) {
      for (int i = 0; i < 3; ++i)
        rounded_.r[3 * c + i] = static_cast<double>(at_.x[3 * c + i] * d_[c] * ratio_ * size_);
      rounded_.eta[c] = static_cast<double>(at_.e[c] * d_[c] * size_);
    }
    rounded_.s = static_cast<double>(at_.s * size_);
    velocities_.evaluate(program_, rounded_.r, rounded_.eta);
    velocities_.bound_rounding(program_, rounded_.r, {});
    const Certificate certificate =
        certify(program_, rounded_.r, rounded_.eta, velocities_, rounded_q_, options_.rounding_units);
    rounded_.gap = certificate.gap;
    rounded_.infeasibility = certificate.infeasibility;
  }

  double worth(const ConeSolution& x) const {
    return x.infeasibility <= options_.feasibility ? std::abs(x.gap) : HUGE_VAL;
  }

  bool factor() {
    for (int c = 0; c < n_; ++c) {
      Matrix3 G = Matrix3::Zero(), G_inverse = Matrix3::Zero();
      if (has_friction_[c]) {
        scaling_[c] = ConeScaling<Real>::of(in_primal(three(at_.x, c), mu_[c]), in_dual(three(at_.y, c), mu_[c]));
        G_inverse = scaling_[c].inverse_squared();
        G_inverse.row(0) *= mu_[c];
        G_inverse.col(0) *= mu_[c];
        G = scaling_[c].squared();
        G.row(0) /= mu_[c];
        G.col(0) /= mu_[c];
      } else {
        G(0, 0) = at_.x[3 * c] / at_.y[3 * c];
        G_inverse(0, 0) = at_.y[3 * c] / at_.x[3 * c];
      }
      newton_.set(c, G, G_inverse, inequality(c) ? at_.a[c] / at_.e[c] : Real(0));
    }
    return newton_.factor(bound_ ? at_.b / at_.s : Real(0));
  }

  // The step for right-hand sides of complementarity (in units of y, a and b).
  void solve() {
    const int at_e = newton_.at_e(), at_s = newton_.at_s();
    Vector rhs(newton_.unknowns()), z;
    rhs.head(3 * n_) = c_x_ + off_y_;
    for (int c = 0; c < n_; ++c)
      if (!has_friction_[c]) rhs[3 * c + 1] = rhs[3 * c + 2] = 0;
    if (below_) rhs.segment(at_e, n_) = c_e_ + off_a_;
    if (bound_) rhs[at_s] = c_s_ + off_b_;
    newton_.solve(rhs, z);
    step_.x = z.head(3 * n_);
    step_.e = below_ ? Vector(z.segment(at_e, n_)) : Vector(Vector::Zero(n_));
    step_.s = bound_ ? z[at_s] : Real(0);
    slacks(step_, false, step_.y, step_.a, step_.b);
    step_.y -= off_y_;
    step_.a -= off_a_;
    for (int c = 0; c < n_; ++c)
      if (!inequality(c)) step_.a[c] = 0;  // there is no slack
    step_.b -= off_b_;
  }

  void predict() {
    c_x_ = -at_.y;
    c_e_ = -at_.a;
    c_s_ = -at_.b;
    solve();
  }

  // To complementarity `centre`, with the second order of the predicted step.
  void correct(Real centre) {
    for (int c = 0; c < n_; ++c) {
      if (has_friction_[c]) {
        const ConeScaling<Real>& s = scaling_[c];
        const Vec3 lambda = s.apply(in_dual(three(at_.y, c), mu_[c]));
        Vec3 product = -jordan<Real>(s.apply_inverse(in_primal(three(step_.x, c), mu_[c])),
                                     s.apply(in_dual(three(step_.y, c), mu_[c])));
        product[0] += centre;
        const Vec3 more = s.apply_inverse(jordan_divide(lambda, product));
        c_x_.segment<3>(3 * c) += Vec3(mu_[c] * more[0], more[1], more[2]);
      } else {
        c_x_[3 * c] += (centre - step_.x[3 * c] * step_.y[3 * c]) / at_.x[3 * c];
      }
      if (inequality(c)) c_e_[c] += (centre - step_.e[c] * step_.a[c]) / at_.e[c];
    }
    if (bound_) c_s_ += (centre - step_.s * step_.b) / at_.s;
    solve();
  }

  Real longest() const {
    Real alpha = Real(HUGE_VAL);
    for (int c = 0; c < n_; ++c) {
      if (has_friction_[c])
        alpha =
            std::min({alpha, cone_step<Real>(in_primal(three(at_.x, c), mu_[c]), in_primal(three(step_.x, c), mu_[c])),
                      cone_step<Real>(in_dual(three(at_.y, c), mu_[c]), in_dual(three(step_.y, c), mu_[c]))});
      else
        alpha = std::min({alpha, ray_step(at_.x[3 * c], step_.x[3 * c]), ray_step(at_.y[3 * c], step_.y[3 * c])});
      if (inequality(c)) alpha = std::min({alpha, ray_step(at_.e[c], step_.e[c]), ray_step(at_.a[c], step_.a[c])});
    }
    if (bound_) alpha = std::min({alpha, ray_step(at_.s, step_.s), ray_step(at_.b, step_.b)});
    return alpha;
  }

  void move(Real alpha) {
    at_.x += alpha * step_.x;
    at_.y += alpha * step_.y;
    at_.e += alpha * step_.e;
    at_.a += alpha * step_.a;
    at_.s += alpha * step_.s;
    at_.b += alpha * step_.b;
  }

  const ConeProgram& program_;
  const ConeOptions& options_;
  const int n_;
  const bool below_, bound_;
  std::vector<Real> mu_;
  std::vector<char> has_friction_;
  DenseNewton newton_;
  mutable DoubleDoubleVector momentum_;
  Vector q_, d_, share_;        // q over U; share_: d where the bound counts the contact, else 0
  double mean_log_weight_ = 0;  // d = exp(-half of it), in the geometric mean
  Real size_ = 0, ratio_ = 1,   // U, R / U
      kappa_ = 0, complementarity_ = 0;
  Point at_, step_;
  ConeSolution rounded_;
  std::vector<double> rounded_q_;  // m/s
  ConeVelocities velocities_;
  Vector off_y_, off_a_, c_x_, c_e_;
  Real off_b_ = 0, c_s_ = 0;
  std::vector<ConeScaling<Real>> scaling_;
};

}  // namespace

void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution) {
  Dense(program, options)(solution);
}

}  // namespace cb
