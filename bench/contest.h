#pragma once
// Solvers that take turns at one problem, ours and others', each in a process of its own: a crash or an endless loop of
// one is a line of the table. Times are of the solve alone, by the clock. On a machine that does something else too,
// the minimum is the figure to compare. Whatever a solver claims, `judge` computes the residual from the original data.

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

namespace cb {

struct Limits {
  double solve_s = 10;       ///< CPU time of one solve; beyond: killed
  double batch_s = 2e-4;     ///< a sample is the mean of as many solves as fit in this time
  double turn_s = 0.05;      ///< a turn of a solver ends after this time
  int samples = 15;          ///< samples of one turn, at most
  int rounds = 3;            ///< turns of each solver
  double solves_lcp = 1e-8;  ///< natural residual up to which an answer counts
  double solves_law = 1e-7;  ///< the same for the residual of Coulomb's law
};

/// What comes back from the process of a solver.
struct Report {
  bool finished;
  bool claims;      ///< does the solver say that it solved the problem?
  char status[40];  ///< in its own words
  double asked;     ///< the tolerance that it was asked for, where it was; else 0
  int iterations;
  double residual;
  int samples;
  double time[64];  ///< s
};

/// One solver on one problem. `solve` repeats the solve from scratch; `judge` then fills in claim and residual.
struct Contestant {
  std::string name;
  std::function<void()> solve;
  std::function<void(Report&)> judge;
  double target_s = 0;                  ///< 0: none
  double accepted = 1e-8;               ///< residual up to which an answer counts
  std::function<void()> prepare = {};   ///< before each solve, by no clock; may be empty
  std::function<bool()> stricter = {};  ///< asks for ten times more after an answer that does not count; false: no more
};

struct Line {
  bool ran = false, ended = true;  // ended: by itself
  std::string ending;
  Report report{};
  std::vector<double> times;
};

inline double read_clock(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Does the clock of CPU time go in fine steps? On some systems they are of milliseconds.
inline bool fine_cpu_clock() {
  static const bool fine = [] {
    const double start = read_clock(CLOCK_PROCESS_CPUTIME_ID);
    double next = start;
    while (next == start) next = read_clock(CLOCK_PROCESS_CPUTIME_ID);
    return next - start < 1e-5;
  }();
  return fine;
}

/// CPU time where its clock is fine, so that what else the machine does is not counted; else by the wall clock.
inline double now_s() { return read_clock(fine_cpu_clock() ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC); }

inline void set_status(Report& report, const std::string& words) {
  std::snprintf(report.status, sizeof report.status, "%s", words.c_str());
}

/// Ends this process after so many seconds of CPU time, or six times as many by the clock.
inline void arm(double seconds) {
  const auto whole = static_cast<time_t>(seconds);
  const itimerval timer{{0, 0}, {whole, static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(whole)))}};
  setitimer(ITIMER_PROF, &timer, nullptr);
  alarm(static_cast<unsigned>(6 * seconds) + 1);
}

/// Seconds of `count` solves, what prepares them not counted.
inline double time_solves(const Contestant& contestant, int count) {
  if (!contestant.prepare) {
    const double start = now_s();
    for (int i = 0; i < count; ++i) contestant.solve();
    return now_s() - start;
  }
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    contestant.prepare();
    const double start = now_s();
    contestant.solve();
    sum += now_s() - start;
  }
  return sum;
}

inline void measure(const Contestant& contestant, const Limits& limits, Report& report) {
  arm(limits.solve_s);
  double first = time_solves(contestant, 1);
  // One that can be asked for more is, until its answer counts.
  for (contestant.judge(report); contestant.stricter && !(report.residual <= contestant.accepted);
       contestant.judge(report)) {
    arm(limits.solve_s);
    if (!contestant.stricter()) break;
    first = time_solves(contestant, 1);
  }
  // The first solve allocates and meets cold caches; it counts only where there is no time for another.
  if (first > 10 * limits.turn_s) {
    report.time[report.samples++] = first;
  } else {
    arm(limits.solve_s);
    const double second = time_solves(contestant, 1);
    const int batch = std::clamp(static_cast<int>(limits.batch_s / std::max(second, 1e-7)), 1, 1000);
    for (double spent = 0; report.samples < limits.samples && spent < limits.turn_s;) {
      arm(limits.solve_s);
      const double time = time_solves(contestant, batch);
      report.time[report.samples++] = time / batch;
      spent += time;
    }
  }
  arm(limits.solve_s);
  contestant.judge(report);
  report.finished = true;
}

/// A turn of one solver in a process of its own; `shared` is memory that both processes see.
inline void turn(const Contestant& contestant, const Limits& limits, Report* shared, Line& line) {
  *shared = Report{};
  std::fflush(stdout);
  const pid_t child = fork();
  if (child < 0) {
    line.ended = false;
    line.ending = "no process";
    return;
  }
  if (child == 0) {
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, 1);
    dup2(null, 2);
    measure(contestant, limits, *shared);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  line.ran = true;
  if (shared->finished) {
    line.report = *shared;
    line.times.insert(line.times.end(), shared->time, shared->time + shared->samples);
    return;
  }
  line.ended = false;
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  line.ending = signal == SIGPROF || signal == SIGALRM ? "time limit"
                : signal != 0                          ? std::string("killed: ") + strsignal(signal)
                                                       : "left the program";
}

/// The contestants take turns at one problem.
inline std::vector<Line> take_turns(const std::vector<Contestant>& contestants, const Limits& limits, Report* shared) {
  std::vector<Line> lines(contestants.size());
  for (int round = 0; round < limits.rounds; ++round)
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      Line& line = lines[i];
      // What failed once, or takes long, has had its turn.
      const bool slow = !line.times.empty() && *std::min_element(line.times.begin(), line.times.end()) > 0.5;
      if (line.ended && !slow) turn(contestants[i], limits, shared, line);
    }
  for (Line& line : lines) std::sort(line.times.begin(), line.times.end());
  return lines;
}

/// nullptr where there is none.
inline Report* shared_report() {
  void* memory = mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  return memory == MAP_FAILED ? nullptr : static_cast<Report*>(memory);
}

}  // namespace cb
