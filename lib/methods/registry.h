#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "contact/laws.h"
#include "methods/options.h"

namespace cb {

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

struct MethodRow {
  std::string_view name;
  std::string_view summary;
  std::string_view source;
  Law law;
  std::vector<SolverRow> solvers;          ///< first is the default; empty where the method has no choice
  std::vector<std::string_view> variants;  ///< first is the default; empty where there is none
  std::vector<OptionRow> options;          ///< flags beyond solver and variant that the method understands
  std::function<ContactMethod(const MethodOptions& options)> make;  ///< options are valid for this row
  /// The law's witness with what is asked of the method in it, and no numbers.
  Witness (*terms)(const MethodOptions& options) = [](const MethodOptions&) -> Witness { return NoWitness{}; };
};

/// All contact models: the one table that `run`, `list`, the tests and the docs read.
std::span<const MethodRow> methods();
/// nullptr where there is no such method.
const MethodRow* find_method(std::string_view name);

/// Answers of another program (methods/external.cpp), which claim this law. Not in the table: it answers nothing by
/// itself.
MethodRow external_row(const Law& law);

/// Rows, one a file (methods/newton.cpp, ...).
MethodRow anitescu_potra_row();
MethodRow drumwright_shell_row();
MethodRow coulomb_row();
MethodRow newton_row();
MethodRow mirtich_row();
MethodRow soft_row();

}  // namespace cb
