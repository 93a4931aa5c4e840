// Every input that fuzzing kept (scripts/fuzz.sh), once: what was mended stays mended, without a fuzzer.

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fuzz/inputs.h"

namespace {

template <class Reader>
int replay(const std::string& folder, const Reader& reader) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TEST_DATA "/fuzz/") + folder)) {
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    INFO(entry.path().string());
    CHECK_NOTHROW(reader(bytes.str()));
    ++count;
  }
  return count;
}

}  // namespace

TEST_CASE("the loader takes or refuses every input that fuzzing kept", "[fuzz]") {
  CHECK(replay("scene", cb::test::read_as_scene) >= 100);
}

TEST_CASE("the readers of problems take or refuse every input that fuzzing kept", "[fuzz]") {
  CHECK(replay("problem", cb::test::read_as_problem) >= 100);
}
