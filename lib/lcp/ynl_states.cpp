// What the search of ynl.cpp keeps (ynl_states.h).

#include "lcp/ynl_states.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// False where it was there.
bool place(std::vector<std::uint64_t>& places, std::uint64_t hash) {
  const std::size_t mask = places.size() - 1;
  std::size_t at = hash & mask;
  for (; places[at] != 0; at = (at + 1) & mask)
    if (places[at] == hash) return false;
  places[at] = hash;
  return true;
}

}  // namespace

void find_candidates(const Basis& basis, const double* change, double pivot_tolerance, double tie,
                     std::vector<Candidate>& candidates) {
  const double* value = basis.rhs();
  const int n = basis.n();
  candidates.clear();
  double bound = HUGE_VAL;
  for (int i = 0; i < n; ++i)
    if (change[i] < -pivot_tolerance) bound = std::min(bound, std::max(value[i], 0.0) / -change[i]);
  if (!(bound < HUGE_VAL)) return;
  for (int i = 0; i < n; ++i)
    if (change[i] < -pivot_tolerance && value[i] + change[i] * bound <= tie)
      candidates.push_back({basis.basic(i), i, basis.basic(i) == basis.artificial() ? HUGE_VAL : -change[i]});
  // By variable where pivots are alike: rows are in the order of the pivots before.
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.pivot != b.pivot ? a.pivot > b.pivot : a.variable < b.variable;
  });
}

bool Memory::room(std::size_t bytes) {
  full = full || double(bytes + aside) > limit;
  if (!full) peak = std::max(peak, bytes + aside);
  return !full;
}

bool SeenStates::insert(std::uint64_t hash) {
  if (hash == 0) hash = 1;
  if (full()) grow();
  if (!place(places_, hash)) return false;
  ++count_;
  return true;
}

void SeenStates::grow() {
  std::vector<std::uint64_t> larger(2 * places_.size());
  for (const std::uint64_t hash : places_)
    if (hash != 0) place(larger, hash);
  places_.swap(larger);
}

void WaitingStates::clear(std::size_t words) {
  words_ = words;
  born_ = 0;
  std::vector<Entry>().swap(heap_);
  std::vector<std::uint64_t>().swap(sets_);
  std::vector<int>().swap(free_);
}

void WaitingStates::push(const SearchState& state) {
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

void WaitingStates::pop(SearchState& state) {
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

void Search::start(int n, double ties, SearchState& state) {
  const std::size_t words = (static_cast<std::size_t>(n) + 63) / 64;
  seen.clear();
  waiting.clear(words);
  near_tie = ties;
  state.basic.assign(words, 0);
}

// A growing array doubles, and lives beside its old self while it does.
bool Search::make_room_to_see(Memory& memory) const {
  return memory.room(bytes() + (seen.full() ? 2 * seen.bytes() : 0));
}

bool Search::push(const SearchState& state, Memory& memory) {
  if (!memory.room(bytes() + (waiting.full() ? 2 * waiting.bytes() + 1024 : 0))) return false;
  waiting.push(state);
  return memory.room(bytes());
}

bool Search::branch(SearchState& state, std::size_t first, int n, Memory& memory) {
  const int choices = state.second_choices;
  for (std::size_t i = candidates.size(); i-- > first;) {
    const int variable = candidates[i].variable, pair = variable % n;
    SearchState& next = i > first ? child_ : state;
    if (i > first) child_ = state;
    if (variable >= n) next.flip(pair);
    next.out = pair;
    next.z_enters = variable < n;
    next.second_choices = choices + (i > first ? 1 : 0);
    if (i > first && !push(next, memory)) return false;
  }
  return true;
}

void DeadEnds::note(Look look) {
  rays += look == Look::ray;
  doubtful_rays += look == Look::doubtful_ray;
  singular += look == Look::singular;
  infeasible += look == Look::infeasible;
}

std::string DeadEnds::text() const {
  std::string text;
  const auto add = [&](int count, const char* what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(rays, "rays");
  add(doubtful_rays, "rays that the original data refute");
  add(singular, "singular bases");
  add(infeasible, "bases out of the feasible region");
  add(seen, "states seen before");
  add(refused, "ends refused by the check");
  return text;
}

std::string CoversUsed::text() const {
  std::string text;
  if (others > 0) text = "; then " + std::to_string(others) + (others > 1 ? " other covers" : " other cover");
  if (own) text += std::string(text.empty() ? "; then " : ", ") + "an end's own cover";
  return text;
}

void conclude(SearchEnd end, const DeadEnds& dead, const CoversUsed& covers, LcpSolution& solution) {
  const std::string ends = dead.text(), used = covers.text();
  if (!ends.empty() || !used.empty()) solution.reason = "dead ends: " + (ends.empty() ? "none" : ends) + used;
  const auto ended = [&](LcpStatus status, const char* reason) {
    solution.status = status;
    solution.reason = reason + std::string(solution.reason.empty() ? "" : "; ") + solution.reason;
  };
  if (end == SearchEnd::solved)
    solution.status = LcpStatus::solved;
  else if (end == SearchEnd::pivot_limit)
    ended(LcpStatus::nonconverged, "pivot limit");
  else if (end == SearchEnd::memory_limit)
    ended(LcpStatus::memory_limit, "memory limit of the stored candidates");
  else if (solution.residual < HUGE_VAL)
    ended(LcpStatus::inaccurate, "no sequence ends in a checked solution");
  else if (dead.rays > 0)
    ended(LcpStatus::ray, "no sequence ends in a solution");
  else if (dead.singular + dead.infeasible + dead.doubtful_rays > 0)
    ended(LcpStatus::singular, "no sequence could be followed to an end");
  else
    ended(LcpStatus::cycling, "every sequence came back to a state seen before");
}

}  // namespace cb
