// The rooms of the house and the order in which they stand: an include points down the list, never up
// (docs/architecture.md).
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

// From the top of the house to its ground.
const std::vector<std::string> rooms = {"app",     "output",  "evaluation", "simulation", "scenario",
                                        "methods", "contact", "geometry",   "control",    "dynamics",
                                        "lcp",     "ncp",     "cone",       "linalg"};
// Rooms that could stand anywhere: they see only these, although others lie below them too.
const std::map<std::string, std::set<std::string>> sees_only = {
    {"lcp", {"linalg"}}, {"ncp", {"cone", "linalg"}}, {"cone", {"linalg"}}};
// Rooms that are handed a method and never ask which: of lib/methods they may see the table alone.
const std::set<std::string> handed_a_method = {"simulation", "evaluation", "output"};
const std::vector<std::string> suitesparse = {"cholmod", "umfpack", "klu",     "SuiteSparse", "suitesparse",
                                              "camd",    "colamd",  "ccolamd", "amd",         "btf"};

int height(const std::string& room) {
  const auto at = std::find(rooms.begin(), rooms.end(), room);
  return at == rooms.end() ? -1 : static_cast<int>(rooms.end() - at);
}

/// What a file of `room` with this text does that it must not; empty where all is well.
std::vector<std::string> violations(const std::string& room, const std::string& text) {
  std::vector<std::string> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t hash = line.find_first_not_of(" \t");
    if (hash == std::string::npos || line[hash] != '#' || line.find("include") == std::string::npos) continue;
    const std::size_t open = line.find_first_of("<\""), close = line.find_last_of(">\"");
    if (open == std::string::npos || close <= open) continue;
    const std::string name = line.substr(open + 1, close - open - 1);
    if (line[open] == '<') {
      const std::string file = name.substr(name.rfind('/') == std::string::npos ? 0 : name.rfind('/') + 1);
      for (const std::string& library : suitesparse)
        if (room != "linalg" && (file.starts_with(library + ".") || file.starts_with(library + "_")))
          found.push_back("SuiteSparse header " + name);
      continue;
    }
    const std::string target = name.substr(0, name.find('/'));
    if (room == "app" && name.find('/') == std::string::npos) continue;  // its own headers
    if (height(target) < 0)
      found.push_back("include of no room: " + name);
    else if (height(target) > height(room))
      found.push_back("points up: " + name);
    else if (sees_only.contains(room) && target != room && !sees_only.at(room).contains(target))
      found.push_back("must not know: " + name);
    else if (handed_a_method.contains(room) && target == "methods" && name != "methods/registry.h" &&
             name != "methods/pruned.h")
      found.push_back("names a method: " + name);
  }
  return found;
}

std::string read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool is_source(const fs::path& path) {
  return path.extension() == ".cpp" || path.extension() == ".h" || path.extension() == ".hpp";
}

}  // namespace

TEST_CASE("every include of the sources points down the list of rooms") {
  const fs::path source = SOURCE_ROOT;
  int files = 0;
  for (const std::string& room : rooms) {
    const fs::path folder = room == "app" ? source / "app" : source / "lib" / room;
    INFO(folder);
    REQUIRE(fs::is_directory(folder));
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
      if (!is_source(entry.path())) continue;
      ++files;
      for (const std::string& violation : violations(room, read(entry.path()))) {
        FAIL_CHECK(fs::relative(entry.path(), source).string() << ": " << violation);
      }
    }
  }
  CHECK(files > 20);
}

TEST_CASE("lib holds the listed rooms and nothing else") {
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(SOURCE_ROOT) / "lib")) {
    INFO(entry.path().filename());
    CHECK((entry.path().filename() == "CMakeLists.txt" || height(entry.path().filename().string()) > 0));
  }
}

TEST_CASE("an include that breaks the order is found") {
  CHECK(violations("lcp", "#include \"contact/problem.h\"\n").size() == 1);    // up
  CHECK(violations("lcp", "#include \"cone/cone_program.h\"\n").size() == 1);  // down, but a neighbour
  CHECK(violations("contact", "  # include \"simulation/simulation.h\"").size() == 1);
  CHECK(violations("simulation", "#include \"methods/newton.h\"\n").size() == 1);  // names a method
  CHECK(violations("methods", "#include <suitesparse/klu.h>\n").size() == 1);
  CHECK(violations("cone", "#include <cholmod.h>\n").size() == 1);
  CHECK(violations("geometry", "#include \"shapes.h\"\n").size() == 1);  // without its room
}

TEST_CASE("an include that keeps the order passes") {
  CHECK(violations("app", "#include \"output/summary.h\"\n#include \"run.h\"\n").empty());
  CHECK(violations("simulation", "#include \"methods/registry.h\"\n").empty());
  CHECK(violations("linalg", "#include <klu.h>\n").empty());
  CHECK(violations("lcp", "#include \"lcp/lcp.h\"\n#include \"linalg/block_matrix.h\"\n").empty());
  CHECK(violations("contact", "// #include \"app/main.h\"\n").empty());
}
