#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "contact/islands.h"
#include "methods/convex_bound.h"
#include "methods/convex_island.h"
#include "methods/convex_judge.h"
#include "methods/convex_proposers.h"
#include "methods/convex_rest.h"
#include "methods/registry.h"
#include "methods/restitution.h"

namespace cb {

/// The convex contact model of Drumwright and Shell, island by island (drumwright_shell.cpp says what is solved).
/// Owns its scratch: a simulation does not allocate after its first events.
class DrumwrightShell {
 public:
  struct Tolerances : ConvexTolerances {
    std::shared_ptr<long> warm_starts;        ///< counts such starts that were accepted, where it is given
    std::shared_ptr<AnsweredBy> answered_by;  ///< counts whose answers were taken, an island each, where it is given
  };
  explicit DrumwrightShell(const Tolerances& tolerances);
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  /// An answer with what it is worth, and whose it is.
  struct Candidate {
    std::vector<double> r, eta;
    Certificate certificate;
    std::string_view who;
  };
  /// How the islands of a phase ended.
  struct Endings {
    ConeStatus worst = ConeStatus::solved;  ///< of the islands without a good answer
    bool unproven = false;                  ///< has one of them a kappa without proof?
    bool inaccurate = false;
    double excess = 0;  ///< J, of the gaps of all islands, beyond rounding
  };
  bool approaches_again();
  void solve(const ContactProblem& problem, const std::vector<double>& v0, double epsilon, ContactSolution& solution);
  void say(const Endings& endings, double epsilon, ContactSolution& solution) const;
  ConeStatus solve_island(double epsilon, ContactSolution& solution, ConvexPrevious* previous, Endings& endings);
  void write(const ContactProblem& problem, ContactSolution& solution) const;
  void begin_island(double epsilon, ContactSolution& solution);
  void set_bound();
  void clear_bound();
  bool stays_at_rest(ConvexPrevious& previous);
  bool slides_freely();
  void prefer_frictionless();
  ConeStatus propose(ConvexPrevious* previous);
  void keep_start(const ConvexProposer& proposer, ConvexPrevious* previous);
  const ConeSolution* start_of(const ConvexPrevious* previous) const;
  bool offer(const ConvexProposer& proposer);

  const Tolerances tolerances_;
  BlockCholesky factor_;
  Islands islands_;
  Groups contacts_of_, blocks_of_;  // per island
  std::vector<double> weight_;
  std::vector<int> block_in_island_;
  std::vector<ConvexPrevious> previous_;  // per island

  // Of the island at work.
  ConvexIsland island_;
  ConvexBound bound_;
  ConeProgram program_;  // (1)
  ConvexBoundFinder bound_finder_;
  ConvexScratch scratch_;
  ConvexJudge judge_;
  ConeSolution answer_;             // proposed
  std::vector<double> multiplier_;  // of (1), that belong to it
  Candidate best_;
  int iterations_ = 0;

  // Of the second phase of restitution.
  Restitution restitution_;
  bool elastic_ = false, second_phase_ = false;
  std::vector<char> bounded_;  // per island
  std::vector<double> first_impulse_, fastest_;
};

}  // namespace cb
