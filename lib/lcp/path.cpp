// Path following on the normal map for linear complementarity problems, after Dirkse and Ferris.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns; lcp.h has the expanded form with free unknowns). With z = x_+
// and w = x_+ - x it is the zero of the normal map F_+(x) = M x_+ + q + x - x_+.
//
//  1. Crash: projected Newton. Active set {i: z_i > F_i(z)}, F = M z + q; Newton's point solves F_a = 0, z = 0
//  elsewhere;
//     the step is projected on z >= 0 and shortened until the merit falls below (1 - decrease alpha) times its largest
//     value of the last `memory` steps. Merit: |Fischer-Burmeister residual|.
//  2. Path: from x_k, F_+(p(t)) = (1 - t) F_+(x_k). F_+ is piecewise linear, so p is, and p is a path of complementary
//     bases of w = M z + q + c z_0 with c = -F_+(x_k), z_0 = 1 - t, on which |F_+| = z_0 |F_+(x_k)|. It may turn back
//     in t. At t = 1 it has found a solution.
//  3. A path that ends before (a ray, t < 0, limits) is left at its point of least |F_+|, and steps 1 and 2
//     start again from there. Watchdog: up to `watchdog` such steps may fail to lower the merit by the factor
//     1 - decrease; then z returns to the best point so far and the proximal term grows.
//  4. Proximal steps: M + eps I, q - eps z_k, eps relative to the scaled diagonal: every basis of a monotone M is then
//     regular. Their end points start a path of the unperturbed map, which alone can end in a solution.
//
// Source: S. P. Dirkse, M. C. Ferris, The PATH solver: a non-monotone stabilization scheme for mixed complementarity
// problems, Optimization Methods and Software 5 (1995); crash: the same, Crash techniques for large-scale
// complementarity problems (1997); proximal perturbation: M. C. Ferris, C. Kanzow, T. S. Munson, Math. Programming 86
// (1999).
//
// Differences from the sources:
//  1. An LCP's linearisation is exact: there is one path to follow, not one a major iteration, and |F_+| along it needs
//  no
//     search. The line search is left to the crash, the watchdog to what follows a path that does not reach t = 1.
//  2. Pairs are scaled by powers of two (scaling.h), and q so that max |q_i| ~ 1.
//  3. Ties. A symmetric box is all ties. The path starts from x_k moved by `noise` (1 + random) in each pair's basic
//     variable: c is then generic, ratios do not agree, and as the end is at z_0 = 0 nothing has to be undone there.
//  4. Singular crash bases: pairs whose exchange has no usable pivot stay on their slack (z_i = 0) until the crash
//  ends.
//     The proximal term enters in later rungs only.
//  5. The crash's point and the answer are vertices of bases; the answer is recomputed from the original data with
//     iterative refinement and checked there.
//  6. Two rungs start on the ray x = -(|q| + 1), without a crash (as the library does when all else fails): c > 0
//     there, and the path is the one that Lemke's method follows. Proximal steps, which cost most, come last.
//  7. Where each asks for a solve a crash tries `crash_tries` exchanges a pair at most; of redundant contacts most have
//     no pivot.
//  8. Where a path ends in a ray, z_0 is taken out and the vertex judged: of data that are rounded a problem may have
//     rays close to its answer.
//
// Returns: solved (residual at most the tolerance), ray (a start with c > 0 ended in a ray that the original data bear
// out), nonconverged (limits, paths that turn back or end in other rays), singular (no usable pivot),
// inaccurate (a vertex whose residual stays above the tolerance), not_finite. `reason` names each rung that was used.

#include <array>
#include <climits>
#include <cmath>
#include <memory>

#include "lcp/complementary_path.h"
#include "lcp/dense_tableau.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
#include "lcp/sparse_basis.h"

namespace cb {

namespace {

/// Numbers of the method. All act on the scaled problem: |M_ii| ~ 1, max |q_i| ~ 1.
struct PathOptions : LcpOptions {
  double pivot_tolerance = 1e-9;  ///< an entry that blocks must be larger than this, -
  int crash_steps = 20;           ///< projected Newton steps at most, before each path
  double decrease = 1e-4;         ///< part of the linear decrease of the merit that a step must reach, -
  int memory = 5;                 ///< merits that the largest is taken of; 1: monotone
  int halvings = 8;               ///< of a Newton step at most
  double converged = 1e-13;       ///< merit at which the crash ends, -
  /// An exchange of the crash needs a pivot above these, pass by pass, -; smaller: near-singular bases are entered.
  std::array<double, 2> crash_pivots{1e-2, 1e-7};
  /// Exchanges a pair that a crash may try, where each asks for a solve, -; more: bases of redundant contacts cost it
  /// many times what the path does.
  int crash_tries = 1;
  int block_exchanges = 4;      ///< exchanges of two pairs at once between fresh factorisations
  int watchdog = 2;             ///< steps that may fail to lower the merit
  int major_limit = 8;          ///< paths of one rung at most
  double proximal_growth = 10;  ///< of eps when the watchdog bites, -
  double retreat = 1;  ///< z_0 beyond which a path has turned back, of its start (t < 0 at 1), -; larger: loops
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
constexpr std::array<Rung, 5> ladder{{{"crash from zero", false, true, 0, 1e-3, 1, 1, 1e-12},
                                      {"start on the ray", false, false, 0, 1, 4, 1, 0},
                                      {"crash from zero, other noise", false, true, 0, 1e-1, 2, 1e-2, 0},
                                      {"start on another ray", false, false, 0, 1, 5, 1e-2, 1e-12},
                                      {"proximal steps", true, true, 1e-2, 1e-3, 3, 1e-2, 1e-12}}};

class Path {
 public:
  explicit Path(const LcpOptions& options) { static_cast<LcpOptions&>(o_) = options; }
  void solve(const LcpProblem& problem, LcpSolution& solution);

 private:
  template <class Table>
  void climb_ladder(Table& table, LcpSolution& solution);
  template <class Table>
  PathEnd attempt(Table& table, const Rung& rung, LcpSolution& solution);
  template <class Table>
  void crash(Table& table, const Eigen::VectorXd& q);
  template <class Table>
  PathEnd path_search(Table& table, const Eigen::VectorXd& q, const Rung& rung, unsigned seed);
  template <class Table>
  void reach(Table& table);
  template <class Table>
  void exchange_two(Table& table, int i, double smallest);
  template <class Table>
  double evaluate(Table& table, const Eigen::VectorXd& q, const Eigen::VectorXd& z);
  template <class Table>
  void read(Table& table, Eigen::VectorXd& z) const;
  DenseTableau& proximal(const DenseTableau&, double eps);
  SparseBasis& proximal(const SparseBasis&, double eps);

  PathOptions o_;
  DenseTableau dense_, dense_proximal_;
  SparseBasis sparse_, sparse_proximal_;
  const LcpProblem* problem_ = nullptr;  // in the form that the tables have
  LcpProblem condensed_, perturbed_;
  ScaledLoad load_;
  PathFollower follower_;
  PathJudge judge_;
  int n_ = 0, pivot_limit_ = 0, blocks_ = 0, factorisations_ = 0;
  int tried_ = 0, tries_ = INT_MAX;  // columns looked at in a crash, and at most
  bool covered_ = false;             // c > 0 on the last path
  double best_merit_ = 0;
  Eigen::VectorXd z_, F_, trial_, target_, product_, cover_, q_proximal_, best_, lowest_, answer_;  // n
  Eigen::VectorXd values_, falling_;                                                                // padded
  std::vector<double> merits_;
  std::vector<char> want_, before_;  // n: z_i is to be basic
  std::vector<char> refused_;        // n: had no usable pivot in this crash
  std::vector<int> waiting_;
};

// F = M z + q into F_; returns the norm of the Fischer-Burmeister residual.
template <class Table>
double Path::evaluate(Table& table, const Eigen::VectorXd& q, const Eigen::VectorXd& z) {
  product_ = z.cwiseProduct(load_.scales.columns);
  table.multiply(product_, F_);
  F_ = F_.cwiseProduct(load_.scales.rows) + q;
  double sum = 0;
  for (int i = 0; i < n_; ++i) {
    const double h = std::hypot(z[i], F_[i]);
    // sqrt(z^2 + F^2) - z - F without cancellation, z >= 0.
    const double phi = F_[i] > 0 ? -2 * z[i] * F_[i] / (h + z[i] + F_[i] + 1e-300) : h - z[i] - F_[i];
    sum += phi * phi;
  }
  return std::sqrt(sum);
}

// Clipped values of the z that are basic.
template <class Table>
void Path::read(Table& table, Eigen::VectorXd& z) const {
  z.setZero(n_);
  for (int i = 0; i < n_; ++i)
    if (table.is_basic(n_ + i)) z[i] = std::max(0.0, table.rhs()[table.row_of(n_ + i)]);
}

// Exchanges pair i and the waiting pair that gives the largest pivot, both at once, or neither.
template <class Table>
void Path::exchange_two(Table& table, int i, double smallest) {
  const auto entering = [&](int k) { return want_[k] ? n_ + k : k; };
  const auto leaving = [&](int k) { return complement(entering(k), n_); };
  const double* column = table.column(entering(i));
  int partner = -1;
  double largest = smallest;
  for (const int j : waiting_)
    if (j != i && table.is_basic(leaving(j)) && std::abs(column[table.row_of(leaving(j))]) > largest) {
      partner = j;
      largest = std::abs(column[table.row_of(leaving(j))]);
    }
  if (partner < 0) return;
  // A fresh factorisation must not fall between the two: the basis is not complementary there.
  if (blocks_++ % o_.block_exchanges == 0 && !table.refresh()) return;
  const int first = table.row_of(leaving(partner)), second = table.row_of(leaving(i));
  if (!table.pivot(first, entering(i))) return;
  if (std::abs(table.column(entering(partner))[second]) > smallest && table.pivot(second, entering(partner)))
    follower_.pivots += 2;
  else
    table.pivot(first, leaving(partner));
}

// Principal exchanges to the basis of `want_`, as far as there are pivots for it.
template <class Table>
void Path::reach(Table& table) {
  if (table.is_basic(2 * n_)) table.restart();
  const auto out_of_budget = [&] {
    poll_stop();
    tried_ += Table::column_solves;
    return follower_.pivots >= follower_.pivot_limit || tried_ > tries_;
  };
  const auto pending = [&](int i) { return table.is_basic(n_ + i) != bool(want_[i]); };
  waiting_.clear();
  for (int i = 0; i < n_; ++i)
    if (pending(i)) waiting_.push_back(i);
  blocks_ = 0;
  for (const double smallest : o_.crash_pivots) {
    std::size_t before = waiting_.size() + 1;
    while (waiting_.size() < before && !waiting_.empty()) {
      before = waiting_.size();
      for (const int i : waiting_) {
        const int entering = want_[i] ? n_ + i : i, row = table.row_of(complement(entering, n_));
        if (out_of_budget()) return;
        if (std::abs(table.column(entering)[row]) > smallest && table.pivot(row, entering)) ++follower_.pivots;
      }
      std::erase_if(waiting_, [&](int i) { return !pending(i); });
      if (smallest == o_.crash_pivots.front() && waiting_.size() < before) continue;
      for (const int i : waiting_)
        if (pending(i) && !out_of_budget()) exchange_two(table, i, smallest);
      std::erase_if(waiting_, [&](int i) { return !pending(i); });
    }
  }
}

// Projected Newton from z_, as long as the merit falls. z_ stays where it was when nothing can be gained.
template <class Table>
void Path::crash(Table& table, const Eigen::VectorXd& q) {
  double merit = evaluate(table, q, z_);
  merits_.assign(1, merit);
  before_.assign(n_, 2);
  refused_.assign(n_, 0);
  for (int step = 0; step < o_.crash_steps && merit > o_.converged; ++step) {
    want_.resize(n_);
    for (int i = 0; i < n_; ++i) want_[i] = z_[i] > F_[i] && !refused_[i];
    if (want_ == before_) return;
    before_ = want_;
    reach(table);
    for (const int i : waiting_) refused_[i] = want_[i];
    table.set_load(q);
    read(table, target_);
    // The projection comes first here: max(0, z_N) and max(0, z + alpha (z_N - z)) agree at alpha = 1, and the segment
    // to a point of the orthant needs no projection of its own.
    const double reference = *std::max_element(merits_.begin(), merits_.end());
    double alpha = 1, found = HUGE_VAL;
    for (int k = 0; k <= o_.halvings; ++k, alpha /= 2) {
      trial_ = z_ + alpha * (target_ - z_);
      found = evaluate(table, q, trial_);
      if (found <= (1 - o_.decrease * alpha) * reference) break;
    }
    if (!(found <= (1 - o_.decrease * alpha) * reference)) break;
    z_ = trial_;
    merit = found;
    merits_.push_back(merit);
    if (static_cast<int>(merits_.size()) > o_.memory) merits_.erase(merits_.begin());
  }
}

// The path from z_ on the map of `table` and q. Leaves z_ at its end, or where |F_+| is least.
template <class Table>
PathEnd Path::path_search(Table& table, const Eigen::VectorXd& q, const Rung& rung, unsigned seed) {
  want_.resize(n_);
  for (int i = 0; i < n_; ++i) want_[i] = z_[i] > 0;
  reach(table);
  if (follower_.pivots >= follower_.pivot_limit) return PathEnd::pivot_limit;
  for (int i = 0; i < n_; ++i)
    if (!table.is_basic(n_ + i)) z_[i] = 0;
  evaluate(table, q, z_);

  // The start x, away from all ties, and c = -F_+(x).
  trial_ = z_;
  for (int i = 0; i < n_; ++i) {
    const double away = rung.noise * (1 + draw(seed, static_cast<unsigned>(i)));
    if (table.is_basic(n_ + i)) {
      trial_[i] += away;
      cover_[i] = 0;
    } else {
      cover_[i] = std::max(F_[i], 0.0) + away;
    }
  }
  evaluate(table, q, trial_);
  cover_ -= F_;
  const double start = cover_.lpNorm<Eigen::Infinity>();
  if (!std::isfinite(start)) return PathEnd::bad_pivot;
  cover_ /= start;
  covered_ = cover_.minCoeff() > 0;

  table.set_load(q);
  table.set_cover(cover_);
  const int artificial = 2 * n_;
  const double* column = table.column(artificial);
  for (int i = 0; i < table.padded(); ++i) {
    falling_[i] = -column[i];
    values_[i] = std::max(0.0, table.rhs()[i] + start * column[i]);
  }
  const int row = follower_.ratio.row(falling_.data(), values_.data(), -1);
  PathEnd end = PathEnd::solution;
  if (row >= 0 && values_[row] < start * column[row]) {
    const int leaving = table.basic(row);
    if (!table.pivot(row, artificial)) return PathEnd::bad_pivot;
    ++follower_.pivots;
    follower_.retreat = rung.crash ? o_.retreat * start : HUGE_VAL;  // a path from the ray cannot come back to it
    double least = HUGE_VAL;
    lowest_ = z_;
    end = follower_.follow(table, n_, leaving, [&] {
      const double z0 = table.rhs()[table.row_of(artificial)];
      if (z0 >= least) return true;
      least = z0;
      read(table, lowest_);
      return true;
    });
    if (end != PathEnd::solution) z_ = lowest_;
  }
  if (end == PathEnd::solution) read(table, z_);
  if (end == PathEnd::ray && !(covered_ && judge_.ray_holds(table, load_, cover_, follower_.ray_variable)))
    end = PathEnd::doubtful_ray;
  return end;
}

DenseTableau& Path::proximal(const DenseTableau&, double eps) {
  perturbed_.M = problem_->M;
  for (int i = 0; i < n_; ++i) perturbed_.M(i, i) += eps / (load_.scales.rows[i] * load_.scales.columns[i]);
  dense_proximal_.start(perturbed_.M, load_.scales.rows, load_.scales.columns);
  return dense_proximal_;
}

SparseBasis& Path::proximal(const SparseBasis&, double eps) {
  perturbed_ = *problem_;
  SparseMatrix diagonal(n_, n_);
  diagonal.reserve(Eigen::VectorXi::Constant(n_, 1));
  for (int i = 0; i < n_; ++i) diagonal.insert(i, i) = eps / (load_.scales.rows[i] * load_.scales.columns[i]);
  perturbed_.D += diagonal;
  factorisations_ += sparse_proximal_.factorisations();
  sparse_proximal_.start(perturbed_);
  sparse_proximal_.set_scales(load_.scales.rows, load_.scales.columns);
  return sparse_proximal_;
}

// One rung: crash and path, again and again, until a vertex passes the check or the watchdog gives up.
template <class Table>
PathEnd Path::attempt(Table& table, const Rung& rung, LcpSolution& solution) {
  follower_.ratio.pivot_tolerance = o_.pivot_tolerance * rung.pivot_tolerance;
  follower_.ratio.harris = rung.harris;
  follower_.pivot_limit = follower_.pivots + (pivot_limit_ - follower_.pivots) / 2;
  table.restart();
  if (rung.from_best)
    z_ = best_;
  else
    z_.setZero(n_);

  double checkpoint = HUGE_VAL, eps = rung.proximal, least = HUGE_VAL;
  int failures = 0;
  PathEnd end = PathEnd::bad_pivot;
  for (int major = 0; major < o_.major_limit; ++major) {
    const unsigned seed = rung.seed + 1000 * static_cast<unsigned>(major);
    if (eps > 0) {
      Table& near = proximal(table, eps);
      near.restart();
      q_proximal_ = load_.q - eps * z_;
      if (rung.crash) crash(near, q_proximal_);
      path_search(near, q_proximal_, rung, seed + 500);
    } else if (rung.crash) {
      tried_ = 0;
      tries_ = o_.crash_tries * n_;
      crash(table, load_.q);
      tries_ = INT_MAX;
    }
    end = path_search(table, load_.q, rung, seed);
    const bool ray = end == PathEnd::ray || end == PathEnd::doubtful_ray;
    if (end == PathEnd::solution || (ray && follower_.drop_artificial(table, n_))) {
      solution.residual = judge_.vertex(table, load_, trial_).residual;
      if (ray && solution.residual > o_.tolerance) solution.residual = HUGE_VAL;
      if (solution.residual < least) {
        least = solution.residual;
        solution.z = trial_;
      }
      if (least <= o_.tolerance) return PathEnd::solution;
    }
    if (end == PathEnd::pivot_limit) break;

    // Watchdog.
    const double merit = evaluate(table, load_.q, z_);
    if (merit < best_merit_) {
      best_merit_ = merit;
      best_ = z_;
    }
    if (merit <= (1 - o_.decrease) * checkpoint) {
      checkpoint = merit;
      failures = 0;
    } else if (++failures > o_.watchdog) {
      if (eps == 0) break;
      z_ = best_;
      eps *= o_.proximal_growth;
      failures = 0;
    }
    if (eps == 0 && !rung.crash) break;
  }
  solution.residual = least;
  return least < HUGE_VAL ? PathEnd::solution : end;
}

template <class Table>
void Path::climb_ladder(Table& table, LcpSolution& solution) {
  const int padded = table.padded();
  follower_.ratio.resize(padded);
  for (Eigen::VectorXd* x : {&values_, &falling_}) x->resize(padded);
  cover_.resize(n_);
  lowest_.setZero(n_);
  best_.setZero(n_);
  best_merit_ = HUGE_VAL;

  Climb tried;
  if (climb(
          ladder, o_.tolerance, solution, answer_, tried,
          [&](const Rung& rung) { return attempt(table, rung, solution); },
          [&] { return follower_.pivots >= pivot_limit_ - 1; }))
    return;
  if (tried.rays > 0)
    solution.status = LcpStatus::ray;
  else
    solution.status = tried.singular == tried.rungs ? LcpStatus::singular : LcpStatus::nonconverged;
}

void Path::solve(const LcpProblem& problem, LcpSolution& solution) {
  n_ = problem.n();
  follower_.pivots = factorisations_ = 0;
  pivot_limit_ = o_.pivot_limit > 0 ? o_.pivot_limit : 50 * (n_ + problem.nx()) + 1000;
  solution.reason.clear();
  solution.pivots = solution.factorisations = 0;
  solution.x.resize(0);
  solution.z.setZero(n_);
  solution.residual = HUGE_VAL;
  const auto refuse = [&](LcpStatus status, const char* reason) {
    solution.status = status;
    solution.reason = reason;
  };

  const bool sparse = problem.expanded && n_ > o_.dense_limit;
  problem_ = &problem;
  if (problem.expanded) {
    if (!finite(problem)) return refuse(LcpStatus::not_finite, "the data are not finite");
    if (sparse ? !sparse_.start(problem) : !condense(problem, condensed_))
      return refuse(LcpStatus::singular, "the block of the free unknowns is singular");
    if (!sparse) problem_ = &condensed_;
  }
  if (n_ == 0) {
    solution.status = LcpStatus::solved;
    solution.residual = 0;
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
    return;
  }
  load_.original = sparse ? sparse_.condensed_load() : problem_->q;
  pair_scales(*problem_, load_.scales);
  if (!load_.set(problem) || (!sparse && !finite(*problem_)))
    return refuse(LcpStatus::not_finite, "the data are not finite");

  if (sparse) {
    sparse_.set_scales(load_.scales.rows, load_.scales.columns);
    climb_ladder(sparse_, solution);
    solution.factorisations = factorisations_ + sparse_.factorisations();
    sparse_.free_unknowns(solution.z, solution.x);
  } else {
    dense_.start(problem_->M, load_.scales.rows, load_.scales.columns);
    climb_ladder(dense_, solution);
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
  }
  solution.pivots = follower_.pivots;
}

}  // namespace

LcpSolverRow path_row() {
  return {"path", "path of the normal map from a projected Newton crash, with watchdog and proximal restarts",
          "Dirkse and Ferris, Optimization Methods and Software 5 (1995); own implementation", "",
          [](const LcpOptions& options) -> LcpSolver {
            auto solver = std::make_shared<Path>(options);
            return [solver](const LcpProblem& problem, LcpSolution& solution) { solver->solve(problem, solution); };
          }};
}

}  // namespace cb
