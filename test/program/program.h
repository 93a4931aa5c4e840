#pragma once

// The real program as a black box: started as a user starts it, judged by what it prints, returns and leaves behind.

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "temporary.h"

namespace program {

using Json = nlohmann::json;
namespace fs = std::filesystem;

struct Result {
  int code = -1;  ///< exit code; -signal where a signal killed it
  std::string out, err;
};

/// A started program; its output goes to files in `directory`, which is also where it runs.
class Process {
 public:
  Process(const fs::path& directory, const std::vector<std::string>& arguments,
          const std::function<void()>& in_child = {})
      : out_(directory / ".out"), err_(directory / ".err") {
    std::vector<std::string> words = {PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ != 0) return;
    if (chdir(directory.c_str()) != 0) _exit(99);
    dup2(open("/dev/null", O_RDONLY), 0);
    dup2(open(out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), 1);
    dup2(open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), 2);
    if (in_child) in_child();
    execv(PROGRAM, argv.data());
    _exit(98);
  }
  ~Process() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal) const { kill(child_, signal); }

  Result wait() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = 0;
    Result result;
    result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    result.out = read_file(out_);
    result.err = read_file(err_);
    fs::remove(out_);
    fs::remove(err_);
    return result;
  }

 private:
  fs::path out_, err_;
  pid_t child_ = 0;
};

inline Result run(const fs::path& directory, const std::vector<std::string>& arguments,
                  const std::function<void()>& in_child = {}) {
  return Process(directory, arguments, in_child).wait();
}

/// Waits until `done` holds; false after a time in which it should long have.
inline bool wait_until(const std::function<bool()>& done) {
  for (int i = 0; i < 6000; ++i) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

inline std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = text.find('\n', at);
    out.push_back(text.substr(at, end - at));
    if (end == std::string::npos) break;
    at = end + 1;
  }
  return out;
}

inline std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out(1);
  for (const char c : line) {
    if (c == ',')
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

/// Of a vector that the program wrote.
inline std::vector<double> numbers_of(const fs::path& matrix_market) {
  std::istringstream in(read_file(matrix_market));
  std::string banner;
  std::getline(in, banner);
  std::size_t rows = 0, columns = 0;
  in >> rows >> columns;
  std::vector<double> x(rows);
  for (double& value : x) in >> value;
  return x;
}

/// Has the process whose id is in the file come to its end, whether anybody has waited for it or not?
inline bool has_ended(const fs::path& file) {
  const int pid = std::atoi(read_file(file).c_str());
  REQUIRE(pid > 1);
  const std::string stat = read_file("/proc/" + std::to_string(pid) + "/stat");
  const std::size_t name = stat.rfind(')');
  return name == std::string::npos || stat.substr(name).starts_with(") Z");
}

inline Json summary(const fs::path& directory) { return Json::parse(read_file(directory / "summary.json")); }

/// Files and folders below a directory, leaving out what Process puts there.
inline std::vector<std::string> content(const fs::path& directory) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(directory))
    names.push_back(fs::relative(entry.path(), directory).string());
  return names;
}

/// Runs in an empty directory; demands exit code 2, one line on standard error that holds all `parts`, nothing on
/// standard output and nothing written.
inline void refused(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), arguments);
  std::string command;
  for (const std::string& argument : arguments) command += argument + ' ';
  INFO(command << "-> " << result.err);
  CHECK(result.code == 2);
  CHECK(result.out.empty());
  CHECK(lines(result.err).size() == 1);
  for (const std::string& part : parts) CHECK(result.err.find(part) != std::string::npos);
  CHECK(content(directory.path()).empty());
}

}  // namespace program
