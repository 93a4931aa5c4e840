#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "flags.h"
#include "methods/registry.h"

namespace cb {

/// The flags of a contact model, as text: `run` and `solve` share them.
struct MethodFlags {
  Text variant, solver, k, epsilon, epsilon_relative, compression_bound, regularise, warm_start;
};

void add_method_flags(CLI::App& command, MethodFlags& flags);

/// Options that are valid for the method. `k` and `compression_bound` stand where the flag was not given (a scenario's
/// own). Throws UsageError, also for a flag that the method has no use for.
MethodOptions method_options(const MethodFlags& flags, const MethodRow& method, std::optional<int> k,
                             std::optional<bool> compression_bound);
/// Why the chosen solver cannot be used here; empty where it can.
std::string unavailable_reason(const MethodRow& method, const MethodOptions& options);

}  // namespace cb
