#pragma once

#include <string>
#include <vector>

#include "flags.h"

namespace cb {

/// The command line of `run --engine`, as text.
struct EngineRunFlags {
  std::string scenario, engine;
  Text variant, setting, restitution, friction, step, duration, record_every, perturb, seed, time_limit, memory_limit,
      out, save_problems, save_every;
  std::vector<std::string> set, knob;
  bool quiet = false, json = false;
};

/// Runs a scene in an engine's program (docs/engines.md); returns an ExitCode.
int run_engine(const EngineRunFlags& flags);
/// `check --engine`: what the engine's preflight measures, every variant's where none is named.
int check_engine(const std::string& engine, const Text& variant, const Text& setting, const Text& step, bool json);

}  // namespace cb
