#pragma once

#include <cmath>

#include "cone/cone_workspace.h"
#include "cone/path.h"

namespace cb {

/// What an interior point method does after it has looked at an iterate.
enum class Next { step, stop, solved };

/// Scratch of PolishedIterates.
struct IteratesScratch {
  ConeSolution best, trial;
};

/// Keeps the iterate of least merit, and tries from time to time whether it names the active constraints: Newton's
/// method then ends at rounding (polish.h). Where neither gets on, its careful steps have the last word.
class PolishedIterates {
 public:
  PolishedIterates(const ConeProgram& program, const ConeOptions& options, ConeWorkspace& workspace,
                   IteratesScratch& scratch, ConeSolution& solution)
      : p_(program),
        options_(options),
        w_(workspace),
        scratch_(scratch),
        x_(solution),
        next_polish_(options.polish_from) {}

  Next look(Path<double>& path);
  /// Fills the solution, which ends as `ending` unless it is solved. `next`: what look() said last.
  void finish(Path<double>& path, Next next, ConeStatus ending);

 private:
  bool keep(const Path<double>& path);
  bool try_polish(Path<double>& path);
  void last_word(ConeStatus ending);

  const ConeProgram& p_;
  const ConeOptions& options_;
  ConeWorkspace& w_;
  IteratesScratch& scratch_;
  ConeSolution& x_;
  double next_polish_, best_merit_ = HUGE_VAL;
  int since_best_ = 0;
};

}  // namespace cb
