#include "engines.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "limits.h"
#include "linalg/stop.h"
#include "scenario/scenario.h"

namespace cb {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
constexpr std::string_view prefix = "contactbench-engine-";

/// Where programs of engines are looked for, the first that has one counts.
std::vector<fs::path> engine_folders() {
  std::vector<fs::path> folders;
  if (const char* mine = std::getenv("CONTACTBENCH_ENGINES"); mine != nullptr && *mine != 0) folders.emplace_back(mine);
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return folders;
  folders.push_back(program.parent_path());
  folders.push_back(program.parent_path().parent_path() / "libexec" / "contactbench");
  return folders;
}

/// A file descriptor that closes itself.
struct File {
  int number = -1;
  File() = default;
  explicit File(int of) : number(of) {}
  File(File&& other) noexcept : number(std::exchange(other.number, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(number, other.number);
    return *this;
  }
  ~File() { close(); }
  void close() {
    if (number >= 0) ::close(std::exchange(number, -1));
  }
};

/// Both ends of a pipe, out of the way of the numbers that a child gets.
struct Pipe {
  File read, write;
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return;
    constexpr int high = 10;
    for (int& end : ends) {
      const int moved = fcntl(end, F_DUPFD_CLOEXEC, high);
      ::close(end);
      end = moved;
    }
    read = File(ends[0]);
    write = File(ends[1]);
  }
};

/// In the child: becomes the program.
[[noreturn]] void become(const fs::path& program, std::vector<char*> argv, int answer, int errors, int page,
                         std::optional<double> memory_mb) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  setpgid(0, 0);
  const int nothing = open("/dev/null", O_RDWR);
  dup2(nothing, STDIN_FILENO);
  dup2(nothing, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  dup2(answer, result_file);
  if (page >= 0) dup2(page, pulse_file);
  for (const int signal : {SIGPIPE, SIGXFSZ, SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
  if (memory_mb) {
    const rlim_t bytes = bytes_of(*memory_mb);
    const rlimit limit = {bytes, bytes};
    setrlimit(RLIMIT_DATA, &limit);
  }
  const rlimit none = {0, 0};
  setrlimit(RLIMIT_CORE, &none);
  execv(program.c_str(), argv.data());
  _exit(127);
}

/// Appends what can be read; false at the end of the file.
bool drain(File& file, std::string& text) {
  char buffer[4096];
  const ssize_t got = read(file.number, buffer, sizeof buffer);
  if (got > 0) text.append(buffer, static_cast<std::size_t>(got));
  if (got == 0 || (got < 0 && errno != EINTR)) file.close();
  return file.number >= 0;
}

std::string last_line(std::string text) {
  constexpr std::size_t longest = 300;
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  if (const std::size_t end = text.rfind('\n'); end != std::string::npos) text.erase(0, end + 1);
  return text.substr(0, longest);
}

}  // namespace

const std::vector<EngineRow>& engine_rows() {
  static const std::vector<EngineRow> rows = {
      {"ode", "Open Dynamics Engine", "libode-dev"},
      {"bullet", "Bullet, double precision", "libbullet-dev"},
      {"bullet-float", "Bullet, single precision", "libbullet-dev"},
      {"mujoco", "MuJoCo", "libmujoco-dev"},
      {"dart", "Dynamic Animation and Robotics Toolkit", "libdart-dev"},
      {"simbody", "Simbody", "libsimbody-dev"},
      {"siconos", "Siconos, its own time stepping", "libsiconos-mechanics-dev"},
  };
  return rows;
}

std::vector<std::string> engine_names() {
  std::vector<std::string> names;
  for (const EngineRow& row : engine_rows()) names.emplace_back(row.name);
  std::vector<std::string> more;
  for (const fs::path& folder : engine_folders()) {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      const std::string file = entry->path().filename().string();
      if (!file.starts_with(prefix) || access(entry->path().c_str(), X_OK) != 0) continue;
      const std::string name = file.substr(prefix.size());
      if (std::find(names.begin(), names.end(), name) == names.end()) more.push_back(name);
    }
  }
  std::sort(more.begin(), more.end());
  more.erase(std::unique(more.begin(), more.end()), more.end());
  names.insert(names.end(), more.begin(), more.end());
  return names;
}

fs::path engine_program(std::string_view name) {
  for (const fs::path& folder : engine_folders()) {
    const fs::path program = fs::absolute(folder / (std::string(prefix) + std::string(name)));
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

std::string engine_missing(std::string_view name) {
  for (const EngineRow& row : engine_rows())
    if (row.name == name)
      return fmt::format(
          "this build has no program of the engine {}: install {} and build again (scripts/setup.sh --engines)", name,
          row.package);
  return fmt::format("there is no program of the engine {}", name);
}

nlohmann::json describe_engine(const fs::path& program, std::string& fault) {
  constexpr double patience = 20;  // s; it reads nothing and prints
  const Ended ended = run_program(program, {"--describe"}, patience, {});
  nlohmann::json said = nlohmann::json::parse(ended.answer, nullptr, false);
  const auto is_variant = [](const nlohmann::json& row) {
    if (!row.is_object() || !row.contains("name") || !row["name"].is_string() || !row.contains("knobs")) return false;
    return row["knobs"].is_object() && std::ranges::all_of(row["knobs"], [](const auto& x) { return x.is_number(); });
  };
  const auto word = [&](const char* key) { return !said.contains(key) || said[key].is_string(); };
  if (ended.code == 0 && said.is_object() && said.contains("variants") && said.contains("knobs") &&
      said["variants"].is_array() && !said["variants"].empty() && std::ranges::all_of(said["variants"], is_variant) &&
      word("version") && word("precision") && word("package"))
    return said;
  fault = fmt::format("{} does not say what it is{}{}", program.filename().string(),
                      ended.last_words.empty() ? "" : ": ", ended.last_words);
  return {};
}

nlohmann::json tuned_knobs(std::string_view engine, std::string_view variant) {
  const std::vector<std::string> scenes = bundled_scenarios();
  if (scenes.empty()) return {};
  std::ifstream file(fs::path(scenes.front()).parent_path() / "engines" / "tuned.json");
  const nlohmann::json all = nlohmann::json::parse(file, nullptr, false);
  const std::string key = fmt::format("{}/{}", engine, variant);
  if (!all.is_object() || !all.contains(key)) return {};
  return all[key].value("knobs", nlohmann::json());
}

Ended run_program(const fs::path& program, const std::vector<std::string>& arguments, std::optional<double> time_s,
                  std::optional<double> memory_mb) {
  std::vector<std::string> words = {program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  Pipe answer, errors;
  File page(memfd_create("pulse", MFD_CLOEXEC));
  void* memory = MAP_FAILED;
  if (page.number >= 0 && ftruncate(page.number, sizeof(Pulse)) == 0)
    memory = mmap(nullptr, sizeof(Pulse), PROT_READ | PROT_WRITE, MAP_SHARED, page.number, 0);
  page = File(fcntl(page.number, F_DUPFD_CLOEXEC, 10));

  Ended ended;
  const Clock::time_point start = Clock::now();
  const pid_t child = fork();
  if (child < 0) {
    ended.code = 127;
    ended.last_words = fmt::format("cannot be started: {}", std::strerror(errno));
    return ended;
  }
  if (child == 0) become(program, argv, answer.write.number, errors.write.number, page.number, memory_mb);
  answer.write.close();
  errors.write.close();

  constexpr double grace = 1;  // s, for a step that is under way and for the files
  std::string said;
  int status = 0;
  rusage usage = {};
  for (;;) {
    pollfd files[2] = {{answer.read.number, POLLIN, 0}, {errors.read.number, POLLIN, 0}};
    const int slice = answer.read.number < 0 && errors.read.number < 0 ? 1 : 50;  // ms; none is left: it is ending
    poll(files, 2, slice);
    if (files[0].revents != 0) drain(answer.read, ended.answer);
    if (files[1].revents != 0) drain(errors.read, said);
    const double waited = std::chrono::duration<double>(Clock::now() - start).count();
    const bool stop = stop_asked.load(std::memory_order_relaxed);
    if (stop && !ended.interrupted) {
      ended.interrupted = true;
      kill(child, SIGTERM);
      time_s = waited;
    }
    if (time_s && waited > *time_s + grace) {
      ended.overdue = true;
      kill(-child, SIGKILL);
      kill(child, SIGKILL);
    }
    siginfo_t gone = {};
    if (waitid(P_PID, static_cast<id_t>(child), &gone, WEXITED | WNOHANG | WNOWAIT) == 0 && gone.si_pid == 0) continue;
    kill(-child, SIGKILL);  // what it left running holds the pipes open, and would be waited for
    wait4(child, &status, 0, &usage);
    while (answer.read.number >= 0 && drain(answer.read, ended.answer)) {
    }
    while (errors.read.number >= 0 && drain(errors.read, said)) {
    }
    break;
  }
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  ended.peak_memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  ended.last_words = last_line(said);
  if (memory != MAP_FAILED) {
    ended.pulse = *static_cast<const Pulse*>(memory);
    munmap(memory, sizeof(Pulse));
  }
  return ended;
}

}  // namespace cb
