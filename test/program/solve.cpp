// `solve` from outside: stored problems in, answers and checked residuals out.

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "program/program.h"

using namespace program;

namespace {

const std::string data = TEST_DATA;

/// `solve` with these arguments is refused (program.h).
void solve_refused(std::vector<std::string> arguments, const std::vector<std::string>& parts) {
  arguments.insert(arguments.begin(), "solve");
  refused(arguments, parts);
}

Json solved(const fs::path& directory, std::vector<std::string> arguments, int code = 0) {
  arguments.insert(arguments.begin(), "solve");
  arguments.push_back("--json");
  const Result result = run(directory, arguments);
  INFO(result.err);
  REQUIRE(result.code == code);
  return Json::parse(result.out);
}

std::vector<std::string> stored_lcp(const std::string& name) {
  const std::string stem = data + "/problems/" + name;
  return {"--kind", "lcp", "--matrix", stem + ".M.mtx", "--vector", stem + ".q.mtx"};
}

std::vector<std::string> with(std::vector<std::string> flags, const std::vector<std::string>& more) {
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

/// Is this a build that reads FCLIB files?
bool has_fclib() {
  static const bool there = [] {
    TemporaryDirectory directory;
    return run(directory.path(),
               {"solve", data + "/problems/gen_free_b2_c1_s1.hdf5", "--kind", "contact", "--method", "ap"})
               .err.find("without HDF5") == std::string::npos;
  }();
  return there;
}

}  // namespace

TEST_CASE("an answer that finds no room is no success", "[program]") {
  TemporaryDirectory directory;
  const std::vector<std::string> full = with(stored_lcp("lcp_spd_8"), {"--out", "/dev/full", "--json"});
  const Result result = run(directory.path(), with({"solve"}, full));
  CHECK(result.code == 3);
  CHECK(result.err.starts_with("contactbench solve: write_failed: /dev/full: could not be written"));
  CHECK(Json::parse(result.out)["status"] == "write_failed");
}

TEST_CASE("solve finds the one solution of a positive definite LCP and writes it", "[program]") {
  TemporaryDirectory directory;
  const Json answer =
      solved(directory.path(), with(stored_lcp("lcp_spd_8"), {"--repeat", "3", "--out", "z.mtx", "--solver", "lemke"}));
  CHECK(answer["status"] == "ok");
  CHECK(answer["solver"] == "lemke");
  CHECK(answer["size"] == 8);
  CHECK(answer["repeats"] == 3);
  CHECK(answer["residual"].get<double>() <= 1e-12);
  CHECK(answer["time_min_s"].get<double>() > 0);
  CHECK(answer["time_min_s"].get<double>() <= answer["time_median_s"].get<double>());
  const Json reference = Json::parse(read_file(data + "/problems/lcp_spd_8.ref.json"));
  const std::vector<double> z = numbers_of(directory.path() / "z.mtx");
  REQUIRE(z.size() == 8);
  for (std::size_t i = 0; i < z.size(); ++i) CHECK(z[i] == Approx(reference["z"][i].get<double>()).margin(1e-12));
}

TEST_CASE("an LCP without a solution ends with exit code 3, a ray, and no answer file", "[program]") {
  TemporaryDirectory directory;
  const Json answer = solved(directory.path(), with(stored_lcp("lcp_infeasible_3"), {"--out", "z.mtx"}), 3);
  CHECK(answer["status"] == "ray");
  CHECK_FALSE(answer["reason"].get<std::string>().empty());
  CHECK(content(directory.path()).empty());
}

TEST_CASE("impulses of a contact problem that was not solved are written nowhere", "[program]") {
  TemporaryDirectory directory;
  const Json answer = solved(directory.path(),
                             {data + "/hardest/random_2390.hdf5", "--kind", "contact", "--method", "coulomb",
                              "--solver", "admm", "--out", "r.mtx", "--velocities", "u.mtx"},
                             3);
  CHECK(answer["status"] == "nonconverged");
  CHECK(answer["residual"].get<double>() > 1e-6);
  CHECK_FALSE(fs::exists(directory.path() / "r.mtx"));
  CHECK_FALSE(fs::exists(directory.path() / "u.mtx"));
}

TEST_CASE("solve reads Siconos LCPs column by column", "[program]") {
  TemporaryDirectory directory;
  // A_ij = 4 [i = j] + i / 8 - j / 16 is positive definite, q < 0 and every z_i > 0: w = A z + q = 0.
  const Json answer = solved(directory.path(), {data + "/siconos/lcp_dense.dat", "--kind", "lcp", "--out", "z.mtx"});
  CHECK(answer["status"] == "ok");
  const std::vector<double> z = numbers_of(directory.path() / "z.mtx");
  REQUIRE(z.size() == 6);
  for (int i = 0; i < 6; ++i) {
    double w = -1 - 0.5 * i;
    for (int j = 0; j < 6; ++j) w += ((i == j ? 4 : 0) + 0.125 * i - 0.0625 * j) * z[j];
    CHECK(w == Approx(0).margin(1e-12));
    CHECK(z[i] > 0);
  }
}

TEST_CASE("the convex model reaches the energy of the reference on a stored contact problem", "[program]") {
  if (!has_fclib()) return;
  TemporaryDirectory directory;
  const std::string stem = data + "/problems/gen_free_b4_c8_s1";
  const Json answer = solved(directory.path(), {stem + ".hdf5", "--kind", "contact", "--method", "convex", "--out",
                                                "r.mtx", "--velocities", "u.mtx"});
  const Json reference = Json::parse(read_file(stem + ".ref.json"));
  CHECK(answer["status"] == "ok");
  CHECK(answer["format"] == "fclib_global");
  CHECK(answer["contacts"] == 8);
  CHECK(answer["energy_before_j"].get<double>() == Approx(reference["KE_before"].get<double>()).epsilon(1e-12));
  CHECK(answer["energy_change_j"].get<double>() == Approx(reference["ds_kappa"]["dKE"].get<double>()).epsilon(1e-8));
  CHECK(numbers_of(directory.path() / "r.mtx").size() == 24);
  const std::vector<double> u = numbers_of(directory.path() / "u.mtx"), u_reference = reference["ds_kappa"]["u"];
  REQUIRE(u.size() == u_reference.size());
  // The reference's own gap of 1e-12 J fixes velocities to its root.
  for (std::size_t i = 0; i < u.size(); ++i) CHECK(u[i] == Approx(u_reference[i]).margin(1e-5));
}

// Two cubes on eight contacts without friction: normals alone, or with k directions and a slip bound each.
TEST_CASE("the speed before an event is that of its fastest contact, approaching or not", "[program]") {
  if (!has_fclib()) return;
  TemporaryDirectory directory;
  // Boxes at rest under 0.0981 m/s of weight: nothing but approach.
  const Json json =
      solved(directory.path(), {data + "/stacks/stack_rest_n2.hdf5", "--kind", "contact", "--method", "convex"});
  CHECK(json["speed_before_m_per_s"].get<double>() > 1e-3);
}

TEST_CASE("solve leaves out what a run does, if asked", "[program]") {
  if (!has_fclib()) return;
  TemporaryDirectory directory;
  REQUIRE(run(directory.path(), {"run", "stack.xml", "--set", "boxes=2", "--set", "mu=0", "--method", "ap", "--k", "4",
                                 "--duration", "0.001", "--save-problems", "p", "--out", "r", "--quiet"})
              .code == 0);
  for (const char* prune : {"on", "off"}) {
    const Json answer = solved(directory.path(), {"p/event_000000001.hdf5", "--kind", "contact", "--method", "ap",
                                                  "--k", "4", "--prune", prune});
    CHECK(answer["status"] == "ok");
    CHECK(answer["size"] == (prune == std::string("on") ? 8 : 8 * 6));
  }
}

TEST_CASE("A-P's answer holds for every form in which a problem is stored", "[program]") {
  TemporaryDirectory directory;
  std::vector<std::string> files;
  for (const char* name : {"dense", "blocks", "triplets", "columns"})
    files.push_back(data + "/siconos/friction_" + name + ".dat");
  if (has_fclib()) {
    files.push_back(data + "/stacks/stack_rest_n2.hdf5");
    files.push_back(data + "/problems/gen_stack_b2_c8_s0.hdf5");
  }
  std::vector<double> energies;
  for (const std::string& file : files) {
    INFO(file);
    const Json answer = solved(directory.path(), {file, "--kind", "contact", "--method", "ap", "--k", "8"});
    CHECK(answer["status"] == "ok");
    CHECK(answer["k"] == 8);
    CHECK(answer["residual"].get<double>() <= 1e-9);
    CHECK(answer["size"].get<int>() >= answer["contacts"].get<int>() * 10);
    CHECK_FALSE(answer["law_residual"].is_null());
    energies.push_back(answer["energy_change_j"]);
  }
  // One W in four forms; two cubes at rest, once with their bodies and once by W.
  for (int i = 1; i < 4; ++i) CHECK(energies[i] == Approx(energies[0]).epsilon(1e-12));
  if (files.size() == 6) CHECK(energies[4] == Approx(energies[5]).epsilon(1e-9));
}

TEST_CASE("solve prints a line each where JSON is not asked for", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), with({"solve"}, stored_lcp("lcp_spd_8")));
  CHECK(result.code == 0);
  for (const char* word : {"status", "pivots", "time_min_s", "time_median_s", "residual", "size"})
    CHECK(result.out.find(word) != std::string::npos);
}

TEST_CASE("wrong flags of solve are named, with the fix", "[program]") {
  const std::string contact = data + "/siconos/friction_dense.dat";
  const std::string lcp = data + "/siconos/lcp_dense.dat";
  solve_refused({contact}, {"--kind is missing"});
  solve_refused({contact, "--kind", "friction"}, {"--kind friction", "lcp or contact"});
  solve_refused({contact, "--kind", ""}, {"--kind '': must be lcp or contact"});
  solve_refused({"--kind", "contact", "--method", "ap"}, {"problem is missing"});
  solve_refused({"--kind", "lcp"}, {"problem is missing", "--matrix"});
  solve_refused({"--kind", "lcp", "--matrix", "M.mtx"}, {"--vector"});
  solve_refused({"M.mtx", "--kind", "lcp"}, {"M.mtx", "--vector"});
  solve_refused({lcp, "--kind", "lcp", "--matrix", "M.mtx", "--vector", "q.mtx"}, {"--matrix"});
  for (const char* part : {"--matrix", "--vector"})
    solve_refused({lcp, "--kind", "lcp", part, "M.mtx"}, {"leave one or the other out"});
  solve_refused({contact, "--kind", "contact"}, {"--method is missing"});
  solve_refused({contact, "--kind", "contact", "--method", "covnex"}, {"covnex", "did you mean \"convex\""});
  solve_refused({contact, "--kind", "contact", "--method", "convex", "--k", "8"}, {"--k 8", "no use"});
  solve_refused({contact, "--kind", "contact", "--method", "ap", "--k", "7"}, {"--k 7", "even"});
  solve_refused({contact, "--kind", "contact", "--method", "ap", "--epsilon", "1e-8"}, {"--epsilon 1e-8", "no use"});
  solve_refused({contact, "--kind", "contact", "--method", "convex", "--epsilon", "1e-8", "--epsilon-relative", "1e-8"},
                {"exclude each other"});
  solve_refused({contact, "--kind", "contact", "--method", "ap", "--matrix", "M.mtx"}, {"--matrix", "no use"});
  solve_refused({contact, "--kind", "contact", "--method", "ap", "--vector", "q.mtx"}, {"--vector q.mtx", "no use"});
  solve_refused({contact, "--kind", "contact", "--method", "ap", "--prune", "rest"}, {"--prune rest", "on or off"});
  solve_refused({contact, "--kind", "contact", "--method", "ap", "--velocities", "no/such/folder/u.mtx"},
                {"--velocities no/such/folder/u.mtx", "in a folder that exists"});
  solve_refused({lcp, "--kind", "lcp", "--method", "ap"}, {"--method ap", "no use"});
  for (const auto& [flag, value] : {std::pair("--velocities", "u.mtx"), {"--prune", "on"}, {"--variant", "capped"}})
    solve_refused({lcp, "--kind", "lcp", flag, value}, {flag, value, "no use"});
  solve_refused({lcp, "--kind", "lcp", "--k", "8"}, {"--k 8", "no use"});
  solve_refused({lcp, "--kind", "lcp", "--epsilon", "1e-8"}, {"--epsilon", "no use"});
  solve_refused({lcp, "--kind", "lcp", "--symmetrise"}, {"--symmetrise", "no use"});
  solve_refused({lcp, "--kind", "lcp", "--solver", "lemky"}, {"lemky", "did you mean \"lemke\""});
  solve_refused({lcp, "--kind", "lcp", "--repeat", "0"}, {"--repeat 0"});
  solve_refused({lcp, "--kind", "lcp", "--tolerance", "-1"}, {"--tolerance -1"});
  solve_refused({lcp, "--kind", "lcp", "--time-limit", "nan"}, {"--time-limit nan"});
  solve_refused({lcp, "--kind", "lcp", "--out", "no/such/folder/z.mtx"}, {"--out", "folder"});
  solve_refused({lcp, "--kind", "lcp", "--out", ""}, {"--out"});
  solve_refused({lcp, "--kind", "lcp", "--out", "."}, {"--out .: must name a file"});
  if (has_fclib())
    solve_refused({data + "/problems/gen_free_b2_c1_s1.hdf5", "--kind", "contact", "--method", "ap", "--symmetrise"},
                  {"--symmetrise", "leave it out"});
}

TEST_CASE("broken problem files are refused with their name", "[program]") {
  solve_refused({"nowhere.hdf5", "--kind", "contact", "--method", "ap"}, {"nowhere.hdf5", "cannot be opened"});
  solve_refused({data + "/siconos/lcp_dense.dat", "--kind", "contact", "--method", "ap"}, {"lcp_dense.dat:1"});
  solve_refused({data + "/siconos/friction_dense.dat", "--kind", "lcp"}, {"friction_dense.dat"});
  solve_refused({data, "--kind", "contact", "--method", "ap"}, {"folder"});
  TemporaryDirectory directory;
  const fs::path skew = directory.path() / "skew.dat";
  std::ofstream(skew) << "3 1 0 3 3 3 3\n2 0 0  1 2 0  0 0 2\n-1 0 0\n0.5\n";
  solve_refused({skew.string(), "--kind", "contact", "--method", "ap"}, {"skew.dat", "--symmetrise"});
  const Json answer = solved(directory.path(), {skew.string(), "--kind", "contact", "--method", "ap", "--symmetrise"});
  CHECK(answer["status"] == "ok");
  CHECK(answer["notes"].size() == 1);
  const Result told =
      run(directory.path(), {"solve", skew.string(), "--kind", "contact", "--method", "ap", "--symmetrise"});
  CHECK(told.out.find("\n  note" + std::string(17, ' ') + answer["notes"][0].get<std::string>() + "\n") !=
        std::string::npos);
  const fs::path still = directory.path() / "still.dat";
  std::ofstream(still) << "3 1 0 3 3 3 3\n1 0 0  0 1 0  0 0 1\n0 0 0\n0.5\n";
  solve_refused({still.string(), "--kind", "contact", "--method", "convex", "--epsilon-relative", "1e-6"},
                {"--epsilon-relative", "still.dat has no kinetic energy before the event"});
}

TEST_CASE("the problems that a run saves are solved again to the same energy", "[program]") {
  if (!has_fclib()) return;
  TemporaryDirectory directory;
  const Result made = run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.05", "--out",
                                             "made", "--save-problems", "kept/here", "--save-every", "20", "--quiet"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  const auto files = content(directory.path() / "kept/here");
  const Json run_summary = summary(directory.path() / "made");
  const long events = run_summary["events"];
  REQUIRE(events > 20);
  CHECK(static_cast<long>(files.size()) == (events + 19) / 20);
  const std::string first = "kept/here/event_000000001.hdf5";
  const Json answer = solved(directory.path(), {first, "--kind", "contact", "--method", "ap"});
  CHECK(answer["status"] == "ok");
  CHECK(answer["contacts"] == 4);
  // Saved twice, the same bytes.
  const std::string bytes = read_file(directory.path() / first);
  REQUIRE(run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.05", "--out", "again",
                                 "--save-problems", "kept/again", "--save-every", "20", "--quiet"})
              .code == 0);
  CHECK(read_file(directory.path() / "kept/again/event_000000001.hdf5") == bytes);
}

TEST_CASE("a place for saved problems that cannot be is refused before the run", "[program]") {
  TemporaryDirectory directory;
  const std::vector<std::string> start = {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01"};
  for (const auto& more : std::vector<std::vector<std::string>>{{"--save-every", "2"},
                                                                {"--save-problems", "/dev/null/x"},
                                                                {"--save-problems", ""},
                                                                {"--save-problems", "d", "--save-every", "0"}}) {
    const Result result = run(directory.path(), with(start, more));
    INFO(more[0] << " -> " << result.err);
    CHECK(result.code == 2);
    CHECK(lines(result.err).size() == 1);
    CHECK(result.err.find("--save-") != std::string::npos);
    CHECK(content(directory.path()).empty());
  }
}
