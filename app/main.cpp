#include <dlfcn.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "commands.h"
#include "flags.h"
#include "scenario/scenario.h"
#include "versions.h"

namespace {

/// Results and timings must not depend on how many cores there are. A BLAS reads its environment before main starts,
/// so it is told here, where there is one that listens.
void use_one_thread() {
  for (const char* setter : {"openblas_set_num_threads", "omp_set_num_threads", "MKL_Set_Num_Threads"})
    if (void* found = dlsym(RTLD_DEFAULT, setter)) reinterpret_cast<void (*)(int)>(found)(1);
}

/// Has the reader of standard output left, as `| head` does once it has enough? It got what it wanted: no failure.
bool reader_left() {
  pollfd output = {STDOUT_FILENO, POLLOUT, 0};
  return poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

int say(const std::string& command, const std::string& message, int code) {
  cb::print_error(fmt::format("contactbench{}{}: {}\n", command.empty() ? "" : " ", command, message));
  return code;
}

/// Runs one command line; every failure ends here, as one message and an exit code.
int run(int argc, char** argv) {
  CLI::App program{"Contact models for rigid bodies, compared on the same scenes", "contactbench"};
  program.set_version_flag("--version", cb::version_line());
  program.footer(
      "Exit codes: 0 finished; 1 a fault in the program; 2 wrong flags or input, nothing written;\n"
      "3 did not finish, for a reason that `contactbench list statuses` explains.\n"
      "Example: contactbench run sticking_box.xml --method ap --solver lemke --k 8");

  cb::Action action;
  cb::add_run(program, action);
  cb::add_solve(program, action);
  cb::add_judge(program, action);
  cb::add_check(program, action);
  cb::add_list(program, action);
  cb::add_completion(program, action);

  std::string command;
  try {
    if (argc < 2) throw cb::UsageError("a command is missing: " + cb::commands_of(program));
    cb::check_command(program, argv[1]);
    if (argv[1][0] != '-') command = argv[1];
    cb::check_values(program, command, {argv, static_cast<std::size_t>(argc)});
    program.parse(argc, argv);
    if (!action) throw cb::UsageError("a command is missing: " + cb::commands_of(program));
    return action();
  } catch (const CLI::Success& request) {  // --help, --version
    return program.exit(request);
  } catch (const CLI::ExtrasError&) {
    return say(command, cb::unknown_flag(program, command), cb::wrong_input);
  } catch (const CLI::RequiredError& error) {
    // A flag that is missing may be one that is misspelt.
    const std::string misspelt = cb::unknown_flag(program, command);
    return say(command, misspelt.empty() ? error.what() : misspelt, cb::wrong_input);
  } catch (const CLI::ArgumentMismatch& error) {
    return say(command, std::string(error.what()) + "; a flag stands once, with one value after it", cb::wrong_input);
  } catch (const CLI::ParseError& error) {
    return say(command, error.what(), cb::wrong_input);
  } catch (const cb::UsageError& error) {
    return say(command, error.what(), cb::wrong_input);
  } catch (const cb::InputError& error) {
    return say(command, error.what(), cb::wrong_input);
  } catch (const std::exception& error) {
    // fmt throws where standard output takes no more; main says so.
    if (std::ferror(stdout) != 0) return cb::finished;
    return say(command, std::string("a fault in the program: ") + error.what(), cb::program_fault);
  }
}

}  // namespace

void cb::print_error(const std::string& text) { std::fputs(text.c_str(), stderr); }

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that left ends nothing
  std::signal(SIGXFSZ, SIG_IGN);  // and so is a file that may not grow
  use_one_thread();
  const int code = run(argc, argv);
  if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && code == cb::finished && !reader_left())
    return say("", "standard output cannot be written", cb::not_finished);
  return code;
}
