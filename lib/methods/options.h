#pragma once

#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace cb {

/// Counted by the threads of a run.
using Counter = std::atomic<long>;

/// Whose answer was taken, where a method tries several ways.
struct AnsweredBy {
  std::map<std::string_view, long> counts;
  std::mutex adding;
  void add(std::string_view who) {
    const std::lock_guard lock(adding);
    ++counts[who];
  }
};

/// What a user can ask of a method; each field that is a number or a switch and changes an answer has a row in the
/// files of the methods that understand it (OptionRow), and is nowhere else named but where it is used.
struct MethodOptions {
  std::string variant;                      ///< newton: uncapped | stick-tested; soft: sap | mujoco; empty: the default
  std::string solver;                       ///< of the method's row (`contactbench list solvers`); empty: its first
  int k = 4;                                ///< ap: edges of the friction polygon, even, >= 4
  double epsilon = 1e-12;                   ///< convex: suboptimality at which the solver may stop, J
  std::optional<double> epsilon_relative;   ///< convex: the same as a fraction of the kinetic energy before the event
  bool compression_bound = true;            ///< convex: bound the sum of normal impulses of each island
  double regularise = 0;                    ///< ap: added to the diagonal of the LCP
  bool idle_friction = true;                ///< ap: keep the unknowns of friction where mu = 0
  int sweeps = 0;                           ///< coulomb by nsgs: sweeps after which it ends; 0: until it is done
  double relaxation = 1;                    ///< coulomb by nsgs: over-relaxation, in (0, 2)
  double beta = 1;                          ///< soft sap: R_n = beta^2 w / (4 pi^2), near rigid
  double sigma = 1e-3;                      ///< soft sap: R_t = sigma w
  double compliance = 0;                    ///< soft sap: R_n is at least this, 1/kg
  double impedance = 0.9;                   ///< soft mujoco: d, R_n = (1 - d) / d W_nn
  double impratio = 1;                      ///< soft mujoco: R_t = R_n / impratio
  bool warm_start = false;                  ///< ap, convex, coulomb, soft: try from the previous event's answer first
  std::string command;                      ///< external: what answers, as a shell takes it
  std::string law;                          ///< external: what its answers claim to solve
  int threads = 1;                          ///< on which islands of one event are solved at once: the same answers
  std::shared_ptr<Counter> warm_starts;     ///< receives how many such starts were accepted, where it is given
  std::shared_ptr<AnsweredBy> answered_by;  ///< receives whose answers were taken, where it is given
};

/// The field that a flag sets, and what it holds; monostate: nothing was asked for.
using OptionField = std::variant<int MethodOptions::*, double MethodOptions::*, std::optional<double> MethodOptions::*,
                                 bool MethodOptions::*, std::string MethodOptions::*>;
using OptionValue = std::variant<std::monostate, int, double, bool, std::string>;

/// A flag that a method understands, and everything that is done with it: `run`, `solve` and `list`, the summary, the
/// names of runs and the sweeps read it from here.
struct OptionRow {
  std::string_view flag;           ///< without dashes: "epsilon-relative"; in JSON and in sweeps with underscores
  std::string_view unit;           ///< "J", "-"
  std::string_view default_value;  ///< as `list` and --help print it
  std::string_view summary;
  OptionField field;
  std::string_view type;              ///< of its value, as --help calls it: "EDGES"
  std::string_view short_name;        ///< begins its part of the name of a run's directory: "eps"
  std::string_view expected = {};     ///< what a number must be, as a message goes on
  double least = 0, most = HUGE_VAL;  ///< of a number
  bool positive = false;              ///< must it be greater than 0?
  int multiple_of = 1;                ///< of a whole number
  bool always_named = false;          ///< is it part of the directory's name where nobody asked for it, too?
  bool of_scenario = false;           ///< may a scenario say it, too?
  std::string_view variant = {};      ///< the one that has a use for it; empty: all
  std::string_view replaces = {};     ///< the flag that it takes the place of; asking for both is an error
  bool between_events = false;        ///< about what one event leaves to the next: of no use to `solve`
  bool of_law = false;                ///< part of what is asked of an answer, whoever gives it (methods/outside.h)
};

/// Its name in JSON and in sweep files.
std::string key(const OptionRow& row);
/// monostate also where another of `rows` has taken its place, or the variant has no use for it.
OptionValue value_of(const OptionRow& row, std::span<const OptionRow> rows, const MethodOptions& options);

/// The row of --warm-start, which several methods understand in their own ways.
inline OptionRow warm_start_option(std::string_view summary) {
  return {.flag = "warm-start",
          .unit = "-",
          .default_value = "off",
          .summary = summary,
          .field = &MethodOptions::warm_start,
          .type = "on|off",
          .short_name = "warm-",
          .between_events = true};
}

}  // namespace cb
