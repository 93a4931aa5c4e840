#pragma once

#include <memory>
#include <optional>

#include "methods/registry.h"

namespace cb {

/// What to leave out of contact problems; each can be told off, to see what it saves.
struct PruneOptions {
  bool islands = true, closed_forms = true, idle_friction = true;
  /// Calls for what an event before was, too, to the last bit: islands that rest (StepPruning::repeats).
  bool repeats = false;
};

/// What was left out of the contact problems of a run, summed over its events.
struct LeftOut {
  long islands = 0;                      ///< islands solved as problems of their own, where an event has several
  long closed_forms = 0;                 ///< islands of one contact answered by a formula
  long idle_friction = 0;                ///< contacts with mu = 0 whose unknowns of friction an LCP did not get
  long repeats = 0;                      ///< calls for an island, or a whole problem, that an event before had, too
  std::optional<ContactProblem> failed;  ///< what the method was handed when it last failed, in the present event
};

/// Something that runs leave out: its name in summary.json, why nothing changes without it, and how often it was.
struct LeftOutItem {
  std::string_view name, why;
  long count;
};
/// All items, also those that were not left out.
std::vector<LeftOutItem> items(const LeftOut& left_out);

/// The method of `row` with `options`, handed only what an event needs:
///  1. islands of bodies joined by contacts are solved apart (`convex` does so in any case: its bound is per island);
///  2. a contact alone on its island whose normal and tangential directions do not couple (a sphere on the ground) has
///     a closed form: ap, convex, coulomb, soft;
///  3. ap gets no unknowns for the friction of contacts with mu = 0 (convex has none in any case, but tries its
///     frictionless answer first).
///  4. with `repeats`, what the method answered in the event before it is not asked again.
/// Islands with restitution: 1 and 4 only.
/// The answer is one of the whole problem, to the same tolerances, and the referee checks it there. Where nothing can
/// be left out the method sees the problem itself: its answer is the same to the last bit.
/// `left_out` receives the counts.
ContactMethod pruned(const MethodRow& row, const MethodOptions& options, std::shared_ptr<LeftOut> left_out,
                     const PruneOptions& prune = {});

}  // namespace cb
