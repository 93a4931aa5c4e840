// `solve` and `judge` on problems small enough to be done by hand: what each number is, and of which contact.

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <sstream>

#include "program/program.h"

using namespace program;

namespace {

/// Two contacts that know nothing of each other: W = diag(2, 4, 4) and diag(1, 1/2, 1/2) 1/kg, u = (-2, 1, 0) and
/// (-3, 0, -2) m/s, mu = 0.5 and 0.25. With (1, -1/4, 0) the first sticks; with (3, 0, 3/4) the second slips on with
/// (0, 0, -1.625).
void write_problem(const fs::path& file) {
  std::ofstream out(file);
  out << "3 2 0 6 6 6 6\n";
  const double diagonal[] = {2, 4, 4, 1, 0.5, 0.5};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) out << (i == j ? diagonal[i] : 0) << (j < 5 ? ' ' : '\n');
  out << "-2 1 0 -3 0 -2\n0.5 0.25\n";
}

Json said(const fs::path& directory, std::vector<std::string> arguments, int code) {
  arguments.emplace_back("--json");
  const Result result = run(directory, arguments);
  INFO(result.err);
  REQUIRE(result.code == code);
  return Json::parse(result.out);
}

Json judged(const fs::path& directory, const std::string& impulses, int code) {
  std::ofstream(directory / "r.txt") << impulses << '\n';
  return said(directory, {"judge", "two.dat", "r.txt", "--law", "coulomb"}, code);
}

void check_near(const std::vector<double>& found, const std::vector<double>& expected, double margin) {
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i] == Approx(expected[i]).margin(margin));
}

}  // namespace

TEST_CASE("what judge says of the right answer of two contacts is what is done by hand", "[program]") {
  const TemporaryDirectory directory;
  write_problem(directory.path() / "two.dat");
  const Json json = judged(directory.path(), "1 -0.25 0 3 0 0.75", 0);
  CHECK(json["problem"] == "two.dat");
  CHECK(json["answer"] == "r.txt");
  CHECK(json["law"] == "coulomb");
  CHECK(json["verdict"] == "holds");
  CHECK(json["reason"] == "");
  CHECK(json["tolerance"] == 1e-9);
  CHECK(json["contacts"] == 2);
  CHECK(json["velocities"] == 6);
  // r.(u- + u+) / 2, contact by contact; u-.W^-1 u- / 2.
  CHECK(json["energy_change_j"].get<double>() == Approx(-(2 + 0.25) / 2 - (9 + 0.75 * 3.625) / 2));
  CHECK(json["energy_before_j"].get<double>() == Approx((4 / 2.0 + 1 / 4.0 + 9 + 4 / 0.5) / 2));
  for (const char* none :
       {"residual", "law_residual", "approach_m_per_s", "cone_violation_n_s", "dissipation_gap_j", "momentum"}) {
    INFO(none);
    CHECK(std::abs(json[none].get<double>()) < 1e-12);
  }
  for (const char* none : {"gap_j", "infeasibility"}) CHECK(json[none].is_null());
  // In lines what is nothing is left out.
  const Result plain = run(directory.path(), {"judge", "two.dat", "r.txt", "--law", "coulomb"});
  CHECK(plain.code == 0);
  CHECK(plain.out.find("  verdict              holds\n") != std::string::npos);
  for (const char* none : {"  reason", "  gap_j", "  infeasibility"}) CHECK(plain.out.find(none) == std::string::npos);
}

TEST_CASE("what judge says of a wrong impulse is of the contact where it is, as large as by hand", "[program]") {
  const TemporaryDirectory directory;
  write_problem(directory.path() / "two.dat");
  // The second contact goes on into the ground with 0.5 m/s and slips with 1.5; friction 1 of 0.625 that it may have.
  const Json json = judged(directory.path(), "1 -0.25 0 2.5 0 1", 3);
  CHECK(json["verdict"] == "does not hold");
  CHECK(json["approach_m_per_s"].get<double>() == Approx(0.5));
  CHECK(json["cone_violation_n_s"].get<double>() == Approx(0.375 / std::sqrt(1 + 0.0625)));
  CHECK(json["dissipation_gap_j"].get<double>() == Approx(0).margin(1e-12));  // it takes more than it may
  const Json& worst = json["worst"];
  CHECK(worst["contact"] == 1);
  CHECK(worst["island"] == 1);
  CHECK(worst["mu"] == 0.25);
  CHECK(worst["restitution"] == 0);
  check_near(worst["impulse_n_s"], {2.5, 0, 1}, 1e-12);
  check_near(worst["velocity_before_m_per_s"], {-3, 0, -2}, 1e-12);
  check_near(worst["velocity_after_m_per_s"], {-0.5, 0, -1.5}, 1e-12);
  // r - P(r - u~ / w), w = 2/3, u~ = (-0.5 + 0.25 1.5, 0, -1.5): P of (2.6875, 0, 3.25) is (1, 0, 0.25) times
  // 3.5 / 1.0625. It is made in what comes with |u|^2 / w = 13 / w.
  const double along = 3.5 / 1.0625, error = std::hypot(2.5 - along, 1 - along / 4);
  CHECK(json["law_residual"].get<double>() == Approx(error * (2.0 / 3) / std::sqrt(13)).epsilon(1e-6));
  // The first takes less than it may: mu r_n |u_t| + r_t.u_t = 0.5 1 0.5 - 0.125 0.5.
  const Json less = judged(directory.path(), "1 -0.125 0 3 0 0.75", 3);
  CHECK(less["dissipation_gap_j"].get<double>() == Approx(0.1875));
  CHECK(less["worst"]["contact"] == 0);
  CHECK(less["approach_m_per_s"].get<double>() == Approx(0).margin(1e-12));
  CHECK(less["cone_violation_n_s"].get<double>() == Approx(0).margin(1e-12));
  // In lines, too, with the verdict on standard error.
  const Result lines_of = run(directory.path(), {"judge", "two.dat", "r.txt", "--law", "coulomb"});
  CHECK(lines_of.code == 3);
  CHECK(lines_of.out.find("  worst contact        0\n") != std::string::npos);
  CHECK(lines_of.out.find("  verdict              does not hold\n") != std::string::npos);
  CHECK(lines_of.err.starts_with("contactbench judge: does not hold: checked residual"));
}

TEST_CASE("what solve says of two contacts is what is done by hand", "[program]") {
  const TemporaryDirectory directory;
  write_problem(directory.path() / "two.dat");
  const Json json = said(directory.path(),
                         {"solve", "two.dat", "--kind", "contact", "--method", "coulomb", "--repeat", "4", "--out",
                          "r.mtx", "--velocities", "u.mtx"},
                         0);
  CHECK(json["kind"] == "contact");
  CHECK(json["problem"] == "two.dat");
  CHECK(json["method"] == "coulomb");
  CHECK(json["status"] == "ok");
  CHECK(json["solver_status"] == "ok");
  CHECK(json["out"] == "r.mtx");
  CHECK(json["velocities_out"] == "u.mtx");
  check_near(numbers_of(directory.path() / "r.mtx"), {1, -0.25, 0, 3, 0, 0.75}, 1e-7);
  check_near(numbers_of(directory.path() / "u.mtx"), {0, 0, 0, 0, 0, -1.625}, 1e-7);
  CHECK(json["contacts"] == 2);
  CHECK(json["velocities"] == 6);
  CHECK(json["rows"] == 6);
  CHECK(json["rank"] == 6);
  // Each contact by its mean mobility, 10/3 and 2/3: from 0.6 and 1.2 to 0.75 and 1.5.
  CHECK(json["condition"].get<double>() == Approx(1.5 / 0.6));
  CHECK(json["weight_max_per_kg"].get<double>() == Approx(10.0 / 3));
  CHECK(json["speed_before_m_per_s"] == 3);
  CHECK(json["energy_before_j"].get<double>() == Approx(9.625));
  CHECK(json["energy_change_j"].get<double>() == Approx(-6.984375).epsilon(1e-7));
  CHECK(json["repeats"] == 4);
  CHECK(json["false_claim"] == false);
  CHECK(json["law_residual"].get<double>() <= 1e-9);
  CHECK(json["claimed_residual"].is_number());
}

TEST_CASE("an answer that a looser tolerance takes is none where it is asked for more", "[program]") {
  const TemporaryDirectory directory;
  write_problem(directory.path() / "two.dat");
  std::ofstream(directory.path() / "r.txt") << "1 -0.25 0 3 0 0.7500001\n";  // a residual of some 1e-8
  const std::vector<std::string> judge = {"judge", "two.dat", "r.txt", "--law", "coulomb", "--tolerance"};
  for (const auto& [tolerance, code] : {std::pair("1e-6", 0), {"1e-10", 3}}) {
    std::vector<std::string> arguments = judge;
    arguments.emplace_back(tolerance);
    CHECK(said(directory.path(), arguments, code)["tolerance"] == std::stod(tolerance));
  }
  // An LCP that is solved where both rows are zero: z = (1, 2).
  std::ofstream(directory.path() / "M.mtx") << "%%MatrixMarket matrix array real general\n2 2\n2\n1\n1\n2\n";
  std::ofstream(directory.path() / "q.mtx") << "%%MatrixMarket matrix array real general\n2 1\n-4\n-5\n";
  const Json lcp = said(directory.path(),
                        {"solve", "--kind", "lcp", "--matrix", "M.mtx", "--vector", "q.mtx", "--solver", "lemke",
                         "--tolerance", "1e-8", "--out", "z.mtx"},
                        0);
  check_near(numbers_of(directory.path() / "z.mtx"), {1, 2}, 1e-12);
  CHECK(lcp["kind"] == "lcp");
  CHECK(lcp["problem"] == "M.mtx");
  CHECK(lcp["vector"] == "q.mtx");
  CHECK(lcp["tolerance"] == 1e-8);
  CHECK(lcp["size"] == 2);
  CHECK(lcp["residual"].get<double>() < 1e-14);
  CHECK(lcp["claimed_residual"].get<double>() < 1e-14);
  // Sweeps go on until the tolerance that was asked for is met, and no longer.
  long sweeps = 0;
  for (const char* tolerance : {"1e-5", "1e-12"}) {
    const Json swept = said(directory.path(),
                            {"solve", "--kind", "lcp", "--matrix", "M.mtx", "--vector", "q.mtx", "--solver", "pgs",
                             "--tolerance", tolerance},
                            0);
    CHECK(swept["pivots"] > sweeps);
    sweeps = swept["pivots"];
  }
  CHECK(lcp["pivots"].get<int>() >= 2);
  CHECK(lcp["false_claim"] == false);
}
