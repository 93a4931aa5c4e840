// An engine that goes wrong in the way that its variant names, after 0.05 s of free fall; `falls` is right, and so are
// `soft`, which knows no restitution, and `tells`, which gives a contact problem away in every step.
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>

#include "frame/engine.h"
#include "frame/own_problem.h"

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

/// Of three points: one of 4 kg slides on the ground, one of 1 kg is held between two walls, one of 1 kg leaves the
/// ground. The velocities after are not those of its own impulses: the first two points are off.
bool tell(OwnProblem& out) {
  out = {};
  for (const double mass : {4.0, 1.0, 1.0})
    out.problem.M.block(out.problem.M.add_block(3)) = mass * Eigen::Matrix3d::Identity();
  for (const auto& [point, sign] : {std::pair(0, 1.0), std::pair(1, 1.0), std::pair(1, -1.0), std::pair(2, 1.0)}) {
    out.problem.J.add_band();
    out.problem.J.entry(out.problem.J.add_entry(point, 3)) = sign * Eigen::Matrix3d::Identity();
    out.problem.mu.push_back(0.5);
    out.problem.restitution.push_back(0);
  }
  out.problem.v_minus = {-2, 3, 0, 0, 0, 0, 1, 0.5, 0};
  out.problem.offset.assign(12, 0.0);
  out.impulse = {8, -4, 0, 3, 0, 0, 3, 0, 0, 0, 0, 0};
  out.v_plus = {0, 2, 1.5, 0.75, 0, 0, 1, 0.5, 0};
  out.compliance = {0, 0, 0, 0.5, 0.5, 0.5, 0.25, 0.25, 0.25, 0, 0, 0};
  out.law = "friction cone";
  out.offset_means = "nothing";
  return true;
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  if (setting.variant == "refuses") throw Unsupported("on purpose");
  for (const PairLaw& law : scenario.pairs.laws)
    if (setting.variant == "soft" && law.restitution > 0) throw Unsupported("restitution, on purpose");
  const auto world = std::make_shared<Falling>();
  world->state = scenario.initial;
  world->variant = setting.variant;
  EngineWorld made = {[world](const Loads& loads) { world->loads = loads; }, [world](double h) { world->step(h); },
                      [world](State& state) { state = world->state; }, [] { return 0; }};
  if (setting.variant == "tells") made.problem = tell;
  return made;
}

Engine broken() {
  Engine engine;
  engine.name = "broken";
  engine.summary = "goes wrong on purpose";
  engine.version = "1";
  engine.precision = "double";
  engine.package = "none";
  engine.documentation = {"none, either"};
  engine.shared = {"gravity"};
  engine.apart = {"forces: none", "contacts: none"};
  for (const char* variant :
       {"falls", "aborts", "faults", "leaves", "hangs", "nan", "throws", "eats", "refuses", "soft", "tells"})
    engine.variants.push_back({variant, variant});
  engine.knobs = {{"depth", 1, "m", "of nothing"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::broken(), argc, argv); }
