// Primal-dual interior point method for the cone programs of cone_program.h, and the Newton method that finishes them.
//
// Problem (nc contacts, r in N s, v and u in m/s, energies in J):
//   min 1/2 v.M v,  v = v0 + M^-1 J^T r,   r_i in K_i,   u_n = N v + w_n >= 0 (or = 0),   d.r <= kappa
// Optimality, with y_i in the dual cone K_i*: mu |y_t| <= y_n, eta >= 0 (free where u_n = 0 is asked), s >= 0:
//   y = J v_hat + w + s d,  v_hat = v - M^-1 N^T eta,   r.y = 0,   eta.u_n = 0,   s (kappa - d.r) = 0
// Both methods linearise to   dr = c_r - G (J dv_hat + d ds),   deta = c_eta - D N dv   and solve one sparse system
// in the velocities (kkt_system.h), bordered by the row of the bound.
//
// Source: S. Boyd, L. Vandenberghe, Convex Optimization, 2004, ch. 11.7 (primal-dual method), with
//   1. Nesterov-Todd scaling and Mehrotra's predictor and corrector for second-order cones in place of the barrier of
//      the squared constraint (L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010, sec. 4-6);
//   2. a finish by Newton's method on the natural map r = P_K(r - y / w) with a proximal term, because a barrier method
//      ends at the square root of rounding on degenerate problems (r is not unique, strict feasibility may fail).
// Fails with `nonconverged` (iteration limit or step length), `singular`, `not_finite`; r is then the best iterate met.

#include "cone/interior_point.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cone/second_order_cone.h"
#include "linalg/stop.h"

namespace cb {

std::string_view name(ConeStatus status) {
  switch (status) {
    case ConeStatus::solved:
      return "solved";
    case ConeStatus::nonconverged:
      return "nonconverged";
    case ConeStatus::singular:
      return "singular";
    case ConeStatus::not_finite:
      return "not_finite";
  }
  return "";
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
// The numbers at x, as a vector or matrix.
Eigen::Map<Vector3d> vec3(double* x) { return Eigen::Map<Vector3d>(x); }
Eigen::Map<const Vector3d> vec3(const double* x) { return Eigen::Map<const Vector3d>(x); }
Eigen::Map<Matrix3d> mat3(double* x) { return Eigen::Map<Matrix3d>(x); }

double tangential(const double* x) { return std::sqrt(x[1] * x[1] + x[2] * x[2]); }

double dot(std::span<const double> x, std::span<const double> y) {
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
  return sum;
}

bool finite(std::span<const double> x) {
  double sum = 0;
  for (double value : x) sum += value * 0.0;
  return sum == 0;
}

// y += N^T x, x one number a band.
void add_normals(const ConeProgram& p, std::span<const double> x, std::span<double> y) {
  const BandMatrix& J = *p.J;
  for (int c = 0; c < J.bands(); ++c) {
    if (x[c] == 0) continue;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* values = J.values.data() + J.offset[e];
      double* out = y.data() + p.M->first[J.block[e]];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      for (int j = 0; j < cols; ++j) out[j] += values[3 * j] * x[c];
    }
  }
}

// x = N v, one number a band.
void normals(const ConeProgram& p, std::span<const double> v, std::span<double> x) {
  const BandMatrix& J = *p.J;
  for (int c = 0; c < J.bands(); ++c) {
    double sum = 0;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* values = J.values.data() + J.offset[e];
      const double* in = v.data() + p.M->first[J.block[e]];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      for (int j = 0; j < cols; ++j) sum += values[3 * j] * in[j];
    }
    x[c] = sum;
  }
}

using Scaling = ConeScaling<double>;

/// -: gap as a fraction of the program's energy up to which an answer is as good as any.
constexpr double exact = 1e-14;

}  // namespace

void ConeVelocities::evaluate(const ConeProgram& p, std::span<const double> r, std::span<const double> eta) {
  const int nv = p.nv(), nc = p.nc();
  v.assign(nv, 0.0);
  multiply_transposed_add(*p.J, *p.M, r, v);
  p.factor->solve_in_place(v);
  for (int i = 0; i < nv; ++i) v[i] += (*p.v0)[i];
  u.resize(3 * nc);
  multiply(*p.J, *p.M, v, u);
  for (int i = 0; i < 3 * nc; ++i) u[i] += (*p.offset)[i];
  v_hat = v;
  u_hat = u;
  rounding.clear();
  bool any = false;
  for (double x : eta) any = any || x != 0;
  if (!any) return;
  scratch_.assign(nv, 0.0);
  add_normals(p, eta, scratch_);
  p.factor->solve_in_place(scratch_);
  for (int i = 0; i < nv; ++i) v_hat[i] -= scratch_[i];
  multiply(*p.J, *p.M, scratch_, u_hat);
  for (int i = 0; i < 3 * nc; ++i) u_hat[i] = u[i] - u_hat[i];
}

void ConeVelocities::bound_rounding(const ConeProgram& p, std::span<const double> r, std::span<const double> eta) {
  const BandMatrix& J = *p.J;
  constexpr double unit = std::numeric_limits<double>::epsilon();
  std::vector<double>& terms = scratch_;  // nv, m/s
  terms.resize(p.nv());
  for (int i = 0; i < p.nv(); ++i) terms[i] = std::abs((*p.v0)[i]);
  for (int c = 0; c < J.bands(); ++c) {
    Vector3d load = vec3(&r[3 * c]).cwiseAbs();
    if (!eta.empty()) load[0] += std::abs(eta[c]);
    if (load.isZero(0)) continue;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const int b = J.block[e], n = p.M->block_size(b);
      columns_.resize(3 * static_cast<std::size_t>(n));
      Eigen::Map<Eigen::MatrixX3d> columns(columns_.data(), n, 3);
      columns = J.entry(e).transpose();
      p.factor->solve_block_in_place(b, columns_.data(), 3);
      Eigen::Map<Eigen::VectorXd>(&terms[p.M->first[b]], n).noalias() += columns.cwiseAbs() * load;
    }
  }
  rounding.resize(J.bands());
  for (int c = 0; c < J.bands(); ++c) {
    Vector3d sum = vec3(&(*p.offset)[3 * c]).cwiseAbs();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* values = J.values.data() + J.offset[e];
      const double* term = &terms[p.M->first[J.block[e]]];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      for (int j = 0; j < cols; ++j) sum += term[j] * vec3(values + 3 * j).cwiseAbs();
    }
    rounding[c] = unit * sum.norm() / std::sqrt((*p.weight)[c]);
  }
}

Certificate certify(const ConeProgram& p, std::span<const double> r, std::span<const double> eta,
                    const ConeVelocities& velocities, std::span<const double> q, double rounding_units) {
  Certificate out;
  const int nc = p.nc();
  const auto along_bound = [&](int c) { return p.share_of(c) * r[3 * c]; };
  double size_r = 0, size_u = 0, size_q = 0, sum = 0, kappa_size = 0;
  for (int c = 0; c < nc; ++c) {
    const double w = (*p.weight)[c];
    size_r += w * vec3(&r[3 * c]).squaredNorm();
    size_u += vec3(&velocities.u[3 * c]).squaredNorm() / w;
    size_q += vec3(&q[3 * c]).squaredNorm() / w;
    sum += along_bound(c);
    kappa_size += std::abs(q[3 * c]) / w;
  }
  out.size = std::sqrt(std::max({size_r, size_u, size_q}));
  const double size = out.size > 0 ? out.size : 1;

  double worst = 0, missing = 0, gap = 0, kappa_rounding = 0, s_rounding = 0;
  const auto violated = [&](double x) { worst = std::max(worst, x); };
  // Rounding of a velocity, sqrt(J).
  const auto excuse = [&](int c) { return velocities.rounding.empty() ? 0 : rounding_units * velocities.rounding[c]; };
  for (int c = 0; c < nc; ++c) {
    const double root_w = std::sqrt((*p.weight)[c]), excused = (1 + (*p.mu)[c]) * excuse(c);
    Vector3d y = vec3(&velocities.u_hat[3 * c]);
    const double short_of = (*p.mu)[c] * tangential(y.data()) - y[0];
    kappa_rounding += excuse(c) / root_w;
    if (p.has_bound() && p.share_of(c) > 0) {
      missing = std::max(missing, short_of);
      s_rounding = std::max(s_rounding, excused * root_w);
    } else {
      violated((short_of / root_w - excused) / size);
    }
  }
  out.s = missing;
  for (int c = 0; c < nc; ++c) {
    const double root_w = std::sqrt((*p.weight)[c]);
    const double u_n = velocities.u[3 * c];
    gap += (eta.empty() ? 0 : eta[c] * (p.is_fixed(c) ? u_n : std::max(u_n + p.slack_of(c), 0.0))) +
           vec3(&r[3 * c]).dot(vec3(&velocities.u_hat[3 * c])) + out.s * along_bound(c);
    // Velocities are wrong by that, and the impulses that they determine.
    const double multiplier = eta.empty() ? 0 : std::abs(eta[c]);
    const double y = vec3(&velocities.u_hat[3 * c]).norm() + 2 * std::abs(out.s);
    out.gap_rounding += excuse(c) * (root_w * (vec3(&r[3 * c]).norm() + multiplier) + y / root_w);
    violated(-r[3 * c] * root_w / size);
    violated((tangential(&r[3 * c]) - (*p.mu)[c] * r[3 * c]) * root_w / size);
    if (p.bounded_below) violated(((-u_n - p.slack_of(c)) / root_w - excuse(c)) / size);
    if (p.is_fixed(c)) violated((std::abs(u_n) / root_w - excuse(c)) / size);
    if (!eta.empty() && !p.is_fixed(c)) violated(-eta[c] * root_w / size);
  }
  if (p.has_bound()) {
    gap += out.s * std::max(p.kappa - sum, 0.0);
    kappa_size = std::max(kappa_size, std::abs(p.kappa));
    violated((sum - p.kappa - kappa_rounding) / (kappa_size > 0 ? kappa_size : 1));
    const double sum_rounding = rounding_units * std::numeric_limits<double>::epsilon() * kappa_size;
    out.gap_rounding += std::abs(out.s) * (kappa_rounding + sum_rounding) + s_rounding * std::abs(p.kappa);
  }
  out.gap_rounding = std::min(out.gap_rounding, most_excused * size * size);
  // Comparisons with NaN are false: say so here, once.
  out.gap = std::isfinite(gap) ? gap : HUGE_VAL;
  out.infeasibility = std::isfinite(gap) ? worst : HUGE_VAL;
  return out;
}

void InteriorPoint::prepare(const ConeProgram& p) {
  const int nc = p.nc(), nv = p.nv();
  kkt_.prepare(*p.M, *p.J, options_.least_block);
  q_.resize(3 * nc);
  multiply(*p.J, *p.M, *p.v0, q_);
  for (int i = 0; i < 3 * nc; ++i) q_[i] += (*p.offset)[i];
  scale(p);
  d_.assign(3 * nc, 0.0);
  for (int c = 0; c < nc; ++c) d_[3 * c] = p.share_of(c);
  G_.resize(9 * nc);
  c_r_.resize(3 * nc);
  D_.resize(p.has_eta() ? nc : 0);
  c_eta_.resize(p.has_eta() ? nc : 0);
  h1_.resize(nv);
  h2_.resize(nv);
  g1_.resize(nv);
  g2_.resize(nv);
  Jdw_.resize(3 * nc);
  t_.resize(3 * nc);
  Mg_.resize(nv);
  Jdv_.resize(nc);
  dr_.resize(3 * nc);
  deta_.assign(nc, 0.0);
}

// The sizes of impulses and of velocities, the weights that belong to them, and what rounding leaves of the data.
void InteriorPoint::scale(const ConeProgram& p) {
  const int nc = p.nc();
  double speed = 0, weight = 0;
  for (int c = 0; c < nc; ++c) {
    const double* q = &q_[3 * c];
    const double along = (*p.mu)[c] > 0 ? q[1] * q[1] + q[2] * q[2] : 0;  // else nothing depends on it
    speed += (q[0] * q[0] + along) / (*p.weight)[c];
    weight += std::log((*p.weight)[c]);
  }
  speed = std::sqrt(speed);
  mean_weight_ = nc > 0 ? std::exp(weight / nc) : 1;
  const double impulse = p.impulse_size * std::sqrt(mean_weight_);
  const double ratio = impulse > 0 && impulse < speed ? impulse / speed : 1;  // R / U
  size_ = speed * std::sqrt(ratio);
  mean_weight_ /= ratio;
  w_r_.resize(nc);
  w_eta_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    w_r_[c] = (*p.weight)[c] / ratio;
    w_eta_[c] = (*p.weight)[c] * ratio;
  }
  ratio_ = ratio;
}

// Of the natural map: what the last bits of velocities without impulses leave of it, sqrt(J).
double InteriorPoint::last_bits(const ConeProgram& p) {
  r_zero_.assign(3 * p.nc(), 0.0);
  velocities_.bound_rounding(p, r_zero_, {});
  double least = 0;
  for (const double rho : velocities_.rounding) least += rho * rho;
  return std::sqrt(least / ratio_);
}

bool InteriorPoint::factor() {
  border_ready_ = false;
  return kkt_.factor(G_, D_);
}

// With t = d - J g2 the Schur complement is t.G t + g2.(M A^-1 M) g2: a sum of squares, no cancellation.
void InteriorPoint::factor_border(const ConeProgram& p) {
  const int nc = p.nc();
  std::fill(g1_.begin(), g1_.end(), 0.0);
  std::fill(g2_.begin(), g2_.end(), 0.0);
  for (int c = 0; c < nc; ++c) vec3(&dr_[3 * c]) = mat3(&G_[9 * c]) * vec3(&d_[3 * c]);
  multiply_transposed_add(*p.J, *p.M, dr_, g2_);
  if (p.has_eta())
    kkt_.solve_in_place(g1_, g2_);
  else
    kkt_.solve_in_place(g2_);
  multiply(*p.J, *p.M, g2_, t_);
  multiply(*p.M, p.has_eta() ? g1_ : g2_, Mg_);
  border_pivot_ = 0;
  for (std::size_t i = 0; i < g2_.size(); ++i) border_pivot_ += g2_[i] * Mg_[i];
  for (int c = 0; c < nc; ++c) {
    auto t = vec3(&t_[3 * c]);
    t = vec3(&d_[3 * c]) - t;
    const Vector3d Gt = mat3(&G_[9 * c]) * t;
    border_pivot_ += t.dot(Gt);
  }
  border_ready_ = true;
}

// Solves for dr_, deta_, ds_ (kkt_system.h), the system being factored.
//   rows:   (M + N^T D N) dv - M dw = N^T c_eta,    M dv + J^T G J dw + g ds = J^T c_r,   g = J^T G d
//   border: d.dr = border_rhs + border_diagonal ds  <=>  g.dw + (d.G d + border_diagonal) ds = d.c_r - border_rhs
bool InteriorPoint::newton_step(const ConeProgram& p, double border_diagonal, double border_rhs, bool border,
                                double ds_known) {
  const int nc = p.nc();
  const bool two = p.has_eta();
  std::fill(h2_.begin(), h2_.end(), 0.0);
  ds_ = border ? 0 : ds_known;
  if (!border && ds_known != 0)
    for (int c = 0; c < nc; ++c)
      vec3(&dr_[3 * c]) = vec3(&c_r_[3 * c]) - ds_known * (mat3(&G_[9 * c]) * vec3(&d_[3 * c]));
  else
    dr_ = c_r_;
  multiply_transposed_add(*p.J, *p.M, dr_, h2_);
  if (two) {
    std::fill(h1_.begin(), h1_.end(), 0.0);
    add_normals(p, c_eta_, h1_);
    kkt_.solve_in_place(h1_, h2_);
  } else {
    kkt_.solve_in_place(h2_);
  }
  multiply(*p.J, *p.M, h2_, Jdw_);
  if (border) {
    if (!border_ready_) factor_border(p);
    const double pivot = border_diagonal + border_pivot_;
    double rhs = -border_rhs;
    for (int c = 0; c < nc; ++c) {
      vec3(&dr_[3 * c]) = vec3(&c_r_[3 * c]) - mat3(&G_[9 * c]) * vec3(&Jdw_[3 * c]);
      rhs += vec3(&d_[3 * c]).dot(vec3(&dr_[3 * c]));
    }
    if (!(pivot > 0)) return false;
    for (int refinement = 0; refinement < 2; ++refinement) {
      const double more = rhs / pivot;
      ds_ += more;
      rhs = -border_rhs - border_diagonal * ds_;
      for (int c = 0; c < nc; ++c) {
        auto dr = vec3(&dr_[3 * c]);
        dr.noalias() -= more * (mat3(&G_[9 * c]) * vec3(&t_[3 * c]));
        rhs += vec3(&d_[3 * c]).dot(dr);
      }
    }
    for (std::size_t i = 0; i < h2_.size(); ++i) h2_[i] -= ds_ * g2_[i];
    if (two)
      for (std::size_t i = 0; i < h1_.size(); ++i) h1_[i] -= ds_ * g1_[i];
    for (int i = 0; i < 3 * nc; ++i) Jdw_[i] += ds_ * (t_[i] - d_[i]);
  } else {
    for (int c = 0; c < nc; ++c) {
      Vector3d dy = vec3(&Jdw_[3 * c]);
      if (ds_ != 0) dy += ds_ * vec3(&d_[3 * c]);
      vec3(&dr_[3 * c]) = vec3(&c_r_[3 * c]) - mat3(&G_[9 * c]) * dy;
    }
  }
  if (two) {
    normals(p, h1_, Jdv_);
    for (int c = 0; c < nc; ++c) deta_[c] = c_eta_[c] - D_[c] * Jdv_[c];
  }
  return true;
}

// Newton's method on the natural map, contact by contact: e = r - P(r - y / w) with P the projection on the cone.
// P' has eigenvectors along the ray a = (1, mu d) (eigenvalue 1), p (across the slip; mu n / t) and a's normal (0).
// Along a the linearised equation fixes y, not r: the proximal term dr_a = -(y_a + dy_a) / (proximal w) takes its
// place. Returns the norm of the natural map, sqrt(J).
double InteriorPoint::newton_terms(const ConeProgram& p, const ConeSolution& x) {
  const int nc = p.nc();
  products_ = 0;
  double missing = 0;
  double sum = 0;
  for (int c = 0; c < nc; ++c) {
    const double w = w_r_[c], mu = (*p.mu)[c], stiff = 1 / (proximal_ * w);
    const auto r = vec3(&x.r[3 * c]);
    const Vector3d y = vec3(&velocities_.u_hat[3 * c]) + x.s * vec3(&d_[3 * c]);
    auto G = mat3(&G_[9 * c]);
    auto step = vec3(&c_r_[3 * c]);
    const Vector3d z = r - y / w;
    const double t = std::sqrt(z[1] * z[1] + z[2] * z[2]);
    products_ += std::abs(r.dot(y));
    if (p.has_bound()) missing = std::max(missing, mu * tangential(y.data()) - y[0]);
    if (mu == 0) {  // a half-line: r_t = 0
      G.setZero();
      step = -r;
      if (z[0] > 0) {
        G(0, 0) = stiff;
        step[0] = -stiff * y[0];
        sum += y[0] * y[0] / w;
      } else {
        sum += w * r[0] * r[0];
      }
      sum += w * (r[1] * r[1] + r[2] * r[2]);
    } else if (t <= mu * z[0]) {  // sticks: y = 0
      G.setIdentity();
      G *= stiff;
      step = -stiff * y;
      sum += y.squaredNorm() / w;
    } else if (mu * t <= -z[0]) {  // open: r = 0
      G.setZero();
      step = -r;
      sum += w * r.squaredNorm();
    } else {  // slides
      const double root = std::sqrt(1 + mu * mu), c1 = z[1] / t, c2 = z[2] / t;
      const Vector3d a(1 / root, mu * c1 / root, mu * c2 / root);
      const Vector3d b(mu / root, -c1 / root, -c2 / root);
      const Vector3d across(0, -c2, c1);
      const double n = (z[0] + mu * t) / (1 + mu * mu), k = mu * n / t;
      const double y_a = a.dot(y), r_b = b.dot(r), r_p = across.dot(r);
      G.noalias() = stiff * a * a.transpose() + (k / ((1 - k) * w)) * across * across.transpose();
      step = -stiff * y_a * a - r_b * b - (r_p / (1 - k)) * across;
      sum += y_a * y_a / w + w * (r_b * r_b + r_p * r_p);
    }
    if (!p.has_eta()) continue;
    const double u_n = velocities_.u[3 * c] + p.slack_of(c);
    products_ += std::abs(x.eta[c] * u_n);
    const double w_eta = w_eta_[c];
    if (p.is_fixed(c) || x.eta[c] - u_n / w_eta > 0) {
      D_[c] = 1 / (proximal_ * w_eta);
      c_eta_[c] = -D_[c] * u_n;
      sum += u_n * u_n / w_eta;
    } else {
      D_[c] = 0;
      c_eta_[c] = -x.eta[c];
      sum += w_eta * x.eta[c] * x.eta[c];
    }
  }
  s_active_ = false;
  if (p.has_bound()) {
    const double excess = dot(d_, x.r) - p.kappa;
    products_ += missing * p.kappa;
    s_active_ = x.s + excess * mean_weight_ > 0;
    sum += s_active_ ? excess * excess * mean_weight_ : x.s * x.s / mean_weight_;
  }
  return std::sqrt(sum);
}

bool InteriorPoint::polish(const ConeProgram& p, ConeSolution& x, int patience, Steps steps) {
  prepare(p);
  if (!p.has_eta()) x.eta.assign(p.nc(), 0.0);
  double best = HUGE_VAL;
  int stalled = 0;
  const bool careful = steps == Steps::careful;
  const int limit = careful ? options_.careful_limit : options_.polish_limit;
  proximal_ = careful ? options_.careful_proximal : options_.proximal;
  const auto terms = [&] {
    velocities_.evaluate(p, x.r, p.has_eta() ? std::span<const double>(x.eta) : std::span<const double>());
    return newton_terms(p, x);
  };
  for (int k = 0; k <= limit; ++k) {
    poll_stop();
    const double residual = terms();
    if (!std::isfinite(residual) && (!careful || best == HUGE_VAL)) break;  // there is nothing to go back to
    if (residual < 0.5 * best)
      stalled = 0;
    else if (best < options_.rounding * size_ || ++stalled > patience)
      break;
    if (residual < best) {
      best = residual;
      best_ = x;
      proximal_ = std::max(options_.proximal, 0.1 * proximal_);
    } else if (careful) {
      // A wrong guess of the active constraints asks for the impossible: back, with a stronger proximal term.
      best_.iterations = x.iterations;
      x = best_;
      proximal_ = std::min(1.0, 30 * proximal_);
      terms();  // at x again
    }
    // Far below rounding, and no product of a large impulse with a velocity that should be zero is left.
    const double tiny = 1e-2 * options_.rounding;
    if ((best <= tiny * size_ && products_ <= tiny * size_ * size_) || k == limit) break;
    if (!factor()) break;
    const double excess = dot(d_, x.r) - p.kappa;
    if (!newton_step(p, proximal_ / mean_weight_, -excess, s_active_, -x.s)) break;
    ++x.iterations;
    for (std::size_t i = 0; i < x.r.size(); ++i) x.r[i] += dr_[i];
    if (p.has_eta())
      for (int c = 0; c < p.nc(); ++c) x.eta[c] += deta_[c];
    x.s += ds_;
  }
  if (!(best < HUGE_VAL)) {
    x.status = ConeStatus::nonconverged;
    return false;
  }
  best_.iterations = x.iterations;
  x = best_;
  const Certificate certificate = checked(p, x);
  // Where the natural map is at rounding there is nothing better, even if the certificate multiplies that rounding (by
  // mu, or by large impulses) beyond what was asked for.
  // Large impulses raise rounding itself; that is the excuse of the last attempt, and of programs without eta.
  const double large = careful || !p.has_eta() ? options_.rounding * certificate.size : 0;
  const bool at_rounding = best <= std::max(options_.rounding * size_, large) || best <= last_bits(p);
  const bool accepted = x.infeasibility <= options_.feasibility &&
                        (at_rounding || std::abs(x.gap) <= std::max(exact * size_ * size_, certificate.gap_rounding));
  x.status = accepted ? ConeStatus::solved : ConeStatus::nonconverged;
  return accepted;
}

// What the answer is worth, rounding considered where it does not do without; into its gap and infeasibility.
Certificate InteriorPoint::checked(const ConeProgram& p, ConeSolution& x) {
  const std::span<const double> eta = p.has_eta() ? std::span<const double>(x.eta) : std::span<const double>();
  velocities_.evaluate(p, x.r, eta);
  Certificate certificate = certify(p, x.r, x.eta, velocities_, q_);
  if (certificate.infeasibility > options_.feasibility || std::abs(certificate.gap) > exact * size_ * size_) {
    velocities_.bound_rounding(p, x.r, {});
    certificate = certify(p, x.r, x.eta, velocities_, q_, options_.rounding_units);
  }
  x.gap = certificate.gap;
  x.infeasibility = certificate.infeasibility;
  return certificate;
}

void InteriorPoint::solve(const ConeProgram& p, ConeSolution& x) {
  prepare(p);
  const int nc = p.nc();
  const auto inequality = [&](int c) { return p.bounded_below && !p.is_fixed(c); };
  x.status = ConeStatus::nonconverged;
  x.iterations = 0;
  x.r.assign(3 * nc, 0.0);
  x.eta.assign(nc, 0.0);
  x.s = 0;
  if (!finite(q_)) {
    x.status = ConeStatus::not_finite;
    return;
  }
  if (nc == 0 || size_ == 0) {
    x.status = ConeStatus::solved;
    x.gap = x.infeasibility = 0;
    return;
  }

  // Start: on the axis of each cone, at the scale of the problem.
  const double start = size_ / std::sqrt(static_cast<double>(nc));
  y_.assign(3 * nc, 0.0);
  a_.assign(nc, 0.0);
  dy_.resize(3 * nc);
  da_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    x.r[3 * c] = start / std::sqrt(w_r_[c]);
    y_[3 * c] = start * std::sqrt(w_r_[c]);
    if (inequality(c)) {
      // A contact that parts has its slack from the start: it may be far from the scale of the rest.
      a_[c] = std::max(start * std::sqrt(w_eta_[c]), q_[3 * c] + p.slack_of(c));
      x.eta[c] = start * start / a_[c];
    }
  }
  double b = 0, db = 0;
  if (p.has_bound()) {
    x.s = start * std::sqrt(mean_weight_);
    b = std::max(start / std::sqrt(mean_weight_), 0.1 * p.kappa);
  }
  int cones = nc + (p.has_bound() ? 1 : 0);
  for (int c = 0; c < nc; ++c) cones += inequality(c) ? 1 : 0;
  scaling_.resize(4 * nc);
  damping_.resize(9 * nc);
  const double delta = options_.regularisation;
  Matrix3d damping;
  const auto scaling = [&](int c) {
    return Scaling{scaling_[4 * c], Vector3d(scaling_[4 * c + 1], scaling_[4 * c + 2], scaling_[4 * c + 3])};
  };
  std::span<const double> no_eta;
  double next_polish = options_.polish_from, best_merit = HUGE_VAL;
  int since_best = 0;
  ConeStatus ending = ConeStatus::nonconverged;

  for (int k = 0; k < options_.iteration_limit; ++k) {
    poll_stop();
    velocities_.evaluate(p, x.r, p.has_eta() ? std::span<const double>(x.eta) : no_eta);
    // Residuals: ry = y - u_hat - s d, ra = a - u_n, rb = b - kappa + d.r.
    double complementarity = x.s * b, residual = 0;
    for (int c = 0; c < nc; ++c) {
      const double u_n = velocities_.u[3 * c] + p.slack_of(c);
      complementarity += vec3(&x.r[3 * c]).dot(vec3(&y_[3 * c])) + x.eta[c] * a_[c];
      const Vector3d ry = vec3(&y_[3 * c]) - vec3(&velocities_.u_hat[3 * c]) - x.s * vec3(&d_[3 * c]);
      residual = std::max(residual, ry.squaredNorm() / w_r_[c]);
      if (p.has_eta()) residual = std::max(residual, (a_[c] - u_n) * (a_[c] - u_n) / w_eta_[c]);
    }
    const double rb = p.has_bound() ? b - p.kappa + dot(d_, x.r) : 0;
    residual = std::sqrt(std::max(residual, rb * rb * mean_weight_)) / size_;
    if (!std::isfinite(complementarity) || !std::isfinite(residual)) {
      break;  // the best iterate is finite
    }
    const double relative = complementarity / (size_ * size_);
    const double merit = std::max(relative, residual);
    if (merit < best_merit) {
      best_merit = merit;
      since_best = 0;
      iterate_ = x;
    } else if (++since_best > options_.patience) {
      break;
    }
    if (relative < next_polish && residual < std::sqrt(next_polish)) {
      next_polish = relative * 1e-2;
      trial_ = x;
      const bool polished = polish(p, trial_, options_.iterate_patience, Steps::bold);
      if (polished) {
        x = trial_;
        return;
      }
      x.iterations = trial_.iterations;
      prepare(p);
      velocities_.evaluate(p, x.r, p.has_eta() ? std::span<const double>(x.eta) : no_eta);
    }
    if (relative < 1e-16) break;

    // Scaling, predictor terms, factorisation.
    for (int c = 0; c < nc; ++c) {
      const double mu = (*p.mu)[c], w = w_r_[c];
      auto G = mat3(&G_[9 * c]);
      if (mu == 0) {
        G.setZero();
        G(0, 0) = x.r[3 * c] / y_[3 * c];
      } else {
        const Scaling s = Scaling::of(in_primal(&x.r[3 * c], mu), in_dual(&y_[3 * c], mu));
        scaling_[4 * c] = s.eta;
        vec3(&scaling_[4 * c + 1]) = s.w;
        G = s.squared();
        G.row(0) /= mu;
        G.col(0) /= mu;
      }
      // dr = -r - G dy, dy = J dw + d ds - ry.
      const Vector3d ry = vec3(&y_[3 * c]) - vec3(&velocities_.u_hat[3 * c]) - x.s * vec3(&d_[3 * c]);
      // Proximal term on dr: (G^-1 + P)^-1 = (1 + G P)^-1 G for G, which bounds its largest eigenvalue. Where friction
      // is strong y_t is multiplied by mu in the certificate, so that P is smaller along the tangents.
      const double along = mu > 1 ? std::pow(mu, -options_.tangent_exponent) : 1;
      damping = delta * w * G;
      damping.rightCols<2>() *= along;
      damping.diagonal().array() += 1;
      damping = damping.inverse().eval();
      vec3(&c_r_[3 * c]) = damping * (-vec3(&x.r[3 * c]) + G * ry);
      mat3(&damping_[9 * c]) = damping;
      G = (damping * G).eval();
      if (!p.has_eta()) continue;
      const double u_n = velocities_.u[3 * c] + p.slack_of(c);
      if (p.is_fixed(c)) {
        D_[c] = 1 / (options_.proximal * w_eta_[c]);
        c_eta_[c] = -D_[c] * u_n;
      } else {
        const double D = x.eta[c] / a_[c], damp = 1 / (1 + delta * w_eta_[c] * D);
        D_[c] = D * damp;
        c_eta_[c] = (-x.eta[c] + D * (a_[c] - u_n)) * damp;
      }
    }
    if (!factor()) {
      ending = ConeStatus::singular;
      break;
    }
    // ds = -s - (s / b) db, db = -rb - d.dr  =>  d.dr = -rb + b + (b / s) ds.
    double correction_b = 0;
    const auto step_slacks = [&] {
      for (int c = 0; c < nc; ++c) {
        vec3(&dy_[3 * c]) =
            vec3(&Jdw_[3 * c]) - vec3(&y_[3 * c]) + vec3(&velocities_.u_hat[3 * c]) + (ds_ + x.s) * vec3(&d_[3 * c]);
        if (inequality(c)) da_[c] = Jdv_[c] - (a_[c] - velocities_.u[3 * c] - p.slack_of(c));
      }
      // From the complementarity row: b may be far smaller than the rounding of the sum, which goes into rb.
      db = p.has_bound() ? -b - b / x.s * ds_ + correction_b : 0;
    };
    const auto longest = [&]() {
      double alpha = HUGE_VAL;
      for (int c = 0; c < nc; ++c) {
        const double mu = (*p.mu)[c];
        if (mu == 0) {
          alpha = std::min({alpha, ray_step(x.r[3 * c], dr_[3 * c]), ray_step(y_[3 * c], dy_[3 * c])});
        } else {
          alpha = std::min({alpha, cone_step(in_primal(&x.r[3 * c], mu), in_primal(&dr_[3 * c], mu)),
                            cone_step(in_dual(&y_[3 * c], mu), in_dual(&dy_[3 * c], mu))});
        }
        if (inequality(c)) alpha = std::min({alpha, ray_step(x.eta[c], deta_[c]), ray_step(a_[c], da_[c])});
      }
      if (p.has_bound()) alpha = std::min({alpha, ray_step(x.s, ds_), ray_step(b, db)});
      return alpha;
    };
    if (!newton_step(p, p.has_bound() ? b / x.s : 0, b - rb, p.has_bound(), 0)) {
      ending = ConeStatus::singular;
      break;
    }
    step_slacks();
    const double affine = std::min(1.0, longest());
    const double sigma = std::pow(1 - affine, 3);
    const double mean = complementarity / cones, centre = sigma * mean;

    // Corrector.
    for (int c = 0; c < nc; ++c) {
      const double mu = (*p.mu)[c];
      auto step = vec3(&c_r_[3 * c]);
      if (mu == 0) {
        step[0] += damping_[9 * c] * (centre - dr_[3 * c] * dy_[3 * c]) / y_[3 * c];
      } else {
        const Scaling s = scaling(c);
        const Vector3d lambda = s.apply(in_dual(&y_[3 * c], mu));
        const Vector3d dx = s.apply_inverse(in_primal(&dr_[3 * c], mu)), dz = s.apply(in_dual(&dy_[3 * c], mu));
        Vector3d d = -jordan(dx, dz);
        d[0] += centre;
        const Vector3d correction = s.apply(jordan_divide(lambda, d));
        step += mat3(&damping_[9 * c]) * Vector3d(correction[0] / mu, correction[1], correction[2]);
      }
      if (inequality(c)) c_eta_[c] += (centre - deta_[c] * da_[c]) / a_[c] / (1 + delta * w_eta_[c] * x.eta[c] / a_[c]);
    }
    double border_rhs = b - rb;
    if (p.has_bound()) {
      correction_b = (centre - ds_ * db) / x.s;
      border_rhs -= correction_b;
    }
    if (!newton_step(p, p.has_bound() ? b / x.s : 0, border_rhs, p.has_bound(), 0)) {
      ending = ConeStatus::singular;
      break;
    }
    step_slacks();
    const double limit = longest();
    const double alpha = std::min(1.0, options_.step_fraction * limit);
    for (int i = 0; i < 3 * nc; ++i) {
      x.r[i] += alpha * dr_[i];
      y_[i] += alpha * dy_[i];
    }
    if (p.has_eta())
      for (int c = 0; c < nc; ++c) {
        x.eta[c] += alpha * deta_[c];
        if (inequality(c)) a_[c] += alpha * da_[c];
      }
    x.s += alpha * ds_;
    b += alpha * db;
    ++x.iterations;
    if (alpha < 1e-10) break;
  }
  // The best iterate is what there is.
  if (best_merit < HUGE_VAL) {
    iterate_.iterations = x.iterations;
    x = iterate_;
  }
  trial_ = x;
  if (polish(p, trial_, options_.careful_limit, Steps::careful)) {
    x = trial_;
    return;
  }
  x.iterations = trial_.iterations;
  x.status = ending;
  const Certificate certificate = checked(p, x);
  if (std::abs(x.gap) <= std::max(options_.gap_tolerance, certificate.gap_rounding) && x.infeasibility <= 1e-9)
    x.status = ConeStatus::solved;
}

}  // namespace cb
