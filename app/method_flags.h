#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <optional>

#include "flags.h"
#include "methods/registry.h"

namespace cb {

/// The flags of a contact model, as text: `run` and `solve` share them.
struct MethodFlags {
  Text variant, solver;
  std::map<std::string, Text, std::less<>> own;  ///< by name, of every row in the table of methods

  bool asked(std::string_view flag) const {
    const auto at = own.find(flag);
    return at != own.end() && at->second;
  }
};

/// The method's row; `external` as the flags beside it want it. Throws UsageError with near matches.
std::shared_ptr<const MethodRow> method_flag(const std::string& value, const MethodFlags& flags);

/// `single_event`: without those that are about what one event leaves to the next.
void add_method_flags(CLI::App& command, MethodFlags& flags, bool single_event);

/// Options that are valid for the method. `k` and `compression_bound` stand where the flag was not given (a scenario's
/// own). Throws UsageError, also for a flag that the method has no use for.
MethodOptions method_options(const MethodFlags& flags, const MethodRow& method, std::optional<int> k,
                             std::optional<bool> compression_bound);
/// --law, and the flags of all laws.
void add_law_flags(CLI::App& command, MethodFlags& flags);
/// The law that --law names. Throws UsageError where it is missing or unknown.
const Law& law_flag(const MethodFlags& flags);
/// What is asked of an answer under the law. Throws UsageError, also for a flag that the law has no use for.
MethodOptions law_options(const MethodFlags& flags, const Law& law);

/// A value as its flag takes it; empty where there is none.
std::string text_of(const OptionValue& value);
/// Why the chosen solver cannot be used here; empty where it can.
std::string unavailable_reason(const MethodRow& method, const MethodOptions& options);

}  // namespace cb
