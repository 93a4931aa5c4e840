#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "contact/problem.h"
#include "engines.h"
#include "evaluation/references.h"
#include "flags.h"
#include "lcp/lcp.h"
#include "output/summary.h"
#include "scenario/near_name.h"
#include "scenario/scenario.h"

namespace cb {

namespace {

using Json = nlohmann::ordered_json;

Json text(std::string_view value) { return value.empty() ? Json() : Json(value); }

// Each topic as JSON first: an array of objects with a name and a summary, which is what the one-line form prints.

Json list_methods() {
  Json list = Json::array();
  for (const MethodRow& row : methods()) {
    Json solvers = Json::array(), options = Json::array();
    for (const SolverRow& solver : row.solvers) solvers.push_back(solver.name);
    for (const OptionRow& option : row.options)
      options.push_back({{"flag", option.flag},
                         {"unit", option.unit},
                         {"default", option.default_value},
                         {"summary", option.summary},
                         {"short", option.short_name}});
    list.push_back({{"name", row.name},
                    {"summary", row.summary},
                    {"source", row.source},
                    {"solvers", solvers},
                    {"variants", row.variants},
                    {"no_expansion", text(row.law.no_expansion)},
                    {"options", options}});
  }
  return list;
}

Json list_solvers() {
  Json list = Json::array();
  const auto add = [&](const auto& row, const Json& method) {
    list.push_back({{"name", row.name},
                    {"summary", row.summary},
                    {"source", row.source},
                    {"method", method},
                    {"unavailable", text(row.unavailable)}});
  };
  for (const MethodRow& method : methods())
    for (const SolverRow& row : method.solvers) add(row, method.name);
  // What solves bare LCPs but is no method's choice.
  for (const LcpSolverRow& row : lcp_solvers())
    if (std::none_of(list.begin(), list.end(), [&](const Json& known) { return known["name"] == row.name; }))
      add(row, Json());
  return list;
}

Json list_laws() {
  Json list = Json::array();
  for (const Law& law : laws()) {
    Json claimed = Json::array();
    for (const MethodRow& row : methods())
      if (row.law == law) claimed.push_back(row.name);
    std::string summary = claimed.empty() ? "claimed by no method" : "claimed by ";
    for (std::size_t i = 0; i < claimed.size(); ++i) summary += (i ? ", " : "") + claimed[i].get<std::string>();
    list.push_back({{"name", law.name}, {"summary", summary}, {"methods", claimed}});
  }
  return list;
}

Json list_outside() {
  const MethodRow row = external_row(laws().front());
  return {{{"name", row.name}, {"summary", row.summary}}};
}

Json list_scenarios() {
  Json list = Json::array();
  for (const std::string& file : bundled_scenarios()) {
    Json entry = {{"name", std::filesystem::path(file).filename().string()}, {"summary", nullptr}, {"file", file}};
    try {
      const Scenario scenario = load_scenario(file, {});
      entry["summary"] = scenario.title;
      entry["reference"] = name(scenario.reference.kind);
      for (const auto& [key, value] : scenario.parameters) entry["parameters"][key] = value;
    } catch (const InputError& error) {
      entry["summary"] = std::string("cannot be read: ") + error.what();
    }
    list.push_back(entry);
  }
  return list;
}

Json list_references() {
  Json list = Json::array();
  for (const ReferenceRow& row : references()) {
    Json errors = Json::object();
    for (const auto& [error, meaning] : row.errors) errors[std::string(error)] = meaning;
    list.push_back({{"name", row.name}, {"summary", row.summary}, {"errors", errors}});
  }
  return list;
}

Json list_statuses() {
  Json list = Json::array();
  for (int i = 0; i < status_count; ++i) {
    const auto status = static_cast<Status>(i);
    list.push_back({{"name", name(status)}, {"summary", explanation(status)}});
  }
  return list;
}

Json list_controllers() {
  Json list = Json::array();
  const auto gains = [](const std::vector<GainRow>& rows) {
    Json all = Json::object();
    for (const GainRow& row : rows)
      all[std::string(row.name)] =
          fmt::format("{}{}{}{}", row.meaning, row.unit.empty() ? "" : fmt::format(" ({})", row.unit),
                      row.meaning.empty() && row.unit.empty() ? "" : "; ",
                      row.default_value ? fmt::format("default {:g}", *row.default_value) : std::string("needed"));
    return all;
  };
  for (const ControllerRow& row : controllers()) {
    Json entry = {{"name", row.name}, {"summary", row.summary}, {"source", row.source}, {"gains", gains(row.gains)}};
    for (const GainWordRow& word : row.words)
      entry["gains"][std::string(word.name)] =
          fmt::format("one of: {}; default {}", fmt::join(word.choices, ", "), word.choices.front());
    for (const JointRoleRow& role : row.roles) {
      entry["gains"][fmt::format("<{}>", role.name)] = role.meaning;
      const Json of_role = gains(role.gains);
      for (const auto& gain : of_role.items())
        entry["gains"][fmt::format("<{}> {}", role.name, gain.key())] = gain.value();
    }
    list.push_back(entry);
  }
  return list;
}

Json list_engines() {
  Json list = Json::array();
  for (const std::string& name : engine_names()) {
    const auto& rows = engine_rows();
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const EngineRow& of) { return of.name == name; });
    Json entry = {{"name", name}, {"summary", row == rows.end() ? "" : row->summary}};
    std::string fault = engine_missing(name);
    const std::filesystem::path program = engine_program(name);
    const Json said = program.empty() ? Json() : Json(describe_engine(program, fault));
    if (said.is_object()) {
      entry.update(said);
      entry["name"] = name;
      entry["program"] = program.string();
      fault.clear();
    }
    entry["unavailable"] = text(fault);
    list.push_back(entry);
  }
  return list;
}

struct Topic {
  const char* name;
  Json (*list)();
};
constexpr Topic topics[] = {
    {"methods", list_methods},       {"outside", list_outside},     {"laws", list_laws},
    {"solvers", list_solvers},       {"scenarios", list_scenarios}, {"controllers", list_controllers},
    {"references", list_references}, {"statuses", list_statuses},   {"engines", list_engines}};

/// A line for each entry, the errors of a reference or the gains of a controller below it.
void print(const Json& list, const char* indent) {
  const auto word = [](const Json& value) { return value.is_string() ? value.get<std::string>() : std::string(); };
  // What an engine's program says of itself may leave these out.
  const auto said = [&](const Json& of, const char* key) { return of.contains(key) ? word(of[key]) : std::string(); };
  std::size_t width = 0;
  for (const Json& entry : list) width = std::max(width, word(entry["name"]).size());
  for (const Json& entry : list) {
    fmt::print("{}{:<{}}  {}", indent, word(entry["name"]), width, word(entry["summary"]));
    if (entry.contains("precision"))
      fmt::print(" ({} {}, {} precision, {})", word(entry["name"]), said(entry, "version"), word(entry["precision"]),
                 said(entry, "package"));
    if (entry.contains("method")) fmt::print(" ({})", entry["method"].is_null() ? "LCP" : word(entry["method"]));
    if (entry.contains("unavailable") && !entry["unavailable"].is_null())
      fmt::print(" (unavailable: {})", word(entry["unavailable"]));
    fmt::print("\n");
    if (entry.contains("variants") && entry.contains("precision"))
      for (const Json& variant : entry["variants"])
        fmt::print("{}    {:<12}  {}\n", indent, word(variant["name"]), said(variant, "summary"));
    const char* details = entry.contains("errors") ? "errors" : "gains";
    if (!entry.contains(details)) continue;
    std::size_t inner = 0;
    for (const auto& error : entry[details].items()) inner = std::max(inner, error.key().size());
    for (const auto& error : entry[details].items())
      fmt::print("{}    {:<{}}  {}\n", indent, error.key(), inner, word(error.value()));
  }
}

int list(const Text& topic, bool json) {
  std::vector<std::string> names;
  for (const Topic& row : topics) names.emplace_back(row.name);
  if (topic && std::find(names.begin(), names.end(), *topic) == names.end())
    throw UsageError(fmt::format("{}: no such topic; {}", *topic, suggest(*topic, names, "there are")));

  Json all = Json::object();
  for (const Topic& row : topics)
    if (!topic || *topic == row.name) all[row.name] = row.list();
  if (json) {
    fmt::print("{}\n", (topic ? all.front() : all).dump(2, ' ', false, Json::error_handler_t::replace));
    return finished;
  }
  for (const auto& entry : all.items()) {
    if (!topic) fmt::print("{}\n", entry.key());
    print(entry.value(), topic ? "" : "  ");
  }
  return finished;
}

}  // namespace

void add_list(CLI::App& program, Action& action) {
  CLI::App& list_app = *program.add_subcommand("list", "what is here, with one line each");
  struct Flags {
    Text topic;
    bool json = false;
  };
  const auto flags = std::make_shared<Flags>();
  list_app
      .add_option("topic", flags->topic,
                  "methods, outside, laws, solvers, scenarios, controllers, references, statuses or engines [all]")
      ->type_name("TOPIC");
  list_app.add_flag("--json", flags->json, "as JSON");
  list_app.callback([flags, &action] { action = [flags] { return list(flags->topic, flags->json); }; });
}

}  // namespace cb
