#include "methods/options.h"

#include <algorithm>

namespace cb {

namespace {

OptionValue held(const OptionField& field, const MethodOptions& options) {
  return std::visit(
      [&](auto member) -> OptionValue {
        const auto& value = options.*member;
        if constexpr (requires { value.empty(); })
          return value.empty() ? OptionValue() : OptionValue(value);
        else if constexpr (requires { value.has_value(); })
          return value ? OptionValue(*value) : OptionValue();
        else
          return value;
      },
      field);
}

}  // namespace

std::string key(const OptionRow& row) {
  std::string name(row.flag);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

OptionValue value_of(const OptionRow& row, std::span<const OptionRow> rows, const MethodOptions& options) {
  if (!row.variant.empty() && row.variant != options.variant) return {};
  for (const OptionRow& other : rows)
    if (other.replaces == row.flag && held(other.field, options).index() != 0) return {};
  return held(row.field, options);
}

}  // namespace cb
