// Lemke's path with stored candidates, after Yamane and Nakamura, on Lloyd's structured solves.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns; lcp.h has the expanded form with free unknowns). As in
// Lemke's method a covering vector c and an artificial z_0 make w = M z + q + c z_0 feasible, and complements enter
// until z_0 leaves. Where several variables block the entering one (nearly) at once, each choice starts another
// sequence of bases; wrong choices cycle, meet a basis that cannot be factorised, or drift out of the feasible region.
//
// Sources: K. Yamane, Y. Nakamura, A numerically robust LCP solver for simulating articulated rigid bodies in contact,
// Robotics: Science and Systems 2008 (all candidates of a pivot are kept and searched; bases come from the original
// matrix, so that round-off does not add up); J. E. Lloyd, Fast implementation of Lemke's algorithm for rigid body
// contact simulation, ICRA 2005 (bases have the size of the bodies: sparse_basis.cpp). The sequence that a
// lexicographic rule would take is among those searched: at each of its bases its choice is one of the tied candidates.
//
// Differences from the sources:
//  1. A state is (basic set, pair that is out, which of it enters). One that was seen is not entered again, so nothing
//     cycles. Of a state's candidates the one with the largest pivot is followed; the others wait. After a dead end the
//     waiting state with the fewest second choices behind it comes next, the youngest of those first (ynl_states.h).
//  2. The problem is scaled by powers of two (scaling.h).
//  3. Along a sequence the dictionary of its basis is carried from pivot to pivot, as Lemke's is: to factorise each
//     basis took most of the time. The dictionary is taken from the original matrix where a sequence begins, every
//     `renew_every` pivots, and before a dead end is believed.
//  4. An end where z_0 has left is solved for and judged on the original data (judge.h). One that is not exact is near
//     the exact one: from the best so far a search of its own goes on (polish). Where that finds none, an end within
//     the tolerance stands, and the search goes on from any other. At a ray z_0 is taken out: where that is an answer,
//     the ray is rounding's, and this an end.
//  5. One search after another, from other covering vectors (try_covers); q itself is never perturbed.
//
// Returns: solved; nonconverged (pivot limit), memory_limit: the search was cut off; where three came to an end:
// inaccurate (ends whose residual stays above the tolerance: the best of them), ray (some sequence ended in a ray that
// the original data confirm), singular (sequences met bases that cannot be used), cycling (all came back to states
// seen); singular also where A is; not_finite. `reason` counts the dead ends; on `solved` too.

#include <algorithm>
#include <cmath>

#include "lcp/complementary_path.h"
#include "lcp/draw.h"
#include "lcp/front.h"
#include "lcp/judge.h"
#include "lcp/ynl_states.h"
#include "linalg/finite.h"
#include "linalg/stop.h"

namespace cb {

namespace {

/// Numbers of the search. All act on the scaled problem: |M_ii| ~ 1, max |q_i| ~ 1.
struct YnlOptions : LcpOptions {
  /// An entry that blocks must be larger than this, -; looser: bases near singular, stricter: real blocks are missed.
  double pivot_tolerance = 1e-9;
  /// Rows whose value at the blocking step is no more than this, or `round_off` of the largest value at the basis, are
  /// candidates, -; larger: wider search.
  double near_tie = 1e-10;
  /// Values above minus this, or `roundings` times round_off of the largest value, count as feasible, -; within it no
  /// sequence is given up.
  double feasible = 1e-8;
  double roundings = 100;
  /// Judgement::beyond_rounding up to which an end is exact, -; looser: ends near the exact one are kept.
  double vertex_tolerance = 1e-12;
  /// States that a dictionary is carried on at most, a pivot each; more: round-off grows, fewer: each costs as many
  /// pivots again as there are basic z.
  int renew_every = 100;
  int first_search = 4;  ///< pivots per pair in the first search; each further one may take twice those of the last
  int exhausted_searches = 12;  ///< searches that all end dead, after which there is no answer
};

class Ynl {
 public:
  static constexpr Wants wants = Wants::basis;
  explicit Ynl(const LcpOptions& options) { static_cast<LcpOptions&>(o_) = options; }
  void solve(Front& front, LcpSolution& solution);

 private:
  // The search: each sequence on to its end, then the next of those that wait.
  SearchEnd follow(Basis& basis, LcpSolution& solution) {
    SearchState state;
    while (!search_.waiting.empty()) {
      search_.waiting.pop(state);
      at_hand_ = false;
      for (bool on = true; on;) {
        if (!search_.make_room_to_see(memory_)) return SearchEnd::memory_limit;
        if (!search_.seen.insert(state.hash())) {
          ++dead_.seen;
          break;
        }
        if (pivots_ >= search_.pivot_limit) return SearchEnd::pivot_limit;
        poll_stop();
        ++pivots_;
        on = expand(basis, state, solution);
        if (solved_) return SearchEnd::solved;
        if (memory_.full) return SearchEnd::memory_limit;
      }
    }
    return SearchEnd::exhausted;
  }

  // One state: the candidates of its basis; the largest pivot is carried out, and states that follow from the others
  // wait. True where `state` has become the next one of the sequence; false where that has ended, in an answer
  // (solved_) or not. A dead end is believed only of a basis taken from the original matrix.
  bool expand(Basis& basis, SearchState& state, LcpSolution& solution) {
    Look found = at_hand_ && worn_ < o_.renew_every ? look(basis, state) : Look::singular;
    if (found != Look::on && (!at_hand_ || worn_ > 0))
      found = take_up(basis, state) ? look(basis, state) : Look::singular;
    dead_.note(found);
    const int entering = state.z_enters ? n_ + state.out : state.out;
    if (found == Look::ray || found == Look::doubtful_ray) answer_beside_ray(basis, state, entering, solution);
    if (found != Look::on) return at_hand_ = false;

    const auto& candidates = search_.candidates;
    if (state.z_enters) state.flip(state.out);
    std::size_t first = 0;
    if (candidates[0].variable == basis.artificial()) {  // z_0 leaves: an end, and perhaps the answer
      at_hand_ = false;
      if (basis.pivot(candidates[0].row, entering) && vertex(basis, state, solution)) return false;
      ++first;
    }
    if (candidates.size() == first || !search_.branch(state, first, n_, memory_)) return false;
    at_hand_ = at_hand_ && basis.pivot(candidates[first].row, entering);
    ++worn_;
    return true;
  }

  SearchEnd try_covers(Basis& basis, LcpSolution& solution);
  SearchEnd search(Basis& basis, LcpSolution& solution);
  bool polish(Basis& basis, const SearchState& end, LcpSolution& solution);
  bool follow_own_cover(Basis& basis, const SearchState& end, LcpSolution& solution);
  Look look(Basis& basis, const SearchState& state);
  bool take_up(Basis& basis, const SearchState& state);
  void list_active(const SearchState& state);
  bool vertex(Basis& basis, const SearchState& state, LcpSolution& solution);
  void answer_beside_ray(Basis& basis, const SearchState& state, int entering, LcpSolution& solution);

  YnlOptions o_;
  const ScaledLoad* load_ = nullptr;
  PathJudge judge_;
  Search search_, aside_;  // in hand; interrupted while an end is polished
  Memory memory_;
  DeadEnds dead_;
  CoversUsed covers_;
  std::vector<int> active_;  // pairs whose z is basic
  int n_ = 0, pivots_ = 0, pivot_limit_ = 0;
  int worn_ = 0;          // pivots since the basis was taken from the original matrix
  bool at_hand_ = false;  // is the basis that of the state in hand?
  bool polishing_ = false, solved_ = false;
  Judgement best_;                              // of the answer that is kept
  Eigen::VectorXd cover_, own_cover_, in_use_;  // n: c of the search; of an end; the one at hand
  Eigen::VectorXd ones_, z_ones_, answer_;      // n
};

void Ynl::solve(Front& front, LcpSolution& solution) {
  load_ = &front.load();
  n_ = front.basis().n();
  pivots_ = 0;
  pivot_limit_ = front.pivot_limit();
  polishing_ = solved_ = false;
  best_ = {};
  memory_ = {o_.memory_limit_mb * 1e6};
  dead_ = {};
  covers_ = {-1};
  const SearchEnd end = try_covers(front.basis(), solution);
  conclude(end, dead_, covers_, solution);
  solution.pivots = pivots_;
  solution.peak_memory_mb = double(memory_.peak) / 1e6;
}

// One search after another, each from another cover, with twice the pivots of the last: which cover meets few ties
// nobody knows, and a search among ties that go nowhere takes thousands. The first is of ones; the entries of the
// others differ, so that few candidates tie.
SearchEnd Ynl::try_covers(Basis& basis, LcpSolution& solution) {
  SearchEnd end = SearchEnd::exhausted;
  int exhausted = 0;
  for (int budget = o_.first_search * n_; exhausted < o_.exhausted_searches; budget *= 2) {
    ++covers_.others;
    cover_.setOnes(n_);
    for (int i = 0; covers_.others > 0 && i < n_; ++i)
      cover_[i] = 0.5 + draw(static_cast<unsigned>(covers_.others), static_cast<unsigned>(i));
    in_use_ = cover_;
    search_.pivot_limit = pivots_ + std::min(budget, pivot_limit_ - pivots_);
    end = search(basis, solution);
    exhausted += end == SearchEnd::exhausted;
    if (end == SearchEnd::solved || end == SearchEnd::memory_limit || pivots_ >= pivot_limit_) break;
  }
  return end;
}

// From the slack basis: all sequences, until one ends in a checked solution.
SearchEnd Ynl::search(Basis& basis, LcpSolution& solution) {
  SearchState state;
  search_.start(n_, o_.near_tie, state);
  const auto& q = load_->q;
  if (q.minCoeff() >= -o_.feasible) {
    basis.restart();
    basis.set_load(q);
    if (vertex(basis, state, solution)) return SearchEnd::solved;
  }

  // z_0 enters; whatever needs most of it leaves. The last of those that tie is the first choice, the others second.
  double need = 0;
  for (int i = 0; i < n_; ++i) need = std::max(need, -q[i] / cover_[i]);
  for (int i = n_ - 1; i >= 0; --i) {
    if (q[i] + cover_[i] * need > search_.near_tie) continue;
    state.out = i;
    if (!search_.push(state, memory_)) return SearchEnd::memory_limit;
    state.second_choices = 1;
  }
  return follow(basis, solution);
}

// Where does the state lead, whose basis is in hand? Fills the candidates.
Look Ynl::look(Basis& basis, const SearchState& state) {
  const double* value = basis.rhs();
  double lowest = 0, largest = 0;
  for (int i = 0; i < n_; ++i) {
    lowest = std::min(lowest, value[i]);
    largest = std::max(largest, value[i]);
  }
  // What a sum of the largest values cannot tell from zero is a tie, whatever the width.
  const double rounding = round_off * largest;
  const double tie = std::max(search_.near_tie, rounding);
  if (lowest < -std::max(o_.feasible, o_.roundings * rounding)) return Look::infeasible;
  const int entering = state.z_enters ? n_ + state.out : state.out;
  const double* change = basis.column(entering);
  if (!all_finite({value, std::size_t(n_)}) || !all_finite({change, std::size_t(n_)})) return Look::singular;
  find_candidates(basis, change, o_.pivot_tolerance, tie, search_.candidates);
  if (!search_.candidates.empty()) return Look::on;
  return judge_.ray_holds(basis, *load_, in_use_, entering) ? Look::ray : Look::doubtful_ray;
}

void Ynl::list_active(const SearchState& state) {
  active_.clear();
  for (int i = 0; i < n_; ++i)
    if (state.has(i)) active_.push_back(i);
}

// The state's basis from the original matrix.
bool Ynl::take_up(Basis& basis, const SearchState& state) {
  list_active(state);
  worn_ = 0;
  return at_hand_ = basis.renew(active_, state.out, load_->q, in_use_);
}

// The answer at the complementary basis in hand, from the original data and judged on them.
bool Ynl::vertex(Basis& basis, const SearchState& state, LcpSolution& solution) {
  const Judgement found = judge_.vertex(basis, *load_, answer_);
  if (found.residual == HUGE_VAL) {
    ++dead_.singular;
    return false;
  }
  const bool improves = better(found, best_, o_.tolerance);
  if (improves) {
    best_ = found;
    solution.residual = found.residual;
    solution.z = answer_;
  }
  const bool good = found.residual <= o_.tolerance, exact = found.beyond_rounding <= o_.vertex_tolerance;
  if (good && exact) return solved_ = true;
  if (!polishing_ && improves && polish(basis, state, solution)) return true;
  if (!polishing_ && solution.residual <= o_.tolerance) return solved_ = true;  // this end's, or one of its polish
  ++dead_.refused;
  return false;
}

// Rounded data have rays close to their answer: without z_0 there the vertex is an end where it is an answer.
void Ynl::answer_beside_ray(Basis& basis, const SearchState& state, int entering, LcpSolution& solution) {
  if (polishing_) return;
  const int in = drop_artificial(basis, entering, o_.pivot_tolerance);
  if (in < 0 || judge_.vertex(basis, *load_, answer_).residual > o_.tolerance) return;
  SearchState end = state;
  if (in >= n_) end.flip(state.out);
  vertex(basis, end, solution);
}

// On from an end that is not exact, with the search in hand put aside meanwhile.
bool Ynl::polish(Basis& basis, const SearchState& end, LcpSolution& solution) {
  covers_.own = polishing_ = true;
  std::swap(search_, aside_);
  memory_.aside = aside_.bytes();
  const bool found = follow_own_cover(basis, end, solution);
  std::swap(search_, aside_);
  memory_.aside = 0;
  in_use_ = cover_;
  polishing_ = at_hand_ = false;
  return found;
}

// The exact end is at another basis. Under its own covering vector all basic values of this one grow with z_0 alike:
// they are feasible from z_0 = -lowest on, where the lowest leaves. From there a search of its own goes on to z_0 = 0,
// its ties no wider than rounding. At most one pivot per pair.
bool Ynl::follow_own_cover(Basis& basis, const SearchState& end, LcpSolution& solution) {
  SearchState state;
  search_.start(n_, 0, state);
  state.basic = end.basic;
  list_active(state);
  ones_.setOnes(n_);
  set_own_cover(basis, *load_, active_, ones_, z_ones_, own_cover_);
  if (!basis.renew(active_, -1, load_->q, own_cover_)) return false;
  in_use_ = own_cover_;
  const double* value = basis.rhs();
  const int row = static_cast<int>(std::min_element(value, value + n_) - value);
  state.out = basis.basic(row) % n_;
  state.z_enters = basis.basic(row) < n_;
  if (!state.z_enters) state.flip(state.out);
  search_.pivot_limit = std::min(pivot_limit_, pivots_ + n_);
  return search_.push(state, memory_) && follow(basis, solution) == SearchEnd::solved;
}

}  // namespace

LcpSolverRow ynl_row() {
  return {"ynl",
          "Lemke's path; candidates of tied pivots are stored and searched, dead ends tried again from fresh bases",
          "Yamane and Nakamura 2008; Lloyd 2005", "", behind_front<Ynl>};
}

}  // namespace cb
