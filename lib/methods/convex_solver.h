#pragma once

#include <string_view>
#include <vector>

#include "methods/convex_bound.h"
#include "methods/convex_island.h"
#include "methods/convex_judge.h"
#include "methods/convex_proposers.h"
#include "methods/convex_rest.h"

namespace cb {

/// Which phase of an event an island is solved in: its only one, or one of restitution's two.
enum class ConvexPhase { only, compression, second };

/// How an island ended.
struct ConvexEnding {
  ConeStatus status = ConeStatus::solved;  ///< solved where `inaccurate`, too
  bool unproven = false;                   ///< has it a kappa without proof?
  bool inaccurate = false;                 ///< at rounding, its certificate not
  bool warm_start = false;                 ///< was the previous event's answer accepted, or led to this one?
  double gap = 0;                          ///< J, of the certificate
  double excess = 0;                       ///< J, of it beyond rounding
  int iterations = 0, size = 0;            ///< size: unknowns
  std::string_view who;                    ///< whose answer it is
};

/// Solves one island: (1) of drumwright_shell.cpp. Owns its scratch.
class ConvexSolver {
 public:
  explicit ConvexSolver(const ConvexTolerances& tolerances);
  /// `epsilon`: J, what is asked for, which becomes the island's; `previous`: what it knows of the event before, null
  /// where it may not be used. The answer stays until the next call.
  ConvexEnding operator()(double epsilon, ConvexPhase phase, ConvexPrevious* previous, ConvexIsland& island);

  const std::vector<double>& r() const { return best_.r; }      ///< 3 nc, N s
  const std::vector<double>& eta() const { return best_.eta; }  ///< nc, N s
  const ConvexBound& bound() const { return bound_; }

 private:
  /// An answer with what it is worth, and whose it is.
  struct Candidate {
    std::vector<double> r, eta;
    Certificate certificate;
    std::string_view who;
  };
  void begin(double epsilon);
  void end(bool proven, ConeStatus status);
  void set_bound();
  void clear_bound();
  bool stays_at_rest(ConvexPrevious& previous);
  bool slides_freely();
  void prefer_frictionless();
  ConeStatus propose(ConvexPrevious* previous);
  void keep_start(const ConvexProposer& proposer, ConvexPrevious* previous);
  const ConeSolution* start_of(const ConvexPrevious* previous) const;
  bool offer(const ConvexProposer& proposer);

  const ConvexTolerances tolerances_;
  ConvexPhase phase_ = ConvexPhase::only;
  ConvexIsland* island_ = nullptr;  // at work
  ConvexBound bound_;
  ConeProgram program_;  // (1)
  ConvexBoundFinder bound_finder_;
  ConvexScratch scratch_;
  ConvexJudge judge_;
  ConeSolution answer_;             // proposed
  std::vector<double> multiplier_;  // of (1), that belong to it
  Candidate best_;
  ConvexEnding ending_;
};

}  // namespace cb
