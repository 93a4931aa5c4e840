#include "engine.h"

#include <fmt/format.h>

#include "run.h"

namespace cb {

const EngineVariant* Engine::find(std::string_view variant) const {
  for (const EngineVariant& row : variants)
    if (row.name == variant) return &row;
  return nullptr;
}

Knobs Engine::knobs_of(const EngineVariant& variant) const {
  Knobs all;
  for (const EngineKnob& knob : knobs) all[knob.name] = knob.value;
  for (const auto& [knob, value] : variant.knobs) all.at(knob) = value;
  return all;
}

double Engine::diagonal(const EngineVariant& variant, const Knobs& all) const {
  const auto slip = all.find(slip_knob);
  return slip != all.end() && slip->second > 0 ? 1 : variant.diagonal;
}

Pose shape_pose(const State& state, const Shape& shape) {
  if (shape.body < 0) return shape.local;
  const Pose& body = state.pose[static_cast<std::size_t>(shape.body)];
  return {body * shape.local.p, body.q * shape.local.q};
}

void refuse_robots(const Scenario& scenario, std::string_view engine) {
  if (!scenario.model.trees.empty())
    throw Unsupported(fmt::format("a robot ({}): the adapter of {} makes free bodies only",
                                  scenario.model.trees.front().name, engine));
}

nlohmann::json describe(const Engine& engine) {
  using Json = nlohmann::json;
  Json variants = Json::array(), knobs = Json::array();
  for (const EngineVariant& row : engine.variants)
    variants.push_back({{"name", row.name},
                        {"summary", row.summary},
                        {"diagonal", engine.diagonal(row, engine.knobs_of(row))},
                        {"knobs", engine.knobs_of(row)}});
  for (const EngineKnob& row : engine.knobs) {
    knobs.push_back({{"name", row.name}, {"default", row.value}, {"unit", row.unit}, {"meaning", row.meaning}});
    if (row.count_from) knobs.back()["count_from"] = *row.count_from;
    if (row.count_to) knobs.back()["count_to"] = *row.count_to;
  }
  return {{"name", engine.name},       {"summary", engine.summary},
          {"version", engine.version}, {"precision", engine.precision},
          {"package", engine.package}, {"documentation", engine.documentation},
          {"shared", engine.shared},   {"apart", engine.apart},
          {"variants", variants},      {"knobs", knobs}};
}

}  // namespace cb
