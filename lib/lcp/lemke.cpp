// Lemke's complementary pivoting for linear complementarity problems.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns; lcp.h has the expanded form with free unknowns). The covering
// vector c > 0 and the artificial z_0 make w = M z + q + c z_0 feasible; from there, whatever variable left the basis
// last, its complement enters, until z_0 leaves (a solution) or nothing blocks (a ray).
//
// Sources: C. E. Lemke, Management Science 11 (1965); R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity
// Problem (1992), sec. 4.4 (algorithm 4.4.5) and 4.9 (degeneracy); P. Fackler, M. Miranda, LEMKE (start from a given
// basis). For A-P's matrix, which is copositive with the properties of Anitescu and Potra 1997, theorem 3.1, the ray
// does not occur in exact arithmetic when e = 0.
//
// Differences from the sources:
//  1. Pairs are scaled symmetrically by powers of two (no rounding) so that |M_ii| ~ 1, and q so that max |q_i| ~ 1.
//  2. Ties. A fully symmetric box is all ties. q is perturbed by a fixed pseudo-random vector delta p, p in [1, 2):
//     generically no two ratios agree, so no basis comes back (Cottle, Pang, Stone, sec. 4.9). p > 0 matters: pairs
//     whose q_i = 0 (idle friction) become strictly slack and never enter, and 16 cubes at rest take 45 pivots.
//  3. The answer is recomputed for the unperturbed q at the basis reached, with iterative refinement on the original
//     data. Where that vertex is infeasible by more than round-off, Lemke goes on from this very basis with p itself as
//     covering vector: the perturbed vertex lies on that path at z_0 = delta, so it only has to be followed to z_0 = 0
//     (with a new perturbation delta repair_factor).
//  4. Ratio test in two passes after Harris (1973): among the rows that block within `harris` the largest pivot wins;
//     z_0 wins whenever it is among them.
//  5. A ray is believed only if its direction is a ray of the original data. On any failure the ladder below restarts
//     with other perturbations and covering vectors; `reason` names each rung that was used.
//
// Returns: solved (residual at most the tolerance), ray, nonconverged (pivot limit), time_limit, singular (pivots too
// small to trust on every rung), inaccurate (a vertex whose residual stays above the tolerance), not_finite.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>

#include "lcp/dense_tableau.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
#include "lcp/sparse_basis.h"
#include "lcp/vector_lanes.h"

namespace cb {

namespace {

/// Numbers of the pivoting. All act on the scaled problem: |M_ii| ~ 1, max |q_i| ~ 1.
struct LemkeOptions : LcpOptions {
  /// An entry that blocks must be larger than this, -; looser: round-off grows, stricter: real blocks are missed.
  double pivot_tolerance = 1e-9;
  /// Rows whose basic value would fall to no less than minus this still compete for the largest pivot, -.
  double harris = 1e-12;
  double perturbation = 1e-7;   ///< delta of q, -; smaller: ties drown in round-off, larger: more repairs
  double repair_factor = 1e-3;  ///< delta of each repair against the one before, -
  int repairs = 4;              ///< continuations from one basis at most
  /// A basic value above minus this counts as zero at the unperturbed vertex and is clipped, -; within `tolerance`.
  double vertex_tolerance = 1e-12;
  double refined = 1e-16;  ///< refinement stops below this residual of the equalities, -
  int refinements = 3;     ///< steps of iterative refinement at most
  /// A ray's direction may violate its equations by this much of its largest entry, -.
  double ray_tolerance = 1e-9;
};

/// A way to start: perturbation as a multiple of the option, seed of p, and c of ones or drawn from [0.5, 1.5).
struct Rung {
  std::string_view name;
  double perturbation;
  unsigned seed;
  bool random_cover;
  double pivot_tolerance;  ///< as a multiple of the option
};
constexpr std::array<Rung, 5> ladder{{{"cover of ones", 1, 1, false, 1},
                                      {"larger perturbation", 100, 2, false, 1e-2},
                                      {"random cover", 1, 3, true, 1e-2},
                                      {"random cover, smaller pivots", 10, 4, true, 1e-4},
                                      {"random cover, smaller perturbation", 0.01, 5, true, 1}}};

enum class End { solution, ray, doubtful_ray, pivot_limit, time_limit, bad_pivot };

constexpr std::string_view text(End end) {
  switch (end) {
    case End::solution:
      return "vertex refused by the check";
    case End::ray:
      return "ray";
    case End::doubtful_ray:
      return "ray that the original data refute";
    case End::pivot_limit:
      return "pivot limit";
    case End::time_limit:
      return "time limit";
    case End::bad_pivot:
      return "pivot too small";
  }
  return "";
}

/// Pseudo-random number in [0, 1) that depends on nothing but its arguments (splitmix64).
double draw(unsigned seed, unsigned i) {
  std::uint64_t x = (std::uint64_t(seed) << 32 | i) + 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

bool finite(const LcpProblem& problem) {
  const auto whole = [](const SparseMatrix& matrix) {
    return Eigen::Map<const Eigen::VectorXd>(matrix.valuePtr(), matrix.nonZeros()).allFinite();
  };
  return whole(problem.A) && whole(problem.B) && whole(problem.C) && whole(problem.D) && problem.a.allFinite() &&
         problem.q.allFinite();
}

using Clock = std::chrono::steady_clock;

class Lemke {
 public:
  explicit Lemke(const LcpOptions& options) { static_cast<LcpOptions&>(o_) = options; }
  void solve(const LcpProblem& problem, LcpSolution& solution);

 private:
  // A Table is the dictionary of the scaled problem at a basis: DenseTableau or SparseBasis.
  template <class Table>
  void climb_ladder(Table& table, LcpSolution& solution);
  template <class Table>
  End attempt(Table& table, const Rung& rung, LcpSolution& solution);
  template <class Table>
  End follow_path(Table& table);
  template <class Table>
  bool ray_holds(Table& table);
  template <class Table>
  double vertex(Table& table, LcpSolution& solution);
  int first_row(const double* cover, const double* rhs) const;
  int ratio_test(const double* column, const double* rhs, int artificial_row);
  void set_scales();
  void set_noise(unsigned seed);

  LemkeOptions o_;
  DenseTableau dense_;
  SparseBasis sparse_;
  LcpProblem condensed_;
  int n_ = 0, pivots_ = 0, pivot_limit_ = 0, rung_limit_ = 0, ray_variable_ = 0;
  double pivot_tolerance_ = 0;
  Clock::time_point deadline_;
  double q_scale_ = 1;  // max_i |q_i| / sqrt(rho_i)
  PairScales scales_;
  Eigen::VectorXd root_, q_;             // n: sqrt(rho_i), scaled q
  Eigen::VectorXd q_original_;           // n, in the problem's units, free unknowns eliminated
  Eigen::VectorXd noise_, load_, base_;  // n: p, q + delta p, c
  Eigen::VectorXd values_, score_;       // padded
  Eigen::VectorXd z_, w_, product_;      // n
  Eigen::VectorXd best_, answer_;        // n: best vertex of a rung, of all rungs
  std::vector<int> active_;
};

// Row that z_0 replaces: the one that needs most of it.
int Lemke::first_row(const double* cover, const double* rhs) const {
  int best = -1;
  double worst = 0;
  for (int i = 0; i < n_; ++i)
    if (rhs[i] < worst * cover[i] && cover[i] > 0) {
      worst = rhs[i] / cover[i];
      best = i;
    }
  return best;
}

// Row that blocks the entering variable, or -1.
int Lemke::ratio_test(const double* column, const double* rhs, int artificial_row) {
  const auto padded = static_cast<int>(score_.size());
  const Lanes infinity = Lanes{} + HUGE_VAL;

  // First pass: how far all rows can go if each may fall to -harris.
  Lanes nearest = infinity;
  for (int i = 0; i < padded; i += lane_count) {
    Lanes c, x;
    load(column + i, c);
    load(rhs + i, x);
    const Lanes ratio = (x + o_.harris) / -c;
    const Lanes candidate = c < -pivot_tolerance_ ? ratio : infinity;
    nearest = candidate < nearest ? candidate : nearest;
  }
  double bound = HUGE_VAL;
  for (int l = 0; l < lane_count; ++l) bound = std::min(bound, nearest[l]);
  if (!(bound < HUGE_VAL)) return -1;
  bound = std::max(bound, 0.0);

  // Second pass: the largest pivot among the rows that block within it.
  Lanes largest = Lanes{};
  for (int i = 0; i < padded; i += lane_count) {
    Lanes c, x;
    load(column + i, c);
    load(rhs + i, x);
    const Lanes blocking = x <= -c * bound ? -c : Lanes{};
    const Lanes size = c < -pivot_tolerance_ ? blocking : Lanes{};
    largest = size > largest ? size : largest;
    store(size, score_.data() + i);
  }
  if (score_[artificial_row] > 0) return artificial_row;
  double top = 0;
  for (int l = 0; l < lane_count; ++l) top = std::max(top, largest[l]);
  if (!(top > 0)) return -1;
  int row = 0;
  while (score_[row] != top) ++row;
  return row;
}

// From the present complementary basis: z_0 enters, complements follow, until z_0 leaves.
template <class Table>
End Lemke::follow_path(Table& table) {
  const double* rhs = table.rhs();
  const int artificial = 2 * n_;
  int entering = artificial;
  const double* column = table.column(artificial);
  int row = first_row(column, rhs);
  if (row < 0) return End::solution;
  for (;;) {
    const int leaving = table.basic(row);
    if (!table.pivot(row, entering)) return End::bad_pivot;
    ++pivots_;
    if (leaving == artificial) return End::solution;
    if (pivots_ >= rung_limit_) return End::pivot_limit;
    if (o_.time_limit_s > 0 && pivots_ % 16 == 0 && Clock::now() > deadline_) return End::time_limit;
    entering = complement(leaving, n_);
    column = table.column(entering);
    row = ratio_test(column, rhs, table.row_of(artificial));
    if (row < 0) break;
  }
  ray_variable_ = entering;
  return ray_holds(table) ? End::ray : End::doubtful_ray;
}

// Is the direction along which nothing blocks a ray of w = M z + q + c z_0 (on the original data)?
// With d the change per unit of the entering variable: M dz + c dz_0 = dw, all of it >= 0, dz.dw = 0 by the basis.
template <class Table>
bool Lemke::ray_holds(Table& table) {
  const double* column = table.column(ray_variable_);
  z_.setZero();
  w_.setZero();
  double artificial = 0, largest = 1;
  const auto put = [&](int variable, double value) {
    largest = std::max(largest, std::abs(value));
    if (variable == 2 * n_)
      artificial = value;
    else if (variable < n_)
      w_[variable] = value;
    else
      z_[variable - n_] = value * scales_.columns[variable - n_];
  };
  for (int i = 0; i < n_; ++i) put(table.basic(i), column[i]);
  put(ray_variable_, 1);
  const double lowest = std::min({artificial, z_.minCoeff(), w_.minCoeff()});
  table.multiply(z_, product_);
  double error = 0;
  for (int i = 0; i < n_; ++i)
    error = std::max(error, std::abs(product_[i] * scales_.rows[i] + base_[i] * artificial - w_[i]));
  return lowest >= -o_.ray_tolerance * largest && error <= o_.ray_tolerance * largest;
}

// The unperturbed vertex of the present basis, refined on the original data, clipped, with its residual in `solution`;
// returns how far its lowest variable was below zero (scaled).
template <class Table>
double Lemke::vertex(Table& table, LcpSolution& solution) {
  auto& z = solution.z;
  solution.residual = HUGE_VAL;
  if (!table.refresh()) return HUGE_VAL;
  active_.clear();
  for (int i = 0; i < n_; ++i)
    if (table.is_basic(n_ + i)) active_.push_back(i);
  z.setZero(n_);

  // M_aa z_a = -q_a through the inverse that the table holds; then residuals from the original M.
  double before = HUGE_VAL;
  for (const int i : active_) z_[i] = -q_original_[i] * scales_.rows[i];
  for (int step = 0;; ++step) {
    table.solve_active(active_, z_.data(), values_.data());
    for (const int i : active_) z[i] += z_[i] * scales_.columns[i];
    table.multiply(z, w_);
    w_ += q_original_;
    double worst = 0;
    for (const int i : active_) worst = std::max(worst, std::abs(z_[i] = -w_[i] * scales_.rows[i]));
    if (step >= o_.refinements || !(worst < 0.5 * before) || worst <= o_.refined * q_scale_) break;
    before = worst;
  }

  // Clip, and judge what is left.
  double lowest = 0;
  for (int i = 0; i < n_; ++i)
    if (!table.is_basic(n_ + i)) lowest = std::min(lowest, w_[i] / root_[i]);
  bool clipped = false;
  for (const int i : active_)
    if (!(z[i] >= 0)) {
      lowest = std::min(lowest, z[i] * root_[i]);
      z[i] = 0;
      clipped = true;
    }
  if (clipped) {
    table.multiply(z, w_);
    w_ += q_original_;
  }
  double worst = 0;
  for (int i = 0; i < n_; ++i) {
    const double e = std::abs(std::min(z[i] * root_[i], w_[i] / root_[i]));
    if (!(e <= worst)) worst = e;
  }
  solution.residual = std::isfinite(worst) ? worst / q_scale_ : HUGE_VAL;
  return -lowest / q_scale_;
}

// One rung: from the basis of slacks to a vertex, and on from there until the vertex stands without perturbation.
template <class Table>
End Lemke::attempt(Table& table, const Rung& rung, LcpSolution& solution) {
  double delta = o_.perturbation * rung.perturbation;
  pivot_tolerance_ = o_.pivot_tolerance * rung.pivot_tolerance;
  rung_limit_ = pivots_ + (pivot_limit_ - pivots_) / 2;
  table.restart();
  set_noise(rung.seed);
  load_ = q_ + delta * noise_;
  table.set_load(load_);
  for (int i = 0; i < n_; ++i)
    base_[i] = rung.random_cover ? 0.5 + draw(rung.seed + 100, static_cast<unsigned>(i)) : 1.0;
  table.set_cover(base_);

  double best = HUGE_VAL;
  for (int repair = 0;; ++repair) {
    const End end = follow_path(table);
    if (end != End::solution) {
      if (best > o_.tolerance) return end;
      break;
    }
    const double below = vertex(table, solution);
    if (solution.residual < best) {
      best = solution.residual;
      best_ = solution.z;
    }
    if (below <= o_.vertex_tolerance || repair == o_.repairs) break;
    // On along the path of the covering vector p, from z_0 = delta.
    base_ = noise_;
    table.set_cover(base_);
    delta *= o_.repair_factor;
    set_noise(rung.seed + 1000 * static_cast<unsigned>(repair + 1));
    load_ = q_ + delta * noise_;
    table.set_load(load_);
  }
  if (solution.residual > best) {
    solution.residual = best;
    solution.z = best_;
  }
  return End::solution;
}

template <class Table>
void Lemke::climb_ladder(Table& table, LcpSolution& solution) {
  const int padded = table.padded();
  for (Eigen::VectorXd* x : {&values_, &score_}) x->resize(padded);
  for (Eigen::VectorXd* x : {&noise_, &base_, &load_, &z_, &w_, &product_}) x->resize(n_);

  double best = HUGE_VAL;
  int rays = 0;
  End end = End::bad_pivot;
  bool first = true;
  for (const Rung& rung : ladder) {
    end = attempt(table, rung, solution);
    if (end == End::solution && solution.residual <= o_.tolerance) {
      solution.status = LcpStatus::solved;
      if (!first) solution.reason += "; solved by: " + std::string(rung.name);
      return;
    }
    if (end == End::solution && solution.residual < best) {
      best = solution.residual;
      answer_ = solution.z;
    }
    if (end == End::ray) ++rays;
    solution.reason += (first ? "" : "; ") + std::string(rung.name) + ": " + std::string(text(end));
    first = false;
    if (pivots_ >= pivot_limit_ - 1 || end == End::time_limit) break;
  }

  // No rung reached a checked solution.
  solution.residual = best;
  if (best < HUGE_VAL) {
    solution.z = answer_;
    solution.status = LcpStatus::inaccurate;
  } else if (end == End::time_limit) {
    solution.status = LcpStatus::time_limit;
  } else if (end == End::pivot_limit) {
    solution.status = LcpStatus::nonconverged;
  } else {
    solution.status = rays > 0 ? LcpStatus::ray : LcpStatus::singular;
  }
  if (best == HUGE_VAL) solution.z.setZero(n_);
}

void Lemke::set_noise(unsigned seed) {
  for (int i = 0; i < n_; ++i) noise_[i] = 1 + draw(seed, static_cast<unsigned>(i));
}

// Scales from rho and the condensed load.
void Lemke::set_scales() {
  root_ = scales_.rho.cwiseSqrt();
  q_scale_ = 0;
  for (int i = 0; i < n_; ++i) q_scale_ = std::max(q_scale_, std::abs(q_original_[i]) / root_[i]);
  if (q_scale_ == 0) q_scale_ = 1;
  q_ = q_original_.cwiseProduct(scales_.rows) / q_scale_;
}

void Lemke::solve(const LcpProblem& problem, LcpSolution& solution) {
  n_ = problem.n();
  pivots_ = 0;
  pivot_limit_ = o_.pivot_limit > 0 ? o_.pivot_limit : 50 * (n_ + problem.nx()) + 1000;
  if (o_.time_limit_s > 0)
    deadline_ =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(o_.time_limit_s));
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
  const LcpProblem* form = &problem;
  if (problem.expanded) {
    if (!finite(problem)) return refuse(LcpStatus::not_finite, "the data are not finite");
    if (sparse ? !sparse_.start(problem) : !condense(problem, condensed_))
      return refuse(LcpStatus::singular, "the block of the free unknowns is singular");
    if (!sparse) form = &condensed_;
  }
  q_original_ = sparse ? sparse_.condensed_load() : form->q;
  pair_scales(*form, scales_);
  set_scales();
  if (!std::isfinite(q_.sum() + scales_.rows.sum() + scales_.columns.sum()) || (!sparse && !form->M.allFinite()))
    return refuse(LcpStatus::not_finite, "the data are not finite");

  if (sparse) {
    sparse_.set_scales(scales_.rows, scales_.columns);
    climb_ladder(sparse_, solution);
    solution.factorisations = sparse_.factorisations();
    sparse_.free_unknowns(solution.z, solution.x);
  } else {
    dense_.start(form->M, scales_.rows, scales_.columns);
    climb_ladder(dense_, solution);
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
  }
  solution.pivots = pivots_;
}

}  // namespace

LcpSolverRow lemke_row() {
  return {"lemke",
          "complementary pivoting from a covering vector, perturbed against ties, checked on the original data",
          "Lemke 1965; Cottle, Pang and Stone 1992, sec. 4.4 and 4.9; Fackler and Miranda, LEMKE", "",
          [](const LcpOptions& options) -> LcpSolver {
            auto solver = std::make_shared<Lemke>(options);
            return [solver](const LcpProblem& problem, LcpSolution& solution) { solver->solve(problem, solution); };
          }};
}

}  // namespace cb
