#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "methods/options.h"

namespace cb {

/// null for what JSON has no number for.
nlohmann::ordered_json finite_or_null(const std::optional<double>& x);
/// The values of these options, by their keys.
void put_options(nlohmann::ordered_json& json, std::span<const OptionRow> rows, const MethodOptions& options);
/// To standard output: as JSON, or `key  value` a line each, what is empty left out.
void print(const nlohmann::ordered_json& json, bool as_json);

}  // namespace cb
