// `completion` from outside: what a shell offers is what the program takes.

#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <sstream>

#include "program/program.h"

using namespace program;

namespace {

/// What bash completes the last of these words to.
std::set<std::string> completed(const fs::path& directory, const std::string& script, const std::string& words) {
  std::ofstream(directory / "ask.sh") << script << "\nCOMP_WORDS=(" << words
                                      << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_contactbench\n"
                                      << "printf '%s\\n' \"${COMPREPLY[@]}\" > said\n";
  const std::string command = "cd '" + directory.string() + "' && bash ask.sh";
  REQUIRE(std::system(command.c_str()) == 0);
  std::istringstream in(read_file(directory / "said"));
  std::set<std::string> out;
  for (std::string word; in >> word;) out.insert(word);
  return out;
}

/// Flags as --help lists them.
std::set<std::string> flags_of_help(const std::string& help) {
  std::set<std::string> flags;
  for (const std::string& line : lines(help)) {
    const std::size_t at = line.find("--");
    if (at == std::string::npos || line.find_first_not_of(' ') > 10 || at > 10) continue;
    flags.insert(line.substr(at, line.find_first_of(" ,=", at) - at));
  }
  return flags;
}

/// What zsh is offered at `place`, "command --flag".
std::set<std::string> offered(const std::string& script, const std::string& place) {
  const std::string before = "('" + place + "') all=(";
  const std::size_t at = script.find(before);
  REQUIRE(at != std::string::npos);
  const std::size_t from = at + before.size();
  std::istringstream in(script.substr(from, script.find(')', from) - from));
  std::set<std::string> out;
  for (std::string word; in >> word;) out.insert(word);
  return out;
}

std::set<std::string> names_listed(const fs::path& directory, const std::string& topic) {
  std::set<std::string> names;
  for (const Json& row : Json::parse(run(directory, {"list", topic, "--json"}).out)) names.insert(row["name"]);
  return names;
}

}  // namespace

TEST_CASE("bash completes to what the program has, and to nothing else", "[program]") {
  TemporaryDirectory directory;
  const std::string script = run(directory.path(), {"completion", "bash"}).out;
  for (const std::string command : {"run", "solve", "judge", "check", "list", "completion"}) {
    INFO(command);
    const std::set<std::string> flags = flags_of_help(run(directory.path(), {command, "--help"}).out);
    CHECK(flags.contains("--help"));
    CHECK(completed(directory.path(), script, "contactbench " + command + " --") == flags);
  }
  CHECK(completed(directory.path(), script, "contactbench ju") == std::set<std::string>{"judge"});
  std::set<std::string> methods = names_listed(directory.path(), "methods");
  methods.insert("external");
  CHECK(completed(directory.path(), script, "contactbench run x --method ''") == methods);
  CHECK(completed(directory.path(), script, "contactbench judge p a --law ''") ==
        names_listed(directory.path(), "laws"));
  CHECK(completed(directory.path(), script, "contactbench solve p --kind c") == std::set<std::string>{"contact"});
  CHECK(completed(directory.path(), script, "contactbench run sta").contains("stack.xml"));
  CHECK(completed(directory.path(), script, "contactbench completion z") == std::set<std::string>{"zsh"});
  CHECK(completed(directory.path(), script, "contactbench completion b") == std::set<std::string>{"bash"});
  CHECK(completed(directory.path(), script, "contactbench ''") ==
        std::set<std::string>{"run", "solve", "judge", "check", "list", "completion", "--help", "--version"});
  CHECK(completed(directory.path(), script, "contactbench run x --prune ''") ==
        std::set<std::string>{"on", "off", "rest"});
  CHECK(completed(directory.path(), script, "contactbench solve p --solver l") == std::set<std::string>{"lemke"});
  CHECK(completed(directory.path(), script, "contactbench solve p --solver n") ==
        std::set<std::string>{"newton", "nsgs"});
  CHECK(completed(directory.path(), script, "contactbench check x --variant s") ==
        std::set<std::string>{"stick-tested", "sap"});
  // Files of the directory come besides names of scenes, and not among flags.
  std::ofstream(directory.path() / "stays.xml") << "x";
  CHECK(completed(directory.path(), script, "contactbench run sta").contains("stays.xml"));
  CHECK(completed(directory.path(), script, "contactbench judge sta") == std::set<std::string>{"stays.xml"});
}

TEST_CASE("zsh is offered the same flags, in a script that it can read", "[program]") {
  TemporaryDirectory directory;
  const std::string script = run(directory.path(), {"completion", "zsh"}).out;
  for (const std::string& flag : flags_of_help(run(directory.path(), {"run", "--help"}).out))
    CHECK(script.find("'" + flag + ":") != std::string::npos);
  const std::string bash = run(directory.path(), {"completion", "bash"}).out;
  for (const std::string place :
       {"run --method", "run --solver", "run --variant", "judge --law", "solve --kind", "solve --method"}) {
    INFO(place);
    CHECK(offered(script, place) == completed(directory.path(), bash, "contactbench " + place + " ''"));
    CHECK(offered(script, place).size() > 1);
  }
  for (const std::string command : {"run", "solve", "judge", "check", "list", "completion"})
    CHECK(script.find("\n      '" + command + ":") != std::string::npos);
  const std::size_t scenes = script.find("[[ $PREFIX == -* ]] || compadd ");
  REQUIRE(scenes != std::string::npos);
  CHECK(script.substr(scenes, script.find('\n', scenes) - scenes).find(" stack.xml") != std::string::npos);
  std::ofstream(directory.path() / "_contactbench") << script;
  const std::string file = (directory.path() / "_contactbench").string();
  CHECK(std::system(("! command -v zsh >/dev/null || zsh -n '" + file + "'").c_str()) == 0);
  refused({"completion", "fish"}, {"bash or zsh"});
}

TEST_CASE("what is said of a flag is what each of the methods that have it says", "[program]") {
  const TemporaryDirectory directory;
  const std::string script = run(directory.path(), {"completion", "zsh"}).out;
  const std::size_t of_run = script.find("\n    (run)\n");
  REQUIRE(of_run != std::string::npos);
  std::map<std::string, int> methods_of;
  for (const Json& method : Json::parse(run(directory.path(), {"list", "methods", "--json"}).out))
    for (const Json& option : method["options"]) {
      const auto flag = option["flag"].get<std::string>();
      ++methods_of[flag];
      const std::size_t at = script.find("'--" + flag + ":", of_run);
      REQUIRE(at != std::string::npos);
      std::string said = method["name"].get<std::string>() + ": " + option["summary"].get<std::string>();
      for (std::size_t quote = said.find('\''); quote != std::string::npos; quote = said.find('\'', quote + 4))
        said.replace(quote, 1, "'\\''");
      INFO(flag << ": " << said);
      CHECK(script.substr(at, script.find('\n', at) - at).find(said) != std::string::npos);
    }
  CHECK(methods_of["warm-start"] > 1);
}
