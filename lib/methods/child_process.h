#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

namespace cb {

/// Another program, started by `sh -c` in a process group of its own, so that Ctrl-C at the terminal ends us and we end
/// it. It lives no longer than this object, and is waited for: no zombie, whatever becomes of it. What it prints on
/// standard error goes where ours goes. Waiting hears a stop (throws Stopped).
class ChildProcess {
 public:
  /// `talk`: its standard input and output are ours to write and read; else it reads nothing, and what it prints goes
  /// to our standard error.
  ChildProcess(const std::string& command, bool talk);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Writes all of it, taking in what the program says meanwhile. False where it no longer reads.
  bool send(std::string_view text);
  /// The next line, without its end. False where the program ended before it, or a line is longer than `longest_line`.
  bool read_line(std::string& line);
  /// The next `size` bytes. False where the program ended before them.
  bool read_bytes(char* to, std::size_t size);
  /// Waits for its end. True: exit code 0.
  bool wait();
  /// How it ended, as a sentence goes on: "ended with exit code 1", "was killed by signal 11 (Segmentation fault)".
  /// Ends it where it still runs.
  std::string ending();

  static constexpr std::size_t longest_line = 1 << 26;

 private:
  void start(const std::string& command, const int* input, const int* output);
  bool exchange(std::string_view* out);
  void reap();

  pid_t pid_ = -1;
  int input_ = -1, output_ = -1;  // the program's standard input, and its output or what tells its end
  int failure_ = 0;               // errno of why it was not started
  bool talk_, stuck_ = false, killed_ = false;
  int status_ = 0;      // of waitpid
  std::string said_;    // by the program, not yet read
  std::size_t at_ = 0;  // how much of that is
};

}  // namespace cb
