#pragma once

#include <fstream>
#include <nlohmann/json.hpp>

namespace cb::test {

/// The stored closed forms: sliding, ramp, circle, sphere, stack (made outside this program).
inline const nlohmann::json& stored() {
  static const nlohmann::json data = nlohmann::json::parse(std::ifstream(TEST_DATA "/evaluation.json"));
  return data;
}

}  // namespace cb::test
