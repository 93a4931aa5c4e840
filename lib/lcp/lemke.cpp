// Lemke's complementary pivoting for linear complementarity problems.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns; lcp.h has the expanded form with free unknowns). The covering
// vector c > 0 and the artificial z_0 make w = M z + q + c z_0 feasible; from there, whatever variable left the basis
// last, its complement enters, until z_0 leaves (a solution) or nothing blocks (a ray). A rung of the ladder (attempt)
// is that path for a perturbed q, from the slack basis (all w_i, which are variables i; z_i is n + i), and further ones
// from the vertex it ends at to that of q.
//
// Sources: C. E. Lemke, Management Science 11 (1965); R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity
// Problem (1992), sec. 4.4 (algorithm 4.4.5) and 4.9 (degeneracy); P. Fackler, M. Miranda, LEMKE (start from a given
// basis). For the matrix of Anitescu and Potra's method, which is copositive with the properties of Anitescu and Potra
// 1997, theorem 3.1, the ray does not occur in exact arithmetic when restitution is 0.
//
// Differences from the sources:
//  1. The problem is scaled by powers of two (scaling.h): |M_ii| ~ 1, max |q_i| ~ 1.
//  2. Ties, of which a symmetric box is full: q is perturbed by delta p, p pseudo-random in [1, 2), so that ratios
//     agree, and bases come back, by accident only (Cottle, Pang, Stone, sec. 4.9).
//  3. The answer is recomputed for q itself at the basis reached, refined and judged on the original data (judge.h).
//     Where that vertex is not exact, the method goes on from its basis (exact_vertex.h).
//  4. Ratio test in two passes after Harris (complementary_path.h); z_0 wins whenever it is among those that block.
//  5. A ray is believed only if it is one of the original data and z_0, taken out there, leaves no answer. On any
//     failure a ladder of other perturbations and covering vectors is climbed; `reason` names each rung that was used.
//
// Returns: solved (residual at most the tolerance), inaccurate (vertices, whose residuals all stay above it; both by
// ladder.h); without a vertex nonconverged (the last rung spent its share of the pivots), ray (a rung ended in one),
// singular (all the rest: no pivot to trust, rays of rounding); not_finite (front.h).

#include <algorithm>
#include <array>
#include <cmath>

#include "lcp/draw.h"
#include "lcp/exact_vertex.h"
#include "lcp/front.h"
#include "lcp/ladder.h"

namespace cb {

namespace {

/// Numbers of the pivoting. All act on the scaled problem: |M_ii| ~ 1, max |q_i| ~ 1.
struct LemkeOptions : LcpOptions {
  /// An entry that blocks must be larger than this, -; looser: round-off grows, stricter: real blocks are missed.
  double pivot_tolerance = 1e-9;
  double harris = 1e-12;       ///< least allowance of the ratio test (RatioTest) on the way to a rung's first vertex, -
  double harris_back = 3e-13;  ///< the same where its perturbation is taken back; after that none but rounding, -
  double perturbation = 1e-7;  ///< delta of q, -; smaller: ties drown in round-off, larger: more repairs
};

/// A rung: perturbation as a multiple of the option, seed of p, and c of ones or drawn from [0.5, 1.5).
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
  static constexpr Wants wants = Wants::basis;
  explicit Lemke(const LcpOptions& options) {
    static_cast<LcpOptions&>(o_) = options;
    exact_.tolerance = options.tolerance;
  }
  void solve(Front& front, LcpSolution& solution);

 private:
  PathEnd attempt(Basis& basis, const Rung& rung, LcpSolution& solution);
  PathEnd follow_path(Basis& basis);
  bool answer_beside_ray(Basis& basis, const Rung& rung, LcpSolution& solution);
  PathEnd take_perturbation_back(Basis& basis);
  void set_noise(unsigned seed);

  LemkeOptions o_;
  const ScaledLoad* load_ = nullptr;
  ComplementaryPath path_;
  PathJudge judge_;
  ExactVertex exact_;
  int n_ = 0, pivot_limit_ = 0;
  Eigen::VectorXd noise_, perturbed_, cover_;  // n: p, q + delta p, c
  Eigen::VectorXd first_noise_;                // p of the first rung, of the largest problem so far
  Eigen::VectorXd answer_;                     // n: best vertex of all rungs
};

// All rungs, until one solves the problem.
void Lemke::solve(Front& front, LcpSolution& solution) {
  Basis& basis = front.basis();
  load_ = &front.load();
  n_ = basis.n();
  pivot_limit_ = front.pivot_limit();
  path_.pivots.done = 0;
  path_.ratio.resize(basis.padded());
  for (Eigen::VectorXd* x : {&noise_, &cover_, &perturbed_}) x->resize(n_);
  if (static_cast<int>(first_noise_.size()) < n_) {
    set_noise(ladder[0].seed);
    first_noise_ = noise_;
  }

  Climb tried;
  const bool answered = climb(
      ladder, o_.tolerance, solution, answer_, tried, [&](const Rung& rung) { return attempt(basis, rung, solution); },
      [&] { return path_.pivots.done >= pivot_limit_ - 1; });
  solution.pivots = path_.pivots.done;
  if (answered) return;
  if (tried.end == PathEnd::pivot_limit)
    solution.status = LcpStatus::nonconverged;
  else
    solution.status = tried.rays > 0 ? LcpStatus::ray : LcpStatus::singular;
}

// One rung: from the basis of slacks to a vertex, and on from there until the vertex stands without perturbation.
PathEnd Lemke::attempt(Basis& basis, const Rung& rung, LcpSolution& solution) {
  const double delta = o_.perturbation * rung.perturbation;
  path_.ratio.pivot_tolerance = o_.pivot_tolerance * rung.pivot_tolerance;
  path_.ratio.harris = o_.harris;
  path_.pivots.limit = path_.pivots.done + (pivot_limit_ - path_.pivots.done) / 2;  // the rest is for other rungs
  basis.restart();
  if (rung.seed == ladder[0].seed)
    noise_ = first_noise_.head(n_);
  else
    set_noise(rung.seed);
  perturbed_ = load_->q + delta * noise_;
  basis.set_load(perturbed_);
  for (int i = 0; i < n_; ++i)
    cover_[i] = rung.random_cover ? 0.5 + draw(rung.seed + 100, static_cast<unsigned>(i)) : 1.0;
  basis.set_cover(cover_);

  const PathEnd end = follow_path(basis);
  if (end == PathEnd::ray || end == PathEnd::doubtful_ray)
    return answer_beside_ray(basis, rung, solution) ? PathEnd::solution : end;
  if (end != PathEnd::solution) return end;
  solution.residual = exact_.find(basis, *load_, path_, judge_, rung.seed, solution.z, [&] {
    // Contacts that approach at 1e-11 beside others at 1 have values of 1e-12 that decide which of them carries.
    path_.ratio.harris = o_.harris_back;
    return take_perturbation_back(basis);
  });
  return PathEnd::solution;
}

// Rounded data have rays close to their answer: z_0 leaves for a variable of the pair that is out, and that vertex
// counts where it is an answer, or the way to an exact one.
bool Lemke::answer_beside_ray(Basis& basis, const Rung& rung, LcpSolution& solution) {
  if (!path_.drop_artificial(basis) || judge_.vertex(basis, *load_, solution.z).residual > o_.tolerance) return false;
  solution.residual = exact_.find(basis, *load_, path_, judge_, rung.seed, solution.z);
  return true;
}

// p > 0 matters: pairs whose q_i = 0 (idle friction) become strictly slack and never enter; 16 cubes at rest take 42
// pivots.
void Lemke::set_noise(unsigned seed) {
  for (int i = 0; i < n_; ++i) noise_[i] = 1 + draw(seed, static_cast<unsigned>(i));
}

PathEnd Lemke::follow_path(Basis& basis) {
  const PathEnd end = path_.follow(basis);
  if (end == PathEnd::ray && !judge_.ray_holds(basis, *load_, cover_, path_.ray_variable)) return PathEnd::doubtful_ray;
  return end;
}

// The vertex in hand is that of q + delta p, so with c = p it is feasible from z_0 = delta on. Back from there to z_0 =
// 0: c > 0, as at the start, and an almost complementary path passes a basis in one direction, that of the sign of its
// determinant. What came to the basis from the slacks goes on towards a solution,
// and for A-P's matrix cannot end in a ray.
PathEnd Lemke::take_perturbation_back(Basis& basis) {
  cover_ = noise_;
  basis.set_cover(cover_);
  basis.set_load(load_->q);
  return follow_path(basis);
}

}  // namespace

LcpSolverRow lemke_row() {
  return {
      "lemke", "complementary pivoting from a covering vector, perturbed against ties, checked on the original data",
      "Lemke 1965; Cottle, Pang and Stone 1992, sec. 4.4 and 4.9; Fackler and Miranda, LEMKE", "", behind_front<Lemke>};
}

}  // namespace cb
