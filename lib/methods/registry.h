#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "contact/laws.h"

namespace cb {

/// Whose answer was taken, where a method tries several ways: a count each, in the order of the tries.
struct AnsweredBy {
  std::vector<std::pair<std::string_view, long>> counts;
  void add(std::string_view who) {
    for (auto& [name, count] : counts)
      if (name == who) {
        ++count;
        return;
      }
    counts.emplace_back(who, 1);
  }
};

/// What a user can ask of a method; each field has the flag of the same name (docs/interface.md).
struct MethodOptions {
  std::string variant;                      ///< newton: uncapped | stick-tested; empty: the method's default
  std::string solver;                       ///< ap: lemke | path | ynl; convex: ipm; empty: the method's default
  int k = 4;                                ///< ap: edges of the friction polygon, even, >= 4
  double epsilon = 1e-12;                   ///< convex: suboptimality at which the solver may stop, J
  std::optional<double> epsilon_relative;   ///< convex: the same as a fraction of the kinetic energy before the event
  bool compression_bound = true;            ///< convex: bound the sum of normal impulses of each island
  double regularise = 0;                    ///< ap: added to the diagonal of the LCP
  bool idle_friction = true;                ///< ap: keep the unknowns of friction where mu = 0
  bool warm_start = false;                  ///< ap, convex: try the active set of the previous event first
  std::shared_ptr<long> warm_starts;        ///< receives how many such starts were accepted, where it is given
  std::shared_ptr<AnsweredBy> answered_by;  ///< receives whose answers were taken, where it is given
};

/// A contact model, ready to solve events: owns its scratch memory. Writes the whole of `solution`; throws nothing but
/// Stopped (linalg/stop.h) and bad_alloc.
using ContactMethod = std::function<void(const ContactProblem& problem, ContactSolution& solution)>;

/// A solver of a method, as `list` shows it.
struct SolverRow {
  std::string_view name;
  std::string_view summary;
  std::string_view source;
  std::string_view unavailable;  ///< why it cannot be used in this build; empty where it can
};

/// A flag that a method understands.
struct OptionRow {
  std::string_view flag;           ///< without dashes: "k", "epsilon"
  std::string_view unit;           ///< "J", "-"
  std::string_view default_value;  ///< as `list` prints it
  std::string_view summary;
};

struct MethodRow {
  std::string_view name;
  std::string_view summary;
  std::string_view source;
  Law law;
  std::vector<SolverRow> solvers;                       ///< first is the default; empty where the method has no choice
  std::vector<std::string_view> variants;               ///< first is the default; empty where there is none
  std::vector<OptionRow> options;                       ///< flags beyond solver and variant that the method understands
  ContactMethod (*make)(const MethodOptions& options);  ///< options are valid for this row
  /// The law's witness with what is asked of the method in it, and no numbers.
  Witness (*terms)(const MethodOptions& options) = [](const MethodOptions&) -> Witness { return NoWitness{}; };
};

/// All contact models: the one table that `run`, `list`, the tests and the docs read.
std::span<const MethodRow> methods();
/// nullptr where there is no such method.
const MethodRow* find_method(std::string_view name);

/// Rows, one a file (methods/newton.cpp, ...).
MethodRow anitescu_potra_row();
MethodRow drumwright_shell_row();
MethodRow newton_row();
MethodRow mirtich_row();

}  // namespace cb
