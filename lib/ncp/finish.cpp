// Newton's method on Alart and Curnier's map,
//   x = r - u / w (u_n / (w max(1, mu)));   open (x_n <= 0): r = 0;   else u_n = 0, and friction
//     sticks (|x_t| <= mu x_n): u_t = 0;   slips: r_t = mu r_n x_t / |x_t|
// of which each contact gives a linear piece dr = c - G du, and M dv = J^T dr, du = J dv the rest:
//   (M + J^T G J) dv = J^T c
// Where u is held at zero its row is u + du + proximal w dr = 0 (times max(1, mu) along the normal): r is not unique as
// a rule, and this picks the answer next to the iterate. With P = I - d d^T, d = x_t / |x_t|, b = mu r_n / |x_t|,
// slipping friction is
//   dr_t = d (mu (r_n + dr_n) - d.r_t) - P r_t / s - b P du_t / (w s),     s = 1 - b (1 - proximal)
// A proximal point is the answer where u has a term t w (r - r0) besides: its own rows are these with t for `proximal`.
//
// Source: P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like solution
// methods, Comput. Methods Appl. Mech. Eng. 92 (1991), with the disc of the unknown normal impulse.
// Differences: 1. impulses are the iterate, and velocities follow from them afresh, so that nothing drifts; 2. proximal
// rows; 3. no line search: a guess that is good goes in by full steps, and another is given up after `patience` steps;
// 4. steps may be cut where the first contact opens or slips. Of redundant contacts (the corners of a box, level to a
// billionth) each wants to open by an impulse that is large beside what it carries: let go all at once, they begin
// anew; 5. steps beyond the tolerance keep the factors of the step before: chords.

#include "ncp/finish.h"

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"
#include "linalg/stop.h"

namespace cb {

namespace {

/// -: natural residual below which nothing is left to do, at least this part of the tolerance; share of a residual that
/// a step beyond the tolerance must leave.
constexpr double least_residual = 1e-16, sharp = 1e-3, worth = 0.1;
/// -: how far within its cone friction sticks, of (mu r_n)^2; less is rounding of the edge. Share of a step by which a
/// cut one goes beyond what ends it, so that the contact is on the other side.
constexpr double within = 1e-6, beyond = 1e-9;
/// rad: turn of friction on the edge of its cone in one step; more, and its square leaves the cone by too much.
constexpr double turn = 0.1;
/// -: difference of two steps, of one of them, up to which the second repeats the first.
constexpr double same = 0.1;

/// Share of `change` at which friction r reaches the edge of its cone from within; on the edge, has turned.
double share_before_slip(const double* r, const double* change, double mu) {
  // mu^2 (r_n + t d_n)^2 - |r_t + t d_t|^2 = a t^2 + 2 b t + c
  const double* d = change;
  const double mu2 = mu * mu, c = mu2 * r[0] * r[0] - r[1] * r[1] - r[2] * r[2];
  if (!(c > within * mu2 * r[0] * r[0])) {
    const double across = std::abs(r[1] * d[2] - r[2] * d[1]);
    return across > 0 ? turn * (r[1] * r[1] + r[2] * r[2]) / across : HUGE_VAL;
  }
  const double a = mu2 * d[0] * d[0] - d[1] * d[1] - d[2] * d[2];
  const double b = mu2 * r[0] * d[0] - r[1] * d[1] - r[2] * d[2], root = b * b - a * c;
  return root >= 0 && (a < 0 || b < 0) ? c / (std::sqrt(root) - b) : HUGE_VAL;
}

}  // namespace

void AlartCurnierNewton::begin(const NcpProblem& problem, VelocitySystem& system, NcpMeasure& measure) {
  problem_ = &problem;
  measure_ = &measure;
  system_ = &system;
  const std::size_t nc = problem.nc();
  G_.resize(9 * nc);
  c_.resize(3 * nc);
  du_.resize(3 * nc);
  change_.resize(3 * nc);
  h_.resize(problem.nv());
}

// G_ and c_ of each contact's piece of the map at r_. Returns whether all are on the pieces where they were, with the
// same proximal term.
bool AlartCurnierNewton::linearise(double proximal, double touching) {
  const NcpProblem& p = *problem_;
  bool as_before = !piece_.empty() && proximal == proximal_;
  piece_.resize(p.nc());
  proximal_ = proximal;
  std::fill(G_.begin(), G_.end(), 0.0);
  for (int c = 0; c < p.nc(); ++c) {
    const double w = p.weight[c], mu = p.mu[c], m = std::max(1.0, mu), stiff = 1 / (proximal * w), stiff_n = stiff / m;
    const double *r = &r_[3 * c], *u = &u_[3 * c];
    const double x[] = {r[0] - u[0] / (w * m), r[1] - u[1] / w, r[2] - u[2] / w};
    double *G = &G_[9 * c], *to = &c_[3 * c];
    for (int i = 0; i < 3; ++i) to[i] = -r[i];
    const double size = std::sqrt(x[1] * x[1] + x[2] * x[2]);
    const Piece piece = !(x[0] * w * m > -touching)                 ? Piece::open
                        : mu == 0                                   ? Piece::frictionless
                        : size <= mu * x[0] || size * w <= touching ? Piece::sticks
                                                                    : Piece::slips;
    as_before = as_before && piece == piece_[c];
    piece_[c] = piece;
    if (piece == Piece::open) continue;
    G[0] = stiff_n;
    to[0] = -stiff_n * u[0];
    if (piece == Piece::frictionless) continue;
    if (piece == Piece::sticks) {
      G[4] = G[8] = stiff;
      to[1] = -stiff * u[1];
      to[2] = -stiff * u[2];
      continue;
    }
    const double d[] = {x[1] / size, x[2] / size}, b = std::min(1.0, mu * std::max(0.0, r[0]) / size);
    const double s = 1 - b * (1 - proximal), k = b / (w * s), along = d[0] * r[1] + d[1] * r[2];
    // With dr_n = to_n - G_nn du_n in it.
    for (int i = 0; i < 2; ++i) {
      to[1 + i] = d[i] * (mu * (r[0] + to[0]) - along) - (r[1 + i] - d[i] * along) / s;
      G[1 + i] = mu * stiff_n * d[i];
    }
    G[4] = k * (1 - d[0] * d[0]);
    G[8] = k * (1 - d[1] * d[1]);
    G[5] = G[7] = -k * d[0] * d[1];
  }
  return as_before;
}

void AlartCurnierNewton::find_velocities() {
  measure_->velocities(r_, v_, u_);
  if (anchor_ == 0) return;
  for (std::size_t i = 0; i < r_.size(); ++i) u_[i] += anchor_ * problem_->weight[i / 3] * (r_[i] - r0_[i]);
}

// Share of change_ at which the first contact that carries opens, one that sticks slips, or one that slips has turned.
double AlartCurnierNewton::share_before_change() const {
  double share = HUGE_VAL;
  for (int c = 0; c < problem_->nc(); ++c) {
    const double *r = &r_[3 * c], *change = &change_[3 * c];
    if (r[0] > 0 && change[0] < 0) share = std::min(share, -r[0] / change[0]);
    share = std::min(share, share_before_slip(r, change, problem_->mu[c]));
  }
  return share;
}

// Is the change the same once more?
bool AlartCurnierNewton::drifts() const {
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < last_.size(); ++i) {
    difference += (change_[i] - last_[i]) * (change_[i] - last_[i]);
    size += last_[i] * last_[i];
  }
  return difference <= same * same * size;
}

// A step from r_, cut where asked; as a chord by the factors of the step before, where nothing has changed its piece.
// False where its system could not be factored, or has no numbers for an answer.
bool AlartCurnierNewton::step(double proximal, double touching, bool cut, bool chord) {
  const NcpProblem& p = *problem_;
  const bool as_before = linearise(proximal, touching);
  if (!(chord && as_before) && !system_->factor(G_)) return false;
  std::fill(h_.begin(), h_.end(), 0.0);
  multiply_transposed_add(*p.J, *p.M, c_, h_);
  system_->solve_in_place(h_);
  multiply(*p.J, *p.M, h_, du_);
  for (int c = 0; c < p.nc(); ++c) {
    const Eigen::Map<const Eigen::Matrix3d> G(&G_[9 * c]);
    Eigen::Map<Eigen::Vector3d> change(&change_[3 * c]);
    change = Eigen::Map<const Eigen::Vector3d>(&c_[3 * c]) - G * Eigen::Map<const Eigen::Vector3d>(&du_[3 * c]);
  }
  if (!all_finite(change_)) return false;
  double share = 1;
  if (cut) {
    const double room = share_before_change() * (1 + beyond);
    share = room < 1 || (std::isfinite(room) && drifts()) ? room : 1;
    last_ = change_;
  }
  for (std::size_t i = 0; i < r_.size(); ++i) r_[i] += share * change_[i];
  find_velocities();
  return true;
}

double AlartCurnierNewton::solve(const Options& o, std::vector<double>& r, std::vector<double>& u, int& steps) {
  r_ = r;
  piece_.clear();
  anchor_ = o.anchor;
  if (anchor_ != 0) r0_ = r;
  find_velocities();
  if (o.cut) last_.assign(r_.size(), 0.0);
  double best = measure_->residual(r_, u_), proximal = std::max(o.proximal, o.anchor);
  if (!std::isfinite(best)) best = HUGE_VAL;
  double before = HUGE_VAL;
  u = u_;
  for (int k = 0, without = 0, returns = 0; k < o.limit && best > std::max(least_residual, sharp * o.tolerance); ++k) {
    const bool enough = best <= o.tolerance, chord = enough && before <= o.chord_from;
    poll_stop();
    ++steps;
    const double residual =
        step(proximal, k == 0 ? o.touching : 0, o.cut, chord) ? measure_->residual(r_, u_) : HUGE_VAL;
    if (residual < 0.5 * best) {
      without = 0;
      if (residual > o.fast * best) proximal = std::max({o.least, o.anchor, o.falls * proximal});
    } else if (++without >= o.patience || !std::isfinite(residual)) {
      if (best <= o.enough || ++returns > o.returns) break;
      without = 0;
      proximal *= o.grows;
    }
    const bool better = residual < worth * best;
    before = best;
    if (residual < best) {
      best = residual;
      r = r_;
      u = u_;
    } else if (without == 0) {
      r_ = r;
      u_ = u;
    }
    // One step beyond the tolerance, and more while they are worth it: along a stack errors add up.
    if (enough ? !better : !o.sharper && best <= o.tolerance) break;
  }
  return best;
}

}  // namespace cb
