// Lemke's path with stored candidates, after Yamane and Nakamura, on Lloyd's structured solves.
//
// Problem: z >= 0, w = M z + q >= 0, z.w = 0 (n unknowns; lcp.h has the expanded form with free unknowns). As in
// Lemke's method a covering vector c and an artificial z_0 make w = M z + q + c z_0 feasible, and complements enter
// until z_0 leaves. Where several variables block the entering one (nearly) at once, each choice starts another
// sequence of bases; wrong choices cycle, meet a basis that cannot be factorised, or drift out of the feasible region.
//
// Sources: K. Yamane, Y. Nakamura, A numerically robust LCP solver for simulating articulated rigid bodies in contact,
// Robotics: Science and Systems 2008 (nothing is carried from pivot to pivot but the set of basic variables; all
// candidates of a pivot are kept and searched); J. E. Lloyd, Fast implementation of Lemke's algorithm for rigid body
// contact simulation, ICRA 2005 (bases have the size of the bodies: basis_system.cpp). The sequence that a
// lexicographic rule would take is among those searched: at each of its bases its choice is one of the tied candidates.
//
// Differences from the sources:
//  1. A state is (basic set, pair that is out, which of it enters). A state that was seen is not entered again (64-bit
//     hashes), so nothing cycles; states that wait are kept whole.
//  2. Order of the search: the candidate with the largest pivot is followed; the others wait. After a dead end the
//     waiting state with the fewest second choices behind it comes next, the youngest of those first.
//  3. Pairs are scaled symmetrically by powers of two (scaling.h).
//  4. Each basis is solved with iterative refinement. A basis whose values fall below -feasible is a dead end.
//  5. An end where z_0 has left counts only if the natural residual on the original data is within the tolerance.
//  6. An end that has a variable below zero by more than rounding is near the exact one: a search of its own goes from
//     its basis (polish) to one whose signs are right. Where it finds none, an end within the tolerance stands, and the
//     search goes on from any other.
//  7. When all sequences from c of ones end dead, or half of the pivots are spent, the search is repeated with two
//     other covering vectors, whose entries differ so that few candidates tie; q itself is never perturbed.
//
// Returns: solved; nonconverged (pivot limit), memory_limit: the search was cut off; where it was not:
// inaccurate (ends whose residual stays above the tolerance: the best of them), ray (some sequence ended in a ray that
// the original data confirm), singular (sequences met bases that cannot be used), cycling (all came back to states
// seen); singular also where A is; not_finite. `reason` counts the dead ends; on `solved` too.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "lcp/basis_system.h"
#include "lcp/complementary_path.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
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
  /// A variable of an end above minus this is zero but for rounding, -; looser: ends near the exact one are kept.
  double vertex_tolerance = 1e-12;
  /// A ray's direction may violate its equations by this much of its largest entry, -.
  double ray_tolerance = 1e-9;
};

constexpr std::array<std::string_view, 3> covers{"cover of ones", "second cover", "third cover"};

std::uint64_t mix(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Set of hashes, open addressing; 0 marks a free place.
class Seen {
 public:
  void clear() { std::vector<std::uint64_t>(64).swap(places_), count_ = 0; }
  /// False where it was there.
  bool insert(std::uint64_t hash) {
    if (hash == 0) hash = 1;
    if (full()) grow();
    if (!place(places_, hash)) return false;
    ++count_;
    return true;
  }
  bool full() const { return 2 * count_ >= places_.size(); }
  std::size_t bytes() const { return places_.capacity() * sizeof(std::uint64_t); }

 private:
  static bool place(std::vector<std::uint64_t>& places, std::uint64_t hash) {
    const std::size_t mask = places.size() - 1;
    std::size_t at = hash & mask;
    for (; places[at] != 0; at = (at + 1) & mask)
      if (places[at] == hash) return false;
    places[at] = hash;
    return true;
  }
  void grow() {
    std::vector<std::uint64_t> larger(2 * places_.size());
    for (const std::uint64_t hash : places_)
      if (hash != 0) place(larger, hash);
    places_.swap(larger);
  }
  std::vector<std::uint64_t> places_;
  std::size_t count_ = 0;
};

/// Where a sequence stands: z_0 is basic, pair `out` is not, and one of its variables is about to enter.
struct State {
  std::vector<std::uint64_t> basic;  ///< bit i: z_i is basic
  int out = -1;
  bool z_enters = true;
  int second_choices = 0;  ///< candidates on the way here that did not have the largest pivot

  bool has(int i) const { return (basic[i / 64] >> (i % 64) & 1) != 0; }
  void flip(int i) { basic[i / 64] ^= std::uint64_t(1) << (i % 64); }
  std::uint64_t hash() const {
    std::uint64_t h = mix(2 * static_cast<std::uint64_t>(out) + (z_enters ? 1 : 0));
    for (const std::uint64_t word : basic) h = mix(h ^ word);
    return h;
  }
};

/// States that wait, fewest second choices first, then the youngest. Their sets lie in one array.
class Waiting {
 public:
  void clear(std::size_t words) {
    words_ = words;
    born_ = 0;
    std::vector<Entry>().swap(heap_);
    std::vector<std::uint64_t>().swap(sets_);
    std::vector<int>().swap(free_);
  }
  bool empty() const { return heap_.empty(); }
  void push(const State& state) {
    if (free_.empty()) {
      free_.push_back(static_cast<int>(sets_.size() / words_));
      sets_.resize(sets_.size() + words_);
    }
    const int slot = free_.back();
    free_.pop_back();
    std::copy(state.basic.begin(), state.basic.end(), sets_.begin() + static_cast<std::ptrdiff_t>(slot * words_));
    heap_.push_back({born_++, state.second_choices, slot, state.out, state.z_enters});
    std::push_heap(heap_.begin(), heap_.end());
  }
  void pop(State& state) {
    std::pop_heap(heap_.begin(), heap_.end());
    const Entry entry = heap_.back();
    heap_.pop_back();
    const auto first = sets_.begin() + static_cast<std::ptrdiff_t>(entry.slot * words_);
    state.basic.assign(first, first + static_cast<std::ptrdiff_t>(words_));
    state.out = entry.out;
    state.z_enters = entry.z_enters;
    state.second_choices = entry.second_choices;
    free_.push_back(entry.slot);
  }
  std::size_t bytes() const {
    return heap_.capacity() * sizeof(Entry) + sets_.capacity() * sizeof(std::uint64_t) + free_.capacity() * sizeof(int);
  }
  bool full() const {
    return heap_.size() == heap_.capacity() || (free_.empty() && sets_.size() + words_ > sets_.capacity());
  }

 private:
  struct Entry {
    std::uint64_t born;
    int second_choices, slot, out;
    bool z_enters;
    bool operator<(const Entry& other) const {
      return second_choices != other.second_choices ? second_choices > other.second_choices : born < other.born;
    }
  };
  std::size_t words_ = 0;
  std::uint64_t born_ = 0;
  std::vector<Entry> heap_;
  std::vector<std::uint64_t> sets_;
  std::vector<int> free_;
};

/// A variable that blocks: z_i or w_i (or z_0: pair -1), with the size of its pivot.
struct Candidate {
  int pair;
  bool is_z;
  double pivot;
};

enum class End { solved, exhausted, pivot_limit, memory_limit };

class Ynl {
 public:
  explicit Ynl(const LcpOptions& options) { static_cast<LcpOptions&>(o_) = options; }
  void solve(const LcpProblem& problem, LcpSolution& solution);

 private:
  /// Counts of dead ends.
  struct Dead {
    int rays = 0, doubtful_rays = 0, singular = 0, infeasible = 0, seen = 0, refused = 0;
  };

  End search(const LcpProblem& problem, LcpSolution& solution);
  End follow(const LcpProblem& problem, LcpSolution& solution);
  bool polish(const LcpProblem& problem, LcpSolution& solution);
  bool follow_own_cover(const LcpProblem& problem, LcpSolution& solution);
  void start(State& state, double near_tie);
  bool expand(State& state, const LcpProblem& problem, LcpSolution& solution);
  void find_candidates(const State& state);
  bool ray_holds(double left) const;
  bool vertex(const State& state, const LcpProblem& problem, LcpSolution& solution);
  bool push(const State& state);
  bool room(std::size_t more);
  void list_active(const State& state);
  std::string dead_ends() const;

  YnlOptions o_;
  BasisSystem system_;
  PairScales scales_;
  Seen seen_;
  Waiting waiting_;
  Dead dead_;
  std::vector<Candidate> candidates_;
  Seen seen_aside_;  // of the search that an end's own cover interrupts
  Waiting waiting_aside_;
  std::vector<Candidate> candidates_aside_;
  std::vector<int> active_;
  State child_;
  int n_ = 0, pivots_ = 0, pivot_limit_ = 0, cover_limit_ = 0;
  double near_tie_ = 0, tie_ = 0;  // width of ties, -: of the search in hand; of the basis in hand
  bool polishing_ = false, polished_ = false;
  std::size_t peak_bytes_ = 0;
  bool memory_full_ = false, solved_ = false;
  double q_scale_ = 1;                   // largest scaled load once x is eliminated
  double judged_ = 1;                    // what residuals are fractions of, over q_scale_
  Eigen::VectorXd load_, cover_, zero_;  // n: condensed and scaled; c; nx of zeros: x counts from A^-1 a
  Eigen::VectorXd z_value_, w_value_;    // n: values at the basis in hand
  Eigen::VectorXd z_change_, w_change_;  // n: their changes per unit of the entering variable
  Eigen::VectorXd free_column_, pair_column_, answer_;
  double z0_value_ = 0, z0_change_ = 0;
};

bool Ynl::room(std::size_t more) {
  const std::size_t bytes = seen_.bytes() + waiting_.bytes() + seen_aside_.bytes() + waiting_aside_.bytes() + more;
  if (double(bytes) > o_.memory_limit_mb * 1e6) {
    memory_full_ = true;
    return false;
  }
  peak_bytes_ = std::max(peak_bytes_, bytes);
  return true;
}

// A growing array doubles, and lives beside its old self while it does.
bool Ynl::push(const State& state) {
  if (!room(waiting_.full() ? 2 * waiting_.bytes() + 1024 : 0)) return false;
  waiting_.push(state);
  return room(0);
}

void Ynl::list_active(const State& state) {
  active_.clear();
  for (int i = 0; i < n_; ++i)
    if (state.has(i)) active_.push_back(i);
}

// Is the direction in hand a ray of w = M z + q + c z_0? All of it >= 0, and its equations hold.
bool Ynl::ray_holds(double left) const {
  const double largest =
      std::max({1.0, z_change_.lpNorm<Eigen::Infinity>(), w_change_.lpNorm<Eigen::Infinity>(), std::abs(z0_change_)});
  const double lowest = std::min({z0_change_, z_change_.minCoeff(), w_change_.minCoeff()});
  return lowest >= -o_.ray_tolerance * largest && left <= o_.ray_tolerance * largest;
}

// The answer at a complementary basis, computed from the original data and checked on them.
bool Ynl::vertex(const State& state, const LcpProblem& problem, LcpSolution& solution) {
  list_active(state);
  ++solution.factorisations;
  if (!system_.factor(active_, -1)) {
    ++dead_.singular;
    return false;
  }
  system_.solve(zero_, load_);
  const double end_below =
      std::max(0.0, -std::min(system_.z().minCoeff(), system_.w().minCoeff()) - round_off * system_.z().maxCoeff()) /
      judged_;
  answer_ = (system_.z().cwiseProduct(scales_.columns) * q_scale_).cwiseMax(0.0);
  const double residual = answer_.allFinite() ? natural_residual(problem, answer_) : HUGE_VAL;
  const bool better = residual < solution.residual;
  if (better) {
    solution.residual = residual;
    solution.z = answer_;
  }
  const bool exact = end_below <= o_.vertex_tolerance;
  if (residual <= o_.tolerance && exact) return solved_ = true;
  if (!polishing_ && better && !exact && polish(problem, solution)) return true;
  if (residual <= o_.tolerance && !polishing_) return solved_ = true;
  ++dead_.refused;
  return false;
}

// All variables that block the entering one within near_tie, the largest pivot first; z_0 before all.
void Ynl::find_candidates(const State& state) {
  candidates_.clear();
  double bound = HUGE_VAL;
  const auto shorten = [&](double value, double change) {
    if (change < -o_.pivot_tolerance) bound = std::min(bound, std::max(value, 0.0) / -change);
  };
  const auto note = [&](int pair, bool is_z, double value, double change) {
    if (change < -o_.pivot_tolerance && value + change * bound <= tie_)
      candidates_.push_back({pair, is_z, pair < 0 ? HUGE_VAL : -change});
  };
  const auto each = [&](auto&& visit) {
    visit(-1, true, z0_value_, z0_change_);
    for (int i = 0; i < n_; ++i) {
      if (i == state.out) continue;
      if (state.has(i))
        visit(i, true, z_value_[i], z_change_[i]);
      else
        visit(i, false, w_value_[i], w_change_[i]);
    }
  };
  each([&](int, bool, double value, double change) { shorten(value, change); });
  if (!(bound < HUGE_VAL)) return;
  each(note);
  std::stable_sort(candidates_.begin(), candidates_.end(),
                   [](const Candidate& a, const Candidate& b) { return a.pivot > b.pivot; });
}

// One state: its basis from the original matrix, the candidates, and what follows from each. True where `state` has
// become the next one of the sequence.
bool Ynl::expand(State& state, const LcpProblem& problem, LcpSolution& solution) {
  list_active(state);
  ++solution.factorisations;
  if (!system_.factor(active_, state.out)) {
    ++dead_.singular;
    return false;
  }
  system_.solve(zero_, load_);
  if (!system_.finite()) {
    ++dead_.singular;
    return false;
  }
  z_value_ = system_.z();
  w_value_ = system_.w();
  z0_value_ = system_.z0();
  // What a sum of the largest values cannot tell from zero is a tie, whatever the width.
  const double rounding = round_off * std::max({z0_value_, z_value_.maxCoeff(), w_value_.maxCoeff()});
  tie_ = std::max(near_tie_, rounding);
  const double lowest = std::min({z0_value_, z_value_.minCoeff(), w_value_.minCoeff()});
  if (lowest < -std::max(o_.feasible, o_.roundings * rounding)) {
    ++dead_.infeasible;
    return false;
  }

  double left = 0;
  if (state.z_enters) {
    system_.column(state.out, free_column_, pair_column_);
    left = system_.solve(free_column_, pair_column_);
  } else {
    pair_column_.setZero(n_);
    pair_column_[state.out] = -1;
    left = system_.solve(zero_, pair_column_);
  }
  if (!system_.finite()) {
    ++dead_.singular;
    return false;
  }
  z_change_ = system_.z();
  w_change_ = system_.w();
  z0_change_ = system_.z0();

  find_candidates(state);
  if (candidates_.empty()) {
    ++(ray_holds(left) ? dead_.rays : dead_.doubtful_rays);
    return false;
  }
  if (state.z_enters) state.flip(state.out);
  std::size_t first = 0;
  if (candidates_[0].pair < 0) {
    if (vertex(state, problem, solution)) return false;
    ++first;
  }
  if (candidates_.size() == first) return false;

  // The largest pivot is followed, the others wait.
  const int choices = state.second_choices;
  for (std::size_t i = candidates_.size(); i-- > first;) {
    const Candidate& c = candidates_[i];
    State& next = i > first ? child_ : state;
    if (i > first) child_ = state;
    if (c.is_z) next.flip(c.pair);
    next.out = c.pair;
    next.z_enters = !c.is_z;
    next.second_choices = choices + (i > first ? 1 : 0);
    if (i > first && !push(next)) return false;
  }
  return true;
}

// Nothing seen, nothing waits; `state` is the slack basis.
void Ynl::start(State& state, double near_tie) {
  const std::size_t words = (static_cast<std::size_t>(n_) + 63) / 64;
  seen_.clear();
  waiting_.clear(words);
  state.basic.assign(words, 0);
  near_tie_ = near_tie;
  solved_ = false;
}

// From the slack basis: all sequences, until one ends in a checked solution.
End Ynl::search(const LcpProblem& problem, LcpSolution& solution) {
  State state;
  start(state, o_.near_tie);
  if (load_.minCoeff() >= -o_.feasible && vertex(state, problem, solution)) return End::solved;

  // z_0 enters; whatever needs most of it leaves. The first of the list is to be the youngest.
  double need = 0;
  for (int i = 0; i < n_; ++i) need = std::max(need, -load_[i] / cover_[i]);
  for (int i = n_ - 1; i >= 0; --i) {
    if (load_[i] + cover_[i] * need > near_tie_) continue;
    state.out = i;
    if (!push(state)) return End::memory_limit;
    state.second_choices = 1;
  }
  return follow(problem, solution);
}

// All sequences from the states that wait, the youngest first.
End Ynl::follow(const LcpProblem& problem, LcpSolution& solution) {
  State state;
  while (!waiting_.empty()) {
    waiting_.pop(state);
    for (;;) {
      if (!room(seen_.full() ? 2 * seen_.bytes() : 0)) return End::memory_limit;
      if (!seen_.insert(state.hash())) {
        ++dead_.seen;
        break;
      }
      if (pivots_ >= cover_limit_) return End::pivot_limit;
      poll_stop();
      ++pivots_;
      const bool on = expand(state, problem, solution);
      if (solved_) return End::solved;
      if (memory_full_) return End::memory_limit;
      if (!on) break;
    }
  }
  return End::exhausted;
}

// On from an end in hand that has a variable below zero by more than rounding: the exact end is at another basis. With
// c = w_d - M z_d, where z_d and w_d are one for what is basic at this end and zero elsewhere, all its basic values
// grow with z_0 alike: they are feasible from z_0 = -lowest on, where the lowest leaves. From there a search of its own
// goes on to z_0 = 0, its ties no wider than rounding. At most a pivot a pair.
bool Ynl::follow_own_cover(const LcpProblem& problem, LcpSolution& solution) {
  State state;
  start(state, o_.vertex_tolerance);
  z_change_.setZero(n_);
  for (const int i : active_) {
    state.flip(i);
    z_change_[i] = 1;
  }
  (system_.z() + system_.w()).minCoeff(&state.out);
  state.z_enters = !state.has(state.out);
  if (!state.z_enters) state.flip(state.out);

  active_.clear();
  ++solution.factorisations;
  if (!system_.factor(active_, -1)) return false;
  system_.product(z_change_, free_column_, pair_column_);
  system_.solve(free_column_, pair_column_);
  system_.set_cover(Eigen::VectorXd::Ones(n_) - z_change_ - system_.w());
  cover_limit_ = std::min(pivot_limit_, pivots_ + n_);
  return push(state) && follow(problem, solution) == End::solved;
}

// The same, with the search in hand put aside meanwhile.
bool Ynl::polish(const LcpProblem& problem, LcpSolution& solution) {
  polished_ = polishing_ = true;
  const double near_tie = near_tie_;
  const int cover_limit = cover_limit_;
  std::swap(seen_, seen_aside_);
  std::swap(waiting_, waiting_aside_);
  std::swap(candidates_, candidates_aside_);
  const bool found = follow_own_cover(problem, solution);
  std::swap(seen_, seen_aside_);
  std::swap(waiting_, waiting_aside_);
  std::swap(candidates_, candidates_aside_);
  system_.set_cover(cover_);
  near_tie_ = near_tie;
  cover_limit_ = cover_limit;
  polishing_ = false;
  return found;
}

std::string Ynl::dead_ends() const {
  std::string text;
  const auto add = [&](int count, const char* what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(dead_.rays, "rays");
  add(dead_.doubtful_rays, "rays that the original data refute");
  add(dead_.singular, "singular bases");
  add(dead_.infeasible, "bases out of the feasible region");
  add(dead_.seen, "states seen before");
  add(dead_.refused, "ends refused by the check");
  return text;
}

void Ynl::solve(const LcpProblem& problem, LcpSolution& solution) {
  n_ = problem.n();
  pivots_ = 0;
  pivot_limit_ = o_.pivot_limit > 0 ? o_.pivot_limit : 50 * (n_ + problem.nx()) + 1000;
  solution.reason.clear();
  solution.pivots = solution.factorisations = 0;
  solution.residual = HUGE_VAL;
  solution.peak_memory_mb = 0;
  solution.z.setZero(n_);
  solution.x.resize(0);
  peak_bytes_ = 0;
  memory_full_ = polishing_ = polished_ = false;
  dead_ = {};
  const auto refuse = [&](LcpStatus status, const char* reason) {
    solution.status = status;
    solution.reason = reason;
  };
  if (!finite(problem)) return refuse(LcpStatus::not_finite, "the data are not finite");
  if (n_ == 0) {
    solution.status = LcpStatus::solved;
    solution.residual = 0;
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
    return;
  }
  pair_scales(problem, scales_);
  system_.start(problem, scales_);
  active_.clear();
  if (!system_.factor(active_, -1)) return refuse(LcpStatus::singular, "the block of the free unknowns is singular");
  system_.solve(system_.free_load(), system_.pair_load());
  load_ = system_.w();
  q_scale_ = n_ > 0 ? load_.lpNorm<Eigen::Infinity>() : 0;
  if (q_scale_ == 0) q_scale_ = 1;
  judged_ = std::max(1.0, problem.size / q_scale_);
  if (!std::isfinite(q_scale_)) return refuse(LcpStatus::not_finite, "the data are not finite");
  load_ /= q_scale_;
  zero_.setZero(problem.nx());

  End end = End::exhausted;
  bool cut_off = false;
  std::string others;
  const auto also = [&](std::string_view cover) { others += (others.empty() ? "; then " : ", ") + std::string(cover); };
  for (std::size_t c = 0; c < covers.size() && (end == End::exhausted || end == End::pivot_limit); ++c) {
    cover_.setOnes(n_);
    for (int i = 0; c > 0 && i < n_; ++i) cover_[i] = 0.5 + draw(static_cast<unsigned>(c), static_cast<unsigned>(i));
    system_.set_cover(cover_);
    cover_limit_ = c + 1 < covers.size() ? pivots_ + (pivot_limit_ - pivots_) / 2 : pivot_limit_;
    if (c > 0) also(covers[c]);
    end = search(problem, solution);
    cut_off = cut_off || end == End::pivot_limit;
  }
  if (end == End::exhausted && cut_off) end = End::pivot_limit;
  if (polished_) also("an end's own cover");

  if (problem.expanded && solution.z.allFinite()) recover_free(problem, solution.z, solution.x);
  solution.pivots = pivots_;
  solution.peak_memory_mb = double(peak_bytes_) / 1e6;
  const std::string dead = dead_ends();
  if (!dead.empty() || !others.empty()) solution.reason = "dead ends: " + (dead.empty() ? "none" : dead) + others;
  const auto ended = [&](LcpStatus status, const std::string& reason) {
    solution.status = status;
    solution.reason = reason + (solution.reason.empty() ? "" : "; ") + solution.reason;
  };
  switch (end) {
    case End::solved:
      solution.status = LcpStatus::solved;
      break;
    case End::pivot_limit:
      ended(LcpStatus::nonconverged, "pivot limit");
      break;
    case End::memory_limit:
      ended(LcpStatus::memory_limit, "memory limit of the stored candidates");
      break;
    case End::exhausted:
      if (solution.residual < HUGE_VAL)
        ended(LcpStatus::inaccurate, "no sequence ends in a checked solution");
      else if (dead_.rays > 0)
        ended(LcpStatus::ray, "no sequence ends in a solution");
      else if (dead_.singular + dead_.infeasible + dead_.doubtful_rays > 0)
        ended(LcpStatus::singular, "no sequence could be followed to an end");
      else
        ended(LcpStatus::cycling, "every sequence came back to a state seen before");
  }
}

}  // namespace

LcpSolverRow ynl_row() {
  return {"ynl",
          "Lemke's path from bases factorised afresh; candidates of tied pivots are stored and searched",
          "Yamane and Nakamura 2008; Lloyd 2005",
          "",
          [](const LcpOptions& options) -> LcpSolver {
            auto solver = std::make_shared<Ynl>(options);
            return [solver](const LcpProblem& problem, LcpSolution& solution) { solver->solve(problem, solution); };
          },
          true};
}

}  // namespace cb
