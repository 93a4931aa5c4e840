// Alternating directions of multipliers: a linear system, a projection on the cones, a step of the multipliers.
//
// Problem: (1) of ncp.h, nc contacts, scaled so that every contact is as heavy as any other: x = sqrt(w) r and z =
// u~ / sqrt(w), both in sqrt(J), with B = J / sqrt(w) row by row, Q = B M^-1 B^T, b = q / sqrt(w). An iteration, with
// a penalty rho of each contact and S = eta + tau rho, diagonal:
//   x <- (Q + S)^-1 (eta x + tau rho y + z - b - mu |z_t| e_n)
//   y <- P_K(x - z / (tau rho))
//   z <- z - tau rho (x - y)
// z is u~ where x = y, and mu |z_t| e_n De Saxce's term, of the iteration before. Q is never formed:
//   (Q + S)^-1 g = S^-1 [g - B (M + B^T S^-1 B)^-1 B^T S^-1 g]
// and M + B^T S^-1 B is banded as the bodies touch each other; it is factored anew where a penalty changes:
//   rho = sqrt(L m) (L / m)^p,   L: largest eigenvalue of Q (power iteration), m = eta, p = 0.2 at first
// and p goes up where x - y is more than ten times the change of z's balance, down where it is less than a tenth: by a
// step, but down by more in the first looks, when the guess may be decades off. What opens wants a stiff penalty, what
// carries a soft one, and one for all is wrong for both: contacts of the same bodies have two, one for those that carry
// and one for those that do not. Not one each: friction of a patch that hardly slips is to stay parallel, or the last
// of its slip takes tens of thousands of iterations.
//
// Source: J. Carpentier, Q. Le Lidec, L. Montaut, From compliant to rigid contact simulation: a unified and efficient
// approach, RSS 2024, alg. 1 and sec. IV (Pinocchio 3; Kamino has the same iteration).
// Differences: 1. contacts are scaled (published tolerances are absolute, and with them the answer depends on units);
// 2. each pair of bodies has two rho, looked at every ten iterations (one for all takes two to ten times the iterations
// where many contacts open or slip: docs/methods/coulomb.md); 3. it ends by the natural residual of (1) on fresh
// velocities, which may be rounding; 4. no compliance; 5. the power iteration begins with b, so that nothing depends on
// the order of contacts; 6. near the end x is refined once an iteration.
//
// Returns: solved; nonconverged (limit of iterations, the best that a check has seen); singular; not_finite.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>

#include "cone/kkt_system.h"
#include "linalg/finite.h"
#include "linalg/stop.h"
#include "ncp/ncp.h"

namespace cb {

namespace {

struct AdmmOptions : NcpOptions {
  double eta = 1e-6;         ///< -: proximal term, as a fraction of w. Larger: slower; smaller: worse systems
  double tau = 0.5;          ///< -: of the penalty rho
  double power = 0.2;        ///< -: p at first; more: stiffer, better for what sticks
  double power_step = 0.05;  ///< -: by which p changes
  /// -: by which it may fall in the first look; in the k-th 1/k of it. Without end, or up as well: what is shaken, and
  /// random problems, take more iterations.
  double first_fall = 0.4;
  /// -: of p. Below 0: a tall stack at rest wants rho under its least eigenvalue; the least, -0.5, is rho = eta, whose
  /// systems have half the digits.
  double least_power = -0.45;
  double ratio = 10;          ///< -: of the two residuals, from which on it does
  double least_share = 1e-3;  ///< -: residuals count as no less than this share of the mean contact's
  int check_every = 10;       ///< iterations between two checks of the residuals
  int limit = 20000;          ///< iterations
  int power_iterations = 20;  ///< for L
  /// -: natural residual from which on x is refined: it is the small difference of g and B (M + ..)^-1 B^T S^-1 g,
  /// which at a soft penalty leaves 1e-11.
  double refined_from = 1e-8;
  double least_block = 3;  ///< mean size of a block of M from which on systems are factored by blocks
};

class Admm {
 public:
  explicit Admm(const NcpOptions& options) { static_cast<NcpOptions&>(o_) = options; }
  void operator()(const NcpProblem& problem, NcpSolution& solution);

 private:
  void begin(const NcpProblem& problem);
  bool factor(const NcpProblem& problem);
  void multiply_Q(const NcpProblem& problem, const std::vector<double>& x, std::vector<double>& y);
  void iterate(const NcpProblem& problem, bool refined);
  void solve_system(const NcpProblem& problem, const std::vector<double>& g, std::vector<double>& x);
  void refine(const NcpProblem& problem, std::vector<double>& x);
  bool check(NcpSolution& solution);
  void find_pairs(const BandMatrix& J);
  bool change_penalties();
  void end(NcpSolution& solution);
  double penalty(int c) const { return o_.tau * rho_[c]; }
  double S(int c) const { return o_.eta + penalty(c); }

  AdmmOptions o_;
  NcpMeasure measure_;
  KktSystem system_;
  std::vector<double> root_;                                     // nc, sqrt(w)
  std::vector<double> b_, x_, y_, z_, g_, x_before_, y_before_;  // 3 nc, sqrt(J)
  std::vector<double> scaled_, r_, u_, v_, h_, G_, rest_, correction_;
  std::vector<double> miss_;                    // J, two of each in power_: squares of x - y, and of the balance
  std::vector<int> pair_, order_;               // nc: which pair of bodies; scratch
  std::vector<double> power_, power_of_, rho_;  // of what carries and what does not of each pair; nc, nc
  double L_ = 1;
  int looks_ = 0;  // at the penalties
};

void Admm::begin(const NcpProblem& p) {
  const int nc = p.nc();
  root_.resize(nc);
  for (int c = 0; c < nc; ++c) root_[c] = std::sqrt(p.weight[c]);
  b_ = measure_.q();
  for (int i = 0; i < 3 * nc; ++i) b_[i] /= root_[i / 3];
  x_.assign(3 * nc, 0.0);
  if (static_cast<int>(p.start.size()) == 3 * nc)
    for (int i = 0; i < 3 * nc; ++i) x_[i] = root_[i / 3] * p.start[i];
  y_ = x_;
  z_.assign(3 * nc, 0.0);
  if (static_cast<int>(p.start.size()) == 3 * nc) {  // u~ of it; an iteration takes it into K*
    measure_.velocities(p.start, v_, u_);
    for (int c = 0; c < nc; ++c) {
      const double slip = std::hypot(u_[3 * c + 1], u_[3 * c + 2]);
      for (int i = 0; i < 3; ++i) z_[3 * c + i] = (u_[3 * c + i] + (i == 0 ? p.mu[c] * slip : 0)) / root_[c];
    }
  }
  system_.prepare(*p.M, *p.J, o_.least_block);
  // L from a vector of the problem's own: where answers are many, which one comes out must not depend on the order of
  // contacts or on axes.
  g_ = b_;
  L_ = 1;
  for (int k = 0; k < o_.power_iterations; ++k) {
    multiply_Q(p, g_, scaled_);
    double norm = 0, before = 0;
    for (int i = 0; i < 3 * nc; ++i) {
      norm += scaled_[i] * scaled_[i];
      before += g_[i] * g_[i];
    }
    if (!(norm > 0)) break;
    L_ = std::sqrt(norm / before);
    for (int i = 0; i < 3 * nc; ++i) g_[i] = scaled_[i] / std::sqrt(norm);
  }
  find_pairs(*p.J);
  power_.assign(2 * root_.size(), o_.power);
  power_of_.assign(nc, o_.power);
  rho_.resize(nc);
  looks_ = 0;
}

// Contacts whose rows are of the same blocks of M.
void Admm::find_pairs(const BandMatrix& J) {
  const auto blocks = [&J](int c) {
    return std::span(J.block).subspan(J.band[c], static_cast<std::size_t>(J.band[c + 1] - J.band[c]));
  };
  order_.resize(J.bands());
  std::iota(order_.begin(), order_.end(), 0);
  std::ranges::sort(order_, [&](int a, int b) { return std::ranges::lexicographical_compare(blocks(a), blocks(b)); });
  pair_.assign(order_.size(), 0);
  for (std::size_t i = 1; i < order_.size(); ++i)
    pair_[order_[i]] = pair_[order_[i - 1]] + !std::ranges::equal(blocks(order_[i]), blocks(order_[i - 1]));
}

// y = Q x.
void Admm::multiply_Q(const NcpProblem& p, const std::vector<double>& x, std::vector<double>& y) {
  r_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) r_[i] = x[i] / root_[i / 3];
  h_.assign(p.nv(), 0.0);
  multiply_transposed_add(*p.J, *p.M, r_, h_);
  p.factor->solve_in_place(h_);
  y.resize(x.size());
  multiply(*p.J, *p.M, h_, y);
  for (std::size_t i = 0; i < x.size(); ++i) y[i] /= root_[i / 3];
}

// M + B^T S^-1 B.
bool Admm::factor(const NcpProblem& p) {
  G_.assign(9 * static_cast<std::size_t>(p.nc()), 0.0);
  for (int c = 0; c < p.nc(); ++c) {
    rho_[c] = std::sqrt(L_ * o_.eta) * std::pow(L_ / o_.eta, power_of_[c]);
    for (const int i : {0, 4, 8}) G_[9 * c + i] = 1 / (S(c) * p.weight[c]);
  }
  return system_.factor(G_, {});
}

// x = (Q + S)^-1 g.
void Admm::solve_system(const NcpProblem& p, const std::vector<double>& g, std::vector<double>& x) {
  const int size = 3 * p.nc();
  r_.resize(size);
  for (int i = 0; i < size; ++i) r_[i] = g[i] / root_[i / 3] / S(i / 3);
  h_.assign(p.nv(), 0.0);
  multiply_transposed_add(*p.J, *p.M, r_, h_);
  system_.solve_in_place(h_);
  scaled_.resize(size);
  multiply(*p.J, *p.M, h_, scaled_);
  x.resize(size);
  for (int i = 0; i < size; ++i) x[i] = (g[i] - scaled_[i] / root_[i / 3]) / S(i / 3);
}

// x += (Q + S)^-1 (g - (Q + S) x).
void Admm::refine(const NcpProblem& p, std::vector<double>& x) {
  multiply_Q(p, x, rest_);
  for (int i = 0; i < 3 * p.nc(); ++i) rest_[i] = g_[i] - rest_[i] - S(i / 3) * x[i];
  solve_system(p, rest_, correction_);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += correction_[i];
}

void Admm::iterate(const NcpProblem& p, bool refined) {
  x_before_ = x_;
  y_before_ = y_;
  for (int c = 0; c < p.nc(); ++c) {
    const double *z = &z_[3 * c], *x = &x_[3 * c], *y = &y_[3 * c];
    for (int i = 0; i < 3; ++i) g_[3 * c + i] = o_.eta * x[i] + penalty(c) * y[i] + z[i] - b_[3 * c + i];
    g_[3 * c] -= p.mu[c] * std::hypot(z[1], z[2]);
  }
  solve_system(p, g_, x_);
  if (refined) refine(p, x_);
  for (int c = 0; c < p.nc(); ++c) {
    const double at = penalty(c);
    double *z = &z_[3 * c], *x = &x_[3 * c];
    const double there[] = {x[0] - z[0] / at, x[1] - z[1] / at, x[2] - z[2] / at};
    project_on_friction_cone(there, p.mu[c], &y_[3 * c]);
    for (int i = 0; i < 3; ++i) z[i] -= at * (x[i] - y_[3 * c + i]);
  }
}

// Keeps the best. Is it done?
bool Admm::check(NcpSolution& solution) {
  for (std::size_t i = 0; i < y_.size(); ++i) r_[i] = y_[i] / root_[i / 3];
  measure_.velocities(r_, v_, u_);
  const double residual = measure_.residual(r_, u_);
  if (residual < solution.residual) {
    solution.residual = residual;
    solution.r = r_;
    solution.u = u_;
  }
  if (residual <= o_.tolerance) return true;
  // What is left may be rounding.
  return residual <= o_.accepted && measure_.residual_beside_rounding(r_, u_) <= o_.tolerance;
}

// By the ratio of what x and y differ by to what the multipliers are out of balance; true where a contact's penalty is
// another.
bool Admm::change_penalties() {
  const int nc = static_cast<int>(pair_.size());
  const auto group = [this](int c) { return 2 * pair_[c] + (y_[3 * c] > 0 ? 1 : 0); };
  miss_.assign(2 * power_.size(), 0.0);
  double primal = 0, dual = 0;
  for (int i = 0; i < 3 * nc; ++i) {
    const int c = i / 3;
    const double difference = x_[i] - y_[i];
    const double balance = o_.eta * (x_[i] - x_before_[i]) + penalty(c) * (y_[i] - y_before_[i]);
    miss_[2 * group(c)] += difference * difference;
    miss_[2 * group(c) + 1] += balance * balance;
    primal += difference * difference;
    dual += balance * balance;
  }
  const double least = o_.least_share * o_.least_share / nc, ratio2 = o_.ratio * o_.ratio;
  const double most = std::max(o_.power_step, o_.first_fall / ++looks_);
  const auto fall = [&](double ratio) { return 0.25 * std::log(ratio) / std::log(L_ / o_.eta); };  // rho by its root
  for (std::size_t g = 0; g < power_.size(); ++g) {
    const double own = miss_[2 * g] + least * primal, balance = miss_[2 * g + 1] + least * dual;
    if (own > ratio2 * balance)
      power_[g] = std::min(1.0, power_[g] + o_.power_step);
    else if (balance > ratio2 * own)
      power_[g] = std::max(o_.least_power, power_[g] - std::clamp(fall(balance / own), o_.power_step, most));
  }
  bool changed = false;
  for (int c = 0; c < nc; ++c) {
    changed = changed || power_of_[c] != power_[group(c)];
    power_of_[c] = power_[group(c)];
  }
  return changed;
}

void Admm::end(NcpSolution& solution) {
  if (solution.residual > o_.tolerance)
    solution.residual = std::min(solution.residual, measure_.residual_beside_rounding(solution.r, solution.u));
  if (solution.residual <= o_.accepted) {
    solution.status = NcpStatus::solved;
  } else if (!all_finite(x_) || solution.residual == HUGE_VAL) {
    solution.status = NcpStatus::not_finite;
    solution.reason = "impulses overflow";
  } else {
    solution.reason = "limit of iterations";
  }
}

void Admm::operator()(const NcpProblem& p, NcpSolution& solution) {
  solution.clear();
  solution.r.assign(3 * p.nc(), 0.0);
  measure_.begin(p);
  solution.u = measure_.q();
  const auto fail = [&](NcpStatus status, const char* reason) {
    solution.status = status;
    solution.reason = reason;
  };
  if (!all_finite(solution.u)) return fail(NcpStatus::not_finite, "NaN or infinity in the problem");
  solution.residual = measure_.residual(solution.r, solution.u);
  if (solution.residual <= o_.tolerance) return fail(NcpStatus::solved, "");
  begin(p);
  if (!factor(p)) return fail(NcpStatus::singular, "the system of an iteration could not be factored");
  r_.resize(x_.size());
  bool done = check(solution);
  while (!done && solution.iterations < o_.limit) {
    poll_stop();
    const bool refined = solution.residual <= o_.refined_from;
    for (int k = 0; k < o_.check_every; ++k, ++solution.iterations) iterate(p, refined);
    if (!all_finite(x_)) break;
    done = check(solution);
    if (!done && change_penalties() && !factor(p))
      return fail(NcpStatus::singular, "the system of an iteration could not be factored");
  }
  end(solution);
}

NcpSolver make(const NcpOptions& options) {
  return [solver = std::make_shared<Admm>(options)](const NcpProblem& problem, NcpSolution& solution) {
    (*solver)(problem, solution);
  };
}

}  // namespace

NcpSolverRow admm_row() {
  return {"admm", "alternating directions: a linear system, a projection on the cones, a step of multipliers",
          "J. Carpentier, Q. Le Lidec, L. Montaut, RSS 2024", make};
}

}  // namespace cb
