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
//     data. Where that vertex is not exact, group by group (complementary_path.h), Lemke goes on from this very basis
//     with p as covering vector: the vertex is that of q + delta p, so the path is followed from z_0 = delta back to
//     z_0 = 0 (take_perturbation_back). p > 0, and an almost complementary path passes a basis in one direction, that
//     of the sign of its determinant: what came to the basis from the slacks goes on towards a solution, and for A-P's
//     matrix cannot end in a ray. It takes a few pivots.
//  4. Contacts that are all but redundant make bases all but singular, where the pivots carried out before have left no
//     digits. Where the path of 3 does not do, a covering vector is made under which the basic values of the best
//     vertex all grow (cover_vertex), and each basis on its path is taken from the original matrix.
//  5. Ratio test in two passes after Harris (complementary_path.h); z_0 wins whenever it is among those that block.
//  6. A ray is believed only if its direction is a ray of the original data. On any failure the ladder below restarts
//     with other perturbations and covering vectors; `reason` names each rung that was used.
//
// Returns: solved (residual at most the tolerance), ray, nonconverged (pivot limit), singular (pivots too
// small to trust on every rung), inaccurate (a vertex whose residual stays above the tolerance), not_finite.

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "lcp/complementary_path.h"
#include "lcp/dense_tableau.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
#include "lcp/sparse_basis.h"

namespace cb {

namespace {

/// Numbers of the pivoting. All act on the scaled problem: |M_ii| ~ 1, max |q_i| ~ 1.
struct LemkeOptions : LcpOptions {
  /// An entry that blocks must be larger than this, -; looser: round-off grows, stricter: real blocks are missed.
  double pivot_tolerance = 1e-9;
  double harris = 1e-12;       ///< least allowance of the ratio test (RatioTest) on the way to a rung's first vertex, -
  double harris_back = 3e-13;  ///< the same where its perturbation is taken back; after that none but rounding, -
  double perturbation = 1e-7;  ///< delta of q, -; smaller: ties drown in round-off, larger: more repairs
  int repairs = 4;             ///< paths from the vertices of one rung to the exact one, at most
  /// Where an answer holds already, a path that leaves more than this of its error was the last, -: rounding is left.
  double repair_gain = 0.5;
  /// Judgement::beyond_rounding up to which a vertex is exact, -; larger: vertices near the exact one are kept.
  double vertex_tolerance = 1e-12;
};

/// A way to start: perturbation as a multiple of the option, seed of p, and c of ones or drawn from [0.5, 1.5).
struct Rung {
  std::string_view name;
  double perturbation;
  unsigned seed;
  bool random_cover;
  double pivot_tolerance;  ///< as a multiple of the option
};
constexpr std::array<Rung, 7> ladder{{{"cover of ones", 1, 1, false, 1},
                                      {"larger perturbation", 100, 2, false, 1e-2},
                                      {"random cover", 1, 3, true, 1e-2},
                                      {"random cover, smaller pivots", 10, 4, true, 1e-4},
                                      {"random cover, smaller perturbation", 0.01, 5, true, 1},
                                      {"another random cover", 1, 6, true, 1},
                                      {"a third random cover", 1, 7, true, 1}}};

class Lemke {
 public:
  explicit Lemke(const LcpOptions& options) { static_cast<LcpOptions&>(o_) = options; }
  void solve(const LcpProblem& problem, LcpSolution& solution);

 private:
  // A Table is the dictionary of the scaled problem at a basis: DenseTableau or SparseBasis.
  template <class Table>
  void climb_ladder(Table& table, LcpSolution& solution);
  template <class Table>
  PathEnd attempt(Table& table, const Rung& rung, LcpSolution& solution);
  template <class Table>
  double exact_vertex(Table& table, const Rung& rung, Eigen::VectorXd& z);
  template <class Table>
  PathEnd follow_path(Table& table, bool afresh);
  template <class Table>
  PathEnd take_perturbation_back(Table& table);
  template <class Table>
  bool cover_vertex(Table& table);
  template <class Table>
  int list_basis(const Table& table, std::vector<int>& active) const;
  int first_row(const double* cover, const double* rhs) const;
  void set_noise(unsigned seed);

  LemkeOptions o_;
  DenseTableau dense_;
  SparseBasis sparse_;
  LcpProblem condensed_;
  ScaledLoad load_;
  PathFollower follower_;
  PathJudge judge_;
  int n_ = 0, pivot_limit_ = 0;
  Eigen::VectorXd noise_, perturbed_, base_;  // n: p, q + delta p, c
  Eigen::VectorXd first_noise_;               // p of the first rung, of the largest problem so far
  Eigen::VectorXd best_, answer_;             // n: best vertex of a rung, of all rungs
  std::vector<int> best_active_, active_;     // pairs whose z is basic: at the best vertex, at the basis in hand
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

// From the present complementary basis: z_0 enters, complements follow, until z_0 leaves. `afresh`: each basis from the
// original matrix, for the load as it is.
template <class Table>
PathEnd Lemke::follow_path(Table& table, bool afresh) {
  const int artificial = 2 * n_;
  const int row = first_row(table.column(artificial), table.rhs());
  if (row < 0) return PathEnd::solution;
  const int leaving = table.basic(row);
  if (!table.pivot(row, artificial)) return PathEnd::bad_pivot;
  ++follower_.pivots;
  const auto renew = [&] {
    const int out = list_basis(table, active_);
    return table.renew(active_, out, load_.q, base_);
  };
  const PathEnd end =
      afresh ? follower_.follow(table, n_, leaving, renew) : follower_.follow(table, n_, leaving, [] { return true; });
  if (end == PathEnd::ray && !judge_.ray_holds(table, load_, base_, follower_.ray_variable))
    return PathEnd::doubtful_ray;
  return end;
}

// One rung: from the basis of slacks to a vertex, and on from there until the vertex stands without perturbation.
template <class Table>
PathEnd Lemke::attempt(Table& table, const Rung& rung, LcpSolution& solution) {
  const double delta = o_.perturbation * rung.perturbation;
  follower_.ratio.pivot_tolerance = o_.pivot_tolerance * rung.pivot_tolerance;
  follower_.ratio.harris = o_.harris;
  follower_.pivot_limit = follower_.pivots + (pivot_limit_ - follower_.pivots) / 2;
  table.restart();
  if (rung.seed == ladder[0].seed)
    noise_ = first_noise_.head(n_);
  else
    set_noise(rung.seed);
  perturbed_ = load_.q + delta * noise_;
  table.set_load(perturbed_);
  for (int i = 0; i < n_; ++i)
    base_[i] = rung.random_cover ? 0.5 + draw(rung.seed + 100, static_cast<unsigned>(i)) : 1.0;
  table.set_cover(base_);

  const PathEnd end = follow_path(table, false);
  if (end != PathEnd::solution) return end;
  solution.residual = exact_vertex(table, rung, solution.z);
  return PathEnd::solution;
}

// From the vertex in hand to one that is exact, or the best on the way: z, and its residual.
template <class Table>
double Lemke::exact_vertex(Table& table, const Rung& rung, Eigen::VectorXd& z) {
  Judgement found = judge_.vertex(table, load_, z), best;
  for (int repair = 1; found.beyond_rounding > o_.vertex_tolerance || found.residual > o_.tolerance; ++repair) {
    const bool better = found.residual < best.residual;
    const bool gained = found.beyond_rounding < o_.repair_gain * best.beyond_rounding;
    if (better) {
      best = found;
      best_ = z;
      list_basis(table, best_active_);
    }
    const bool stuck = found.residual < HUGE_VAL && !gained && best.residual <= o_.tolerance;
    if (best.residual == HUGE_VAL || repair > o_.repairs || stuck) break;  // HUGE_VAL: it cannot be factorised
    PathEnd end;
    // Contacts that approach at 1e-11 beside others at 1 have values of 1e-12 that decide which of them carries.
    follower_.ratio.harris = repair == 1 ? o_.harris_back : 0;
    if (repair == 1) {
      end = take_perturbation_back(table);
    } else {
      set_noise(rung.seed + 1000 * static_cast<unsigned>(repair));
      end = cover_vertex(table) ? follow_path(table, true) : PathEnd::bad_pivot;
    }
    found = end == PathEnd::solution ? judge_.vertex(table, load_, z) : Judgement{};
    if (end == PathEnd::pivot_limit) break;
  }
  if (found.residual <= best.residual) return found.residual;
  z = best_;
  return best.residual;
}

// The vertex in hand is that of q + delta p, so with c = p it is feasible from z_0 = delta on. Back from there to z_0 =
// 0: c > 0, as at the start, and a path that comes to a vertex of one orientation leaves it on the other side.
template <class Table>
PathEnd Lemke::take_perturbation_back(Table& table) {
  base_ = noise_;
  table.set_cover(base_);
  table.set_load(load_.q);
  return follow_path(table, false);
}

// Takes up the best vertex so far with a covering vector of its own: its basic values are y + p z_0, feasible from some
// z_0 > 0 on, where the lowest leaves, and at z_0 = 0 nothing is perturbed any more. False where its basis is singular.
template <class Table>
bool Lemke::cover_vertex(Table& table) {
  set_own_cover(table, load_, best_active_, noise_, perturbed_, base_);
  return table.renew(best_active_, -1, load_.q, base_);
}

// Pairs whose z is basic, and (returned) the pair that is out, -1 where z_0 is not basic.
template <class Table>
int Lemke::list_basis(const Table& table, std::vector<int>& active) const {
  int out = -1;
  active.clear();
  for (int i = 0; i < n_; ++i) {
    if (table.is_basic(n_ + i))
      active.push_back(i);
    else if (!table.is_basic(i))
      out = i;
  }
  return out;
}

template <class Table>
void Lemke::climb_ladder(Table& table, LcpSolution& solution) {
  const int padded = table.padded();
  follower_.ratio.resize(padded);
  for (Eigen::VectorXd* x : {&noise_, &base_, &perturbed_}) x->resize(n_);
  if (static_cast<int>(first_noise_.size()) < n_) {
    set_noise(ladder[0].seed);
    first_noise_ = noise_;
  }

  Climb tried;
  if (climb(
          ladder, o_.tolerance, solution, answer_, tried,
          [&](const Rung& rung) { return attempt(table, rung, solution); },
          [&] { return follower_.pivots >= pivot_limit_ - 1; }))
    return;
  if (tried.end == PathEnd::pivot_limit)
    solution.status = LcpStatus::nonconverged;
  else
    solution.status = tried.rays > 0 ? LcpStatus::ray : LcpStatus::singular;
}

void Lemke::set_noise(unsigned seed) {
  for (int i = 0; i < n_; ++i) noise_[i] = 1 + draw(seed, static_cast<unsigned>(i));
}

void Lemke::solve(const LcpProblem& problem, LcpSolution& solution) {
  n_ = problem.n();
  follower_.pivots = 0;
  pivot_limit_ = o_.pivot_limit > 0 ? o_.pivot_limit : 50 * (n_ + problem.nx()) + 1000;
  solution.reason.clear();
  solution.pivots = solution.factorisations = 0;
  if (!problem.expanded) solution.x.resize(0);

  solution.z.setZero(n_);
  solution.residual = HUGE_VAL;
  const auto refuse = [&](LcpStatus status, const char* reason) {
    solution.status = status;
    solution.reason = reason;
    solution.x.resize(0);
  };
  const bool sparse = problem.expanded && n_ > o_.dense_limit;
  const LcpProblem* form = &problem;
  if (problem.expanded) {
    if (!finite(problem)) return refuse(LcpStatus::not_finite, "the data are not finite");
    if (sparse ? !sparse_.start(problem) : !condense(problem, condensed_))
      return refuse(LcpStatus::singular, "the block of the free unknowns is singular");
    if (!sparse) form = &condensed_;
  }
  load_.original = sparse ? sparse_.condensed_load() : form->q;
  pair_scales(*form, load_.scales);
  if (!load_.set(problem) || (!sparse && !finite(*form)))
    return refuse(LcpStatus::not_finite, "the data are not finite");

  if (sparse) {
    sparse_.set_scales(load_.scales.rows, load_.scales.columns);
    climb_ladder(sparse_, solution);
    solution.factorisations = sparse_.factorisations();
    sparse_.free_unknowns(solution.z, solution.x);
  } else {
    dense_.start(form->M, load_.scales.rows, load_.scales.columns);
    climb_ladder(dense_, solution);
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
  }
  solution.pivots = follower_.pivots;
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
