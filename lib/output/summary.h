#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "output/machine.h"
#include "output/tally.h"

namespace cb {

/// What the program was made from.
struct Versions {
  std::string contactbench, git, compiler, flags, eigen, suitesparse;
};

/// Method, solver and variant by name; empty: none.
struct Choice {
  std::string method, solver, variant;
};

/// An engine in a method's place (docs/engines.md).
struct EngineUse {
  std::string name, version, precision, package;
  std::string setting;                                ///< default, tuned, or own where a knob was given
  std::vector<std::pair<std::string, double>> knobs;  ///< all of them
};

/// Everything needed to repeat and to judge a run: summary.json.
struct RunSummary {
  // What was asked.
  std::string scenario, file, title;
  std::vector<std::pair<std::string, std::string>> parameters;
  Choice requested, used;  ///< an engine stands as the method
  std::optional<EngineUse> engine;
  MethodOptions method_options;
  std::vector<std::string> method_flags;  ///< those that the method understands; the others are null
  SimulationOptions simulation;
  std::optional<double> restitution, friction;  ///< overrides of every pair
  double rotate_cone = 0;                       ///< rad
  long record_every = 1;
  double perturb = 0;  ///< m
  long seed = 0;       ///< of `perturb`
  bool prune = true;
  std::optional<double> time_limit_s, memory_limit_mb;
  Versions versions;
  Machine machine;

  // What came of it.
  Status status = Status::ok;
  std::string reason;        ///< one line where status is not ok
  std::string hard_problem;  ///< file beside the summary with the contact problem that it stumbled over; empty: none
  std::string hard_problem_command;  ///< what solves it to the same status again; empty where nothing does
  std::string worst_refusal;         ///< what the check says of the worst answer that it refused
  bool finished = false;
  RunTally tally;
  std::optional<AccuracyTally> accuracy;  ///< where that is how it stepped
  std::string reference_kind, reference_name;
  std::vector<std::pair<std::string, double>> errors;
  std::optional<double> control_eigenvalue;   ///< largest of the controllers' explicit step (explicit_step.h)
  std::optional<double> largest_stable_step;  ///< s, of controllers, springs and damping (explicit_step.h)
  std::vector<std::pair<std::string, long>>
      left_out;  ///< what pruning left out, with counts over the run; zeros are not here
  std::vector<std::pair<std::string, long>> answered_by;  ///< whose answers were taken, where the method tries several
  double write_s = 0;                                     ///< spent on trajectory.csv and steps.csv
  double wall_s = 0;                                      ///< all of it, by the clock on the wall
  double peak_memory_mb = 0;
};

std::string_view name(ReferenceKind kind);

/// What is known of a run before it starts: its scene and the machine; its method.
void describe(const Scenario& scenario, RunSummary& summary);
void describe(const MethodRow& method, const MethodOptions& options, RunSummary& summary);

/// The text of summary.json. Non-finite numbers are null.
std::string to_json(const RunSummary& summary);
/// A few lines for people.
std::string to_text(const RunSummary& summary);

/// summary.json, its place reserved before the run starts so that a full disk can refuse it only then.
class SummaryFile {
 public:
  /// Writes `provisional` (what is true of a run that gets killed) with white space after it.
  SummaryFile(const std::filesystem::path& path, const std::string& provisional);
  SummaryFile(const SummaryFile&) = delete;
  SummaryFile& operator=(const SummaryFile&) = delete;
  ~SummaryFile();

  bool ok() const { return error_ == 0; }
  /// errno of the first failure, 0 where there is none.
  int error() const { return error_; }
  /// Puts the final text in the reserved place. False where that fails; `text` is then not on the disk.
  bool replace(const std::string& text);

  /// Characters beyond the provisional text that the final one may grow by without asking the disk for more.
  static constexpr std::size_t reserve = 8192;

 private:
  int file_ = -1;
  int error_ = 0;
  std::size_t size_ = 0;
};

}  // namespace cb
