// What: a program that is talked to through pipes, with a stop heard while it is waited for.
// Fails: the program cannot be started, ends, or stops reading: false, and ending() says how.
#include "methods/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <utility>

#include "linalg/stop.h"

namespace cb {

namespace {

constexpr int hear_within = 50;     // ms: how often a stop is looked for while nothing happens
constexpr int pipe_size = 1 << 20;  // bytes: a whole problem, so that neither side waits for the other in between
constexpr int leave_within = 1000;  // ms: a program whose input was closed may take for its end
constexpr std::size_t read_size = 1 << 16;

void close_fd(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

/// In the program's process, between fork and exec: nothing but system calls.
[[noreturn]] void become(const char* command, int in, int out) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_DFL);
  if (in < 0) in = open("/dev/null", O_RDONLY);
  dup2(in, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  execl("/bin/sh", "sh", "-c", command, static_cast<char*>(nullptr));
  _exit(127);
}

}  // namespace

ChildProcess::ChildProcess(const std::string& command, bool talk) : talk_(talk) {
  int input[2] = {-1, -1}, output[2] = {-1, -1};
  if (pipe2(output, O_CLOEXEC) != 0 || (talk && pipe2(input, O_CLOEXEC) != 0)) failure_ = errno;
  if (failure_ == 0) start(command, input, output);
  close_fd(input[0]);
  close_fd(output[1]);
  input_ = input[1];
  output_ = output[0];
  for (const int fd : {input_, output_}) {
    if (fd < 0) continue;
    fcntl(fd, F_SETFL, O_NONBLOCK);
    fcntl(fd, F_SETPIPE_SZ, pipe_size);  // refused: it takes more turns
  }
}

void ChildProcess::start(const std::string& command, const int* input, const int* output) {
  pid_ = fork();
  if (pid_ < 0) failure_ = errno;
  if (pid_ > 0) setpgid(pid_, pid_);  // whoever is first
  if (pid_ != 0) return;
  // Without talk the pipe stays open in the program, unused: it closes when the program ends.
  if (!talk_) fcntl(output[1], F_SETFD, 0);
  become(command.c_str(), input[0], talk_ ? output[1] : STDERR_FILENO);
}

ChildProcess::~ChildProcess() { reap(); }

// One turn: waits until the program takes or says something, and does that. False: neither will happen any more.
bool ChildProcess::exchange(std::string_view* out) {
  if (failure_ != 0 || output_ < 0) return false;
  pollfd fds[] = {{output_, POLLIN, 0}, {out && !out->empty() ? input_ : -1, POLLOUT, 0}};
  stuck_ = stop_asked.load(std::memory_order_relaxed);  // it has not answered, and will not leave by itself
  poll_stop();
  const int ready = poll(fds, 2, hear_within);
  if (ready < 0 && errno != EINTR) return false;
  if (ready <= 0) return true;
  if (fds[1].revents != 0) {
    const ssize_t written = ::write(input_, out->data(), out->size());
    if (written < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (written > 0) out->remove_prefix(static_cast<std::size_t>(written));
  }
  if (fds[0].revents != 0) {
    if (at_ == said_.size()) said_.clear(), at_ = 0;
    const std::size_t before = said_.size();
    said_.resize(before + read_size);
    const ssize_t got = ::read(output_, said_.data() + before, read_size);
    said_.resize(before + (got > 0 ? static_cast<std::size_t>(got) : 0));
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) close_fd(output_);
  }
  return true;
}

bool ChildProcess::send(std::string_view text) {
  while (!text.empty())
    if (!exchange(&text)) return false;
  return true;
}

bool ChildProcess::read_line(std::string& line) {
  std::size_t looked = at_;
  for (;;) {
    const std::size_t end = said_.find('\n', looked);
    if (end != std::string::npos) {
      line.assign(said_, at_, end - at_);
      at_ = end + 1;
      return true;
    }
    const std::size_t waiting = said_.size() - at_;
    if (waiting > longest_line || !exchange(nullptr)) return false;
    looked = at_ + waiting;
  }
}

bool ChildProcess::read_bytes(char* to, std::size_t size) {
  while (said_.size() - at_ < size)
    if (!exchange(nullptr)) return false;
  std::memcpy(to, said_.data() + at_, size);
  at_ += size;
  return true;
}

bool ChildProcess::wait() {
  while (exchange(nullptr)) {
  }
  reap();
  return failure_ == 0 && WIFEXITED(status_) && WEXITSTATUS(status_) == 0;
}

std::string ChildProcess::ending() {
  if (failure_ != 0) return std::string("could not be started: ") + std::strerror(failure_);
  reap();
  if (killed_) return "did not go on";
  if (WIFSIGNALED(status_))
    return "was killed by signal " + std::to_string(WTERMSIG(status_)) + " (" + strsignal(WTERMSIG(status_)) + ")";
  return "ended with exit code " + std::to_string(WEXITSTATUS(status_));
}

// Closes its input, by which it should end; ends it, with all that it started, where it does not.
void ChildProcess::reap() {
  close_fd(input_);
  if (pid_ <= 0) return close_fd(output_);
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::milliseconds(leave_within);
  bool ended = false;
  while (!stuck_ && !(ended = waitpid(pid_, &status_, WNOHANG) == pid_) && Clock::now() < until &&
         !stop_asked.load(std::memory_order_relaxed)) {
    char ignored[4096];
    pollfd fd = {output_, POLLIN, 0};
    if (poll(&fd, 1, 1) > 0 && ::read(output_, ignored, sizeof ignored) <= 0) usleep(200);
  }
  kill(-pid_, SIGKILL);
  killed_ = !ended;
  if (!ended)
    while (waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
    }
  pid_ = -1;
  close_fd(output_);
}

}  // namespace cb
