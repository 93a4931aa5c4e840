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
//  1. A state is (basic set, pair that is out, which of it enters). A state that was seen is not entered again (64-bit
//     hashes), so nothing cycles; states that wait are kept whole.
//  2. Order of the search: the candidate with the largest pivot is followed; the others wait. After a dead end the
//     waiting state with the fewest second choices behind it comes next, the youngest of those first.
//  3. Pairs are scaled symmetrically by powers of two (scaling.h).
//  4. Along a sequence the dictionary is carried from pivot to pivot, as Lemke's is; factorising each basis took most
//  of
//     the time. It is taken from the original matrix where a sequence begins, every `renew_every` pivots, and before a
//     dead end is believed: a basis whose values fall below -feasible, that cannot be factorised, or that nothing
//     blocks.
//  5. An end where z_0 has left is solved for and judged on the original data, as Lemke's vertices are.
//  6. An end that is not exact, group by group (complementary_path.h), is near the exact one: a search of its own goes
//     from its basis (polish) to one that is. Where it finds none, an end within the tolerance stands, and the search
//     goes on from any other.
//  7. The search begins with c of ones. One that takes more than its share of pivots is given up for another covering
//     vector, whose entries differ so that few candidates tie, with twice the share, and so is one whose sequences all
//     end dead, up to `exhausted_searches` times; q itself is never perturbed.
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

#include "lcp/complementary_path.h"
#include "lcp/dense_tableau.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
#include "lcp/sparse_basis.h"
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
  /// Pivots that a dictionary is carried on at most; more: round-off grows, fewer: each costs as many pivots again as
  /// there are basic z.
  int renew_every = 100;
  int first_search = 4;        ///< pivots a pair of the first search; each further one may take twice those of the last
  int exhausted_searches = 3;  ///< searches that all end dead, after which there is no answer
  /// A ray's direction may violate its equations by this much of its largest entry, -.
  double ray_tolerance = 1e-9;
};

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

/// A variable that blocks, with the size of its pivot.
struct Candidate {
  int variable, row;
  double pivot;
};

/// What a state leads to: on, or one of the dead ends.
enum class Look { on, ray, doubtful_ray, singular, infeasible };

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

  // A Table is the dictionary of the scaled problem at a basis: DenseTableau or SparseBasis.
  template <class Table>
  void try_covers(Table& table, LcpSolution& solution);
  template <class Table>
  End search(Table& table, LcpSolution& solution);
  template <class Table>
  End follow(Table& table, LcpSolution& solution);
  template <class Table>
  bool polish(Table& table, const State& end, LcpSolution& solution);
  template <class Table>
  bool follow_own_cover(Table& table, const State& end, LcpSolution& solution);
  template <class Table>
  bool expand(Table& table, State& state, LcpSolution& solution);
  template <class Table>
  Look look(Table& table, const State& state);
  template <class Table>
  bool take_up(Table& table, const State& state);
  template <class Table>
  bool vertex(Table& table, const State& state, LcpSolution& solution);
  void start(State& state, double near_tie);
  void find_candidates(const double* change, const double* value);
  bool dead(Look look);
  bool push(const State& state);
  bool room(std::size_t more);
  void conclude(End end, const std::string& covers_used, LcpSolution& solution);
  std::string dead_ends() const;

  YnlOptions o_;
  DenseTableau dense_;
  SparseBasis sparse_;
  LcpProblem condensed_;
  ScaledLoad load_;
  PathJudge judge_;
  Seen seen_;
  Waiting waiting_;
  Dead dead_;
  std::vector<Candidate> candidates_;
  Seen seen_aside_;  // of the search that an end's own cover interrupts
  Waiting waiting_aside_;
  std::vector<Candidate> candidates_aside_;
  std::vector<int> active_, basic_;  // pairs whose z is basic; n: the variable of each row of the table in hand
  State child_;
  int n_ = 0, pivots_ = 0, pivot_limit_ = 0, cover_limit_ = 0, renewals_ = 0;
  int worn_ = 0;                   // pivots since the table was taken from the original matrix
  bool at_hand_ = false;           // is the table at the state in hand?
  double near_tie_ = 0, tie_ = 0;  // width of ties, -: of the search in hand; of the basis in hand
  bool polishing_ = false, polished_ = false;
  std::size_t peak_bytes_ = 0;
  bool memory_full_ = false, solved_ = false;
  Eigen::VectorXd cover_, own_cover_, in_use_;  // n: c of the search; of an end; the one at hand
  Eigen::VectorXd ones_, z_ones_, answer_;      // n
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

// The state's dictionary from the original matrix.
template <class Table>
bool Ynl::take_up(Table& table, const State& state) {
  active_.clear();
  for (int i = 0; i < n_; ++i)
    if (state.has(i)) active_.push_back(i);
  ++renewals_;
  worn_ = 0;
  at_hand_ = table.renew(active_, state.out, load_.q, in_use_);
  return at_hand_;
}

// The answer at the complementary basis in hand, from the original data and judged on them.
template <class Table>
bool Ynl::vertex(Table& table, const State& state, LcpSolution& solution) {
  const Judgement found = judge_.vertex(table, load_, answer_);
  if (found.residual == HUGE_VAL) {
    ++dead_.singular;
    return false;
  }
  const bool better = found.residual < solution.residual;
  if (better) {
    solution.residual = found.residual;
    solution.z = answer_;
  }
  const bool good = found.residual <= o_.tolerance, exact = found.beyond_rounding <= o_.vertex_tolerance;
  if (good && exact) return solved_ = true;
  if (!polishing_ && better && polish(table, state, solution)) return true;
  if (good && !polishing_) return solved_ = true;
  ++dead_.refused;
  return false;
}

// All rows that block the entering variable within a tie, the largest pivot first; z_0 before all.
void Ynl::find_candidates(const double* change, const double* value) {
  candidates_.clear();
  double bound = HUGE_VAL;
  for (int i = 0; i < n_; ++i)
    if (change[i] < -o_.pivot_tolerance) bound = std::min(bound, std::max(value[i], 0.0) / -change[i]);
  if (!(bound < HUGE_VAL)) return;
  for (int i = 0; i < n_; ++i)
    if (change[i] < -o_.pivot_tolerance && value[i] + change[i] * bound <= tie_)
      candidates_.push_back({basic_[i], i, basic_[i] == 2 * n_ ? HUGE_VAL : -change[i]});
  // By variable where pivots are alike: rows are in the order of the pivots before.
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
    return a.pivot != b.pivot ? a.pivot > b.pivot : a.variable < b.variable;
  });
}

// Where does the state lead, whose dictionary is in hand? Fills candidates_.
template <class Table>
Look Ynl::look(Table& table, const State& state) {
  const double* value = table.rhs();
  double lowest = 0, largest = 0;
  for (int i = 0; i < n_; ++i) {
    basic_[i] = table.basic(i);
    lowest = std::min(lowest, value[i]);
    largest = std::max(largest, value[i]);
  }
  // What a sum of the largest values cannot tell from zero is a tie, whatever the width.
  const double rounding = round_off * largest;
  tie_ = std::max(near_tie_, rounding);
  if (lowest < -std::max(o_.feasible, o_.roundings * rounding)) return Look::infeasible;
  const int entering = state.z_enters ? n_ + state.out : state.out;
  const double* change = table.column(entering);
  if (!all_finite({value, std::size_t(n_)}) || !all_finite({change, std::size_t(n_)})) return Look::singular;
  find_candidates(change, value);
  if (!candidates_.empty()) return Look::on;
  return judge_.ray_holds(table, load_, in_use_, entering) ? Look::ray : Look::doubtful_ray;
}

// Notes a dead end.
bool Ynl::dead(Look look) {
  if (look == Look::on) return false;
  ++(look == Look::ray            ? dead_.rays
     : look == Look::doubtful_ray ? dead_.doubtful_rays
     : look == Look::singular     ? dead_.singular
                                  : dead_.infeasible);
  return true;
}

// One state: the candidates of its basis, and what follows from each. True where `state` has become the next one of the
// sequence. A dead end is believed only of a basis taken from the original matrix.
template <class Table>
bool Ynl::expand(Table& table, State& state, LcpSolution& solution) {
  Look found = at_hand_ && worn_ < o_.renew_every ? look(table, state) : Look::singular;
  if (found != Look::on && (!at_hand_ || worn_ > 0))
    found = take_up(table, state) ? look(table, state) : Look::singular;
  if (dead(found)) return at_hand_ = false;

  const int entering = state.z_enters ? n_ + state.out : state.out;
  if (state.z_enters) state.flip(state.out);
  std::size_t first = 0;
  if (candidates_[0].variable == 2 * n_) {
    at_hand_ = false;
    if (table.pivot(candidates_[0].row, entering) && vertex(table, state, solution)) return false;
    ++first;
  }
  if (candidates_.size() == first) return false;

  // The largest pivot is followed, the others wait.
  const int choices = state.second_choices;
  for (std::size_t i = candidates_.size(); i-- > first;) {
    const int variable = candidates_[i].variable, pair = variable % n_;
    State& next = i > first ? child_ : state;
    if (i > first) child_ = state;
    if (variable >= n_) next.flip(pair);
    next.out = pair;
    next.z_enters = variable < n_;
    next.second_choices = choices + (i > first ? 1 : 0);
    if (i > first && !push(next)) return false;
  }
  at_hand_ = at_hand_ && table.pivot(candidates_[first].row, entering);
  ++worn_;
  return true;
}

// Nothing seen, nothing waits; `state` is the slack basis.
void Ynl::start(State& state, double near_tie) {
  const std::size_t words = (static_cast<std::size_t>(n_) + 63) / 64;
  seen_.clear();
  waiting_.clear(words);
  state.basic.assign(words, 0);
  near_tie_ = near_tie;
  solved_ = at_hand_ = false;
}

// From the slack basis: all sequences, until one ends in a checked solution.
template <class Table>
End Ynl::search(Table& table, LcpSolution& solution) {
  State state;
  start(state, o_.near_tie);
  const auto& q = load_.q;
  if (q.minCoeff() >= -o_.feasible) {
    table.restart();
    table.set_load(q);
    if (vertex(table, state, solution)) return End::solved;
  }

  // z_0 enters; whatever needs most of it leaves. The first of the list is to be the youngest.
  double need = 0;
  for (int i = 0; i < n_; ++i) need = std::max(need, -q[i] / cover_[i]);
  for (int i = n_ - 1; i >= 0; --i) {
    if (q[i] + cover_[i] * need > near_tie_) continue;
    state.out = i;
    if (!push(state)) return End::memory_limit;
    state.second_choices = 1;
  }
  return follow(table, solution);
}

// All sequences from the states that wait, the youngest first.
template <class Table>
End Ynl::follow(Table& table, LcpSolution& solution) {
  State state;
  while (!waiting_.empty()) {
    waiting_.pop(state);
    at_hand_ = false;
    for (;;) {
      if (!room(seen_.full() ? 2 * seen_.bytes() : 0)) return End::memory_limit;
      if (!seen_.insert(state.hash())) {
        ++dead_.seen;
        break;
      }
      if (pivots_ >= cover_limit_) return End::pivot_limit;
      poll_stop();
      ++pivots_;
      const bool on = expand(table, state, solution);
      if (solved_) return End::solved;
      if (memory_full_) return End::memory_limit;
      if (!on) break;
    }
  }
  return End::exhausted;
}

// On from an end that is not exact: the exact one is at another basis. Under its own covering vector all basic values
// grow with z_0 alike: they are feasible from z_0 = -lowest on, where the lowest leaves. From there a search of its own
// goes on to z_0 = 0, its ties no wider than rounding. At most a pivot a pair.
template <class Table>
bool Ynl::follow_own_cover(Table& table, const State& end, LcpSolution& solution) {
  State state;
  start(state, 0);
  state.basic = end.basic;
  active_.clear();
  for (int i = 0; i < n_; ++i)
    if (state.has(i)) active_.push_back(i);
  ones_.setOnes(n_);
  set_own_cover(table, load_, active_, ones_, z_ones_, own_cover_);
  ++renewals_;
  if (!table.renew(active_, -1, load_.q, own_cover_)) return false;
  in_use_ = own_cover_;
  const double* value = table.rhs();
  const int row = static_cast<int>(std::min_element(value, value + n_) - value);
  state.out = table.basic(row) % n_;
  state.z_enters = table.basic(row) < n_;
  if (!state.z_enters) state.flip(state.out);
  cover_limit_ = std::min(pivot_limit_, pivots_ + n_);
  return push(state) && follow(table, solution) == End::solved;
}

// The same, with the search in hand put aside meanwhile.
template <class Table>
bool Ynl::polish(Table& table, const State& end, LcpSolution& solution) {
  polished_ = polishing_ = true;
  const double near_tie = near_tie_;
  const int cover_limit = cover_limit_;
  std::swap(seen_, seen_aside_);
  std::swap(waiting_, waiting_aside_);
  std::swap(candidates_, candidates_aside_);
  const bool found = follow_own_cover(table, end, solution);
  std::swap(seen_, seen_aside_);
  std::swap(waiting_, waiting_aside_);
  std::swap(candidates_, candidates_aside_);
  in_use_ = cover_;
  near_tie_ = near_tie;
  cover_limit_ = cover_limit;
  polishing_ = at_hand_ = false;
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

// One search after another, each from another cover, with twice the pivots of the last: which cover meets few ties
// nobody knows, and a search among ties that go nowhere takes thousands.
template <class Table>
void Ynl::try_covers(Table& table, LcpSolution& solution) {
  basic_.resize(n_);
  End end = End::exhausted;
  int others = -1, exhausted = 0;
  for (int budget = o_.first_search * n_; exhausted < o_.exhausted_searches; budget *= 2) {
    ++others;
    cover_.setOnes(n_);
    for (int i = 0; others > 0 && i < n_; ++i)
      cover_[i] = 0.5 + draw(static_cast<unsigned>(others), static_cast<unsigned>(i));
    in_use_ = cover_;
    cover_limit_ = pivots_ + std::min(budget, pivot_limit_ - pivots_);
    end = search(table, solution);
    exhausted += end == End::exhausted;
    if (end == End::solved || end == End::memory_limit || pivots_ >= pivot_limit_) break;
  }
  std::string used;
  if (others > 0) used = "; then " + std::to_string(others) + (others > 1 ? " other covers" : " other cover");
  if (polished_) used += std::string(used.empty() ? "; then " : ", ") + "an end's own cover";
  conclude(end, used, solution);
}

// Status and reason.
void Ynl::conclude(End end, const std::string& covers_used, LcpSolution& solution) {
  solution.pivots = pivots_;
  solution.peak_memory_mb = double(peak_bytes_) / 1e6;
  const std::string dead = dead_ends();
  if (!dead.empty() || !covers_used.empty())
    solution.reason = "dead ends: " + (dead.empty() ? "none" : dead) + covers_used;
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

void Ynl::solve(const LcpProblem& problem, LcpSolution& solution) {
  n_ = problem.n();
  pivots_ = renewals_ = 0;
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
  const bool sparse = problem.expanded && n_ > o_.dense_limit;
  const LcpProblem* form = &problem;
  if (problem.expanded) {
    if (sparse ? !sparse_.start(problem) : !condense(problem, condensed_))
      return refuse(LcpStatus::singular, "the block of the free unknowns is singular");
    if (!sparse) form = &condensed_;
  }
  load_.original = sparse ? sparse_.condensed_load() : form->q;
  pair_scales(*form, load_.scales);
  if (!load_.set(problem) || (!sparse && !finite(*form)))
    return refuse(LcpStatus::not_finite, "the data are not finite");

  judge_.ray_tolerance = o_.ray_tolerance;
  if (sparse) {
    sparse_.set_scales(load_.scales.rows, load_.scales.columns);
    sparse_.restart();
    try_covers(sparse_, solution);
    solution.factorisations = sparse_.factorisations();
    sparse_.free_unknowns(solution.z, solution.x);
  } else {
    dense_.start(form->M, load_.scales.rows, load_.scales.columns);
    try_covers(dense_, solution);
    solution.factorisations = renewals_;
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
  }
}

}  // namespace

LcpSolverRow ynl_row() {
  return {"ynl",
          "Lemke's path; candidates of tied pivots are stored and searched, dead ends tried again from fresh bases",
          "Yamane and Nakamura 2008; Lloyd 2005", "", [](const LcpOptions& options) -> LcpSolver {
            auto solver = std::make_shared<Ynl>(options);
            return [solver](const LcpProblem& problem, LcpSolution& solution) { solver->solve(problem, solution); };
          }};
}

}  // namespace cb
