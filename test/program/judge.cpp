// `judge` from outside: answers from files, whoever gave them, under every law.

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "program/program.h"

using namespace program;

namespace {

const std::string data = TEST_DATA;
const std::string slide = data + "/problems/gen_free_b4_c8_s1.hdf5";

Json judged(const fs::path& directory, std::vector<std::string> arguments, int code) {
  arguments.insert(arguments.begin(), "judge");
  arguments.push_back("--json");
  const Result result = run(directory, arguments);
  INFO(result.err);
  REQUIRE(result.code == code);
  CHECK(lines(result.err).size() == (code == 0 ? 0 : 1));
  return Json::parse(result.out);
}

void judge_refused(std::vector<std::string> arguments, const std::vector<std::string>& parts) {
  arguments.insert(arguments.begin(), "judge");
  refused(arguments, parts);
}

/// What `solve` prints, its answer in r.mtx.
Json solved(const fs::path& directory, const std::string& problem, const std::vector<std::string>& method) {
  std::vector<std::string> arguments = {"solve", problem, "--kind", "contact", "--out", "r.mtx", "--json", "--method"};
  arguments.insert(arguments.end(), method.begin(), method.end());
  const Result result = run(directory, arguments);
  REQUIRE(result.code == 0);
  return Json::parse(result.out);
}

void write_plain(const fs::path& file, const std::vector<double>& x) {
  std::ofstream out(file);
  out.precision(17);
  for (const double value : x) out << value << '\n';
}

}  // namespace

TEST_CASE("an answer judged from its file holds as it does where it was found", "[program]") {
  struct Case {
    std::string problem, law;
    std::vector<std::string> method, asked;
  };
  const std::string boxes = data + "/problems/gen_stack_b4_c16_s1.hdf5";
  for (const Case& known :
       {Case{slide, "newton", {"newton"}, {}}, Case{slide, "coulomb", {"coulomb"}, {}},
        Case{slide, "soft", {"soft"}, {}},
        Case{slide, "soft", {"soft", "--variant", "mujoco"}, {"--variant", "mujoco"}},
        Case{slide, "mirtich", {"mirtich"}, {}}, Case{slide, "anitescu_potra", {"ap", "--k", "8"}, {"--k", "8"}},
        Case{slide, "ap", {"ap"}, {}}, Case{slide, "convex", {"convex"}, {}},
        Case{slide, "convex", {"convex", "--compression-bound", "off"}, {"--compression-bound", "off"}},
        Case{boxes, "ap", {"ap", "--k", "16"}, {"--k", "16"}}, Case{boxes, "convex", {"convex"}, {}}}) {
    TemporaryDirectory directory;
    INFO(known.problem << ' ' << known.law);
    const Json found = solved(directory.path(), known.problem, known.method);
    std::vector<std::string> arguments = {known.problem, "r.mtx", "--law", known.law};
    arguments.insert(arguments.end(), known.asked.begin(), known.asked.end());
    const Json json = judged(directory.path(), arguments, 0);
    CHECK(json["verdict"] == "holds");
    CHECK(json["residual"].get<double>() <= 1e-9);
    CHECK(json["energy_change_j"].get<double>() == Approx(found["energy_change_j"].get<double>()).epsilon(1e-9));
    if (found["law_residual"].is_number())
      CHECK(json["law_residual"].get<double>() == found["law_residual"].get<double>());
    CHECK(json["notes"].empty() == (known.law != "mirtich"));
  }
}

TEST_CASE("a push too much at one contact is found there", "[program]") {
  TemporaryDirectory directory;
  solved(directory.path(), slide, {"newton"});
  std::vector<double> r = numbers_of(directory.path() / "r.mtx");
  // Friction beyond its cone: whatever else it does, this contact is where the law is broken.
  constexpr std::size_t contact = 3;
  r[3 * contact + 1] += 10 * (1 + std::abs(r[3 * contact]));
  write_plain(directory.path() / "r.txt", r);
  for (const std::string law : {"newton", "mirtich"}) {
    const Json json = judged(directory.path(), {slide, "r.txt", "--law", law}, 3);
    CHECK(json["verdict"] == "does not hold");
    CHECK(json["worst"]["contact"] == contact);
    CHECK(json["worst"]["impulse_n_s"][1] == r[3 * contact + 1]);
    CHECK(json["residual"].get<double>() > 1e-3);
    CHECK(json["cone_violation_n_s"].get<double>() > 0.1);
    CHECK(json["reason"].get<std::string>().find("contact 3 of island") != std::string::npos);
  }
  judged(directory.path(), {slide, "r.txt", "--law", "newton", "--tolerance", "1e6"}, 0);
}

TEST_CASE("impulses may stand in a matrix of three rows, or of three columns", "[program]") {
  TemporaryDirectory directory;
  const Json found = solved(directory.path(), slide, {"newton"});
  const std::vector<double> r = numbers_of(directory.path() / "r.mtx");
  const std::size_t nc = r.size() / 3;
  REQUIRE(nc != 3);
  for (const bool wide : {true, false}) {
    std::ofstream out(directory.path() / "matrix.mtx");
    out.precision(17);
    out << "%%MatrixMarket matrix array real general\n" << (wide ? 3 : nc) << ' ' << (wide ? nc : 3) << '\n';
    if (wide)
      for (const double value : r) out << value << '\n';
    else
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c < nc; ++c) out << r[3 * c + i] << '\n';
    out.close();
    const Json json = judged(directory.path(), {slide, "matrix.mtx", "--law", "newton"}, 0);
    CHECK(json["energy_change_j"].get<double>() == Approx(found["energy_change_j"].get<double>()).epsilon(1e-9));
  }
}

TEST_CASE("the answer of one law is none of another", "[program]") {
  TemporaryDirectory directory;
  solved(directory.path(), slide, {"ap", "--k", "4"});
  CHECK(judged(directory.path(), {slide, "r.mtx", "--law", "ap"}, 0)["k"] == 4);
  CHECK(judged(directory.path(), {slide, "r.mtx", "--law", "ap", "--k", "8"}, 3)["residual"].get<double>() > 1e-3);
}

TEST_CASE("what impulses alone do not prove is said, and nothing is said to hold", "[program]") {
  TemporaryDirectory directory;
  // Two phases of restitution.
  const std::string bounce = data + "/events/ap_elastic_stack.hdf5";
  solved(directory.path(), bounce, {"ap"});
  const Json json = judged(directory.path(), {bounce, "r.mtx", "--law", "ap"}, 3);
  CHECK(json["verdict"] == "not judged");
  CHECK(json["reason"].get<std::string>().find("phases") != std::string::npos);
  CHECK(json["residual"].is_null());
}

TEST_CASE("FCLIB's solution is read as an answer", "[program]") {
  TemporaryDirectory directory;
  // Libraries keep placeholders of zeros there, which is an answer like any: a wrong one.
  const std::string file = data + "/problems/fc3d_Rover1039.hdf5";
  const Result result = run(directory.path(), {"judge", file, file, "--law", "newton", "--json"});
  if (result.err.find("holds no /solution") != std::string::npos) return;
  CHECK((result.code == 0 || result.code == 3));
  CHECK(Json::parse(result.out)["contacts"].get<int>() > 0);
}

TEST_CASE("an unsymmetric W is judged by its symmetric part, where that is asked for", "[program]") {
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "skew.dat") << "3 1 0 3 3 3 3\n2 0 0  1 2 0  0 0 2\n-1 0 0\n0.5\n";
  // W r = (1, 0, 0) by (2, 1/2, 0), (1/2, 2, 0): it sticks, with half of the friction that it may have.
  write_plain(directory.path() / "r.txt", {8.0 / 15, -2.0 / 15, 0});
  const std::vector<std::string> asked = {"skew.dat", "r.txt", "--law", "coulomb"};
  std::vector<std::string> words = asked;
  words.insert(words.begin(), "judge");
  const Result plain = run(directory.path(), words);
  CHECK(plain.code == 2);
  CHECK(plain.err.find("--symmetrise") != std::string::npos);
  words = asked;
  words.emplace_back("--symmetrise");
  CHECK(judged(directory.path(), words, 0)["notes"].size() == 1);
}

TEST_CASE("where an answer is right to the last bit no contact is the worst", "[program]") {
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "apart.dat") << "3 1 0 3 3 3 3\n1 0 0  0 1 0  0 0 1\n1 0 0\n0.5\n";  // it parts
  write_plain(directory.path() / "r.txt", {0, 0, 0});
  const Json json = judged(directory.path(), {"apart.dat", "r.txt", "--law", "coulomb"}, 0);
  CHECK(json["residual"] == 0);
  CHECK(json["worst"].is_null());
}

TEST_CASE("judge refuses what it cannot read, in one line", "[program]") {
  judge_refused({}, {"problem is required"});
  judge_refused({slide}, {"answer is required"});
  judge_refused({slide, slide}, {"--law is missing", "newton"});
  judge_refused({slide, slide, "--law", "coulom"}, {"--law coulom", "no such law"});
  judge_refused({slide, slide, "--law", ""}, {"--law '': no such law"});
  judge_refused({slide, slide + "x", "--law", "newton"}, {"cannot be opened"});
  judge_refused({slide, slide, "--law", "newton", "--k", "8"}, {"--k 8", "no use"});
  judge_refused({slide, slide, "--law", "ap", "--k", "7"}, {"--k 7", "even"});
  judge_refused({slide, slide, "--law", "newton", "--tolerance", "0"}, {"--tolerance 0", "a positive residual"});
  judge_refused({slide, data + "/problems/lcp_spd_8.q.mtx", "--law", "newton"}, {"holds 8 impulses", "need 24"});
  judge_refused({slide, data + "/README.md", "--law", "newton"}, {"README.md"});
  TemporaryDirectory directory;
  write_plain(directory.path() / "nan.txt", std::vector<double>(24, std::nan("")));
  judge_refused({slide, (directory.path() / "nan.txt").string(), "--law", "newton"},
                {"nan.txt:1", "not a finite number"});
}
