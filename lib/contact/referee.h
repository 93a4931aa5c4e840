#pragma once

#include <string>
#include <vector>

#include "contact/evidence.h"
#include "contact/laws.h"

namespace cb {

/// Recomputes every measure; owns its scratch, so that a run does not allocate after its first events.
class Referee {
 public:
  /// -: error over size up to which an answer is one; also what an error of the size of rounding counts as.
  static constexpr double accepted = 1e-9;

  /// Checks `solution` under `law`. `v_plus` is set to v- + M^-1 J^T r, computed here and used by the caller:
  /// what is simulated is what was checked.
  Residuals check(const ContactProblem& problem, const ContactSolution& solution, const Law& law,
                  std::vector<double>& v_plus);
  /// The impulses as an unambiguous verdict: does the claim hold to `tolerance`?
  /// Laws without a gap: model <= tolerance, where at every contact
  ///   model = error / max(size, terms, rounding / accepted), all in sqrt(J) (referee.cpp).
  /// With one: what |gap| is beyond rounding (J) adds up to epsilon over the islands at most, infeasibility <=
  /// accepted.
  static bool holds(const Residuals& residuals, double tolerance);
  /// Why it does not, in one line.
  static std::string refusal(const Residuals& residuals, double tolerance);

 private:
  bool weigh(const ContactProblem& problem);
  bool recompute(const ContactProblem& problem, std::span<const double> r, std::vector<double>& v_plus);
  void observe(const ContactProblem& problem, std::span<const double> r, Residuals& out);
  void balance(const ContactProblem& problem, std::span<const double> v_plus, Residuals& out);
  void look_at_islands(const ContactProblem& problem);
  void look_at_terms(const ContactProblem& problem, const ContactSolution& solution, const Law& law);
  void find_changes(const ContactProblem& problem, const ContactSolution& solution, const Law& law);
  template <class LoadOf>
  void find_loads(const ContactProblem& problem, const LoadOf& load_of);

  Evidence at_;
  LawCheck law_check_;               // of the law of the last answer,
  LawCheck (*made_by_)() = nullptr;  // made by this
  /// What factor, weights and islands were found from.
  struct Weighed {
    std::vector<int> band, block, first;
    std::vector<double> J, M;
  } weighed_;
  bool weighs_ = false;
  std::vector<double> scratch_v_, difference_, momentum_, columns_, loads_, changes_, mass_changes_, stops_, energy_;
  std::vector<double> sum_;  // per island
};

}  // namespace cb
