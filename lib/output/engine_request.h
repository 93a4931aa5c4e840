#pragma once

// What `contactbench` and the program of an engine say to each other.

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace cb {

/// Files that a run inherits: where its result goes (JSON), and a page of memory that it keeps up to date, which
/// outlives it.
inline constexpr int result_file = 3, pulse_file = 4;

/// How far a run is; read by the parent after whatever end.
struct Pulse {
  double t = 0;       ///< s, end of the last whole step
  long steps = 0;     ///< whole steps
  double step_s = 0;  ///< s spent in them
};

/// What an engine's program is asked to run.
struct EngineRequest {
  std::string scene;  ///< file
  std::vector<std::pair<std::string, std::string>> set;
  std::string variant;
  std::map<std::string, double, std::less<>> knobs;  ///< all of the engine's
  std::optional<double> friction, restitution;       ///< of every pair
  double step = 0, duration = 0;                     ///< s
  double perturb = 0;                                ///< m
  long seed = 0;
  long record_every = 1;
  std::optional<double> time_limit_s;
  std::string save_problems;  ///< folder of the engine's own contact problems; empty: none are kept
  long save_every = 1;        ///< of the steps with contact
  std::string out;            ///< folder of trajectory.csv and steps.csv; of a preflight, that of its scenes
};

inline void to_json(nlohmann::json& json, const EngineRequest& of) {
  const auto maybe = [](const std::optional<double>& x) { return x ? nlohmann::json(*x) : nlohmann::json(); };
  json = {{"scene", of.scene},
          {"set", of.set},
          {"variant", of.variant},
          {"knobs", of.knobs},
          {"friction", maybe(of.friction)},
          {"restitution", maybe(of.restitution)},
          {"step", of.step},
          {"duration", of.duration},
          {"perturb", of.perturb},
          {"seed", of.seed},
          {"record_every", of.record_every},
          {"time_limit_s", maybe(of.time_limit_s)},
          {"save_problems", of.save_problems},
          {"save_every", of.save_every},
          {"out", of.out}};
}

inline void from_json(const nlohmann::json& json, EngineRequest& of) {
  const auto maybe = [&](const char* key, std::optional<double>& x) {
    if (!json.at(key).is_null()) x = json.at(key).get<double>();
  };
  json.at("scene").get_to(of.scene);
  json.at("set").get_to(of.set);
  json.at("variant").get_to(of.variant);
  json.at("knobs").get_to(of.knobs);
  maybe("friction", of.friction);
  maybe("restitution", of.restitution);
  json.at("step").get_to(of.step);
  json.at("duration").get_to(of.duration);
  json.at("perturb").get_to(of.perturb);
  json.at("seed").get_to(of.seed);
  json.at("record_every").get_to(of.record_every);
  maybe("time_limit_s", of.time_limit_s);
  of.save_problems = json.value("save_problems", "");
  of.save_every = json.value("save_every", 1L);
  json.at("out").get_to(of.out);
}

}  // namespace cb
