// Primal-dual interior point method for small cone programs in impulses, dense and in long double.
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
// Source: as interior_point.cpp (Nesterov-Todd scaling, predictor and corrector). Pivoting does not need G^-1 to be
// bounded away from zero, but impulses are not unique, and where friction is strong the middle of the cones is far out:
// without the proximal term P they drift there, until the rounding of what cancels is more than the gap.
// Fails with `nonconverged` (iterations), `singular`, `not_finite`; the best iterate is returned.

#include "cone/dense_interior_point.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cone/interior_point.h"
#include "cone/second_order_cone.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Vec3 = ConeVector<Real>;

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
    Real best_merit = HUGE_VALL;
    int since_best = 0;
    for (int k = 0; k < options_.iteration_limit; ++k) {
      poll_stop();
      const Real merit = residuals();
      if (!std::isfinite(merit)) {
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
      since_best = merit < 0.5L * best_merit ? 0 : since_best + 1;
      best_merit = std::min(best_merit, merit);
      if (merit < rounding || (best_merit < near && since_best > patience)) break;
      if (merit < near && worth(solution) <= enough * options_.gap_tolerance) break;
      factor();
      predict();
      const Real affine = std::min<Real>(1, longest());
      correct((1 - affine) * (1 - affine) * (1 - affine) * complementarity_ / cones());
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
  static constexpr Real rounding = 1e-18L, accepted = 1e-12L, near = 1e-9L;
  // Of the gap that is asked for: the share of an answer that another iteration need not improve.
  static constexpr double enough = 1e-2;
  // Iterations in a row that do not halve the merit.
  static constexpr int patience = 6;
  // P, of 1, the contacts' mobility. It does not move the answer; larger: slower at the end.
  static constexpr Real proximal = 1e-15L;

  void form(const ConeProgram& p) {
    const int nv = p.nv();
    Matrix J = Matrix::Zero(3 * n_, nv);
    for (int c = 0; c < n_; ++c)
      for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
        const auto entry = p.J->entry(e);
        J.block(3 * c, p.M->first[p.J->block[e]], 3, entry.cols()) += entry.cast<Real>();
      }
    q_ = J * Eigen::Map<const Eigen::VectorXd>(p.v0->data(), nv).cast<Real>() +
         Eigen::Map<const Eigen::VectorXd>(p.offset->data(), 3 * n_).cast<Real>();
    d_.resize(n_);
    for (int c = 0; c < n_; ++c) {
      d_[c] = 1 / std::sqrt(Real((*p.weight)[c]));
      J.middleRows(3 * c, 3) *= d_[c];
      q_.segment(3 * c, 3) *= d_[c];
    }
    has_friction_.resize(n_);
    double mean_weight = 0;
    for (int c = 0; c < n_; ++c) {
      has_friction_[c] = mu_[c] > 0;
      mean_weight += std::log((*p.weight)[c]) / n_;
      if (!has_friction_[c]) q_[3 * c + 1] = q_[3 * c + 2] = 0;  // nothing depends on it
    }
    size_ = q_.norm();
    const Real impulse = p.impulse_size * std::sqrt(std::exp(mean_weight));
    if (impulse > 0 && impulse < size_) ratio_ = impulse / size_;
    rounded_q_.resize(3 * n_);
    for (int i = 0; i < 3 * n_; ++i) rounded_q_[i] = static_cast<double>(q_[i] / d_[i / 3]);
    if (size_ > 0) q_ /= size_;
    kappa_ = bound_ && size_ > 0 ? Real(p.kappa) / (ratio_ * size_) : 0;
    share_.resize(n_);
    for (int c = 0; c < n_; ++c) share_[c] = p.share_of(c) * d_[c];
    W_ = Matrix::Zero(3 * n_, 3 * n_);
    for (int b = 0; b < p.M->blocks(); ++b) {
      const int first = p.M->first[b], rows = p.M->block_size(b);
      const Matrix M = p.M->block(b).cast<Real>();
      const Matrix L_J = M.llt().matrixL().solve(J.middleCols(first, rows).transpose());
      W_.noalias() += L_J.transpose() * L_J;
    }
    K_.resize(unknowns(), unknowns());
    scaling_.resize(n_);
  }

  int at_e() const { return 3 * n_; }
  int at_s() const { return 3 * n_ + (below_ ? n_ : 0); }
  int unknowns() const { return at_s() + (bound_ ? 1 : 0); }
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
    const Real start = 1 / std::sqrt(Real(n_));
    at_.x = at_.y = Vector::Zero(3 * n_);
    at_.e = at_.a = Vector::Zero(n_);
    for (int c = 0; c < n_; ++c)
      if (inequality(
              c)) {  // a contact that parts has its slack from the start: it may be far from the scale of the rest
        at_.a[c] = std::max(start, q_[3 * c] / ratio_);
        at_.e[c] = start * start / at_.a[c];
      }
    for (int c = 0; c < n_; ++c) at_.x[3 * c] = at_.y[3 * c] = start;
    at_.s = bound_ ? start / d_.array().pow(Real(1) / n_).prod() : 0;
    at_.b = bound_ ? std::max(start * start / at_.s, kappa_ / 10) : 0;
  }

  // What the slacks of `at` should be for its impulses and multipliers, less what they are. Without `offsets`: of a
  // step.
  void slacks(const Point& at, bool offsets, Vector& y, Vector& a, Real& b) const {
    const Vector u = W_ * at.x;
    y = ratio_ * u;
    if (offsets) y += q_;
    a = Vector::Zero(n_);
    if (below_) {
      Vector normals = Vector::Zero(3 * n_);
      for (int c = 0; c < n_; ++c) {
        normals[3 * c] = at.e[c];
        a[c] = offsets ? u[3 * c] + q_[3 * c] / ratio_ + slack(c) : u[3 * c];
      }
      y.noalias() -= W_ * normals;
    }
    b = offsets ? kappa_ : 0;
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
    Real worst = bound_ ? std::abs(off_b_) : 0;
    for (int c = 0; c < n_; ++c) {
      if (!has_friction_[c]) off_y_[3 * c + 1] = off_y_[3 * c + 2] = 0;
      worst = std::max(worst, off_y_.segment<3>(3 * c).norm());
      if (below_) worst = std::max(worst, std::abs(off_a_[c]));
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
        certify(program_, rounded_.r, rounded_.eta, rounded_.s, velocities_, rounded_q_, options_.rounding_units);
    rounded_.gap = certificate.gap;
    rounded_.infeasibility = certificate.infeasibility;
  }

  double worth(const ConeSolution& x) const {
    return x.infeasibility <= options_.feasibility ? std::abs(x.gap) : HUGE_VAL;
  }

  void factor() {
    K_.setZero();
    K_.topLeftCorner(3 * n_, 3 * n_) = ratio_ * W_;
    K_.diagonal().head(3 * n_).array() += proximal;
    for (int c = 0; c < n_; ++c) {
      if (below_) {
        K_.col(at_e() + c).head(3 * n_) = -W_.col(3 * c);
        K_.row(at_e() + c).head(3 * n_) = W_.row(3 * c);
        K_(at_e() + c, at_e() + c) = inequality(c) ? at_.a[c] / at_.e[c] : proximal;
      }
      if (bound_) {
        K_(3 * c, at_s()) = share_[c];
        K_(at_s(), 3 * c) = -share_[c];
      }
      if (has_friction_[c]) {
        scaling_[c] = ConeScaling<Real>::of(in_primal(three(at_.x, c), mu_[c]), in_dual(three(at_.y, c), mu_[c]));
        Eigen::Matrix<Real, 3, 3> G = scaling_[c].inverse_squared();
        G.row(0) *= mu_[c];
        G.col(0) *= mu_[c];
        K_.block<3, 3>(3 * c, 3 * c) += G;
      } else {
        K_(3 * c, 3 * c) += at_.y[3 * c] / at_.x[3 * c];
      }
    }
    if (bound_) K_(at_s(), at_s()) = at_.b / at_.s;
    for (int c = 0; c < n_; ++c)
      for (int i = 3 * c + 1; i < 3 * c + 3 && !has_friction_[c]; ++i) {
        K_.row(i).setZero();
        K_.col(i).setZero();
        K_(i, i) = 1;
      }
    lu_.compute(K_);
  }

  // The step for right-hand sides of complementarity (in units of y, a and b), with one refinement.
  void solve() {
    Vector rhs(unknowns());
    rhs.head(3 * n_) = c_x_ + off_y_;
    for (int c = 0; c < n_; ++c)
      if (!has_friction_[c]) rhs[3 * c + 1] = rhs[3 * c + 2] = 0;
    if (below_) rhs.segment(at_e(), n_) = c_e_ + off_a_;
    if (bound_) rhs[at_s()] = c_s_ + off_b_;
    Vector z = lu_.solve(rhs);
    z += lu_.solve(rhs - K_ * z);
    step_.x = z.head(3 * n_);
    step_.e = below_ ? Vector(z.segment(at_e(), n_)) : Vector(Vector::Zero(n_));
    step_.s = bound_ ? z[at_s()] : 0;
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
    Real alpha = HUGE_VALL;
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
  Matrix W_, K_;
  Vector q_, d_, share_;       // q over U; share_: d where the bound counts the contact, else 0
  Real size_ = 0, ratio_ = 1,  // U, R / U
      kappa_ = 0, complementarity_ = 0;
  Point at_, step_;
  ConeSolution rounded_;
  std::vector<double> rounded_q_;  // m/s
  ConeVelocities velocities_;
  Vector off_y_, off_a_, c_x_, c_e_;
  Real off_b_ = 0, c_s_ = 0;
  std::vector<ConeScaling<Real>> scaling_;
  Eigen::PartialPivLU<Matrix> lu_;
};

}  // namespace

void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution) {
  Dense(program, options)(solution);
}

}  // namespace cb
