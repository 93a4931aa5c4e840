#pragma once

#include <span>

#include "cone/interior_point.h"
#include "methods/convex_judge.h"
#include "methods/convex_stick.h"
#include "methods/convex_stop.h"

namespace cb {

/// What a proposer may look at.
struct ConvexEvent {
  const ConvexTolerances& tolerances;
  const ConvexIsland& island;
  const ConvexBound& bound;
  const ConeProgram& program;    ///< (1) of drumwright_shell.cpp
  const ConeSolution* previous;  ///< the previous event's answer, where Newton's method may start from it
};

/// Scratch of the proposers, a struct each.
struct ConvexScratch {
  explicit ConvexScratch(const ConvexTolerances& tolerances);

  InteriorPoint solver;
  InteriorPoint finisher;  ///< of dense answers: other proximal terms
  StopScratch stop;
  StickScratch stick;
  ConeSolution interior;  ///< what the interior point method came to
  ConeSolution finished;
  std::vector<double> slack;  ///< nc, m/s, of the relaxed program
};

/// A way to an answer. `propose` fills the answer; false where it has none to propose.
struct ConvexProposer {
  std::string_view name;
  bool (*propose)(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer);
  Allowed allowed;
  bool starts_next;        ///< may Newton's method start from it in the next event?
  bool is_start;           ///< is it such a start? Counted as a warm start
  bool last_word = false;  ///< is it asked only where nobody before it had a good answer, excused or not?
};

/// In the order in which they are asked, cheapest first.
std::span<const ConvexProposer> convex_proposers();

}  // namespace cb
