// `check --engine`: the preflight of an engine, printed and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "commands.h"
#include "engines.h"
#include "limits.h"
#include "linalg/stop.h"
#include "run_engine.h"
#include "scenario/near_name.h"

namespace cb {

namespace {

using Json = nlohmann::ordered_json;

/// Has a line what is printed of it?
bool is_line(const nlohmann::json& line) {
  if (!line.is_object()) return false;
  const auto word = [&](const char* key) { return line.contains(key) && line[key].is_string(); };
  const auto number = [&](const char* key) { return line.contains(key) && line[key].is_number(); };
  const bool wants = line.contains("unsupported") || (number("expected") && number("allowed") && word("unit"));
  return wants && word("name") && word("note") && line.contains("measured") && line.contains("passed") &&
         line["passed"].is_boolean();
}

/// The preflight of one variant: its lines, or the fault that stands in their place.
Json measure(const std::filesystem::path& program, const std::string& engine, const nlohmann::json& variant,
             const std::string& setting, double step) {
  constexpr double patience = 60, memory_mb = 4096;  // s
  EngineRequest request;
  request.variant = variant["name"];
  request.knobs = variant["knobs"];
  request.step = step;
  request.out = (std::filesystem::path(bundled_scenarios().front()).parent_path() / "preflight").string();
  Json row = {{"engine", engine}, {"variant", request.variant}, {"setting", setting},
              {"step", step},     {"fault", nullptr},           {"lines", Json::array()}};
  if (setting == "tuned")
    if (const nlohmann::json tuned = tuned_knobs(engine, request.variant); tuned.is_object())
      for (const auto& [key, value] : tuned.items())
        if (const auto found = request.knobs.find(key); found != request.knobs.end()) found->second = value;
  row["knobs"] = request.knobs;
  const Ended ended = run_program(program, {"--preflight", nlohmann::json(request).dump()}, patience, memory_mb);
  const nlohmann::json said = nlohmann::json::parse(ended.answer, nullptr, false);
  if (ended.code == 0 && said.is_object() && said.contains("lines") && said["lines"].is_array() &&
      std::ranges::all_of(said["lines"], is_line))
    row["lines"] = said["lines"];
  else if (ended.stopped())
    row["fault"] = "interrupted: stopped by a signal";
  else if (ended.overdue)
    row["fault"] = fmt::format("time_limit: it did not come back within {:g} s", patience);
  else if (ended.code == 0)
    row["fault"] = "crash: its preflight has no lines as docs/engines.md says";
  else
    row["fault"] =
        fmt::format("crash: {}{}{}",
                    ended.code < 0 ? fmt::format("signal {}", -ended.code) : fmt::format("exit code {}", ended.code),
                    ended.last_words.empty() ? "" : ": ", ended.last_words);
  return row;
}

void print(const Json& row) {
  fmt::print("{} {}, {}, h = {:g} s{}\n", row["engine"].get<std::string>(), row["variant"].get<std::string>(),
             row["setting"].get<std::string>(), row["step"].get<double>(),
             row["fault"].is_null() ? "" : ": " + row["fault"].get<std::string>());
  for (const Json& line : row["lines"]) {
    const bool unsupported = line.contains("unsupported");
    const std::string measured =
        line["measured"].is_number() ? fmt::format("{:.9g}", line["measured"].get<double>()) : "-";
    const std::string wanted = unsupported
                                   ? ""
                                   : fmt::format("{:g} +- {:.1g} {}", line["expected"].get<double>(),
                                                 line["allowed"].get<double>(), line["unit"].get<std::string>());
    fmt::print("  {:<6} {:<32} {:>14}   {:<24} {}\n",
               unsupported                  ? "-"
               : line["passed"].get<bool>() ? "ok"
                                            : "FAILS",
               line["name"].get<std::string>(), measured, wanted, line["note"].get<std::string>());
  }
}

}  // namespace

int check_engine(const std::string& engine, const Text& variant, const Text& setting, const Text& step, bool json) {
  const std::vector<std::string> names = engine_names();
  if (std::find(names.begin(), names.end(), engine) == names.end())
    throw UsageError(fmt::format("--engine {}: no such engine; {}", engine, suggest(engine, names, "there are")));
  if (setting && *setting != "default" && *setting != "tuned")
    throw UsageError(fmt::format("--setting {}: must be default or tuned", *setting));
  constexpr double longest = 0.5;  // s, what the shortest of the preflight's scenes takes
  constexpr const char* seconds = "a positive number of seconds, at most 0.5";
  const double h = step ? positive_flag("step", *step, seconds) : 1e-3;
  if (h > longest) throw UsageError(fmt::format("--step {}: must be {}", *step, seconds));
  std::string fault = engine_missing(engine);
  const std::filesystem::path program = engine_program(engine);
  const nlohmann::json said = program.empty() ? nlohmann::json() : describe_engine(program, fault);
  if (!said.is_object()) {
    print_error(fmt::format("contactbench check: unavailable: {}\n", fault));
    return not_finished;
  }
  Json rows = Json::array();
  std::vector<std::string> known;
  const Limits limits({}, {});
  for (const nlohmann::json& row : said["variants"]) {
    known.push_back(row["name"]);
    if (!rows.empty() && stop_asked.load(std::memory_order_relaxed)) continue;
    if (!variant || *variant == row["name"])
      rows.push_back(measure(program, engine, row, setting.value_or("default"), h));
  }
  if (rows.empty())
    throw UsageError(fmt::format("--variant {}: {} has no such variant; {}", *variant, engine,
                                 suggest(*variant, known, "there are")));
  bool all = true;
  for (const Json& row : rows) {
    all = all && row["fault"].is_null();
    for (const Json& line : row["lines"]) all = all && (line["passed"].get<bool>() || line.contains("unsupported"));
    if (!json) print(row);
  }
  if (json) fmt::print("{}\n", rows.dump(1, ' ', false, Json::error_handler_t::replace));
  if (!all && !json) fmt::print("A line that fails stands beside the engine's rows (docs/engines.md).\n");
  return all ? finished : not_finished;
}

}  // namespace cb
