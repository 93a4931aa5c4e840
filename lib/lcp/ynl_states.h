#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "lcp/basis.h"
#include "lcp/draw.h"
#include "lcp/lcp.h"

namespace cb {

// What the search of ynl.cpp keeps, and how much memory that is.

/// Where a sequence stands: z_0 is basic, pair `out` is not, and one of its variables is about to enter.
struct SearchState {
  std::vector<std::uint64_t> basic;  ///< bit i: z_i is basic
  int out = -1;
  bool z_enters = true;
  int second_choices = 0;  ///< candidates on the way here that did not have the largest pivot

  bool has(int i) const { return (basic[i / 64] >> (i % 64) & 1) != 0; }
  void flip(int i) { basic[i / 64] ^= std::uint64_t(1) << (i % 64); }
  std::uint64_t hash() const {
    std::uint64_t h = splitmix64(2 * static_cast<std::uint64_t>(out) + (z_enters ? 1 : 0));
    for (const std::uint64_t word : basic) h = splitmix64(h ^ word);
    return h;
  }
};

/// A variable that blocks, with the size of its pivot.
struct Candidate {
  int variable, row;
  double pivot;
};
/// All rows whose variable is within `tie` of zero where the first blocks a variable that changes them by `change`, the
/// largest pivot first; z_0 before all. An entry that blocks is larger than `pivot_tolerance`.
void find_candidates(const Basis& basis, const double* change, double pivot_tolerance, double tie,
                     std::vector<Candidate>& candidates);

/// Memory of the stored states, bytes.
struct Memory {
  double limit = 0;
  std::size_t aside = 0;  ///< of a search that another interrupts
  std::size_t peak = 0;
  bool full = false;

  /// Is there room for so many, besides those aside?
  bool room(std::size_t bytes);
};

/// Set of hashes, open addressing; 0 marks a free place.
class SeenStates {
 public:
  void clear() { std::vector<std::uint64_t>(64).swap(places_), count_ = 0; }
  /// False where it was there.
  bool insert(std::uint64_t hash);
  bool full() const { return 2 * count_ >= places_.size(); }
  std::size_t bytes() const { return places_.capacity() * sizeof(std::uint64_t); }

 private:
  void grow();
  std::vector<std::uint64_t> places_;
  std::size_t count_ = 0;
};

/// States that wait, fewest second choices first, then the youngest. Their sets lie in one array.
class WaitingStates {
 public:
  /// Empties it and gives its memory back; a set has `words` words.
  void clear(std::size_t words);
  bool empty() const { return heap_.empty(); }
  void push(const SearchState& state);
  void pop(SearchState& state);
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

/// All sequences from one start.
struct Search {
  SeenStates seen;
  WaitingStates waiting;
  std::vector<Candidate> candidates;  ///< of the state in hand
  double near_tie = 0;                ///< width of ties, -
  int pivot_limit = 0;

  /// Nothing seen, nothing waits; `state` is the basis of the slacks of n pairs.
  void start(int n, double ties, SearchState& state);
  std::size_t bytes() const { return seen.bytes() + waiting.bytes(); }
  /// Where there is no room these are false, and memory.full holds.
  bool make_room_to_see(Memory& memory) const;
  bool push(const SearchState& state, Memory& memory);
  /// The candidate `first` is followed: `state` becomes what it leads to; the others wait.
  bool branch(SearchState& state, std::size_t first, int n, Memory& memory);

 private:
  SearchState child_;
};

/// How a search ends.
enum class SearchEnd { solved, exhausted, pivot_limit, memory_limit };

/// What a state leads to: on, or one of the dead ends.
enum class Look { on, ray, doubtful_ray, singular, infeasible };

/// Counts of dead ends.
struct DeadEnds {
  int rays = 0, doubtful_rays = 0, singular = 0, infeasible = 0, seen = 0, refused = 0;
  void note(Look look);
  std::string text() const;  ///< empty where there are none
};

/// Covering vectors used besides ones.
struct CoversUsed {
  int others = 0;
  bool own = false;  ///< that of an end
  std::string text() const;
};

/// Status and reason of a solution whose search has ended, by its residual.
void conclude(SearchEnd end, const DeadEnds& dead, const CoversUsed& covers, LcpSolution& solution);

}  // namespace cb
