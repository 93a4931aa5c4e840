// Primal-dual interior point method for the cone programs of cone_program.h.
//
// Problem (nc contacts, r in N s, v and u in m/s, energies in J):
//   min 1/2 v.M v + w.r,  v = v0 + M^-1 J^T r,   r_i in K_i,   u_n = N v + w_n >= 0 (or = 0),   d.r <= kappa
// where K_i: |r_t| <= mu r_n, N: the normal rows of J, d: the contacts' shares in the bound (1, or 0). Optimality, with
// y_i in the dual cone K_i*: mu |y_t| <= y_n, eta >= 0 (free where u_n = 0 is asked), s >= 0:
//   y = J v_hat + w + s d,  v_hat = v - M^-1 N^T eta,   r.y = 0,   eta.u_n = 0,   s (kappa - d.r) = 0
// The iterates keep r, y, eta, a, s, b inside their cones; y less its value above, a - u_n and b - (kappa - d.r) go to
// zero. They end where look() says so: solved, or no longer getting better (iterates.h).
//
// Source: S. Boyd, L. Vandenberghe, Convex Optimization, 2004, ch. 11.7 (primal-dual method), with
//   1. Nesterov-Todd scaling and Mehrotra's predictor and corrector for second-order cones in place of the barrier of
//      the squared constraint (L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010, sec. 4-6);
//   2. a finish by Newton's method (polish.h; tried by look() and finish()), because a barrier method ends at the
//      square root of rounding on degenerate problems (r is not unique, strict feasibility may fail).
// One loop for every kind of numbers, linear system and keeping of iterates (iterates.h): in double, with a sparse
// system (sparse_newton.h) and iterates that are polished; in DoubleDouble, with a dense one (dense_newton.h).
// Fails with `nonconverged` (iteration limit or step length), `singular`: r is then the best iterate met; `not_finite`
// where the data are, r = 0.

#include "cone/interior_point.h"

#include <algorithm>
#include <cmath>

#include "cone/second_order_cone.h"
#include "linalg/finite.h"
#include "linalg/stop.h"

namespace cb {

namespace {

/// -: steps shorter than this get nowhere.
constexpr double least_step = 1e-10;

/// -: complementarity that the dense method aims at, of the present, at least. Never to the edge itself: products that
/// fall far behind the others leave no room for the path's turns.
constexpr double dense_centre = 1e-2;

/// How far each step goes.
struct StepRules {
  int iteration_limit;
  double step_fraction;  ///< -: of the longest step inside the cones
  double least_centre;   ///< -: complementarity aimed at, of the present, at least
  double least_step;     ///< -: shorter ones end the iteration
};

template <class Real, class System, class Iterates>
class PrimalDual {
 public:
  PrimalDual(const StepRules& rules, System& system, Iterates& iterates, CentralPath<Real>& path)
      : rules_(rules), system_(system), iterates_(iterates), path_(path) {}

  void operator()() {
    start();
    ConeNext next = ConeNext::stop;
    ConeStatus ending = ConeStatus::nonconverged;
    for (int k = 0; k < rules_.iteration_limit; ++k) {
      poll_stop();
      find_residuals();
      next = iterates_.look(path_);
      if (next != ConeNext::step) break;
      find_scaling();
      if (!system_.factor(path_) || !predict() || !correct()) {
        ending = ConeStatus::singular;
        break;
      }
      if (!move()) break;
    }
    iterates_.finish(path_, next, ending);
  }

 private:
  using Three = ConeVector<Real>;
  static Eigen::Map<const Three> three(const RealVector<Real>& x, int c) { return Eigen::Map<const Three>(&x[3 * c]); }

  // On the axis of each cone, at the scale of the problem.
  void start() {
    const Cones<Real>& cones = path_.cones;
    const ConeScales<Real>& scales = path_.scales;
    const Real start = scales.size / sqrt(static_cast<Real>(cones.nc()));
    ConePoint<Real>& x = path_.at;
    x.set_zero(cones.nc());
    for (int c = 0; c < cones.nc(); ++c) {
      x.r[3 * c] = start / sqrt(scales.w_r[c]);
      x.y[3 * c] = start * sqrt(scales.w_r[c]);
      if (!cones.inequality[c]) continue;
      // A contact that parts has its slack from the start: it may be far from the scale of the rest.
      x.a[c] = std::max<Real>(start * sqrt(scales.w_eta[c]), path_.a_free[c]);
      x.eta[c] = start * start / x.a[c];
    }
    if (cones.bound) {
      x.s = start * sqrt(scales.mean_weight);
      x.b = std::max<Real>(start / sqrt(scales.mean_weight), 0.1 * cones.kappa);
    }
    path_.step.set_zero(cones.nc());
    path_.scaling.resize(cones.nc());
    path_.second_order.contact.setZero(3 * cones.nc());
    path_.second_order.eta.setZero(cones.nc());
    path_.iterations = 0;
  }

  void find_residuals() {
    const Cones<Real>& cones = path_.cones;
    const ConeScales<Real>& scales = path_.scales;
    const ConePoint<Real>& x = path_.at;
    ConeResiduals<Real>& off = path_.off;
    off.y.resize(3 * cones.nc());
    off.a.resize(cones.nc());
    system_.slacks(x, off.y, off.a);
    off.complementarity = x.s * x.b;
    off.b = x.b - cones.kappa;
    Real worst = 0, sum = 0;
    for (int c = 0; c < cones.nc(); ++c) {
      off.complementarity += three(x.r, c).dot(three(x.y, c)) + x.eta[c] * x.a[c];
      for (int i = 0; i < 3; ++i) off.y[3 * c + i] = x.y[3 * c + i] - off.y[3 * c + i];
      off.y[3 * c] -= x.s * cones.d[c];
      off.a[c] = x.a[c] - off.a[c];
      worst = std::max<Real>(worst, three(off.y, c).squaredNorm() / scales.w_r[c]);
      if (cones.eta) worst = std::max<Real>(worst, off.a[c] * off.a[c] / scales.w_eta[c]);
      sum += cones.d[c] * x.r[3 * c];
    }
    off.b = cones.bound ? off.b + sum : 0;
    off.worst = sqrt(std::max<Real>(worst, off.b * off.b * scales.mean_weight)) / scales.size;
    off.relative = off.complementarity / (scales.size * scales.size);
  }

  void find_scaling() {
    for (int c = 0; c < path_.cones.nc(); ++c)
      if (const Real mu = path_.cones.mu[c]; mu > 0)
        path_.scaling[c] = ConeScaling<Real>::of(in_primal(&path_.at.r[3 * c], mu), in_dual(&path_.at.y[3 * c], mu));
  }

  bool predict() {
    path_.second_order.b = 0;
    return solve();
  }

  // Towards the centre by as much as the predicted step falls short, with the second order of that step.
  bool correct() {
    const Cones<Real>& cones = path_.cones;
    const ConePoint<Real>&x = path_.at, &step = path_.step;
    SecondOrder<Real>& second = path_.second_order;
    const Real affine = std::min<Real>(1, longest());
    const Real sigma = std::max<Real>(rules_.least_centre, cube(1 - affine));
    const Real centre = sigma * (path_.off.complementarity / cones.count);
    for (int c = 0; c < cones.nc(); ++c) {
      if (cones.mu[c] > 0) {
        const Three t = second_order(c, centre);
        for (int i = 0; i < 3; ++i) second.contact[3 * c + i] = t[i];
      } else {
        second.contact[3 * c] = centre - step.r[3 * c] * step.y[3 * c];
      }
      if (cones.inequality[c]) second.eta[c] = centre - step.eta[c] * step.a[c];
    }
    if (cones.bound) second.b = (centre - step.s * step.b) / x.s;
    system_.add(path_);
    return solve();
  }

  // In scaled coordinates: lambda \ (centre - dr o dy).
  Three second_order(int c, Real centre) const {
    const ConeScaling<Real>& s = path_.scaling[c];
    const Real mu = path_.cones.mu[c];
    const Three lambda = s.apply(in_dual(&path_.at.y[3 * c], mu));
    const Three dr = s.apply_inverse(in_primal(&path_.step.r[3 * c], mu));
    const Three dy = s.apply(in_dual(&path_.step.y[3 * c], mu));
    Three d = -jordan<Real>(dr, dy);
    d[0] += centre;
    return jordan_divide(lambda, d);
  }

  bool solve() {
    ConePoint<Real>& step = path_.step;
    if (!system_.solve(path_, step)) return false;
    // From the complementarity row: b may be far smaller than the rounding of the sum, which goes into its residual.
    const ConePoint<Real>& x = path_.at;
    step.b = path_.cones.bound ? -x.b - x.b / x.s * step.s + path_.second_order.b : 0;
    return true;
  }

  // Step to the edge of the first cone.
  Real longest() const {
    const Cones<Real>& cones = path_.cones;
    const ConePoint<Real>&x = path_.at, &d = path_.step;
    Real alpha = HUGE_VAL;
    for (int c = 0; c < cones.nc(); ++c) {
      const Real mu = cones.mu[c];
      if (mu > 0) {
        alpha = std::min({alpha, cone_step<Real>(in_primal(&x.r[3 * c], mu), in_primal(&d.r[3 * c], mu)),
                          cone_step<Real>(in_dual(&x.y[3 * c], mu), in_dual(&d.y[3 * c], mu))});
      } else {
        alpha = std::min({alpha, ray_step(x.r[3 * c], d.r[3 * c]), ray_step(x.y[3 * c], d.y[3 * c])});
      }
      if (cones.inequality[c]) alpha = std::min({alpha, ray_step(x.eta[c], d.eta[c]), ray_step(x.a[c], d.a[c])});
    }
    if (cones.bound) alpha = std::min({alpha, ray_step(x.s, d.s), ray_step(x.b, d.b)});
    return alpha;
  }

  // False where there is no way to go.
  bool move() {
    const Real alpha = std::min<Real>(1, rules_.step_fraction * longest());
    ConePoint<Real>& x = path_.at;
    const ConePoint<Real>& d = path_.step;
    x.r += alpha * d.r;
    x.y += alpha * d.y;
    x.eta += alpha * d.eta;
    x.a += alpha * d.a;
    x.s += alpha * d.s;
    x.b += alpha * d.b;
    ++path_.iterations;
    return !(alpha < rules_.least_step);
  }

  static Real sqrt(const Real& x) {
    using std::sqrt;
    return sqrt(x);
  }

  static Real cube(const Real& x) {
    using std::pow;
    return pow(x, 3);
  }

  const StepRules rules_;
  System& system_;
  Iterates& iterates_;
  CentralPath<Real>& path_;
};

// Answers of programs that need no iteration: true where there is one.
bool answer_at_once(const ConeProgram& p, const ConeWorkspace& w, ConeSolution& x) {
  x.status = ConeStatus::nonconverged;
  x.iterations = 0;
  x.gap = x.infeasibility = HUGE_VAL;
  x.r.assign(3 * p.nc(), 0.0);
  x.eta.assign(p.nc(), 0.0);
  x.s = 0;
  if (!all_finite(w.q)) {
    x.status = ConeStatus::not_finite;
    return true;
  }
  if (p.nc() > 0 && w.scales.size > 0) return false;
  x.status = ConeStatus::solved;
  x.gap = x.infeasibility = 0;
  return true;
}

}  // namespace

void InteriorPoint::solve(const ConeProgram& program, ConeSolution& solution) {
  workspace_.prepare(program, options_);
  if (answer_at_once(program, workspace_, solution)) return;
  SparseNewton system(program, options_, workspace_, newton_);
  PolishedIterates iterates(program, options_, workspace_, iterates_, solution);
  system.describe(path_);
  PrimalDual(StepRules{options_.iteration_limit, options_.step_fraction, 0, least_step}, system, iterates, path_)();
}

bool InteriorPoint::polish(const ConeProgram& program, ConeSolution& solution, const PolishRules& rules) {
  workspace_.prepare(program, options_);
  return cb::polish(program, options_, rules, workspace_, solution);
}

bool InteriorPoint::go_by_points(const ConeProgram& program, ConeSolution& solution) {
  workspace_.prepare(program, options_);
  return cb::go_by_points(program, options_, workspace_, solution);
}

void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution) {
  solution = {};
  solution.r.assign(3 * program.nc(), 0.0);
  solution.eta.assign(program.nc(), 0.0);
  DenseNewton system(program);
  if (program.nc() == 0 || system.size() == 0) {
    solution.status = ConeStatus::solved;
    solution.gap = solution.infeasibility = 0;
    return;
  }
  RoundedIterates iterates(program, options, system, solution);
  CentralPath<DoubleDouble> path;
  system.describe(path);
  PrimalDual(StepRules{options.iteration_limit, options.step_fraction, dense_centre, least_step}, system, iterates,
             path)();
}

}  // namespace cb
