// What: another program as a contact model (docs/external.md). It gets contact problems and gives impulses; what they
//   are worth the referee says, under the law that the program is said to solve.
// Two ways, by the command:
//   './mine {problem} {answer}'   started for every problem: {problem} is an FCLIB file, {text} the problem as text,
//                                 {answer} where it writes 3 nc impulses (Matrix Market, or numbers)
//   './mine'                      started once; problems come on its standard input, answers on its standard output
// Sizes and units: those of ContactProblem; impulses n, t1, t2 contact by contact, N s.
// Fails, with zero impulses: `crash` where the program ends, exits with another code than 0, or does not keep to the
//   protocol; `input_error` for an answer of the wrong size; `not_finite`; `write_failed` where its files cannot be
//   written; whatever it says of itself. The next problem starts it anew.

#include <fmt/compile.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "contact/answer_files.h"
#include "contact/problem_files.h"
#include "methods/child_process.h"
#include "methods/external_text.h"
#include "methods/outside.h"

namespace cb {

namespace {

namespace fs = std::filesystem;

/// Words of a line, white space between them.
std::string_view next_word(std::string_view& line) {
  const std::size_t from = std::min(line.find_first_not_of(" \t\r"), line.size());
  const std::size_t to = std::min(line.find_first_of(" \t\r", from), line.size());
  const std::string_view word = line.substr(from, to - from);
  line.remove_prefix(to);
  return word;
}

template <class Number>
bool read_number(std::string_view word, Number& x) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
  return error == std::errc() && end == word.data() + word.size() && !word.empty();
}

/// A program that is kept alive.
class Talking {
 public:
  explicit Talking(const std::string& command) : command_(command) {}

  void operator()(const ContactProblem& problem, ContactSolution& solution) {
    if (!process_ && !greet(solution)) return;
    ++number_;
    text_.clear();
    if (binary_)
      append_binary(problem, number_, text_);
    else
      append_text(problem, number_, text_);
    if (!process_->send(text_)) return lose("stopped reading and", solution);
    if (!process_->read_line(line_)) return lose("gave no answer and", solution);
    read_answer(problem, solution);
  }

 private:
  bool greet(ContactSolution& solution) {
    process_ = std::make_unique<ChildProcess>(command_, true);
    if (!process_->send("contactbench 1\n") || !process_->read_line(line_)) {
      lose("said nothing and", solution);
      return false;
    }
    binary_ = line_ == "ready binary";
    if (binary_ || line_ == "ready text") return true;
    misread("its first line is \"" + shown(line_) + "\"; it must be \"ready text\" or \"ready binary\"", solution);
    return false;
  }

  /// answer STATUS ITERATIONS COUNT [reason], then COUNT numbers.
  void read_answer(const ContactProblem& problem, ContactSolution& solution) {
    std::string_view line = line_;
    Status said = Status::ok;
    int taken = 0;
    long count = 0;
    const std::string_view answer = next_word(line), status = next_word(line), iterations = next_word(line),
                           numbers = next_word(line);
    if (answer != "answer" || !find_status(status, said) || !read_number(iterations, taken) ||
        !read_number(numbers, count) || count < 0)
      return misread("\"" + shown(line_) + "\" is no line \"answer STATUS ITERATIONS COUNT\"", solution);
    solution.status = said;
    solution.iterations = taken;
    const std::size_t from = line.find_first_not_of(' ');
    if (from != std::string_view::npos) solution.reason = line.substr(from);
    if (count != 3L * problem.nc() && !(count == 0 && said > Status::inaccurate)) {
      process_.reset();  // what comes next is not where it should be
      return solution.fail(Status::input_error,
                           fmt::format("the answer holds {} impulses; {} contacts need {} (n, t1, t2 of each)", count,
                                       problem.nc(), 3 * problem.nc()));
    }
    solution.impulse.resize(static_cast<std::size_t>(count));
    binary_ ? read_binary(solution) : read_text(solution);
  }

  void read_binary(ContactSolution& solution) {
    const std::size_t size = solution.impulse.size() * sizeof(double);
    if (!process_->read_bytes(reinterpret_cast<char*>(solution.impulse.data()), size))
      lose("broke off its answer and", solution);
  }

  void read_text(ContactSolution& solution) {
    if (!process_->read_line(line_)) return lose("broke off its answer and", solution);
    std::string_view line = line_;
    bool good = next_word(line) == "r";
    for (double& x : solution.impulse) good = good && read_number(next_word(line), x);
    if (!good || !next_word(line).empty())
      misread(fmt::format("its line of impulses is not r and {} numbers", solution.impulse.size()), solution);
  }

  static bool find_status(std::string_view word, Status& status) {
    for (int i = 0; i < status_count; ++i)
      if (name(static_cast<Status>(i)) == word) {
        status = static_cast<Status>(i);
        return true;
      }
    return false;
  }
  static std::string shown(std::string text) {
    constexpr std::size_t enough = 60;
    if (text.size() > enough) text = text.substr(0, enough) + "...";
    for (char& c : text)
      if (static_cast<unsigned char>(c) < ' ') c = '?';
    return text;
  }
  void lose(const char* what, ContactSolution& solution) {
    crash(fmt::format("the program {} {}{}", what, process_->ending(),
                      number_ > 0 ? fmt::format(", at problem {} that it got", number_) : ""),
          solution);
  }
  void misread(const std::string& why, ContactSolution& solution) {
    crash("the program does not keep to the protocol: " + why, solution);
  }
  /// Whatever it said of itself before.
  void crash(std::string why, ContactSolution& solution) {
    solution.impulse.clear();
    solution.status = Status::crash;
    solution.reason = std::move(why);
    process_.reset();
  }

  std::string command_, text_, line_;
  std::unique_ptr<ChildProcess> process_;
  bool binary_ = false;
  long number_ = 0;
};

/// A folder of its own, which goes when it goes.
class Folder {
 public:
  Folder() {
    std::error_code none;  // what the system names for temporary files; where that is missing, path_ stays empty
    std::string path = (fs::temp_directory_path(none) / "contactbench-").string() + std::string(6, 'X');
    if (!none && mkdtemp(path.data())) path_ = path;
  }
  ~Folder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A program that is started for every problem.
class Started {
 public:
  explicit Started(std::string command) : command_(std::move(command)) {}

  void operator()(const ContactProblem& problem, ContactSolution& solution) {
    if (folder_.path().empty()) return solution.fail(Status::write_failed, "no folder for its files can be made");
    const std::string answer = folder_.path() + "/answer.txt";
    std::error_code ignored;
    fs::remove(answer, ignored);
    try {
      ChildProcess process(command_for(problem, answer), false);
      if (!process.wait()) return solution.fail(Status::crash, "the program " + process.ending());
    } catch (const FileError& error) {
      return solution.fail(Status::write_failed, error.what());
    }
    if (!fs::exists(answer, ignored)) return solution.fail(Status::crash, "the program wrote no {answer}");
    try {
      solution.impulse = read_impulses(answer, problem.nc());
    } catch (const FileError& error) {
      const std::string_view said = error.what();
      const std::string_view file = std::string_view(said).substr(std::min(answer.size(), said.size()));
      solution.impulse.clear();
      solution.fail(Status::input_error, "{answer}" + std::string(file));
    }
  }

 private:
  /// With the paths in place of their names, and the files that it asks for written.
  std::string command_for(const ContactProblem& problem, const std::string& answer) {
    std::string command = command_;
    const auto put = [&](std::string_view what, const std::string& path) {
      bool there = false;
      for (std::size_t at = command.find(what); at != std::string::npos; at = command.find(what, at + path.size())) {
        command.replace(at, what.size(), path);
        there = true;
      }
      return there;
    };
    if (const std::string path = folder_.path() + "/problem.hdf5"; put("{problem}", path))
      write_contact_problem(path, problem);
    if (const std::string path = folder_.path() + "/problem.txt"; put("{text}", path))
      write_external_text(path, problem, ++number_);
    put("{answer}", answer);
    return command;
  }

  std::string command_;
  Folder folder_;
  long number_ = 0;
};

OutsideSolver make(const MethodOptions& options) {
  const auto one = [](auto solver) -> OutsideSolver {
    return [solver](const ContactProblem& problem, ContactSolution& solution) { (*solver)(problem, solution); };
  };
  if (options.command.find("{answer}") != std::string::npos) return one(std::make_shared<Started>(options.command));
  return one(std::make_shared<Talking>(options.command));
}

}  // namespace

MethodRow external_row(const Law& law) {
  MethodRow row =
      outside_row("external", "another program that is handed contact problems (docs/external.md)", law, make);
  row.source = "--command";
  std::vector<OptionRow> options = {{.flag = "command",
                                     .unit = "-",
                                     .default_value = "none",
                                     .summary = "what answers: started once and talked to, or for each problem where "
                                                "it names {problem} or {text}, and {answer}",
                                     .field = &MethodOptions::command,
                                     .type = "COMMAND",
                                     .short_name = "",
                                     .always_named = true},
                                    {.flag = "law",
                                     .unit = "-",
                                     .default_value = "none",
                                     .summary = "what its answers claim to solve: see contactbench list laws",
                                     .field = &MethodOptions::law,
                                     .type = "LAW",
                                     .short_name = "law-",
                                     .always_named = true}};
  options.insert(options.end(), row.options.begin(), row.options.end());
  row.options = std::move(options);
  return row;
}

}  // namespace cb
