// An engine that goes wrong in the way that its variant names, after 0.05 s of free fall; `falls` is right, and so is
// `soft`, which knows no restitution.
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "frame/engine.h"

namespace cb {

namespace {

struct Falling {
  State state;
  Loads loads;
  std::string variant;
  std::vector<std::vector<char>> hoard;

  void step(double h) {
    state.t += h;
    for (std::size_t i = 0; i < state.pose.size(); ++i) {
      Eigen::Map<Vec3> v(&state.v[6 * i]);
      v += h * loads.gravity;
      state.pose[i].p += h * v;
    }
    constexpr double begins = 0.05;  // s
    if (state.t >= begins) go_wrong();
  }

  void go_wrong() {
    if (variant == "aborts") {
      std::fprintf(stderr, "assertion failed: on purpose\n");
      std::abort();
    }
    if (variant == "faults") raise(SIGSEGV);
    if (variant == "leaves") _exit(0);
    if (variant == "hangs")
      for (;;) pause();
    if (variant == "nan") state.v[1] = NAN;
    if (variant == "throws") throw std::runtime_error("thrown on purpose");
    if (variant == "eats")
      for (;;) hoard.emplace_back(std::size_t(1) << 24, char(1));
  }
};

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  if (setting.variant == "refuses") throw Unsupported("on purpose");
  for (const PairLaw& law : scenario.pairs.laws)
    if (setting.variant == "soft" && law.restitution > 0) throw Unsupported("restitution, on purpose");
  const auto world = std::make_shared<Falling>();
  world->state = scenario.initial;
  world->variant = setting.variant;
  return {[world](const Loads& loads) { world->loads = loads; }, [world](double h) { world->step(h); },
          [world](State& state) { state = world->state; }, [] { return 0; }};
}

Engine broken() {
  Engine engine;
  engine.name = "broken";
  engine.summary = "goes wrong on purpose";
  engine.version = "1";
  engine.precision = "double";
  engine.package = "none";
  for (const char* variant :
       {"falls", "aborts", "faults", "leaves", "hangs", "nan", "throws", "eats", "refuses", "soft"})
    engine.variants.push_back({variant, variant});
  engine.knobs = {{"depth", 1, "m", "of nothing"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::broken(), argc, argv); }
