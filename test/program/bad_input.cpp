// Wrong flags and wrong files: one message that names the flag or the place and the fix, exit code 2, nothing written.

#include <catch2/catch.hpp>
#include <regex>
#include <set>
#include <tuple>

#include "program/program.h"

using namespace program;

namespace {

std::vector<std::string> run_with(const std::vector<std::string>& more, const std::string& method = "ap") {
  std::vector<std::string> arguments = {"run", "sticking_box.xml", "--method", method, "--duration", "0.01"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

TEST_CASE("a command that is missing or unknown is named", "[program]") {
  refused({}, {"command", "run", "check", "list"});
  refused({"rnu"}, {"rnu", "did you mean \"run\""});
  refused({"simulate"}, {"simulate", "run", "check", "list"});
  refused({""}, {"command"});
  refused({"--"}, {"contactbench: a command is missing: there are run, solve"});
}

TEST_CASE("a flag that does not exist is an error, flags to come included", "[program]") {
  refused(run_with({"--frobnicate"}), {"--frobnicate"});
  refused(run_with({"--frictoin", "0.5"}), {"--frictoin", "--friction"});
  refused(run_with({"--stepp=0.01"}), {"--stepp: no such flag; did you mean \"--step\""});
  refused(run_with({"--prune", "some"}), {"--prune", "on, off or rest"});
  refused(run_with({"--prune", "rest", "--accuracy", "1e-6"}), {"--prune rest", "--accuracy"});
  refused(run_with({"--prune", "rest", "--shuffle-contacts", "1"}), {"--prune rest", "--shuffle-contacts"});
  refused(run_with({"--warm-start", "some"}), {"--warm-start", "on or off"});
  refused({"--nonsense"}, {"--nonsense"});
  refused({"check", "sticking_box.xml", "--solver", "lemke"}, {"--solver"});
  refused({"list", "--quiet"}, {"--quiet"});
  refused(run_with({"stack.xml"}), {"stack.xml"});
}

TEST_CASE("what a run cannot do without is asked for", "[program]") {
  refused({"run", "sticking_box.xml"}, {"--method"});
  refused({"run", "--method", "ap"}, {"scenario"});
  refused(run_with({"--k"}), {"--k", "one value"});
  refused(run_with({"--k="}), {"--k", "one value"});
  refused(run_with({"--k", "8", "--k", "16"}), {"--k", "once"});
  refused({"list", "--json=maybe"}, {"contactbench list: ", "--json"});  // a switch is on or off
}

TEST_CASE("a name that is not in a table comes with the ones that are", "[program]") {
  refused({"run", "sticking_box.xml", "--method", "convx"}, {"--method", "convx", "did you mean \"convex\""});
  refused({"run", "sticking_box.xml", "--method", "magic"}, {"--method", "newton", "mirtich", "ap", "convex"});
  refused(run_with({"--solver", "lemka"}), {"--solver", "lemka", "did you mean \"lemke\""});
  refused(run_with({"--solver", "lemke"}, "convex"), {"--solver", "lemke", "ipm"});
  refused(run_with({"--solver", "lemke"}, "newton"), {"--solver", "newton"});
  refused(run_with({"--variant", "uncaped"}, "newton"), {"--variant", "did you mean \"uncapped\""});
  refused(run_with({"--variant", "uncapped"}), {"--variant", "ap"});
  for (const char* factor : {"0", "2"})
    refused(run_with({"--relaxation", factor}, "coulomb"), {"--relaxation", factor, "less than 2"});
  refused({"list", "method"}, {"method", "did you mean \"methods\""});
  refused({"list", "weather"}, {"weather", "statuses"});
  refused({"check", "sticking_box.xml", "--method", "app"}, {"--method", "app"});
}

TEST_CASE("a misspelt flag is named, also where it leaves one that is needed missing", "[program]") {
  refused({"run", "sticking_box.xml", "--methd", "ap"}, {"--methd", "did you mean \"--method\""});
  refused({"run", "--methd", "ap", "sticking_box.xml"}, {"--methd", "did you mean \"--method\""});
  refused({"run", "sticking_box.xml", "--method", "ap", "--warm-start", "--duration", "1"},
          {"--warm-start: its value is missing before --duration"});
  refused(run_with({"--frobnicate", "--json"}), {"--frobnicate: no such flag"});
  // What is no flag is a value, though it begins as one.
  refused(run_with({"--friction", "--0.5"}), {"--friction --0.5: must be a coefficient"});
  refused(run_with({"--friction", ""}), {"--friction '': must be a coefficient"});
  refused({"run", "sticking_box.xml"}, {"--method is required"});
}

TEST_CASE("a flag that the method has no use for says so", "[program]") {
  refused(run_with({"--k", "8"}, "convex"), {"--k", "convex", "ap"});
  refused(run_with({"--k", "8"}, "newton"), {"--k", "newton"});
  refused(run_with({"--epsilon", "1e-6"}), {"--epsilon", "convex"});
  refused(run_with({"--epsilon-relative", "1e-6"}), {"--epsilon-relative", "convex"});
  refused(run_with({"--compression-bound", "on"}), {"--compression-bound", "convex"});
  refused(run_with({"--regularise", "1e-9"}, "convex"), {"--regularise", "ap"});
}

TEST_CASE("a friction polygon has an even number of edges, at least four", "[program]") {
  for (const char* k : {"0", "2", "3", "5", "7", "-4", "8.5", "eight", "nan", "1e1", "4x", "99999999999999999999"})
    refused(run_with({std::string("--k=") + k}), {"--k", "even"});
  refused(run_with({"--k=1048578"}), {"--k 1048578", "even"});  // 2^20 and 2
}

TEST_CASE("steps, durations and limits are positive finite numbers", "[program]") {
  for (const char* value : {"0", "-1", "nan", "inf", "-inf", "1e999", "one", "0x10", "1,5", "1e-3s"}) {
    refused({"run", "sticking_box.xml", "--method", "ap", std::string("--step=") + value}, {"--step", "positive"});
    refused({"run", "sticking_box.xml", "--method", "ap", std::string("--duration=") + value},
            {"--duration", "positive"});
  }
  refused(run_with({"--time-limit", "0"}), {"--time-limit", "positive"});
  refused(run_with({"--time-limit", "-5"}), {"--time-limit", "positive"});
  refused(run_with({"--memory-limit", "0"}), {"--memory-limit", "positive"});
  refused(run_with({"--step", "1e-300"}), {"--step", "longer step"});
  refused(run_with({"--step", "1e-12"}), {"--step 1e-12", "1e+10 steps", "--duration", "--time-limit"});
  refused(run_with({"--step", "1e-15", "--time-limit", "1"}), {"--step 1e-15", "1e+13 steps", "longer step"});
  refused({"run", "stack.xml", "--method", "ap", "--step", "0.002", "--duration", "0.001"},
          {"--step 0.002", "longer than the run", "0.001 s"});
  refused(run_with({"--step", "1e300"}), {"--step 1e+300", "longer than the run"});
  refused(run_with({"--record-every", "-1"}), {"--record-every"});
  refused(run_with({"--record-every", "0.5"}), {"--record-every"});
  refused(run_with({"--jobs", "0"}), {"--jobs 0", "at least 1"});
  refused(run_with({"--jobs", "1025"}), {"--jobs 1025", "a number of cores"});
  refused(run_with({"--law", "coulomb", "--command", "true", "--jobs", "2"}, "external"), {"--jobs 2", "external"});
}

TEST_CASE("a remedy is one that the command takes: check has no program to ask", "[program]") {
  refused({"check", "stack", "--method", "external"}, {"--method external", "own methods; leave it out"});
}

TEST_CASE("physical numbers stay in their range", "[program]") {
  for (const char* value : {"-0.1", "1.1", "nan", "two"})
    refused(run_with({std::string("--restitution=") + value}), {"--restitution", "from 0 to 1"});
  refused(run_with({"--restitution", "-0.5"}), {"--restitution", "-0.5"});  // a value, not another flag
  for (const char* value : {"-0.1", "nan", "inf", "mu"})
    refused(run_with({std::string("--friction=") + value}), {"--friction"});
  for (const char* value : {"-1e-12", "0", "nan", "small"})
    refused(run_with({std::string("--epsilon=") + value}, "convex"), {"--epsilon", "positive"});
  refused(run_with({"--epsilon", "1e-6", "--epsilon-relative", "1e-6"}, "convex"),
          {"--epsilon", "--epsilon-relative", "one of them"});
  refused(run_with({"--compression-bound", "yes"}, "convex"), {"--compression-bound", "on or off"});
  refused(run_with({"--regularise", "-1"}), {"--regularise"});
}

TEST_CASE("a parameter must be one that the scenario declares", "[program]") {
  refused(run_with({"--set", "boxes=2"}), {"boxes"});
  refused(run_with({"--set", "boxes"}), {"--set", "NAME=VALUE"});
  refused(run_with({"--set", "=2"}), {"--set", "NAME=VALUE"});
  refused(run_with({"--set", "mu="}), {"--set mu=: must be NAME=VALUE"});
  refused(run_with({"--set", "mu=0.5", "--set", "mu=0.6"}), {"--set", "mu", "twice"});
  refused({"run", "stack.xml", "--method", "ap", "--set", "boxes=-3"}, {"boxes"});
  refused({"check", "stack.xml", "--set", "boxes=none"}, {"boxes"});
}

TEST_CASE("a scenario that is not there is told from those that are", "[program]") {
  refused({"run", "stickin_box.xml", "--method", "ap"}, {"stickin_box.xml", "sticking_box"});
  refused({"check", "/nowhere/at/all.xml"}, {"/nowhere/at/all.xml"});
  refused({"check", "."}, {"."});
}

TEST_CASE("a folder that cannot be written is refused before anything runs", "[program]") {
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "file") << "in the way";
  for (const std::string out : {"file", "file/below", "/proc/nowhere/run"}) {
    const Result result = run(directory.path(), run_with({"--out", out}));
    INFO(result.err);
    CHECK(result.code == 2);
    CHECK(lines(result.err).size() == 1);
    CHECK(result.err.find("--out") != std::string::npos);
    CHECK(result.err.find(out) != std::string::npos);
  }
  CHECK(content(directory.path()) == std::vector<std::string>{"file"});
  CHECK(read_file(directory.path() / "file") == "in the way");

  // One of the files is in the way of a folder.
  fs::create_directories(directory.path() / "run" / "trajectory.csv");
  const Result result = run(directory.path(), run_with({"--out", "run"}));
  CHECK(result.code == 2);
  CHECK(result.err.find("trajectory.csv") != std::string::npos);
  CHECK_FALSE(fs::exists(directory.path() / "run" / "summary.json"));
  refused(run_with({"--out", ""}), {"--out"});
}

TEST_CASE("each broken scenario gives one message with file and line", "[program]") {
  const std::regex place(R"(\.xml:\d+:\d+: .+)");
  std::set<std::string> messages;
  int files = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(TEST_DATA) / "broken")) {
    if (entry.path().extension() != ".xml") continue;
    ++files;
    TemporaryDirectory directory;
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"check", entry.path().string()},
          std::vector<std::string>{"run", entry.path().string(), "--method", "ap"}}) {
      const Result result = run(directory.path(), arguments);
      INFO(entry.path() << ": " << result.err);
      CHECK(result.code == 2);
      CHECK(result.out.empty());
      CHECK(lines(result.err).size() == 1);
      CHECK(std::regex_search(result.err, place));
      CHECK(content(directory.path()).empty());
      messages.insert(result.err.substr(result.err.find(".xml:")));
    }
  }
  CHECK(files >= 20);
  CHECK(messages.size() >= 20);
}

TEST_CASE("flags of an engine, or of a method, are refused beside the other", "[program]") {
  refused(run_with({"--setting", "tuned"}), {"--setting tuned", "--engine"});
  refused(run_with({"--knob", "a=1"}), {"--knob a=1", "--engine"});
  refused({"check", "stack.xml", "--variant", "si10"}, {"--variant", "--engine"});
  refused({"check", "stack.xml", "--setting", "tuned"}, {"--setting: belongs to --engine"});
  refused({"check", "stack.xml", "--step", "1e-3"}, {"--step: belongs to --engine"});
  refused({"check", "stack.xml", "--engine", "ode"}, {"stack.xml: --engine ode is checked without a scene"});
  for (const std::vector<std::string>& of_scene :
       {std::vector<std::string>{"--method", "ap"}, {"--steps", "3"}, {"--set", "n=1"}, {"--files"}}) {
    std::vector<std::string> words = {"check", "--engine", "ode"};
    words.insert(words.end(), of_scene.begin(), of_scene.end());
    refused(words, {of_scene[0], "scene"});
  }
  const std::vector<std::string> by_engine = {"run", "sticking_box.xml", "--engine", "ode"};
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--joint-forces", "implicit"},
                                               {"--record-contacts"},
                                               {"--jobs", "2"},
                                               {"--seed", "3"}}) {
    std::vector<std::string> words = by_engine;
    words.insert(words.end(), more.begin(), more.end());
    refused(words, {more[0]});
  }
}

TEST_CASE("a scene's reference is one that there is, its files are files, its places finite", "[program]") {
  const TemporaryDirectory directory;
  const auto scene = [&](const std::string& reference, const std::string& array, const std::string& robot) {
    std::ofstream(directory.path() / "s.xml") << R"(<?xml version="1.0"?>
<scenario title="t">
  <simulation step="1e-3" duration="0.01"/>
  )" << reference << R"(
  <gravity constant="0 -9.8 0"/>
  <bodies>
    <half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <array count="3" offset=")" << array << R"( 0 0">
      <sphere name="ball" radius="1" mass="1" position="1e308 1 0"/>
    </array>
    )" << robot << R"(
  </bodies>
  <contacts>
    <pair a="*" b="ground" mu="0.5"/>
  </contacts>
</scenario>
)";
    return (directory.path() / "s.xml").string();
  };
  const std::string none = "<reference kind=\"missing\"/>";
  const std::string misspelt = scene("<reference kind=\"analytic\" name=\"slidng_box\"/>", "1", "");
  for (const std::vector<std::string>& words : {std::vector<std::string>{"check", misspelt},
                                                {"run", misspelt, "--method", "ap"},
                                                {"run", misspelt, "--engine", "ode"}})
    refused(words, {"s.xml:4:", "slidng_box", "did you mean \"sliding_box\""});
  refused({"check", scene(none, "1e308", "")}, {"s.xml:9:", "ball_2", "not finite"});
  const std::string robots = "<robot name=\"r\" urdf=\"" + std::string(300, 'x') + "\"/>";
  refused({"check", scene(none, "1", robots)}, {"s.xml:11:", "there is no file"});
}

TEST_CASE("no flag of methods is taken for an engine's run, and its numbers stay in their range, too", "[program]") {
  const auto by_engine = [](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run", "sticking_box.xml", "--engine", "ode"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  for (const std::vector<std::string>& of_methods : {std::vector<std::string>{"--solver", "lemke"},
                                                     {"--prune", "on"},
                                                     {"--shuffle-contacts", "1"},
                                                     {"--order", "2"},
                                                     {"--gyroscopic", "implicit"},
                                                     {"--stepping", "events"},
                                                     {"--accuracy", "1e-6"},
                                                     {"--conditioning"},
                                                     {"--record-interval", "0.1"},
                                                     {"--format", "csv"},
                                                     {"--joint-forces", "explicit"},
                                                     {"--record-contacts"},
                                                     {"--jobs", "2"}})
    refused(by_engine(of_methods), {of_methods[0] + ": belongs to methods"});
  for (const auto& [flag, value, expected] :
       {std::tuple("--friction", "-0.1", "at least 0"), std::tuple("--restitution", "1.1", "from 0 to 1"),
        std::tuple("--restitution", "-0.1", "from 0 to 1"), std::tuple("--record-every", "-1", "a whole number of"),
        std::tuple("--perturb", "-1", "a length in m of at least 0"), std::tuple("--time-limit", "0", "positive"),
        std::tuple("--memory-limit", "0", "positive number of MB"), std::tuple("--step", "0", "positive"),
        std::tuple("--duration", "0", "positive"), std::tuple("--save-every", "2", "give that too"),
        std::tuple("--seed", "3", "belongs to --perturb"), std::tuple("--out", "", "must name a directory")})
    refused(by_engine({flag, value}), {flag, expected});
  refused(by_engine({"--perturb", "1", "--seed", "-1"}), {"--seed -1", "at least 0"});
}

TEST_CASE("what belongs to another flag is refused without it, and a switch has its own words", "[program]") {
  refused(run_with({"--seed", "3"}), {"--seed 3: belongs to --perturb"});
  refused(run_with({"--perturb", "-1"}), {"--perturb -1", "a length in m of at least 0"});
  refused(run_with({"--perturb", "1", "--seed", "-1"}), {"--seed -1", "at least 0"});
  refused(run_with({"--shuffle-contacts", "-1"}), {"--shuffle-contacts -1", "at least 0"});
  refused(run_with({"--gyroscopic", "on"}), {"--gyroscopic on: must be implicit or explicit"});
  refused(run_with({"--joint-forces", "on"}), {"--joint-forces on: must be implicit or explicit"});
  for (const char* order : {"1", "9"})
    refused(run_with({"--accuracy", "1e-6", "--order", order}), {"--order", order, "from 2 to 8"});
  refused(run_with({"--accuracy", "1e-6", "--record-interval", "0"}), {"--record-interval 0", "positive"});
  refused(run_with({"--record-contacts", "--record-every", "0"}), {"--record-every 0 keeps no steps; leave one out"});
  refused(run_with({"--impedance", "0.5"}, "soft"), {"--impedance: of soft, only --variant mujoco has a use for it"});
  refused({"check"}, {"scenario is required"});
  refused({"check", "stack.xml", "--steps", "3"}, {"--steps 3: says how long --method METHOD is tried"});
  refused({"check", "stack.xml", "--method", "ap", "--steps", "-1"}, {"--steps -1", "a whole number of steps"});
}
