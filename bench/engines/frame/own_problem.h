#pragma once

#include <string>
#include <vector>

#include "contact/problem.h"
#include "engine.h"

namespace cb {

/// The contact problem that an engine solved in a step, with its own answer: the model in isolation from the engine.
struct OwnProblem {
  ContactProblem problem;          ///< v_minus: what the step would have led to without contact; restitution 0
  std::vector<double> impulse;     ///< 3 nc, the engine's, N s
  std::vector<double> v_plus;      ///< nv, the engine's velocity after the step
  std::vector<double> compliance;  ///< 3 nc, 1/kg: by which u gives way to the impulse; empty: rigid
  std::string law;                 ///< the engine's, in words
  std::string offset_means;        ///< what the engine has in the offset, in words; empty: it is zero
};

/// What is true of the engine's answer.
struct OwnMeasures {
  double momentum = 0;  ///< |M (v+ - v-) - J^T r| over |M (v+ - v-)|, worst of the blocks of M: how well the data agree
  double velocity = 0;  ///< largest |v- + M^-1 J^T r - v+|, m/s or rad/s
  double law = 0;       ///< residual of Coulomb's law with the engine's offset (docs/judging.md)
  double law_bare = 0;  ///< the same without an offset: what its velocities are to Coulomb
  double own = 0;       ///< residual of min r.(W + R) r/2 + r.u- over the friction cones: the engine's model, solved?
};
OwnMeasures measure(const OwnProblem& own);

/// Keeps every N-th of a run's steps with contact: step_NNNNNNNNN.hdf5 (FCLIB, the answer in /solution) and .json
/// beside it, and nothing where no folder is asked for.
class OwnProblems {
 public:
  OwnProblems(const Engine& engine, const EngineSetting& setting, std::string folder, long every);
  /// After a step. Throws FileError, and Unsupported where the engine gives nothing away.
  void keep(const EngineWorld& world, long step, double t);

 private:
  const Engine& engine_;
  const EngineSetting& setting_;
  std::string folder_;
  long every_, met_ = 0;
  OwnProblem own_;
};

}  // namespace cb
