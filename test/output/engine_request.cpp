#include "output/engine_request.h"

#include <catch2/catch.hpp>

using namespace cb;

TEST_CASE("what an engine is asked for arrives as it was sent, each in its own place", "[output]") {
  EngineRequest sent;
  sent.scene = "scene.xml";
  sent.set = {{"boxes", "3"}, {"mu", "0.5"}};
  sent.variant = "si10";
  sent.knobs = {{"cfm", 0.25}, {"erp", 0.5}};
  sent.friction = 1;
  sent.restitution = 2;
  sent.step = 3;
  sent.duration = 4;
  sent.perturb = 5;
  sent.seed = 6;
  sent.record_every = 7;
  sent.time_limit_s = 8;
  sent.save_problems = "problems";
  sent.save_every = 9;
  sent.out = "out";
  // Programs of engines read these names.
  const nlohmann::json json = sent;
  CHECK(json == nlohmann::json::parse(R"({"scene": "scene.xml", "set": [["boxes", "3"], ["mu", "0.5"]],
    "variant": "si10", "knobs": {"cfm": 0.25, "erp": 0.5}, "friction": 1.0, "restitution": 2.0, "step": 3.0,
    "duration": 4.0, "perturb": 5.0, "seed": 6, "record_every": 7, "time_limit_s": 8.0, "save_problems": "problems",
    "save_every": 9, "out": "out"})"));
  const auto got = json.get<EngineRequest>();
  CHECK(got.scene == "scene.xml");
  CHECK(got.set == sent.set);
  CHECK(got.variant == "si10");
  CHECK(got.knobs == sent.knobs);
  CHECK(got.friction == 1);
  CHECK(got.restitution == 2);
  CHECK(got.step == 3);
  CHECK(got.duration == 4);
  CHECK(got.perturb == 5);
  CHECK(got.seed == 6);
  CHECK(got.record_every == 7);
  CHECK(got.time_limit_s == 8);
  CHECK(got.save_problems == "problems");
  CHECK(got.save_every == 9);
  CHECK(got.out == "out");
}

TEST_CASE("what an engine is not asked for is null, and stays unset", "[output]") {
  nlohmann::json json = EngineRequest();
  for (const char* key : {"friction", "restitution", "time_limit_s"}) CHECK(json.at(key).is_null());
  json.erase("save_problems");
  json.erase("save_every");
  const auto got = json.get<EngineRequest>();
  CHECK_FALSE(got.friction.has_value());
  CHECK_FALSE(got.restitution.has_value());
  CHECK_FALSE(got.time_limit_s.has_value());
  CHECK(got.save_problems.empty());
  CHECK(got.save_every == 1);
}
