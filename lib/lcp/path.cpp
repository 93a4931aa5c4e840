// Path following on the normal map for linear complementarity problems, after Dirkse and Ferris.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns; lcp.h has the expanded form with free unknowns). With z = x_+
// and w = x_+ - x it is the zero of the normal map F_+(x) = M x_+ + q + x - x_+.
//
//  1. Crash: projected Newton to a point near the solution (path_crash.cpp).
//  2. Path: from x_k, F_+(p(t)) = (1 - t) F_+(x_k). F_+ is piecewise linear, so p is, and p is a path of complementary
//     bases of w = M z + q + c z_0 with c = -F_+(x_k), z_0 = 1 - t (c is scaled, and z_0 with it), on which |F_+| = z_0
//     |F_+(x_k)|. It may turn back in t. At t = 1 it has found a solution.
//  3. A path that ends before (a ray, t < 0) is left at its point of least |F_+|, and 1 and 2 start again from there.
//     Watchdog: up to `watchdog` of them may fail to lower the merit (normal_map.h) by the factor 1 - decrease; then
//     the rung is given up, or, with proximal steps, z returns to the best point so far and their term grows.
//  4. Proximal steps: M + eps I, q - eps z_k, eps relative to the scaled diagonal: every basis of a positive
//     semidefinite M is then regular. Their end points start a path of the unperturbed map, which alone can solve.
//
// Source: S. P. Dirkse, M. C. Ferris, The PATH solver: a non-monotone stabilization scheme for mixed complementarity
// problems, Optimization Methods and Software 5 (1995); proximal perturbation: M. C. Ferris, C. Kanzow, T. S. Munson,
// Feasible descent algorithms for mixed complementarity problems, Math. Programming 86 (1999).
//
// Differences from the sources:
//  1. An LCP's linearisation is exact: there is one path to follow, not one a major iteration, and |F_+| along it needs
//     no search. The line search is left to the crash, the watchdog to what follows a path that does not reach t = 1.
//  2. The problem is scaled by powers of two (scaling.h). Ties, of which a symmetric box is full: the path starts from
//     x_k moved by `noise` (1 + random) a pair, and as its end is at z_0 = 0 nothing has to be undone there.
//  3. The answer is the vertex of the last basis, recomputed, refined and judged on the original data (judge.h). So is
//     that of a path that ends in a ray, with z_0 taken out: rounded data have rays close to their answer. From a
//     vertex that is refused a path goes on under a cover of its own (exact_vertex.h).
//  4. A ladder of starts, proximal steps, which cost most, last. Two rungs start at z = 0, x_i = -(max(q_i, 0) + 1 +
//     random), once and without a crash (the PATH library's last resort): c > 0 there, the path is Lemke's.
//
// Returns: solved (residual at most the tolerance), inaccurate (vertices, whose residuals all stay above it); without a
// vertex ray (a rung ended, from c > 0, in one that the original data bear out), singular (no rung had a usable pivot),
// nonconverged (all the rest: limits, paths that turn back); not_finite. `reason` names each rung that was used.

#include <array>
#include <climits>
#include <cmath>

#include "lcp/draw.h"
#include "lcp/exact_vertex.h"
#include "lcp/front.h"
#include "lcp/ladder.h"
#include "lcp/path_crash.h"

namespace cb {

namespace {

/// Numbers of the method. All act on the scaled problem: |M_ii| ~ 1, max |q_i| ~ 1. Those of the crash: PathCrash.
struct PathOptions : LcpOptions {
  double pivot_tolerance = 1e-9;  ///< an entry that blocks must be larger than this, -
  /// Exchanges per pair that a crash of the problem itself may try, where each asks for a solve, -; more: bases of
  /// redundant contacts, most of whose exchanges have no pivot, cost it many times what the path does.
  int crash_tries = 1;
  int watchdog = 2;             ///< steps that may fail to lower the merit
  int major_limit = 8;          ///< paths of one rung at most
  double proximal_growth = 10;  ///< of eps when the watchdog bites, -
  double retreat = 1;           ///< of z_0's start, -: beyond it a path has turned back (1: t < 0); larger: loops
};

/// A way to start, and the perturbations that go with it.
struct Rung {
  std::string_view name;
  bool from_best, crash;  ///< start: the best point so far, or z = 0
  double proximal;        ///< eps; 0: none
  double noise;           ///< of the start, -
  unsigned seed;
  double pivot_tolerance;  ///< as a multiple of the option
  double harris;           ///< least allowance of the ratio test (RatioTest), -; 0: rounding alone
};

/// What the watchdog of a rung has seen.
struct Watchdog {
  double eps;                    ///< proximal term, -
  double checkpoint = HUGE_VAL;  ///< merit that steps must stay below
  int failures = 0;
};

class Path {
 public:
  static constexpr Wants wants = Wants::basis;
  explicit Path(const LcpOptions& options) {
    static_cast<LcpOptions&>(o_) = options;
    exact_.tolerance = options.tolerance;
  }
  void solve(Front& front, LcpSolution& solution);

 private:
  // One rung: crash or proximal step, then path, until a vertex holds, the watchdog gives up or a limit is reached.
  PathEnd attempt(Basis& basis, const Rung& rung, LcpSolution& solution) {
    start(basis, rung);
    Watchdog dog{rung.proximal};
    PathEnd end = PathEnd::bad_pivot;
    least_ = HUGE_VAL;
    for (int major = 0; major < o_.major_limit; ++major) {
      const unsigned seed = rung.seed + 1000 * static_cast<unsigned>(major);
      if (dog.eps > 0)
        proximal_step(rung, dog.eps, seed + 500);
      else if (rung.crash)
        crash_.run(basis, map_, load_->q, path_.pivots, o_.crash_tries * n_);
      end = path_search(basis, load_->q, rung, seed);
      if (is_answer(basis, end, seed, solution)) return PathEnd::solution;
      if (end == PathEnd::pivot_limit || !may_try_again(basis, rung, dog)) break;
    }
    solution.residual = least_;
    return least_ < HUGE_VAL ? PathEnd::solution : end;
  }

  // The path, from the basis that z_0 enters for the variable of `row`: whatever variable left last, its complement
  // enters, until z_0 leaves at t = 1 or path_ ends otherwise. Notes the point where z_0, so |F_+|, is least.
  PathEnd follow(Basis& basis, int row) {
    if (!path_.enter(basis, row)) return PathEnd::bad_pivot;
    double least = HUGE_VAL;
    while (path_.goes_on(basis)) {
      const double z0 = basis.rhs()[basis.row_of(basis.artificial())];
      if (z0 < least) {
        least = z0;
        read_point(basis, lowest_);
      }
      const int entering = complement(path_.left, n_);
      path_.exchange(basis, entering, path_.blocking_row(basis, entering));
    }
    return path_.end;
  }

  void start(Basis& basis, const Rung& rung);
  void proximal_step(const Rung& rung, double eps, unsigned seed);
  PathEnd path_search(Basis& basis, const Eigen::VectorXd& q, const Rung& rung, unsigned seed);
  double choose_cover(Basis& basis, const Eigen::VectorXd& q, const Rung& rung, unsigned seed);
  int first_row(Basis& basis, double start);
  bool is_answer(Basis& basis, PathEnd end, unsigned seed, LcpSolution& solution);
  bool may_try_again(Basis& basis, const Rung& rung, Watchdog& dog);

  PathOptions o_;
  const LcpProblem* form_ = nullptr;  // in the form that the basis has
  const ScaledLoad* load_ = nullptr;
  NormalMap map_;
  PathCrash crash_;
  ComplementaryPath path_;
  PathJudge judge_;
  ExactVertex exact_;
  Kernels proximal_;
  LcpProblem perturbed_;
  int n_ = 0, pivot_limit_ = 0, factorisations_ = 0;
  bool covered_ = false;  // c > 0 on the last path
  double least_ = 0, best_merit_ = 0;
  Eigen::VectorXd trial_, cover_, q_proximal_, best_, lowest_, answer_;  // n
  Eigen::VectorXd values_, falling_;                                     // padded
};

constexpr std::array<Rung, 5> ladder{{{"crash from zero", false, true, 0, 1e-3, 1, 1, 1e-12},
                                      {"start on the ray", false, false, 0, 1, 4, 1, 0},
                                      {"crash from zero, other noise", false, true, 0, 1e-1, 2, 1e-2, 0},
                                      {"start on another ray", false, false, 0, 1, 5, 1e-2, 1e-12},
                                      {"proximal steps", true, true, 1e-2, 1e-3, 3, 1e-2, 1e-12}}};

// All rungs, until one solves the problem.
void Path::solve(Front& front, LcpSolution& solution) {
  Basis& basis = front.basis();
  form_ = &front.form();
  load_ = &front.load();
  map_.scales = &load_->scales;
  n_ = basis.n();
  pivot_limit_ = front.pivot_limit();
  path_.pivots.done = factorisations_ = 0;
  path_.ratio.resize(basis.padded());
  for (Eigen::VectorXd* x : {&values_, &falling_}) x->resize(basis.padded());
  cover_.resize(n_);
  best_.setZero(n_);
  best_merit_ = HUGE_VAL;

  Climb tried;
  const bool answered = climb(
      ladder, o_.tolerance, solution, answer_, tried, [&](const Rung& rung) { return attempt(basis, rung, solution); },
      [&] { return path_.pivots.done >= pivot_limit_ - 1; });
  solution.pivots = path_.pivots.done;
  solution.factorisations = factorisations_;
  if (answered) return;
  if (tried.rays > 0)
    solution.status = LcpStatus::ray;
  else
    solution.status = tried.singular == tried.rungs ? LcpStatus::singular : LcpStatus::nonconverged;
}

void Path::start(Basis& basis, const Rung& rung) {
  path_.ratio.pivot_tolerance = o_.pivot_tolerance * rung.pivot_tolerance;
  path_.ratio.harris = rung.harris;
  path_.ratio.vanishing = round_off;
  path_.pivots.limit = path_.pivots.done + (pivot_limit_ - path_.pivots.done) / 2;
  basis.restart();
  if (rung.from_best)
    map_.z = best_;
  else
    map_.z.setZero(n_);
}

// Crash and path on the map that eps makes regular; its end is where the path of the map itself starts.
void Path::proximal_step(const Rung& rung, double eps, unsigned seed) {
  perturb_diagonal(*form_, load_->scales, eps, perturbed_);
  Basis& near = proximal_.of(perturbed_);
  near.start(perturbed_, load_->scales);
  near.eliminate();  // A is that of the problem
  near.restart();
  q_proximal_ = load_->q - eps * map_.z;
  crash_.run(near, map_, q_proximal_, path_.pivots, INT_MAX);
  path_search(near, q_proximal_, rung, seed);
  factorisations_ += near.factorisations();
}

// The path from map_.z on the map of `basis` and q. Leaves z at its end, or where |F_+| is least.
PathEnd Path::path_search(Basis& basis, const Eigen::VectorXd& q, const Rung& rung, unsigned seed) {
  map_.want.resize(n_);
  for (int i = 0; i < n_; ++i) map_.want[i] = map_.z[i] > 0;
  map_.reach(basis, path_.pivots);
  if (path_.pivots.spent()) return PathEnd::pivot_limit;
  const double start = choose_cover(basis, q, rung, seed);
  if (!std::isfinite(start)) return PathEnd::bad_pivot;
  basis.set_load(q);
  basis.set_cover(cover_);
  const int row = first_row(basis, start);
  lowest_ = map_.z;
  path_.retreat = rung.crash ? o_.retreat * start : HUGE_VAL;  // a path from the ray cannot come back to it
  const PathEnd end = row < 0 ? PathEnd::solution : follow(basis, row);
  if (end == PathEnd::solution)
    read_point(basis, map_.z);
  else
    map_.z = lowest_;
  const bool believed = covered_ && end == PathEnd::ray && judge_.ray_holds(basis, *load_, cover_, path_.ray_variable);
  return end == PathEnd::ray && !believed ? PathEnd::doubtful_ray : end;
}

// The start x, map_.z away from all ties, and c = -F_+(x) over its largest entry. Returns that entry: c being scaled,
// z_0 falls from there, and not from 1.
double Path::choose_cover(Basis& basis, const Eigen::VectorXd& q, const Rung& rung, unsigned seed) {
  for (int i = 0; i < n_; ++i)
    if (!basis.is_basic(n_ + i)) map_.z[i] = 0;  // reach() had no pivot for it
  map_.evaluate(basis, q, map_.z);
  trial_ = map_.z;
  for (int i = 0; i < n_; ++i) {
    const double away = rung.noise * (1 + draw(seed, static_cast<unsigned>(i)));
    if (basis.is_basic(n_ + i)) {
      trial_[i] += away;
      cover_[i] = 0;
    } else {
      cover_[i] = std::max(map_.F[i], 0.0) + away;
    }
  }
  map_.evaluate(basis, q, trial_);
  cover_ -= map_.F;
  const double start = cover_.lpNorm<Eigen::Infinity>();
  cover_ /= start;
  covered_ = cover_.minCoeff() > 0;
  return start;
}

// Row that blocks first as z_0 falls from `start`; -1 where none does before z_0 = 0.
int Path::first_row(Basis& basis, double start) {
  const double *column = basis.column(basis.artificial()), *rhs = basis.rhs();
  for (int i = 0; i < basis.padded(); ++i) {
    falling_[i] = -column[i];
    values_[i] = std::max(0.0, rhs[i] + start * column[i]);
  }
  const int row = path_.ratio.row(falling_.data(), values_.data(), -1);
  return row >= 0 && values_[row] < start * column[row] ? row : -1;
}

// Does the vertex at the end of a path solve the problem? The best of a rung goes into solution.z.
bool Path::is_answer(Basis& basis, PathEnd end, unsigned seed, LcpSolution& solution) {
  const bool ray = end == PathEnd::ray || end == PathEnd::doubtful_ray;
  if (end != PathEnd::solution && !(ray && path_.drop_artificial(basis))) return false;
  double residual = judge_.vertex(basis, *load_, trial_).residual;
  if (ray ? residual <= o_.tolerance : residual > o_.tolerance) {
    residual = exact_.find(basis, *load_, path_, judge_, seed + 50'000, trial_);
    basis.restart();  // its last path may have broken off anywhere
  }
  const bool counts = !ray || residual <= o_.tolerance;
  if (counts && residual < least_) {
    least_ = solution.residual = residual;
    solution.z = trial_;
  }
  return least_ <= o_.tolerance;
}

// Notes how a path that has not solved the problem has served. False where the rung is to be given up.
bool Path::may_try_again(Basis& basis, const Rung& rung, Watchdog& dog) {
  const double merit = map_.evaluate(basis, load_->q, map_.z);
  if (merit < best_merit_) {
    best_merit_ = merit;
    best_ = map_.z;
  }
  if (merit <= (1 - crash_.decrease) * dog.checkpoint) {
    dog.checkpoint = merit;
    dog.failures = 0;
  } else if (++dog.failures > o_.watchdog) {
    if (dog.eps == 0) return false;
    map_.z = best_;
    dog.eps *= o_.proximal_growth;
    dog.failures = 0;
  }
  return dog.eps > 0 || rung.crash;
}

}  // namespace

LcpSolverRow path_row() {
  return {"path", "path of the normal map from a projected Newton crash, with watchdog and proximal restarts",
          "Dirkse and Ferris, Optimization Methods and Software 5 (1995); own implementation", "", behind_front<Path>};
}

}  // namespace cb
