#pragma once

#include <cmath>

#include "cone/central_path.h"
#include "cone/cone_workspace.h"
#include "cone/dense_newton.h"

namespace cb {

/// What an interior point method does after it has looked at an iterate.
enum class ConeNext { step, stop, solved };

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

  ConeNext look(CentralPath<double>& path);
  /// Fills the solution, which ends as `ending` unless it is solved. `next`: what look() said last.
  void finish(CentralPath<double>& path, ConeNext next, ConeStatus ending);

 private:
  bool keep(const CentralPath<double>& path);
  bool try_polish(CentralPath<double>& path);
  void last_word(ConeStatus ending);

  const ConeProgram& p_;
  const ConeOptions& options_;
  ConeWorkspace& w_;
  IteratesScratch& scratch_;
  ConeSolution& x_;
  double next_polish_, best_merit_ = HUGE_VAL;
  int since_best_ = 0;
};

/// Keeps the iterate whose answer, rounded to doubles, has the best certificate: it multiplies by mu what impulses lose
/// as doubles, and each loses something else. As long as there is no certificate, the merit decides.
class RoundedIterates {
 public:
  RoundedIterates(const ConeProgram& program, const ConeOptions& options, const DenseNewton& newton,
                  ConeSolution& solution)
      : p_(program), options_(options), newton_(newton), x_(solution) {}

  ConeNext look(CentralPath<DoubleDouble>& path);
  void finish(CentralPath<DoubleDouble>& path, ConeNext next, ConeStatus ending);

 private:
  void round_off(const CentralPath<DoubleDouble>& path);
  double worth(const ConeSolution& x) const;

  const ConeProgram& p_;
  const ConeOptions& options_;
  const DenseNewton& newton_;
  ConeSolution& x_;
  ConeSolution rounded_;
  ConeVelocities velocities_;
  DoubleDouble best_merit_ = HUGE_VAL;
  int since_best_ = 0;
  bool finite_ = true;
};

}  // namespace cb
