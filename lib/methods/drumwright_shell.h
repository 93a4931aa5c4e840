#pragma once

#include <memory>
#include <vector>

#include "contact/islands.h"
#include "methods/convex_solver.h"
#include "methods/registry.h"
#include "methods/restitution.h"

namespace cb {

/// The convex contact model of Drumwright and Shell, island by island (drumwright_shell.cpp says what is solved).
/// Owns its scratch: a simulation does not allocate after its first events.
class DrumwrightShell {
 public:
  struct Tolerances : ConvexTolerances {
    int threads = 1;                          ///< on which islands are solved at once: the same answers
    std::shared_ptr<Counter> warm_starts;     ///< counts such starts that were accepted, where it is given
    std::shared_ptr<AnsweredBy> answered_by;  ///< counts whose answers were taken, an island each, where it is given
  };
  explicit DrumwrightShell(const Tolerances& tolerances);
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  /// What a thread solves an island with.
  struct Worker {
    explicit Worker(const ConvexTolerances& tolerances) : solver(tolerances) {}

    ConvexSolver solver;
    ConvexIsland island;
    std::vector<int> block_in_island;
  };
  void solve(const ContactProblem& problem, const std::vector<double>& v0, ConvexPhase phase,
             ContactSolution& solution);
  void write(const ContactProblem& problem, const Worker& own, ContactSolution& solution) const;
  void say(double epsilon, ContactSolution& solution) const;
  bool approaches_again();

  const Tolerances tolerances_;
  BlockCholesky factor_;
  Islands islands_;
  Groups contacts_of_, blocks_of_;        // per island
  std::vector<ConvexPrevious> previous_;  // per island
  std::vector<ConvexEnding> endings_;     // per island
  std::vector<Worker> workers_;
  std::vector<double> weight_;

  // Of restitution.
  Restitution restitution_;
  std::vector<char> elastic_, bounded_;  // per island
  std::vector<double> first_impulse_, fastest_;
};

}  // namespace cb
