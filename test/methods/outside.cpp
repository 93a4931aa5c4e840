// Answers that come from outside: whatever the solver says of itself, the referee judges what it gave.

#include "methods/outside.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "contact/referee.h"
#include "methods/external_text.h"
#include "problems.h"
#include "temporary.h"

using namespace cb;
using namespace cb::test;

TEST_CASE("an answer that its solver doubts is judged by what the law was asked for", "[outside]") {
  const ContactProblem p = box(0.3, {1, -0.5, 0.2});
  MethodOptions asked;
  asked.sigma = 0.1;
  const MethodRow& soft = *find_method("soft");
  ContactSolution own, answer;
  soft.make(asked)(p, own);
  REQUIRE(own.status == Status::ok);
  const MethodRow row = outside_row("doubting", "", soft.law, [&](const MethodOptions&) -> OutsideSolver {
    return [&](const ContactProblem&, ContactSolution& solution) {
      solution.impulse = own.impulse;
      solution.status = Status::inaccurate;
      solution.reason = "does not trust itself";
    };
  });
  row.make(asked)(p, answer);
  CHECK(answer.status == Status::inaccurate);
  CHECK(answer.reason == "does not trust itself");
  std::vector<double> v_plus;
  CHECK(Referee::holds(Referee().check(p, answer, soft.law, v_plus), 1e-9));
}

// Works of several contacts of an island: any that add up to its own.
TEST_CASE("impulses alone are answers of mirtich where its own are, with their works or without", "[outside]") {
  for (const ContactProblem& p : {box(0.3, {1, -0.5, 0.2}), stack(2, 0.5, {0.1, -1, 0})}) {
    const MethodRow& mirtich = *find_method("mirtich");
    ContactSolution own, answer;
    mirtich.make({})(p, own);
    REQUIRE(own.status == Status::ok);
    const MethodRow row = outside_row("impulses", "", mirtich.law, [&](const MethodOptions&) -> OutsideSolver {
      return [&](const ContactProblem&, ContactSolution& solution) { solution.impulse = own.impulse; };
    });
    row.make({})(p, answer);
    CHECK(answer.status == Status::ok);
    std::vector<double> v_plus;
    CHECK(Referee::holds(Referee().check(p, own, mirtich.law, v_plus), 1e-9));
    CHECK(Referee::holds(Referee().check(p, answer, mirtich.law, v_plus), 1e-9));
  }
}

TEST_CASE("what is no answer is refused though its solver says only that it doubts, and what gave up says why",
          "[outside]") {
  ContactProblem p = box(0.3, {1, -0.5, 0.2});
  std::fill(p.restitution.begin(), p.restitution.end(), 0.5);  // whose two phases ap cannot tell from their sum
  const std::vector<double> zeros(12, 0.0);
  std::vector<double> no_number = zeros;
  no_number[4] = std::nan("");
  struct Case {
    const char* method;
    std::vector<double> impulse;
    Status status;
  };
  for (const Case& known :
       {Case{"coulomb", no_number, Status::not_finite}, Case{"coulomb", {1, 0, 0}, Status::input_error},
        Case{"ap", std::vector<double>(12, 0.1), Status::unsupported}})
    for (const Status said : {Status::inaccurate, Status::nonconverged}) {
      const Law law = find_method(known.method)->law;
      const MethodRow row = outside_row("says", "", law, [&](const MethodOptions&) -> OutsideSolver {
        return [&](const ContactProblem&, ContactSolution& solution) {
          solution.impulse = known.impulse;
          solution.status = said;
          solution.reason = "as it says";
        };
      });
      ContactSolution answer;
      row.make({})(p, answer);
      INFO(known.method << ": " << name(answer.status) << ", " << answer.reason);
      const bool doubts = said == Status::inaccurate;
      CHECK(answer.status == (doubts ? known.status : said));
      CHECK((answer.reason == "as it says") == !doubts);
      if (doubts) CHECK(answer.impulse == zeros);
    }
}

TEST_CASE("a program has crashed where it breaks off what it says, whatever status stands in it", "[outside]") {
  const ContactProblem p = sphere({0, -1, 0}, {0, 0, 0});
  struct Case {
    std::string says, then;
    Status status;
    std::string reason;
  };
  const std::string listens = "cat > /dev/null", leaves = "read greeting; read problem";
  for (const Case& known :
       {Case{"answer input_error x 3", listens, Status::crash, "\"answer input_error x 3\" is no line"},
        Case{"answer unsupported 1 3 too hard\nr 1 2", listens, Status::crash, "is not r and 3 numbers"},
        Case{"answer input_error 1 3 too hard", leaves, Status::crash, "broke off its answer"},
        Case{"answer ok 1 -3\nr", listens, Status::crash, "\"answer ok 1 -3\" is no line"},
        Case{"answer ok 1 3.5\nr 4 0 0", listens, Status::crash, "\"answer ok 1 3.5\" is no line"},
        Case{"answer ok 1 many\nr 4 0 0", listens, Status::crash, "\"answer ok 1 many\" is no line"},
        Case{"answer ok 99999999999 3\nr 4 0 0", listens, Status::crash, "\"answer ok 99999999999 3\" is no line"},
        Case{"answer ok 1 3\nr 4 0x 0", listens, Status::crash, "is not r and 3 numbers"},
        Case{"answer \\033x 1 3", listens, Status::crash, "\"answer ?x 1 3\" is no line"},
        Case{"answer " + std::string(80, 'a'), listens, Status::crash,
             "\"answer " + std::string(53, 'a') + "...\" is no line"},
        Case{"answer inaccurate 1 0 doubts\nr", listens, Status::input_error, "holds 0 impulses"},
        Case{"answer nonconverged 1 0 too hard\nr", listens, Status::nonconverged, "too hard"}}) {
    MethodOptions options;
    options.command = "printf 'ready text\n" + known.says + "\n'; " + known.then;
    ContactSolution answer;
    external_row(coulomb_law()).make(options)(p, answer);
    INFO(known.says << ": " << name(answer.status) << ", " << answer.reason);
    CHECK(answer.status == known.status);
    CHECK(answer.reason.find(known.reason) != std::string::npos);
    CHECK(answer.impulse == std::vector<double>(3, 0.0));
  }
}

TEST_CASE("what a program says of its answer is what is known of it: how it ended, why, and in how many steps",
          "[outside]") {
  MethodOptions options;
  options.command = "printf 'ready text\nanswer inaccurate 7 3  it doubts\nr 4 0.25 -1e-3\n'; cat > /dev/null";
  ContactSolution answer;
  external_row(coulomb_law()).make(options)(sphere({0, -1, 0}, {0, 0, 0}), answer);
  CHECK(answer.status == Status::inaccurate);
  CHECK(answer.reason == "it doubts");
  CHECK(answer.iterations == 7);
  CHECK(answer.impulse == std::vector<double>{4, 0.25, -1e-3});
}

TEST_CASE("a program that is started for every problem is believed where it ends without an error, and not otherwise",
          "[outside]") {
  const ContactProblem p = sphere({0, -1, 0}, {0, 0, 0});
  for (const std::string ending : {"exit 0", "exit 1", "kill -9 $$"}) {
    MethodOptions options;
    options.command = "echo 4 0 0 > {answer}; test -s {text}; " + ending;
    ContactSolution answer;
    external_row(coulomb_law()).make(options)(p, answer);
    INFO(ending << ": " << name(answer.status) << ", " << answer.reason);
    CHECK((answer.status == Status::ok) == (ending == "exit 0"));
    CHECK(answer.impulse[0] == (ending == "exit 0" ? 4 : 0));
  }
}

TEST_CASE("a program that breaks off an answer in bytes has crashed, and gave no impulse", "[outside]") {
  MethodOptions options;
  options.command = "printf 'ready binary\nanswer ok 1 3\n12345678'; read greeting; read problem";
  ContactSolution answer;
  external_row(coulomb_law()).make(options)(sphere({0, -1, 0}, {0, 0, 0}), answer);
  INFO(answer.reason);
  CHECK(answer.status == Status::crash);
  CHECK(answer.reason.find("broke off its answer") != std::string::npos);
  CHECK(answer.impulse == std::vector<double>(3, 0.0));
}

TEST_CASE("a program that is started for every problem has the time that it takes", "[outside]") {
  MethodOptions options;
  options.command = "sleep 1.2; echo 4 0 0 > {answer}; test -s {text}";
  ContactSolution answer;
  external_row(coulomb_law()).make(options)(sphere({0, -1, 0}, {0, 0, 0}), answer);
  INFO(answer.reason);
  CHECK(answer.status == Status::ok);
  CHECK(answer.impulse[0] == 4);
}

TEST_CASE("a line that goes on for more than 64 MB is none", "[outside]") {
  MethodOptions options;
  for (const std::string size : {"66000000", "68000000"}) {
    options.command = "printf 'ready text\nanswer ok 1 3\nr'; head -c " + size +
                      " /dev/zero | tr '\\0' ' '; echo ' 4 0 0'; cat > /dev/null";
    ContactSolution answer;
    external_row(coulomb_law()).make(options)(sphere({0, -1, 0}, {0, 0, 0}), answer);
    INFO(size << ": " << answer.reason);
    CHECK(answer.impulse[0] == (size == "66000000" ? 4 : 0));
  }
}

TEST_CASE("a problem larger than a pipe is heard whole, and so is an answer", "[outside]") {
  const TemporaryDirectory folder;
  const std::string heard = (folder.path() / "heard").string();
  const ContactProblem p = stack(2500, 0.5, {0, -1, 0});
  std::string text = "contactbench 1\n";
  append_text(p, 1, text);
  REQUIRE(text.size() > (std::size_t(1) << 20));  // bytes: what a pipe holds at most
  MethodOptions options;
  options.command =
      "printf 'ready text\nanswer ok 1 30000\nr'; yes ' 0.25' | head -n 30000 | tr -d '\\n'; echo; "
      "cat > '" +
      heard + "'";
  ContactSolution answer;
  external_row(coulomb_law()).make(options)(p, answer);  // which ends with the program
  INFO(answer.reason);
  CHECK(answer.status == Status::ok);
  CHECK((answer.impulse == std::vector<double>(30000, 0.25)));
  CHECK((read_file(heard) == text));
}

TEST_CASE("a program that is started for every problem is told its number, from one on", "[outside]") {
  const TemporaryDirectory folder;
  const std::string heads = (folder.path() / "heads").string();
  MethodOptions options;
  options.command = "head -n 1 {text} >> '" + heads + "'; echo 4 0 0 > {answer}";
  const ContactMethod method = external_row(coulomb_law()).make(options);
  const ContactProblem p = sphere({0, -1, 0}, {0, 0, 0});
  ContactSolution answer;
  for (int i = 0; i < 3; ++i) {
    method(p, answer);
    CHECK(answer.status == Status::ok);
  }
  const std::string said = read_file(heads);
  INFO(said);
  CHECK(said.starts_with("problem 1 1 6 1 1 "));
  for (const char* next : {"\nproblem 2 1 6 1 1 ", "\nproblem 3 1 6 1 1 "}) CHECK(said.find(next) != std::string::npos);
}

TEST_CASE("a program that gave too few impulses is started anew for the next problem", "[outside]") {
  const TemporaryDirectory folder;
  MethodOptions options;
  options.command = "cd '" + folder.path().string() +
                    "'; n=2; [ -e before ] && n=3; touch before; printf 'ready text\nanswer ok 1 '$n'\nr 4 0.25 0\n'; "
                    "cat > /dev/null";
  const ContactMethod method = external_row(coulomb_law()).make(options);
  const ContactProblem p = sphere({0, -1, 0}, {0, 0, 0});
  ContactSolution answer;
  method(p, answer);
  CHECK(answer.status == Status::input_error);
  CHECK(answer.reason == "the answer holds 2 impulses; 1 contacts need 3 (n, t1, t2 of each)");
  method(p, answer);
  INFO(answer.reason);
  CHECK(answer.status == Status::ok);
  CHECK(answer.impulse == std::vector<double>{4, 0.25, 0});
}

namespace {

/// Where files are put that are there for a while.
class FilesGoTo {
 public:
  explicit FilesGoTo(const std::string& path) { setenv("TMPDIR", path.c_str(), 1); }
  ~FilesGoTo() {
    if (usual_)
      setenv("TMPDIR", before_.c_str(), 1);
    else
      unsetenv("TMPDIR");
  }
  FilesGoTo(const FilesGoTo&) = delete;
  FilesGoTo& operator=(const FilesGoTo&) = delete;

 private:
  bool usual_ = std::getenv("TMPDIR") != nullptr;
  std::string before_ = usual_ ? std::getenv("TMPDIR") : "";
};

}  // namespace

TEST_CASE("where no folder can be made for its files a program is not started, and where one was made it goes",
          "[outside]") {
  const ContactProblem p = sphere({0, -1, 0}, {0, 0, 0});
  MethodOptions options;
  options.command = "echo 4 0 0 > {answer}; test -s {text}";
  ContactSolution answer;
  const TemporaryDirectory directory;
  {
    const FilesGoTo there(directory.path().string());
    const ContactMethod method = external_row(coulomb_law()).make(options);
    method(p, answer);
    CHECK(answer.status == Status::ok);
    CHECK(answer.impulse == std::vector<double>{4, 0, 0});
    CHECK_FALSE(std::filesystem::is_empty(directory.path()));
  }
  CHECK(std::filesystem::is_empty(directory.path()));
  for (const char* nobodys : {"/nowhere/at/all", "/proc"}) {  // which is not there, and where nobody makes a folder
    INFO(nobodys);
    const FilesGoTo there(nobodys);
    external_row(coulomb_law()).make(options)(p, answer);
    CHECK(answer.status == Status::write_failed);
    CHECK(answer.reason == "no folder for its files can be made");
    CHECK(answer.impulse == std::vector<double>(3, 0.0));
  }
}

TEST_CASE("where a program's problem can be written no more it is not started", "[outside]") {
  const TemporaryDirectory directory;
  const FilesGoTo there(directory.path().string());
  MethodOptions options;
  options.command = "echo 4 0 0 > {answer}; : {text}";
  const ContactMethod method = external_row(coulomb_law()).make(options);
  const std::filesystem::path folder = std::filesystem::directory_iterator(directory.path())->path();
  std::filesystem::remove_all(folder);
  ContactSolution answer;
  method(sphere({0, -1, 0}, {0, 0, 0}), answer);
  CHECK(answer.status == Status::write_failed);
  CHECK(answer.reason == (folder / "problem.txt").string() + ": cannot be opened for writing");
  CHECK(answer.impulse == std::vector<double>(3, 0.0));
}

// `soft` needs the masses to prove an answer, `convex` an answer of our own.
TEST_CASE("an answer from outside to what is no problem is unsupported, with what is wrong of it", "[outside]") {
  for (const char* method : {"soft", "convex"}) {
    const bool soft = method == std::string("soft");
    ContactProblem p = sphere({0, -1, 0}, {0, 0, 0});
    if (soft)
      p.M.block(0)(0, 0) = -1;
    else
      p.mu[0] = -0.1;
    const MethodRow row = outside_row("says", "", find_method(method)->law, [](const MethodOptions&) -> OutsideSolver {
      return [](const ContactProblem&, ContactSolution& solution) { solution.impulse = {4, 0, 0}; };
    });
    ContactSolution answer;
    row.make({})(p, answer);
    CHECK(answer.status == Status::unsupported);
    CHECK(answer.reason ==
          (soft ? "the mass matrix is not positive definite"
                : "convex: the bound on the sum of normal impulses is known with its proof only from solving the "
                  "problem, and our own method does not solve it: contact 0 has a negative coefficient of friction"));
    CHECK(answer.impulse == std::vector<double>(3, 0.0));
  }
}
