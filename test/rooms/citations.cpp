// A reader who follows what a comment or a page cites finds it: every file that is named by its path from the top of
// the project is there, and so is every benchmark, and every command of the program is one that it has.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path source = SOURCE_ROOT;
const std::set<std::string> commands = {"run", "solve", "check", "list", "judge", "completion"};

/// What the line cites that is not there.
std::vector<std::string> missing(const std::string& line) {
  static const std::regex file(
      R"((^|[^\w./{<-])((docs|lib|app|scripts|scenarios|bench|test)/[\w./-]*\w\.(md|cpp|h|py|sh|xml|toml|json|csv))\b)");
  static const std::regex benchmark(R"(\bbench_(\w+))"), command(R"(`(build/bin/)?contactbench ([a-z]+))");
  const auto each = [&](const std::regex& what, int group, const auto& is_there, std::vector<std::string>& out) {
    for (std::sregex_iterator at(line.begin(), line.end(), what), end; at != end; ++at)
      if (!is_there((*at)[group].str())) out.push_back((*at)[group].str());
  };
  std::vector<std::string> out;
  each(
      file, 2, [](const std::string& name) { return fs::exists(source / name); }, out);
  each(
      benchmark, 1, [](const std::string& name) { return fs::exists(source / "bench" / (name + ".cpp")); }, out);
  each(
      command, 2, [](const std::string& name) { return commands.contains(name); }, out);
  if (line.find("(spec"
                ": ") != std::string::npos)
    out.emplace_back("a specification that no reader has");
  return out;
}

bool is_read(const fs::path& path) {
  static const std::set<std::string> kinds = {".cpp", ".h", ".md", ".py", ".sh", ".xml", ".toml", ".txt"};
  return kinds.contains(path.extension().string()) && path.filename() != "rooms.cpp" &&
         path.filename() != "citations.cpp";  // both quote what is not there
}

}  // namespace

TEST_CASE("files, benchmarks and commands that comments and pages cite are there") {
  std::vector<fs::path> read = {source / "README.md", source / "CMakeLists.txt"};
  for (const char* folder : {"app", "lib", "bench", "docs", "scenarios", "scripts", "test"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(source / folder)) {
      const std::string inside = fs::relative(entry.path(), source).string();
      if (entry.is_regular_file() && is_read(entry.path()) && inside.find("test/data") != 0)
        read.push_back(entry.path());
    }
  CHECK(read.size() > 200);
  for (const fs::path& path : read) {
    std::ifstream file(path);
    int number = 0;
    for (std::string line; std::getline(file, line);) {
      ++number;
      for (const std::string& name : missing(line))
        FAIL_CHECK(fs::relative(path, source).string() << ":" << number << " cites " << name);
    }
  }
}

TEST_CASE("a citation of what is not there is found") {
  CHECK(missing("see docs/no_such_page.md").size() == 1);
  CHECK(missing("// lib/contact/problem.h says it, lib/contact/nothing.h does not") ==
        std::vector<std::string>{"lib/contact/nothing.h"});
  CHECK(missing("`bench_nothing` measures it").size() == 1);
  CHECK(missing("`contactbench frobnicate x`").size() == 1);
  CHECK(missing("`contactbench run x.xml`, `docs/architecture.md`, lib/methods/<name>.cpp").empty());
}
