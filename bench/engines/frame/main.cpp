#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "run.h"

namespace cb {

namespace {

using Json = nlohmann::json;

/// The parent's page; one of our own where there is none.
Pulse& shared_pulse() {
  void* page = mmap(nullptr, sizeof(Pulse), PROT_READ | PROT_WRITE, MAP_SHARED, pulse_file, 0);
  static Pulse own;
  return page == MAP_FAILED ? own : *static_cast<Pulse*>(page);
}

/// To the parent, or to standard output where there is none.
int answer(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  const char* at = text.data();
  std::size_t left = text.size();
  while (left > 0) {
    const ssize_t written = write(result_file, at, left);
    if (written <= 0) return std::fputs(at, stdout) >= 0 ? 0 : 1;
    at += written;
    left -= static_cast<std::size_t>(written);
  }
  return 0;
}

}  // namespace

int engine_main(const Engine& engine, int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  try {
    if (what == "--describe") return answer(describe(engine));
    if (argc == 3 && what == "--run")
      return answer(run_scene(engine, Json::parse(argv[2]).get<EngineRequest>(), shared_pulse()));
    if (argc == 3 && what == "--preflight") return answer(preflight(engine, Json::parse(argv[2]).get<EngineRequest>()));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", engine.name.c_str(), error.what());
    return 1;
  }
  std::fprintf(stderr,
               "The engine %s for contactbench, which starts it: contactbench run SCENE --engine %s\n"
               "  --describe | --run REQUEST | --preflight REQUEST   (JSON; lib/output/engine_request.h)\n",
               engine.name.c_str(), engine.name.c_str());
  return 2;
}

}  // namespace cb
