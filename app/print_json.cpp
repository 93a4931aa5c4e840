#include "print_json.h"

#include <fmt/format.h>

#include <cmath>

namespace cb {

using Json = nlohmann::ordered_json;

Json finite_or_null(const std::optional<double>& x) { return x && std::isfinite(*x) ? Json(*x) : Json(); }

void put_options(Json& json, std::span<const OptionRow> rows, const MethodOptions& options) {
  for (const OptionRow& option : rows) {
    if (option.between_events) continue;
    Json& value = json[key(option)];
    std::visit(
        [&](const auto& held) {
          if constexpr (!std::is_same_v<decltype(held), const std::monostate&>) value = held;
        },
        value_of(option, rows, options));
  }
}

namespace {

void print_text(const Json& json) {
  const auto line = [](const std::string& key, const Json& value) {
    fmt::print("  {:<20} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
  };
  for (const auto& item : json.items()) {
    const Json& value = item.value();
    if (value.is_null() || (value.is_string() && value.get<std::string>().empty())) continue;
    if (value.is_object())
      for (const auto& part : value.items()) line(item.key() + " " + part.key(), part.value());
    else if (value.is_array())
      for (const Json& note : value) line("note", note);
    else
      line(item.key(), value);
  }
}

}  // namespace

void print(const Json& json, bool as_json) {
  if (as_json)
    fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
  else
    print_text(json);
}

}  // namespace cb
