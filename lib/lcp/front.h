#pragma once

#include <Eigen/Core>
#include <memory>

#include "lcp/basis.h"
#include "lcp/dense_basis.h"
#include "lcp/lcp.h"
#include "lcp/scaling.h"
#include "lcp/sparse_basis.h"

namespace cb {

/// Both kernels of a basis, of which a problem's form uses one.
struct Kernels {
  DenseBasis dense;
  SparseBasis sparse;
  Basis& of(const LcpProblem& form) { return form.expanded ? static_cast<Basis&>(sparse) : dense; }
};

/// Which problems a solver wants: all in dense form, or expanded ones of more than LcpOptions::dense_limit pairs as
/// they are; and a basis with scales, or the matrix alone.
enum class Wants { dense_matrix, basis };

/// What stands in front of every solver: clears the solution, refuses data that are no numbers or do not determine the
/// free unknowns, condenses, scales, and starts the kernel that the form asks for; after the solver, the free unknowns.
class Front {
 public:
  Front(const LcpOptions& options, Wants wants) : o_(options), wants_(wants) {}
  /// Takes a problem, which is referred to until the next call. False where nothing is left to solve: `solution` then
  /// has its status, and the reason where it was refused.
  bool open(const LcpProblem& problem, LcpSolution& solution);
  /// The free unknowns of solution.z, and the factorisations.
  void close(LcpSolution& solution);

  const LcpProblem& given() const { return *problem_; }
  const LcpProblem& form() const { return *form_; }  ///< what is solved: as it was given, or condensed
  int pivot_limit() const { return pivot_limit_; }   ///< pivots or iterations, in all
  Basis& basis() { return *basis_; }                 ///< of form(), scaled
  const ScaledLoad& load() const { return load_; }

 private:
  bool start_basis(LcpSolution& solution);

  LcpOptions o_;
  Wants wants_;
  const LcpProblem *problem_ = nullptr, *form_ = nullptr;
  int pivot_limit_ = 0;
  LcpProblem condensed_;
  ScaledLoad load_;
  Kernels kernels_;
  Basis* basis_ = nullptr;
};

/// A row's `make`: a Method (made from LcpOptions, with `Method::wants` and `solve(Front&, LcpSolution&)`) behind the
/// front. It writes status, reason, z, residual and pivots.
template <class Method>
LcpSolver behind_front(const LcpOptions& options) {
  struct Both {
    explicit Both(const LcpOptions& o) : front(o, Method::wants), method(o) {}
    Front front;
    Method method;
  };
  const auto both = std::make_shared<Both>(options);
  return [both](const LcpProblem& problem, LcpSolution& solution) {
    if (!both->front.open(problem, solution)) return;
    both->method.solve(both->front, solution);
    both->front.close(solution);
  };
}

}  // namespace cb
