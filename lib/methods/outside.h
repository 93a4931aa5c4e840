#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "methods/registry.h"

namespace cb {

// Answers that come from outside (another program, a file, a Python function): impulses, and nothing else. The law that
// they claim is judged as that of any method.

/// The law's row in the table of laws, by its own name or by that of a method that claims it ("ap"); nullptr: none.
const Law* find_law(std::string_view name);
/// The first method whose law it is; nullptr where none claims it.
const MethodRow* method_of_law(const Law& law);
/// The flags that say what is asked of an answer under the law, whoever gives it.
std::vector<OptionRow> options_of_law(const Law& law);

/// Finds the witness that belongs to impulses, so that the referee can judge them under the law. Owns its scratch.
class WitnessFinder {
 public:
  /// `options`: what is asked, as that law's method would be asked.
  WitnessFinder(const Law& law, const MethodOptions& options);
  /// Sets the witness of `solution`, whose impulses are 3 nc finite numbers; all else stays. Returns why there is none
  /// (one line), empty where there is one. Where only solving the problem gives it, the law's own method lends its.
  std::string operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  std::string lend(const ContactProblem& problem, ContactSolution& solution, std::string_view why);

  Law law_;
  Witness terms_;
  ContactMethod lender_;  // empty: the law has no method
  ContactSolution lent_;
  BlockCholesky factor_;
  Islands islands_;
  std::vector<double> v_, u_minus_, u_plus_;
};

/// Answers one problem. Sets impulses and, where it gave up, status and reason; `iterations` and `claimed_residual`
/// where it knows them. `solution` comes cleared, with zero impulses.
using OutsideSolver = std::function<void(const ContactProblem& problem, ContactSolution& solution)>;

/// A row for such a solver: its answers are checked for shape and numbers (`input_error`, `not_finite`), and get their
/// witness. `make` is asked for one solver a method that is made.
MethodRow outside_row(std::string_view name, std::string_view summary, const Law& law,
                      std::function<OutsideSolver(const MethodOptions& options)> make);

}  // namespace cb
