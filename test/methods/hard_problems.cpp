// Stored problems that a solver once could not do.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "methods/drumwright_shell.h"
#include "methods/pruned.h"
#include "methods/registry.h"

using namespace cb;

// bench_random_problems by seed: 976 and 7252 end far off without the dense method, 109340 is the largest of them. Of
// 6169 and 8579 the least sum needs a direct solution of its proof, of 104039 the frictionless problem the dense
// method. In the rest impulses drift apart without a proximal term, or lose as doubles what strong friction multiplies.
TEST_CASE("problems whose masses and friction span decades are solved to a checked 1e-8", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const char* seed :
       {"976", "6169", "7252", "6401", "8169", "8579", "9410", "104039", "105434", "106193", "109340"}) {
    const StoredProblem stored =
        read_contact_problem(std::string(SOURCE_ROOT) + "/scenarios/stress/problems/random_" + seed + ".hdf5");
    ContactSolution s;
    DrumwrightShell({})(stored.problem, s);
    std::vector<double> v_plus;
    INFO("seed " << seed << " " << s.reason);
    CHECK((s.status == Status::ok || s.status == Status::inaccurate));
    CHECK(Referee().check(stored.problem, s, convex_law(), v_plus).model <= 1e-8);
  }
}

// Events of scenes that nothing is wrong with. A box in a corner: contacts that open by 1e-9 m/s are open. Spheres in a
// bowl and beside one: of two islands one is at rest, and all its velocities are rounding. Bricks of a wall, tilted by
// what they sank: rows of 14 contacts depend on each other up to 1e-10. A second phase of restitution, faster than the
// event was. A limit that carries 1e10 times what the contacts do; two jams whose least sum has many shares; and a box
// on a belt, flat but for rounding, whose multipliers excuse an answer that gains energy. A wall in which a contact
// parts by rounding of what moved before: the proof of the least sum covers it. Bricks of which some hardly carry: the
// others take that over. A contact that approaches by less than kappa is known to, which a limit could lift out of what
// friction cannot: an answer that gains energy.
TEST_CASE("what rounding leaves of a velocity is no error, and what is more is no rounding", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const char* name : {"convex_corner",
                           "convex_bowl",
                           "convex_resting_island",
                           "convex_wall",
                           "convex_slow_opening",
                           "convex_light_among_heavy",
                           "convex_second_phase",
                           "convex_limit_carries",
                           "convex_least_sum",
                           "convex_least_sum_wedged",
                           "convex_flat_on_belt",
                           "convex_parts_by_rounding",
                           "convex_lets_go",
                           "convex_limit_lifts",
                           "convex_parts_by_friction",
                           "convex_touches_by_a_hair",
                           "convex_elastic_gap",
                           "convex_proof_beside_rounding",
                           "convex_touches_unevenly",
                           "convex_least_sum_large",
                           "convex_parted_by_rounding"})
    for (const bool bounded : {true, false}) {
      const StoredProblem stored =
          read_contact_problem(std::string(SOURCE_ROOT) + "/test/data/events/" + name + ".hdf5");
      DrumwrightShell::Tolerances tolerances;
      tolerances.bounded = bounded;
      ContactSolution s;
      DrumwrightShell method(tolerances);
      method(stored.problem, s);
      std::vector<double> v_plus;
      Referee referee;
      INFO(name << " bounded " << bounded << " " << s.reason);
      CHECK(s.status == Status::ok);
      CHECK(Referee::holds(referee.check(stored.problem, s, convex_law(), v_plus), 1e-9));
    }
}

// Two hundred bodies that come to rest in a bin, more than the dense method takes: cones too curved for the interior
// point method, which ends at an infeasibility of 2e-2; and how they share their load next to undetermined, so that the
// last steps are long.
TEST_CASE("a heap that comes to rest is answered by proximal points", "[convex]") {
  if (!fclib_available()) return;
  for (const char* name : {"convex_heap", "convex_heap_settling"}) {
    INFO(name);
    const ContactProblem p = read_contact_problem(std::string(TEST_DATA "/events/") + name + ".hdf5").problem;
    DrumwrightShell::Tolerances tolerances;
    tolerances.bounded = false;
    ContactSolution s;
    DrumwrightShell method(tolerances);
    method(p, s);
    CHECK(s.status == Status::ok);
    std::vector<double> v_plus;
    CHECK(Referee::holds(Referee().check(p, s, convex_law(), v_plus), 1e-9));
  }
}

// A corner that parts from rest at 3e-15 m/s beside others of 1e-2: its gap is within epsilon, and more than it has.
TEST_CASE("the convex program's residual counts no last bits of what rests beside others", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const ContactProblem p = read_contact_problem(TEST_DATA "/events/convex_rests_beside.hdf5").problem;
  DrumwrightShell::Tolerances tolerances;
  tolerances.bounded = false;
  tolerances.epsilon_relative = 1e-14;
  ContactSolution s;
  DrumwrightShell method(tolerances);
  method(p, s);
  CHECK(s.status == Status::ok);
  std::vector<double> v_plus;
  Referee referee;
  const Residuals residuals = referee.check(p, s, convex_law(), v_plus);
  CHECK(Referee::holds(residuals, 1e-9));
  CHECK(residuals.model < 1e-9);
}

// A box that falls down a slope, with restitution: in the second phase some contacts have velocities of rounding alone,
// whose error was all of them, so that no answer was better than none. Spheres in a bowl: the same in the first phase.
// And in a third event, of `soft`: near rigid contacts, whose impulses are forty times as wrong as their velocities.
TEST_CASE("contacts that rest beside what moves do not hide its answer", "[coulomb]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const auto holds = [](const char* event, const char* method, std::string solver, std::string variant,
                        const Law& law) {
    INFO(event << " " << method << " " << solver << variant);
    const ContactProblem p = read_contact_problem(std::string(TEST_DATA "/events/") + event + ".hdf5").problem;
    MethodOptions options;
    options.solver = std::move(solver);
    options.variant = std::move(variant);
    ContactSolution s;
    find_method(method)->make(options)(p, s);
    CHECK(s.status == Status::ok);
    std::vector<double> v_plus;
    Referee referee;
    CHECK(Referee::holds(referee.check(p, s, law, v_plus), 1e-9));
  };
  for (const char* solver : {"newton", "nsgs", "admm", "cascade"})
    for (const char* event : {"newton_slope", "coulomb_bowl", "soft_bowl"})
      holds(event, "coulomb", solver, "", coulomb_law());
  // A robot's joint at its limit leaves it, and one that runs into it at 1e-14 rad/s while its body falls away; bodies
  // that rest to rounding beside one that turns; a stack that approaches by rounding alone; a plate on the ground below
  // a stack of 1 g to 100 kg without friction; a rock that slides on the ground while another one lands: what pulls it
  // by 2e-13 N s, solved to 1e-12, drives it. And mu up to 2e4: friction beside normal impulses of rounding.
  for (const char* event : {"coulomb_limit_open", "coulomb_limit_drifts", "coulomb_nothing", "coulomb_next_to_nothing",
                            "coulomb_beside_rounding", "coulomb_pulls_by_rounding", "coulomb_large_mu"})
    holds(event, "coulomb", "newton", "", coulomb_law());
  for (const char* variant : {"sap", "mujoco"}) holds("soft_bowl", "soft", "", variant, soft_law());
}

TEST_CASE("an answer that is off by a millionth at most is one to go on with, and is not called good", "[coulomb]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const auto ends = [](const char* stored, const char* solver) {
    const ContactProblem p = read_contact_problem(std::string(TEST_DATA "/contact/") + stored + ".hdf5").problem;
    MethodOptions options;
    options.solver = solver;
    ContactSolution s;
    find_method("coulomb")->make(options)(p, s);
    CHECK(!s.reason.empty());
    std::vector<double> v_plus;
    Referee referee;
    CHECK(!Referee::holds(referee.check(p, s, coulomb_law(), v_plus), 1e-9));
    return std::pair(s.status, s.claimed_residual);
  };
  const auto [near, near_residual] = ends("sum_tilted_wall", "cascade");
  CHECK(near == Status::inaccurate);
  CHECK(near_residual < 1e-6);
  const auto [far, far_residual] = ends("bound_dense_wall", "cascade");
  CHECK(far == Status::nonconverged);
  CHECK(far_residual > 1e-6);
}

namespace {

/// A stored event, solved by one of ap's solvers.
struct StoredEvent {
  ContactSolution solution;
  double residual;

  StoredEvent(const std::string& name, const char* solver, int k) {
    const StoredProblem stored = read_contact_problem(std::string(SOURCE_ROOT) + "/test/data/events/" + name + ".hdf5");
    MethodOptions options;
    options.solver = solver;
    options.k = k;
    find_method("ap")->make(options)(stored.problem, solution);
    std::vector<double> v_plus;
    residual = Referee().check(stored.problem, solution, anitescu_potra_law(), v_plus).model;
  }
};

/// Every solver of ap answers to the stored events as the referee asks, to `residual`.
void expect_answers(std::initializer_list<const char*> names, int k, double residual) {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const char* name : names)
    for (const char* solver : {"lemke", "path", "ynl"}) {
      const StoredEvent event(name, solver, k);
      INFO(name << " " << solver << " " << k << " edges " << event.solution.reason);
      CHECK(event.solution.status == Status::ok);
      CHECK(event.residual <= residual);
    }
}

}  // namespace

// Boxes on a belt and on a cart, masses 1e3 apart, and a stack with restitution, whose first phase leaves faster
// velocities than there were: vertices within 1e-10 of the event were wrong by 1e-9 of what their lightest contact
// carries.
TEST_CASE("What a light box carries is found as exactly as what a heavy one carries", "[ap]") {
  expect_answers({"ap_cart", "ap_belt", "ap_elastic_stack"}, 4, 1e-12);
}

// Two robots of a campaign: a limit that rests to 1e-14 in a tree that turns, and one whose W has 1e-33 beside the
// other limit's for a zero.
TEST_CASE("What a limit at rest has left by rounding is no error", "[ap]") {
  expect_answers({"ap_limit_at_rest", "ap_limit_apart"}, 4, 1e-9);
}

// A stack whose heavy impulses hide from a solver that its light contact still approaches.
TEST_CASE("An approach is an error beside what approached for solvers of ap too", "[ap]") {
  expect_answers({"ap_light_among_heavy"}, 4, 1e-9);
}

// A wall where a contact that carries nothing has a slip bound of 5e5 m/s, and one by which the others were excused
// 4e-9 of what they carry, a contact at rest that is off by rounding in
// each of four directions, and a limit after restitution, whose own velocity is 1e-14 beside 1e-2: solvers took the
// error of other pairs, or 1e-14 rad/s, for rounding.
TEST_CASE("What solvers of ap excuse is what the referee excuses", "[ap]") {
  expect_answers(
      {"ap_large_slip_bound", "ap_slip_bound_beside", "ap_at_rest_beside", "ap_limit_second_phase", "ap_belt"}, 8,
      1e-9);
  expect_answers({"ap_belt"}, 16, 1e-9);
}

// A stack whose light boxes approach at 1e-11 m/s beside terms of 3 m/s: which of them carries is decided by values
// that a ratio test with an allowance of 1e-12 does not see.
TEST_CASE("Contacts that approach by a hair are told from those that do not", "[ap]") {
  expect_answers({"ap_slow_stack"}, 8, 1e-12);
}

// A stack of boxes at rest, 22 contacts. From a cover of ones the search went through 4000 dead ends first.
TEST_CASE("Ties that lead nowhere do not keep the search from a cover that knows none", "[ynl]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  const StoredEvent event("ap_stack_ties", "ynl", 4);
  INFO(event.solution.iterations << " pivots " << event.solution.reason);
  CHECK(event.solution.status == Status::ok);
  CHECK(event.solution.iterations < 10 * event.solution.size);
  CHECK(event.residual <= 1e-12);
}

// Bricks of a wall, 28 contacts: W is indefinite by its rounding, and all paths ended in a ray 1e-9 from the answer.
TEST_CASE("A ray that rounding makes of a wall at rest ends at its answer", "[path]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const int k : {4, 8}) {
    const StoredEvent event("ap_wall_ray", "path", k);
    INFO(k << " edges, " << event.solution.reason);
    CHECK(event.solution.status == Status::ok);
    CHECK(event.residual <= 1e-10);
  }
}

// Two contacts, one that carries hardly anything: where z_0 comes to zero, so do four other variables, and z_0 was left
// at 2e-15 beside values of 3, past which every path ended in a ray.
TEST_CASE("A covering vector that vanishes together with other variables has led to an answer", "[path]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  const StoredEvent event("ap_cover_vanishes", "path", 4);
  INFO(event.solution.iterations << " pivots " << event.solution.reason);
  CHECK(event.solution.status == Status::ok);
  CHECK(event.solution.iterations < 2 * event.solution.size);
  CHECK(event.residual <= 1e-12);
}

// A wheel of 20 rad/s rolls between two planes that it could jam between: u- is the rounding, 1e-16 of it, and the load
// of the second phase no longer one that impulses without effect cannot oppose. From all covers there are rays then.
TEST_CASE("What rolls where it could jam is answered to what its velocities leave open", "[ap]") {
  expect_answers({"ap_rolls_jammed"}, 8, 1e-9);
}

// At rest against each other in a wedge, u- of rounding: all paths end in rays, with the answer beside each.
TEST_CASE("A ray of rounding has its answer beside it", "[ap]") { expect_answers({"ap_wedge_jammed"}, 8, 1e-9); }

// 15 contacts, many redundant: exchanges wear the dictionary until z_0 leaves where nothing is solved.
TEST_CASE("A vertex of a worn dictionary is followed by one from the matrix", "[ap]") {
  expect_answers({"ap_worn_basis"}, 4, 1e-10);
}

// 76 contacts of a wall: four crashes that led nowhere, and ten thousand pivots of proximal steps, before the path from
// the ray, which takes 40.
TEST_CASE("A crash does not cost more than the path that it is to shorten", "[path]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  const StoredEvent event("ap_wall_crash", "path", 8);
  INFO(event.solution.iterations << " pivots " << event.solution.reason);
  CHECK(event.solution.status == Status::ok);
  CHECK(event.solution.iterations < 2 * event.solution.size);
  CHECK(event.residual <= 1e-12);
}

// Two boxes and four contacts with restitution: Poisson's hypothesis applied to all contacts at once adds 1.28 J to
// 0.80 J.
TEST_CASE("restitution gives back no more energy than compression took", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const StoredProblem stored =
      read_contact_problem(std::string(SOURCE_ROOT) + "/test/data/events/convex_energy_gain.hdf5");
  for (const bool scaled : {true, false})
    for (const bool bounded : {true, false}) {
      DrumwrightShell::Tolerances tolerances;
      tolerances.bounded = bounded;
      tolerances.bounded_restitution = scaled;
      ContactSolution s;
      DrumwrightShell method(tolerances);
      method(stored.problem, s);
      std::vector<double> v_plus;
      Referee referee;
      const Residuals residuals = referee.check(stored.problem, s, convex_law(), v_plus);
      INFO("scaled " << scaled << " bounded " << bounded << " gain " << residuals.energy_gain);
      CHECK(s.status == Status::ok);
      CHECK((s.restitution_scale < 1) == scaled);
      if (!scaled && !bounded) continue;  // there the second phase happens to take it back
      CHECK((residuals.energy_gain <= 1e-13) == scaled);
      CHECK(Referee::holds(residuals, 1e-9) == scaled);
    }
}

// Two contacts of which one alone has restitution: what it gives back adds 0.59 mJ to 0.08 mJ.
TEST_CASE("an island that Poisson's restitution would give energy is left with what it had", "[ap]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  for (const char* solver : {"lemke", "path", "ynl"}) {
    const StoredEvent event("ap_energy_gain", solver, 8);
    INFO(solver << " scale " << event.solution.restitution_scale << " " << event.solution.reason);
    CHECK(event.solution.status == Status::ok);
    CHECK(event.residual <= 1e-12);
    CHECK(event.solution.restitution_scale > 0);
    CHECK(event.solution.restitution_scale < 1);
  }
}

// Asked for no more restitution than that, it has the same two phases at once.
TEST_CASE("pivots of a second phase that gained energy, and was given up, count", "[ap]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  StoredProblem stored = read_contact_problem(std::string(SOURCE_ROOT) + "/test/data/events/ap_energy_gain.hdf5");
  const auto solved = [&] {
    MethodOptions options;
    options.k = 8;
    ContactSolution solution;
    find_method("ap")->make(options)(stored.problem, solution);
    CHECK(solution.status == Status::ok);
    return solution;
  };
  const ContactSolution scaled = solved();
  REQUIRE(scaled.restitution_scale < 1);
  for (double& e : stored.problem.restitution) e *= scaled.restitution_scale;
  const ContactSolution at_once = solved();
  REQUIRE(at_once.restitution_scale == 1);
  CHECK(scaled.iterations > at_once.iterations);  // equal where only the last second phase counts
}

// A wall at rest but for 1e-13 m/s, in whose event a brick elsewhere moves at 1 m/s: what parts by less than that
// rounds by touches, and the proof of the bound is about it.
TEST_CASE("what parts by rounding alone is part of the bound's proof", "[convex][pruned]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  const ContactProblem problem =
      read_contact_problem(std::string(TEST_DATA) + "/events/parts_by_rounding.hdf5").problem;
  const auto left_out = std::make_shared<LeftOut>();
  ContactSolution s;
  pruned(*find_method("convex"), {}, left_out)(problem, s);
  CHECK(s.status == Status::ok);
  std::vector<double> v_plus;
  CHECK(Referee::holds(Referee().check(problem, s, convex_law(), v_plus), 1e-9));
}

namespace {

/// The answer to a stored problem, with the bound: `ok`, and the referee agrees.
ContactSolution checked_answer(const std::string& name, const ContactProblem& problem) {
  ContactSolution s;
  DrumwrightShell({})(problem, s);
  std::vector<double> v_plus;
  const Residuals residuals = Referee().check(problem, s, convex_law(), v_plus);
  INFO(name << " " << s.reason << " " << Referee::refusal(residuals, 1e-9));
  CHECK(s.status == Status::ok);
  CHECK(Referee::holds(residuals, 1e-9));
  return s;
}

ContactProblem test_problem(const std::string& name) {
  return read_contact_problem(std::string(TEST_DATA) + "/" + name + ".hdf5").problem;
}

}  // namespace

// Islands of random scenes (piles, walls, corners) that hold each other up but for a tilt of 1e-9 to 1e-6: (1) has no
// strictly feasible point, or multipliers of the inverse.
TEST_CASE("a bound that leaves no room is missed by no more than what is accepted", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const std::string name :
       {"contact/bound_bin", "contact/bound_wall", "contact/bound_corner", "contact/bound_three_in_line",
        "contact/bound_weak_direction", "contact/bound_tilt_1e-9", "contact/bound_large_multiplier",
        "contact/bound_gap_at_rounding", "contact/bound_dense_wall", "contact/bound_pile"})
    checked_answer(name, test_problem(name));
}

// Strong friction: what its multipliers make of rounding is up to thirty times smaller in some iterate than in the
// last.
TEST_CASE("of the dense method's iterates that with the best proof is the answer", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const auto& [name, gap] : {std::pair("2589", 1e-4), {"919578", 1e-3}, {"8540", 0.5}}) {  // J
    const StoredProblem stored = read_contact_problem(std::string(TEST_DATA "/hardest/random_") + name + ".hdf5");
    DrumwrightShell::Tolerances tolerances;
    tolerances.epsilon_relative = 1e-14;
    ContactSolution s;
    DrumwrightShell{tolerances}(stored.problem, s);
    INFO(name << " " << s.reason);
    std::vector<double> v_plus;
    const Residuals found = Referee().check(stored.problem, s, convex_law(), v_plus);
    REQUIRE(found.gap);
    CHECK(std::abs(*found.gap) <= gap);
  }
}

// An impact between light bodies under heavy ones: what touches is said by the rounding of the impulses that there are.
TEST_CASE("a contact that parts by more than its impulses round is open in the least sum", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  checked_answer("convex_light_contacts", test_problem("events/convex_light_contacts"));
}

TEST_CASE("the least sum is found and proven where contacts depend on each other up to rounding", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const std::string name :
       {"contact/sum_wall", "contact/sum_tilted_wall", "contact/sum_light_between_heavy", "contact/sum_opens_slowly",
        "contact/sum_at_rounding", "contact/sum_turns", "robots/grasp_bound_on"}) {
    const ContactProblem problem = test_problem(name);
    ContactSolution s = checked_answer(name, problem);
    for (double& f : s.as<ConvexWitness>().frictionless) f *= 2;
    std::vector<double> v_plus;
    INFO(name << ": a sum twice as large is none");
    CHECK_FALSE(Referee::holds(Referee().check(problem, s, convex_law(), v_plus), 1e-9));
  }
}

// An event of scenarios/stress/units.xml (T2, N1): one box slides on another that it is tilted against by 1e-5 rad, and
// the bound on compression acts through multipliers of the inverse. As rows of one program they left 1e-7 m/s open.
TEST_CASE("the bound's answer does not hang on the order of contacts that hardly tilt", "[convex]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const ContactProblem given =
      read_contact_problem(std::string(SOURCE_ROOT) + "/scenarios/stress/problems/tilted_boxes.hdf5").problem;
  ContactProblem reversed;
  reversed.M = given.M;
  reversed.v_minus = given.v_minus;
  for (int c = given.nc() - 1; c >= 0; --c) {
    reversed.J.add_band();
    for (int e = given.J.band[c]; e < given.J.band[c + 1]; ++e)
      reversed.J.entry(reversed.J.add_entry(given.J.block[e], static_cast<int>(given.J.entry(e).cols()))) =
          given.J.entry(e);
    reversed.mu.push_back(given.mu[c]);
    reversed.restitution.push_back(given.restitution[c]);
    reversed.offset.insert(reversed.offset.end(), given.offset.begin() + 3 * c, given.offset.begin() + 3 * c + 3);
  }
  std::vector<double> v[2];
  for (const bool turned : {false, true}) {
    const ContactProblem& problem = turned ? reversed : given;
    DrumwrightShell::Tolerances tolerances;
    tolerances.epsilon_relative = 1e-14;
    ContactSolution s;
    DrumwrightShell method(tolerances);
    method(problem, s);
    CHECK(s.status == Status::ok);
    CHECK(Referee().check(problem, s, convex_law(), v[turned]).model <= 1e-11);
  }
  for (std::size_t i = 0; i < v[0].size(); ++i) CHECK(v[0][i] == Approx(v[1][i]).epsilon(0).margin(1e-10));
}

// The sixth event of M1 at 1e6, of 9800 N s on 1 kg: each of five covers of Lemke's method ends in a vertex that the
// check refuses, the best of them with 8e-7 m/s where nothing moves.
TEST_CASE("Lemke's method tries further covers where heavy bodies on light ones spoil the first", "[ap]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const StoredProblem stored =
      read_contact_problem(std::string(SOURCE_ROOT) + "/scenarios/stress/problems/heavier_on_light.hdf5");
  MethodOptions options;
  options.solver = "lemke";
  ContactSolution s;
  find_method("ap")->make(options)(stored.problem, s);
  CHECK(s.status == Status::ok);
  std::vector<double> v_plus;
  CHECK(Referee().check(stored.problem, s, anitescu_potra_law(), v_plus).model <= 1e-12);
}

namespace {

ContactProblem stored_problem(const std::string& name) {
  return read_contact_problem(std::string(TEST_DATA) + "/contact/" + name + ".hdf5").problem;
}

Status solve_ap(const ContactProblem& problem, const char* solver, int k, double& residual) {
  MethodOptions options;
  options.solver = solver;
  options.k = k;
  ContactSolution s;
  find_method("ap")->make(options)(problem, s);
  std::vector<double> v_plus;
  residual = Referee().check(problem, s, anitescu_potra_law(), v_plus).model;
  UNSCOPED_INFO(solver << ", " << s.iterations << " pivots: " << s.reason);
  return s.status;
}

/// The same problem with the contacts in a ring, from `first` on.
ContactProblem from_contact(const ContactProblem& given, int first) {
  ContactProblem out;
  out.M = given.M;
  out.v_minus = given.v_minus;
  for (int i = 0; i < given.nc(); ++i) {
    const int c = (first + i) % given.nc();
    out.J.add_band();
    for (int e = given.J.band[c]; e < given.J.band[c + 1]; ++e)
      out.J.entry(out.J.add_entry(given.J.block[e], static_cast<int>(given.J.entry(e).cols()))) = given.J.entry(e);
    out.offset.insert(out.offset.end(), given.offset.begin() + 3 * c, given.offset.begin() + 3 * c + 3);
    out.mu.push_back(given.mu[c]);
    out.restitution.push_back(given.restitution[c]);
  }
  return out;
}

}  // namespace

// A body rolls at 1 m/s on contacts whose velocities are 1e-16 m/s: an island that another one's event found at rest.
// As a velocity v+ to be found, what the contacts see of it was rounding.
TEST_CASE("an island at rest that rolls is solved like one that falls, at any scale of its velocities", "[ap]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const ContactProblem given = stored_problem("resting_island");
  for (const char* solver : {"lemke", "path", "ynl"})
    for (const int power : {-56, -20, 0, 20}) {
      ContactProblem problem = given;
      for (double& v : problem.v_minus) v = std::ldexp(v, power);
      double residual = 1;
      CAPTURE(solver, power);
      CHECK(solve_ap(problem, solver, 8, residual) == Status::ok);
    }
}

// Events of scenarios/grasp.xml at k = 8: the pads' corners are redundant but for 1e-9, so bases of Lemke's path are
// all but singular and its vertices infeasible by 1e-9 and more. The first took 4302 pivots and ended inaccurate. Which
// vertex the path first comes to hangs on rounding, and so on the order of the contacts. From some orders a repair
// brings nothing and the next one, under another perturbation, does: one that gains nothing is no reason to stop.
TEST_CASE("Lemke's method goes on from a vertex that is all but right to the exact one", "[ap]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problems are not read");
    return;
  }
  for (const char* name : {"grasp_k8_1437", "grasp_k8_884"}) {
    const ContactProblem given = stored_problem(name);
    for (int first = 0; first < given.nc(); ++first) {
      double residual = 1;
      CAPTURE(name, first);
      CHECK(solve_ap(from_contact(given, first), "lemke", 8, residual) == Status::ok);
      CHECK(residual <= 1e-13);
    }
  }
}

// An arm whose joints cannot move its tip along a direction of friction: that diagonal is 1e-34, and as the scale of
// its pair it made the load of the event 1e17 times what it is. Any answer was accurate then, where v+ was not
// eliminated.
TEST_CASE("a contact along which an arm cannot move does not make the event a large one", "[ap]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  for (const char* name : {"arm_beside_contact", "arm_pushes_box"})
    for (const char* solver : {"lemke", "path", "ynl"}) {
      double residual = 1;
      CAPTURE(name, solver);
      CHECK(solve_ap(stored_problem(name), solver, 8, residual) == Status::ok);
      CHECK(residual <= 1e-9);
    }
}
