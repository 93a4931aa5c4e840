// What an engine does with the simplest scenes (scenarios/preflight/), measured before any of its rows count.
#include <fmt/format.h>

#include <cmath>

#include "run.h"

namespace cb {

namespace {

using Json = nlohmann::json;

class Preflight {
 public:
  Preflight(const Engine& engine, const EngineRequest& request)
      : engine_(engine), request_(request), setting_{request.variant, request.knobs, request.step} {}

  /// A line: passes where the measured number is within `allowed` of the expected one.
  void line(const char* name, double measured, double expected, double allowed, const char* unit,
            const std::string& note = {}) {
    const bool passed = std::abs(measured - expected) <= allowed;
    Json row = {{"name", name}, {"expected", expected}, {"allowed", allowed}, {"unit", unit}, {"note", note}};
    row["measured"] = std::isfinite(measured) ? Json(measured) : Json();
    row["passed"] = passed;
    lines_.push_back(row);
  }
  /// A line of what cannot be asked of this engine.
  void none(const char* name, const std::string& why) {
    lines_.push_back({{"name", name}, {"measured", nullptr}, {"passed", false}, {"unsupported", true}, {"note", why}});
  }

  void step(const char* file, Overrides set, double duration, const std::function<void(const State&, int)>& see) {
    const Scenario scenario = load_scenario(request_.out + "/" + file, set);
    step_through(engine_, scenario, setting_, duration, see);
  }

  /// Rounding of a sum of `n` numbers of size 1 in the engine's precision.
  double rounding(double n) const { return n * (engine_.precision == "single" ? 1.2e-7 : 2.3e-16) + 1e-14; }
  double h() const { return setting_.step; }
  Json lines() const { return lines_; }

 private:
  const Engine& engine_;
  const EngineRequest& request_;
  EngineSetting setting_;
  Json lines_ = Json::array();
};

void fall(Preflight& of) {
  constexpr double g = 9.8, duration = 0.5, frequency = 10;
  State start, end;
  of.step("fall.xml", {}, duration, [&](const State& state, int) {
    if (state.t == 0) start = state;
    end = state;
  });
  const double h = of.h(), n = std::round(duration / h);
  of.line("gravity", -end.v[1] / (n * h), g, g * of.rounding(n), "m/s^2", "speed after a free fall of 0.5 s");
  const double drop = (start.pose[0].p - end.pose[0].p).y();
  of.line("velocity that moves", drop / (g * h * h * n) - (n - 1) / 2, 1, 1e-6 + n * n * of.rounding(n), "",
          "0: at the start of the step, 1: at its end, 0.5: their mean");
  double at_start = 0;
  for (double i = 0; i < n; ++i) at_start += h * std::cos(frequency * i * h);
  const double to_end = h * (std::cos(frequency * n * h) - 1);
  of.line("time at which forces are taken", (end.v[0] - at_start) / to_end, 0, 1e-6 + of.rounding(n) / std::abs(to_end),
          "", "0: the start of the step, 1: its end");
}

void coast(Preflight& of) {
  double slow = NAN, fast = NAN, spin = NAN;
  of.step("coast.xml", {}, 5, [&](const State& state, int) { slow = state.v[0] / 1e-3; });
  of.step("coast.xml", {{"speed", "1"}, {"spin", "1"}}, 1, [&](const State& state, int) {
    fast = state.v[0];
    spin = state.v[4];
  });
  const double n = 5 / of.h();
  of.line("speed kept, asleep or not", slow, 1, of.rounding(n), "", "of 1e-3 m/s after 5 s; 0: asleep");
  of.line("speed kept", fast, 1, of.rounding(n), "", "of 1 m/s after 1 s; less: damping");
  of.line("spin kept", spin, 1, of.rounding(n), "", "of 1 rad/s after 1 s");
}

/// Friction at work over mu, from the stopping distance; and by how much the box left its heading, rad.
std::pair<double, double> stopping(Preflight& of, double heading, double mu, int& contacts) {
  constexpr double g = 9.8, v = 2;
  Vec3 start = Vec3::Zero(), end = start;
  of.step("slide.xml", {{"heading", fmt::format("{:.17g}", heading)}}, 1.5, [&](const State& state, int points) {
    if (state.t == 0) start = state.pose[0].p;
    end = state.pose[0].p;
    if (state.t > 0.1) contacts = std::max(contacts, points);
  });
  const Vec3 way = end - start;
  const double distance = std::hypot(way.x(), way.z());
  return {v * v / (2 * g * (distance + v * of.h() / 2)) / mu, std::atan2(way.z(), way.x()) - heading};
}

void slide(Preflight& of, double diagonal) {
  constexpr double mu = 0.2, allowed = 0.01, eighth = 0.78539816339744831;
  int contacts = -1;
  const auto [along, aside] = stopping(of, 0, mu, contacts);
  of.line("friction along x, of mu", along, 1, allowed, "", "from the stopping distance of a box, mu = 0.2");
  const auto [across, turned] = stopping(of, eighth, mu, contacts);
  of.line("friction at 45 degrees, of mu", across, diagonal, diagonal * allowed, "",
          diagonal == 1 ? "a cone's" : fmt::format("{:.3g} is what the friction pyramid of this law has", diagonal));
  of.line("heading left at 45 degrees", turned, 0, 0.01, "rad");
  of.line("contacts of a box on the ground", contacts, 4, 0, "", contacts < 0 ? "the engine does not say" : "");
}

void bounce(Preflight& of) {
  for (const double e : {0.5, 0.0}) {
    double down = 0, up = 0;
    const char* name = e > 0 ? "restitution of 0.5" : "restitution of 0";
    try {
      of.step("bounce.xml", {{"e", fmt::format("{}", e)}}, 0.6, [&](const State& state, int) {
        down = std::max(down, -state.v[1]);
        up = std::max(up, state.v[1]);
      });
      of.line(name, up / down, e, 0.01, "", "speed after over speed before the impact of a sphere");
    } catch (const Unsupported& why) {
      of.none(name, why.what());
    }
  }
}

}  // namespace

Json preflight(const Engine& engine, const EngineRequest& request) {
  const EngineVariant* variant = engine.find(request.variant);
  Preflight of(engine, request);
  fall(of);
  coast(of);
  slide(of, variant ? engine.diagonal(*variant, request.knobs) : 1);
  bounce(of);
  return {{"lines", of.lines()}};
}

}  // namespace cb
