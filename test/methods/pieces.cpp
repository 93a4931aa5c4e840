// What methods share: options and what is asked of an answer, restitution, endings, answers from outside.

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "lcp/lcp.h"
#include "methods/lcp_status.h"
#include "methods/outside.h"
#include "methods/registry.h"
#include "methods/restitution.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// Every field has another value.
MethodOptions all_different() {
  MethodOptions o;
  o.k = 12;
  o.epsilon = 1e-3;
  o.compression_bound = false;
  o.regularise = 0.25;
  o.sweeps = 7;
  o.relaxation = 1.5;
  o.beta = 2;
  o.sigma = 3;
  o.compliance = 4;
  o.impedance = 0.5;
  o.impratio = 6;
  o.warm_start = true;
  return o;
}

const OptionRow& option(const char* method, std::string_view flag) {
  for (const OptionRow& row : find_method(method)->options)
    if (row.flag == flag) return row;
  throw std::logic_error("no such flag");
}

/// Flags of all methods for which something is so.
template <class Test>
std::set<std::string_view> flags(const Test& test) {
  std::set<std::string_view> out;
  for (const MethodRow& row : methods())
    for (const OptionRow& of : row.options)
      if (test(of)) out.insert(of.flag);
  return out;
}

/// A point of 1 kg per contact, free along its normal alone, that comes at 1 m/s.
ContactProblem points(int count) {
  ContactProblem p;
  for (int c = 0; c < count; ++c) {
    p.M.block(p.M.add_block(1))(0, 0) = 1;
    p.v_minus.push_back(-1);
    p.J.add_band();
    p.J.entry(p.J.add_entry(c, 1))(0, 0) = 1;
    p.mu.push_back(0);
    p.restitution.push_back(1);
  }
  p.offset.assign(3 * static_cast<std::size_t>(count), 0.0);
  return p;
}

}  // namespace

TEST_CASE("each flag is that of its own field, under its own name") {
  const std::map<std::string_view, OptionValue> expected = {{"k", 12},
                                                            {"regularise", 0.25},
                                                            {"epsilon", 1e-3},
                                                            {"epsilon-relative", {}},
                                                            {"compression-bound", false},
                                                            {"sweeps", 7},
                                                            {"relaxation", 1.5},
                                                            {"beta", 2.0},
                                                            {"sigma", 3.0},
                                                            {"compliance", 4.0},
                                                            {"impedance", 0.5},
                                                            {"impratio", 6.0},
                                                            {"warm-start", true}};
  std::set<std::string_view> seen;
  for (const MethodRow& row : methods())
    for (const OptionRow& of : row.options) {
      INFO(row.name << " --" << of.flag);
      MethodOptions options = all_different();
      options.variant = of.variant;
      REQUIRE(expected.count(of.flag) == 1);
      CHECK(value_of(of, row.options, options) == expected.at(of.flag));
      CHECK_FALSE(of.summary.empty());
      seen.insert(of.flag);
    }
  CHECK(seen.size() == expected.size());
  CHECK(key(option("convex", "epsilon-relative")) == "epsilon_relative");
  CHECK(key(option("ap", "k")) == "k");
}

TEST_CASE("a flag that another has replaced, or that the variant has no use for, has no value") {
  const auto& convex = find_method("convex")->options;
  MethodOptions options = all_different();
  options.epsilon_relative = 1e-6;
  CHECK(value_of(option("convex", "epsilon"), convex, options) == OptionValue());
  CHECK(value_of(option("convex", "epsilon-relative"), convex, options) == OptionValue(1e-6));
  CHECK(value_of(option("convex", "compression-bound"), convex, options) == OptionValue(false));
  const auto& soft = find_method("soft")->options;
  for (const char* variant : {"sap", "mujoco"}) {
    options.variant = variant;
    for (const char* flag : {"sigma", "beta", "compliance"})
      CHECK((value_of(option("soft", flag), soft, options).index() != 0) == (options.variant == "sap"));
    for (const char* flag : {"impedance", "impratio"})
      CHECK((value_of(option("soft", flag), soft, options).index() != 0) == (options.variant == "mujoco"));
    CHECK(value_of(option("soft", "warm-start"), soft, options) == OptionValue(true));
  }
}

TEST_CASE("flags say where they belong: to the law, the scene, the name of a run, the event before") {
  using Flags = std::set<std::string_view>;
  CHECK(flags([](const OptionRow& of) { return of.of_law; }) == Flags{"k", "epsilon", "epsilon-relative",
                                                                      "compression-bound", "sigma", "beta",
                                                                      "compliance", "impedance", "impratio"});
  CHECK(flags([](const OptionRow& of) { return of.of_scenario; }) == Flags{"k", "compression-bound"});
  CHECK(flags([](const OptionRow& of) { return of.always_named; }) == Flags{"k", "epsilon"});
  CHECK(flags([](const OptionRow& of) { return of.between_events; }) == Flags{"warm-start"});
  const auto is_number = [](const OptionRow& of) { return !std::holds_alternative<bool MethodOptions::*>(of.field); };
  CHECK(flags([&](const OptionRow& of) { return of.positive && is_number(of); }) ==
        Flags{"epsilon", "epsilon-relative", "relaxation", "sigma", "beta", "impratio"});
  CHECK(flags([](const OptionRow& of) { return of.multiple_of != 1; }) == Flags{"k"});
  CHECK(option("ap", "k").least == 4);
  CHECK(option("ap", "k").multiple_of == 2);
  CHECK(option("coulomb", "relaxation").most < 2);
  CHECK(option("coulomb", "relaxation").most > 1.9999999);
  CHECK(option("soft", "impedance").least == 1e-4);
  CHECK(option("soft", "impedance").most == 0.9999);
}

TEST_CASE("what a method is asked stands in the terms of its law, and nothing else does") {
  MethodOptions options = all_different();
  const auto polygon = std::get<PolygonWitness>(find_method("ap")->terms(options));
  CHECK(polygon.k == 12);
  CHECK(polygon.regularisation == 0.25);
  CHECK(polygon.z.empty());
  options.epsilon_relative = 1e-6;
  const auto convex = std::get<ConvexWitness>(find_method("convex")->terms(options));
  CHECK_FALSE(convex.bounded);
  CHECK(convex.epsilon == 1e-3);
  CHECK(convex.epsilon_relative == 1e-6);
  CHECK(std::get<ConvexWitness>(find_method("convex")->terms({})).bounded);
  for (const char* variant : {"sap", "mujoco", ""}) {
    options.variant = variant;
    const Softness softness = std::get<SoftWitness>(find_method("soft")->terms(options)).softness;
    CHECK((softness.rule == Softness::Rule::mujoco) == (options.variant == "mujoco"));
    CHECK(softness.beta == 2);
    CHECK(softness.sigma == 3);
    CHECK(softness.compliance == 4);
    CHECK(softness.impedance == 0.5);
    CHECK(softness.impratio == 6);
  }
  for (const char* method : {"newton", "mirtich", "coulomb"})
    CHECK(std::holds_alternative<NoWitness>(find_method(method)->terms(options)));
}

TEST_CASE(
    "a law is found by its name and by that of a method that claims it, and brings what is asked of its answers") {
  CHECK(find_law("anitescu_potra")->name == "anitescu_potra");
  CHECK(find_law("ap")->name == "anitescu_potra");
  for (const char* name : {"newton", "mirtich", "convex", "coulomb", "soft"}) {
    INFO(name);
    CHECK(find_law(name)->name == name);
    CHECK(method_of_law(*find_law(name))->name == name);
  }
  CHECK(method_of_law(*find_law("ap"))->name == "ap");
  CHECK(find_law("nobody") == nullptr);
  Law unknown = newton_law();
  unknown.name = "nobody's";
  CHECK(method_of_law(unknown) == nullptr);
  CHECK(options_of_law(unknown).empty());
  const auto asked = [](const char* law) {
    std::vector<std::string_view> names;
    for (const OptionRow& of : options_of_law(*find_law(law))) names.push_back(of.flag);
    return names;
  };
  using Names = std::vector<std::string_view>;
  CHECK(asked("ap") == Names{"k"});
  CHECK(asked("convex") == Names{"epsilon", "epsilon-relative", "compression-bound"});
  CHECK(asked("soft") == Names{"sigma", "beta", "compliance", "impedance", "impratio"});
  for (const char* law : {"newton", "mirtich", "coulomb"}) CHECK(asked(law).empty());
}

TEST_CASE("an LCP solver's ending is the event's ending of that name") {
  const std::pair<LcpStatus, Status> endings[] = {{LcpStatus::solved, Status::ok},
                                                  {LcpStatus::inaccurate, Status::inaccurate},
                                                  {LcpStatus::ray, Status::ray},
                                                  {LcpStatus::nonconverged, Status::nonconverged},
                                                  {LcpStatus::cycling, Status::cycling},
                                                  {LcpStatus::singular, Status::singular},
                                                  {LcpStatus::not_finite, Status::not_finite},
                                                  {LcpStatus::memory_limit, Status::memory_limit},
                                                  {LcpStatus::unavailable, Status::unavailable}};
  for (const auto& [lcp, event] : endings) {
    INFO(name(lcp));
    CHECK(status_of(lcp) == event);
    if (lcp != LcpStatus::solved) CHECK(name(lcp) == name(event));
  }
}

// r = 1.5 N s makes 0.5 m/s of -1: E_0 = 1.5 (0.5 - 1) / 2, and e = 1 gives g = 1.5 back, which comes to
// E(theta) = -0.375 + 0.75 theta + 1.125 theta^2 = 0 at theta = 1/3.
TEST_CASE("restitution is scaled where its island would gain energy and that is asked for, and there alone") {
  const ContactProblem p = points(3);
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  Islands islands;
  find_islands(p, islands);
  REQUIRE(islands.count == 3);
  const auto given = [&](std::vector<char> bounded, double expected_scale, std::vector<double> expected) {
    Restitution restitution;
    std::vector<double> impulse = {1.5, 0, 0, 1, 0, 0, 1.5, 0, 0};
    CHECK(restitution.give_back(p, factor, islands, bounded, impulse) == Approx(expected_scale));
    for (int c = 0; c < 3; ++c) {
      const double before = c == 1 ? 1 : 1.5;
      CHECK(restitution.given()[c] == Approx(expected[c]));
      CHECK(impulse[3 * c] == Approx(before + expected[c]));
      CHECK(restitution.v()[c] == Approx(before + expected[c] - 1));
      CHECK(restitution.u()[3 * c] == Approx(before + expected[c] - 1));
    }
  };
  given({1, 1, 1}, 1. / 3, {0.5, 1, 0.5});
  given({1, 0, 0}, 1. / 3, {0.5, 1, 1.5});
  given({0, 1, 1}, 1. / 3, {1.5, 1, 0.5});
  given({0, 1, 0}, 1, {1.5, 1, 1.5});
  given({0, 0, 0}, 1, {1.5, 1, 1.5});
}

TEST_CASE("of what is given back each contact has its own part, and friction has none") {
  ContactProblem p = points(2);
  p.restitution = {0.25, 0.75};
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  Islands islands;
  find_islands(p, islands);
  Restitution restitution;
  std::vector<double> impulse = {2, 3, 4, 8, 5, 6};
  CHECK(restitution.give_back(p, factor, islands, {0, 0}, impulse) == 1);
  CHECK(impulse == std::vector<double>{2.5, 3, 4, 14, 5, 6});
  CHECK(restitution.given() == std::vector<double>{0.5, 6});
}

TEST_CASE("data that cannot be weighed ends an event with what is wrong of it", "[conformance]") {
  for (const char* method : {"convex", "coulomb", "soft"}) {
    const auto ends = [&](const ContactProblem& p) {
      ContactSolution s;
      find_method(method)->make({})(p, s);
      CHECK(s.impulse == std::vector<double>(3 * static_cast<std::size_t>(p.nc()), 0.0));
      return std::pair(s.status, s.reason);
    };
    INFO(method);
    const ContactProblem good = box(0.5, {0.1, -0.0098, 0});
    for (const auto& list :
         {&ContactProblem::v_minus, &ContactProblem::offset, &ContactProblem::mu, &ContactProblem::restitution}) {
      ContactProblem bad = good;
      (bad.*list)[1] = std::nan("");
      CHECK(ends(bad) == std::pair(Status::not_finite, std::string("NaN or infinity in the contact problem")));
    }
    ContactProblem bad = good;
    bad.J.values[7] = HUGE_VAL;
    CHECK(ends(bad).first == Status::not_finite);
    bad = good;
    bad.M.block(0)(2, 2) = -1;
    CHECK(ends(bad) == std::pair(Status::singular, std::string("the mass matrix is not positive definite")));
    bad = good;
    add_contact(bad, -1, {}, -1, {}, ground_axes(), 0.5);
    CHECK(ends(bad) == std::pair(Status::input_error, std::string("contact 4 joins two fixed bodies (W_ii = 0)")));
  }
}

TEST_CASE("a solver that nobody knows is not there, and the options of nsgs reach it") {
  const ContactProblem p = sphere({1, -2, 0}, {0, 0, 0}, 0.1);
  for (const auto& [method, reason] :
       {std::pair("coulomb", "no solver named magic"), std::pair("ap", "no LCP solver named magic")}) {
    MethodOptions options;
    options.solver = "magic";
    ContactSolution s;
    find_method(method)->make(options)(p, s);
    CHECK(s.status == Status::unavailable);
    CHECK(s.reason == reason);
    CHECK(s.impulse == std::vector<double>(3, 0.0));
  }
  MethodOptions options;
  options.solver = "nsgs";
  options.sweeps = 2;
  options.relaxation = 0.5;
  ContactSolution s;
  find_method("coulomb")->make(options)(p, s);
  CHECK(s.status == Status::inaccurate);
  CHECK(s.reason == "the sweeps that were asked for are done");
  CHECK(s.iterations == 2);
  CHECK(s.size == 3);
  CHECK(s.impulse[0] == Approx(0.75 * 2 * 4. / 3 * M_PI));
  CHECK(s.claimed_residual > 1e-3);
}

TEST_CASE(
    "starts from the event before are counted, an island each by convex, and so are those whose answers were taken") {
  // Two boxes that slide apart from each other.
  const auto sliding = [](double speed) {
    ContactProblem p = box(0.3, {speed, -0.0098, 0});
    add_body(p, 1, Vector3d::Constant(1. / 6), {0, -0.0098, -2 * speed});
    for (const double x : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5}) add_contact(p, 1, {x, -0.5, z}, -1, {}, ground_axes(), 0.3);
    return p;
  };
  for (const char* method : {"ap", "convex", "coulomb", "soft"}) {
    INFO(method);
    MethodOptions options;
    options.warm_start = true;
    options.warm_starts = std::make_shared<Counter>(0);
    options.answered_by = std::make_shared<AnsweredBy>();
    const ContactMethod solve = find_method(method)->make(options);
    ContactSolution s;
    solve(sliding(1), s);
    CHECK(s.status == Status::ok);
    CHECK(*options.warm_starts == 0);
    solve(sliding(1.01), s);
    CHECK(s.status == Status::ok);
    CHECK(*options.warm_starts == (method == std::string("convex") ? 2 : 1));
    long answers = 0;
    for (const auto& [who, count] : options.answered_by->counts) answers += count;
    CHECK(answers == (method == std::string("convex") || method == std::string("coulomb") ? 4 : 0));
  }
}

TEST_CASE("an answer from outside is checked for shape and numbers, and keeps what its solver says of it",
          "[outside]") {
  const ContactProblem p = sphere({1, -2, 0}, {0, 0, 0}, 0);
  const double r_n = 2 * 4. / 3 * M_PI;
  int asked = 0;
  const auto answer = [&](std::vector<double> impulse, Status status, const ContactProblem& problem) {
    const MethodRow row =
        outside_row("one", "its summary", *find_law("newton"), [&](const MethodOptions&) -> OutsideSolver {
          return [&](const ContactProblem& of, ContactSolution& solution) {
            ++asked;
            CHECK(solution.impulse == std::vector<double>(3 * static_cast<std::size_t>(of.nc()), 0.0));
            solution.impulse = impulse;
            solution.status = status;
            if (status != Status::ok) solution.reason = "its own word";
            solution.iterations = 11;
            solution.claimed_residual = 0.125;
          };
        });
    CHECK(row.name == "one");
    CHECK(row.summary == "its summary");
    CHECK(row.law.name == "newton");
    ContactSolution out;
    out.iterations = 99;
    row.make({})(problem, out);
    return out;
  };
  const ContactSolution good = answer({r_n, 0, 0}, Status::ok, p);
  CHECK(good.status == Status::ok);
  CHECK(good.impulse == std::vector<double>{r_n, 0, 0});
  CHECK(good.iterations == 11);
  CHECK(good.claimed_residual == 0.125);
  CHECK(good.size == 3);
  const ContactSolution shape = answer({1, 2}, Status::ok, p);
  CHECK(shape.status == Status::input_error);
  CHECK(shape.reason == "the answer holds 2 impulses; 1 contacts need 3 (n, t1, t2 of each)");
  const ContactSolution nan = answer({1, std::nan(""), 0}, Status::ok, p);
  CHECK(nan.status == Status::not_finite);
  CHECK(nan.reason == "the answer holds NaN or infinity");
  const ContactSolution gave_up = answer({}, Status::nonconverged, p);
  CHECK(gave_up.status == Status::nonconverged);
  CHECK(gave_up.reason == "its own word");
  for (const ContactSolution* refused : {&shape, &nan, &gave_up})
    CHECK(refused->impulse == std::vector<double>(3, 0.0));
  CHECK(asked == 4);
  const ContactSolution nothing = answer({}, Status::ok, ContactProblem());
  CHECK(asked == 4);
  CHECK(nothing.status == Status::ok);
  CHECK(nothing.iterations == 0);
}

TEST_CASE("a row from outside has its law's terms and flags, and variants where a flag belongs to one", "[outside]") {
  const auto make = [](const MethodOptions&) -> OutsideSolver { return {}; };
  const MethodRow soft = outside_row("one", "", *find_law("soft"), make),
                  ap = outside_row("one", "", *find_law("ap"), make);
  CHECK(soft.variants == std::vector<std::string_view>{"sap", "mujoco"});
  CHECK(soft.options.size() == 5);
  CHECK(ap.variants.empty());
  REQUIRE(ap.options.size() == 1);
  CHECK(ap.options[0].flag == "k");
  CHECK(std::get<PolygonWitness>(ap.terms(all_different())).k == 12);
  const MethodRow newton = outside_row("one", "", *find_law("newton"), make);
  CHECK(newton.variants.empty());
  const MethodRow external = external_row(*find_law("convex"));
  std::vector<std::string_view> names;
  for (const OptionRow& of : external.options) names.push_back(of.flag);
  CHECK(names == std::vector<std::string_view>{"command", "law", "epsilon", "epsilon-relative", "compression-bound"});
  MethodOptions options;
  CHECK(value_of(external.options[0], external.options, options) == OptionValue());
  options.command = "./mine";
  CHECK(value_of(external.options[0], external.options, options) == OptionValue(std::string("./mine")));
}
