#pragma once

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "output/engine_request.h"

namespace cb {

/// An engine that this version has an adapter for; its program says the rest of itself.
struct EngineRow {
  std::string_view name, summary, package;
};
const std::vector<EngineRow>& engine_rows();

/// The rows' names, and those of programs that are here without a row.
std::vector<std::string> engine_names();
/// The program contactbench-engine-NAME: in the folder that CONTACTBENCH_ENGINES names, beside this program, or
/// installed (../libexec/contactbench). Empty where there is none.
std::filesystem::path engine_program(std::string_view name);
/// Why the engine is not here: one line with the package.
std::string engine_missing(std::string_view name);
/// What the engine's program says of itself; null where it does not answer, with `fault` saying why.
nlohmann::json describe_engine(const std::filesystem::path& program, std::string& fault);
/// Knobs that the search of scripts/engines.py found (tuned.json in scenarios/engines): null where there are none.
nlohmann::json tuned_knobs(std::string_view engine, std::string_view variant);

/// How a program that was started ended.
struct Ended {
  int code = 0;              ///< exit code; -signal
  bool overdue = false;      ///< had to be killed: it did not come back in time
  bool interrupted = false;  ///< this program was asked to stop, and stopped it
  double peak_memory_mb = 0;
  /// Did it end because this program was asked to stop?
  bool stopped() const { return interrupted && (overdue || code == -SIGTERM); }
  std::string answer;      ///< what it wrote to `result_file`
  std::string last_words;  ///< last line on standard error
  Pulse pulse;
};
/// Runs an engine's program to its end. It is asked to end after `time_s` and killed where it does not; `memory_mb`
/// bounds its private memory.
Ended run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                  std::optional<double> time_s, std::optional<double> memory_mb);

}  // namespace cb
