// What pruning leaves out changes nothing in the answer: every method and solver, with and without.

#include "methods/pruned.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "methods/choices.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

std::vector<Choice> pruned_choices() {
  std::vector<Choice> all;
  const auto add = [&](const char* method, const char* solver, const char* variant, int k, bool bound) {
    Choice choice{find_method(method), {}, std::string(method) + ' ' + solver + variant + (bound ? "" : " unbounded")};
    choice.options.solver = solver;
    choice.options.variant = variant;
    choice.options.k = k;
    choice.options.compression_bound = bound;
    all.push_back(choice);
  };
  add("newton", "", "uncapped", 4, true);
  add("newton", "", "stick-tested", 4, true);
  add("mirtich", "", "", 4, true);
  for (const int k : {4, 8, 14})
    for (const char* solver : {"lemke", "path", "ynl"}) add("ap", solver, "", k, true);
  add("convex", "ipm", "", 4, true);
  add("convex", "ipm", "", 4, false);
  for (const char* rule : {"sap", "mujoco"}) add("soft", "", rule, 4, true);
  return all;
}

/// The bodies and contacts of both, side by side.
ContactProblem beside(ContactProblem a, const ContactProblem& b) {
  const int first = a.M.blocks();
  for (int i = 0; i < b.M.blocks(); ++i) {
    const int block = a.M.add_block(b.M.block_size(i));
    a.M.block(block) = b.M.block(i);
  }
  for (int c = 0; c < b.nc(); ++c) {
    a.J.add_band();
    for (int e = b.J.band[c]; e < b.J.band[c + 1]; ++e) {
      const int entry = a.J.add_entry(first + b.J.block[e], static_cast<int>(b.J.entry(e).cols()));
      a.J.entry(entry) = b.J.entry(e);
    }
  }
  const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(a.v_minus, b.v_minus);
  append(a.offset, b.offset);
  append(a.mu, b.mu);
  append(a.restitution, b.restitution);
  return a;
}

struct Answer {
  ContactSolution solution;
  std::vector<double> v_plus;
  bool holds = false;
};

Answer judge(const ContactMethod& method, const MethodRow& row, const ContactProblem& problem) {
  Answer answer;
  method(problem, answer.solution);
  Referee referee;
  const Residuals residuals = referee.check(problem, answer.solution, row.law, answer.v_plus);
  answer.holds = answer.solution.status == Status::ok && Referee::holds(residuals, 1e-9);
  return answer;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace

TEST_CASE("leaving out what an event does not need leaves every unique motion as it is", "[pruned]") {
  struct Case {
    const char* name;
    ContactProblem problem;
    long islands, closed;  // with ap
  };
  const ContactProblem sticks = sphere({1, -10, 0.4}, {0, 0, 0}), slides = sphere({20, -3, 1}, {0, 2, 0});
  const ContactProblem leaves = sphere({3, 2, 0}, {0, 0, 0}), rests = box(0.5, {0, -0.0098, 0});
  const std::vector<Case> cases = {
      {"a sphere sticks", sticks, 0, 1},
      {"a sphere slides", slides, 0, 1},
      {"a sphere without friction", sphere({1, -1, 0.3}, {0, 0, 0}, 0), 0, 1},
      {"a sphere leaves", leaves, 0, 0},
      {"two spheres apart", beside(sticks, slides), 2, 2},
      {"a box beside a sphere that leaves", beside(rests, leaves), 2, 0},
      {"two boxes and a sphere apart", beside(beside(rests, slides), rests), 3, 1},
      {"a stack beside a sliding box", beside(stack(2, 0.5, {0, -0.0098, 0}), box(0.1, {0.5, -0.0098, 0})), 2, 0}};
  for (const Choice& choice : pruned_choices())
    for (const Case& c : cases) {
      INFO(choice.label << ": " << c.name);
      const auto left_out = std::make_shared<LeftOut>();
      const Answer plain = judge(choice.row->make(choice.options), *choice.row, c.problem);
      const Answer less = judge(pruned(*choice.row, choice.options, left_out), *choice.row, c.problem);
      CHECK(plain.holds);
      CHECK(less.holds);
      double fastest = 0;
      for (const double v : c.problem.v_minus) fastest = std::max(fastest, std::abs(v));
      CHECK(distance(plain.v_plus, less.v_plus) <= 1e-10 * fastest);
      if (choice.row->law == anitescu_potra_law()) {
        CHECK(left_out->islands == c.islands);
        CHECK(left_out->closed_forms == c.closed);
      }
    }
}

TEST_CASE("a box that rests has nothing to leave out, and its answer is the same to the last bit", "[pruned]") {
  for (const Choice& choice : pruned_choices()) {
    INFO(choice.label);
    const auto left_out = std::make_shared<LeftOut>();
    ContactSolution plain, less;
    choice.row->make(choice.options)(box(0.5, {0.01, -0.0098, 0}), plain);
    pruned(*choice.row, choice.options, left_out)(box(0.5, {0.01, -0.0098, 0}), less);
    REQUIRE(plain.impulse.size() == less.impulse.size());
    CHECK(std::memcmp(plain.impulse.data(), less.impulse.data(), plain.impulse.size() * sizeof(double)) == 0);
    CHECK(left_out->islands + left_out->closed_forms == 0);
  }
}

TEST_CASE("each thing left out can be left in", "[pruned]") {
  const MethodRow& row = *find_method("ap");
  const ContactProblem apart =
      beside(beside(box(0.5, {0, -0.0098, 0}), sphere({20, -3, 1}, {0, 2, 0})), sphere({3, 2, 0}, {0, 0, 0}));
  const Answer plain = judge(row.make({}), row, apart);
  for (int item = 0; item < 2; ++item) {
    PruneOptions prune;
    (item == 0 ? prune.islands : prune.closed_forms) = false;
    const auto left_out = std::make_shared<LeftOut>();
    const Answer less = judge(pruned(row, {}, left_out, prune), row, apart);
    INFO("without item " << item);
    CHECK(less.holds);
    CHECK(distance(plain.v_plus, less.v_plus) <= 1e-10);
    CHECK((left_out->islands == 0) == (item == 0));
    CHECK(left_out->closed_forms == 0);
  }
}

// A stack that is pushed, on ice and with ice below every second box, by the dense and the sparse form of the LCP.
TEST_CASE("the friction of contacts without any gets no unknowns, and nothing else changes", "[pruned]") {
  for (const Choice& choice : pruned_choices())
    for (const int boxes : {1, 2, 8})
      for (const double mu : {0.0, 0.5})
        for (const double e : {0.0, 0.3}) {
          if (choice.row->law != anitescu_potra_law()) continue;
          INFO(choice.label << ", " << boxes << " boxes, mu = " << mu << ", e = " << e);
          ContactProblem p = stack(boxes, 0, {0.3, -1, 0.1});
          for (int c = 0; c < p.nc(); ++c) p.mu[c] = c / 4 % 2 == 1 ? mu : 0;
          std::fill(p.restitution.begin(), p.restitution.end(), e);
          const long idle = e == 0 ? std::count(p.mu.begin(), p.mu.end(), 0.0) : 0;
          const auto left_out = std::make_shared<LeftOut>();
          const Answer plain = judge(choice.row->make(choice.options), *choice.row, p);
          const Answer less = judge(pruned(*choice.row, choice.options, left_out), *choice.row, p);
          CHECK(plain.holds);
          CHECK(less.holds);
          CHECK(distance(plain.v_plus, less.v_plus) <= 1e-10);
          CHECK(left_out->idle_friction == idle);
          CHECK(plain.solution.size - less.solution.size == (choice.options.k + 1) * idle);
        }
}

TEST_CASE("friction left out is counted on islands that the method solves, and not where a closed form does",
          "[pruned]") {
  const MethodRow& ap = *find_method("ap");
  const ContactProblem on_ice = box(0, {1, -0.5, 0.2}), p = beside(beside(on_ice, box(0.5, {1, -0.5, 0.2})), on_ice);
  for (const auto& [problem, idle] :
       {std::pair(on_ice, 4L), {p, 8L}, {beside(p, sphere({1, -1, 0.3}, {0, 0, 0}, 0)), 8L}}) {
    const auto left_out = std::make_shared<LeftOut>();
    CHECK(judge(pruned(ap, {}, left_out), ap, problem).holds);
    CHECK(left_out->idle_friction == idle);
  }
}

TEST_CASE("what a solver answers depends on the island at hand, not on those before", "[pruned]") {
  for (const Choice& choice : pruned_choices()) {
    INFO(choice.label);
    const auto left_out = std::make_shared<LeftOut>();
    const ContactMethod method = pruned(*choice.row, choice.options, left_out);
    ContactSolution alone, after;
    for (const double random : {0.0, 1e-17, 1e-3, 1e-16, 1e-2}) {
      const ContactProblem p = stack(16, 0.5, {0, -0.0098, 0}, random);
      method(p, after);
      pruned(*choice.row, choice.options, left_out)(p, alone);
      CHECK(alone.impulse == after.impulse);
      CHECK(alone.iterations == after.iterations);
    }
  }
}

TEST_CASE("the closed form of a sphere meets the polygon's answer in every direction", "[pruned]") {
  for (int k : {4, 6, 8, 16})
    for (int i = 0; i < 40; ++i) {
      const double angle = 2 * M_PI * i / 40;
      for (double speed : {0.1, 1.9, 2.2, 30.0}) {
        INFO(k << " edges, slip " << speed << " at " << angle);
        MethodOptions options;
        options.k = k;
        const ContactProblem p = sphere({speed * std::cos(angle), -1, speed * std::sin(angle)}, {0, 0, 0});
        const auto left_out = std::make_shared<LeftOut>();
        const MethodRow& row = *find_method("ap");
        const Answer plain = judge(row.make(options), row, p), less = judge(pruned(row, options, left_out), row, p);
        CHECK(left_out->closed_forms == 1);
        CHECK(less.holds);
        CHECK(distance(plain.v_plus, less.v_plus) <= 1e-12 * (1 + speed));
      }
    }
}

TEST_CASE("an island that is handed over after all counts as no closed form", "[pruned]") {
  // A sphere that has one and an end of a capsule that has none, its contact off the centre: convex takes all or
  // nothing.
  ContactProblem leaning;
  add_body(leaning, 1, Vector3d(0.1, 0.2, 0.3), {0.3, -1, 0.2}, {1, 2, 3});
  add_contact(leaning, 0, {0.4, -0.3, 0.1}, -1, {}, ground_axes(), 0.5);
  const ContactProblem both = beside(sphere({1, -10, 0}, {0, 2, 0}), leaning);
  const MethodRow& row = *find_method("convex");
  const auto left_out = std::make_shared<LeftOut>();
  CHECK(judge(pruned(row, {}, left_out, {}), row, both).holds);
  CHECK(left_out->closed_forms == 0);
}

namespace {

/// `coulomb` that leaves out what rests, and how often it was asked.
struct Counted {
  int calls = 0;
  Status status = Status::ok;  // that it claims
  std::shared_ptr<LeftOut> left_out = std::make_shared<LeftOut>();
  ContactMethod method;
  ContactSolution solution;

  Counted() {
    MethodRow row = *find_method("coulomb");
    row.make = [this, make = row.make](const MethodOptions& options) -> ContactMethod {
      return [this, asked = make(options)](const ContactProblem& problem, ContactSolution& out) {
        ++calls;
        asked(problem, out);
        if (status != Status::ok) out.status = status;
      };
    };
    method = pruned(row, {}, left_out, {.repeats = true});
  }
  const ContactSolution& ask(const ContactProblem& problem) {
    method(problem, solution);
    return solution;
  }
};

}  // namespace

TEST_CASE("what comes a third time to the last bit is not asked about, what differs in one number is", "[pruned]") {
  ContactProblem problem = stack(3, 0.5, {0.3, -1, 0.1});
  for (int part = 0; part < 7; ++part) {
    INFO("part " << part);
    Counted counted;
    const std::vector<double> impulse = counted.ask(problem).impulse;
    CHECK(counted.ask(problem).iterations > 0);
    CHECK(counted.calls == 2);
    CHECK(counted.ask(problem).impulse == impulse);
    CHECK(counted.solution.iterations == 0);
    CHECK(counted.calls == 2);
    CHECK(counted.left_out->repeats == 1);
    ContactProblem other = problem;
    double* number[] = {&other.v_minus.back(), &other.J.values[40], &other.M.values[0],
                        &other.offset.back(),  &other.mu.back(),    &other.restitution.back()};
    if (part == 6)
      other.J.block[other.J.band[8]] = 0;  // a corner of the third box on the first
    else
      *number[part] = part == 5 ? 1e-3 : *number[part] + 1e-3;
    ContactSolution afresh;
    find_method("coulomb")->make({})(other, afresh);
    CHECK(counted.ask(other).impulse == afresh.impulse);
    CHECK(counted.calls == 3);
    CHECK(counted.ask(problem).impulse == impulse);  // another came between
    CHECK(counted.calls == 4);
    CHECK(counted.left_out->repeats == 1);
  }
}

TEST_CASE("islands that rest are not asked about while another moves, nor is what was not solved kept", "[pruned]") {
  const ContactProblem rests = box(0.5, {0, -0.0098, 0});
  Counted counted;
  for (int i = 0; i < 5; ++i) {
    const ContactProblem moves = stack(2, 0.3, {0.1 * i, -1, 0});
    counted.ask(beside(beside(rests, moves), rests));
    CHECK(counted.solution.status == Status::ok);
  }
  CHECK(counted.calls == 5 + 2 * 2);  // twins that rest are one problem, and yet two calls until it is known
  CHECK(counted.left_out->repeats == 3 * 2);
  Counted doubtful;
  doubtful.status = Status::inaccurate;
  for (int i = 0; i < 5; ++i) doubtful.ask(rests);
  CHECK(doubtful.calls == 5);
}

TEST_CASE("the restitution that an event is left with is that of its worst island, whichever comes last", "[pruned]") {
  if (!fclib_available()) {
    WARN("no HDF5 in this build: the stored problem is not read");
    return;
  }
  const ContactProblem gains = read_contact_problem(TEST_DATA "/events/ap_energy_gain.hdf5").problem;
  const ContactProblem rests = box(0.5, {0, -0.0098, 0});
  const MethodRow& row = *find_method("ap");
  MethodOptions options;
  options.k = 8;
  const auto scale = [&](const ContactProblem& problem) {
    ContactSolution solution;
    pruned(row, options, std::make_shared<LeftOut>())(problem, solution);
    CHECK(solution.status == Status::ok);
    return solution.restitution_scale;
  };
  const double alone = scale(gains);
  CHECK(alone < 1);
  CHECK(scale(rests) == 1);
  CHECK(scale(beside(gains, rests)) == Approx(alone));
  CHECK(scale(beside(rests, gains)) == Approx(alone));
}

TEST_CASE("islands solved at once are answered and counted as one after the other, to the last bit", "[pruned]") {
  const ContactProblem slides = sphere({20, -3, 1}, {0, 2, 0}), rests = box(0.5, {0, -0.0098, 0});
  ContactProblem apart = beside(beside(stack(3, 0.5, {0.3, -1, 0.1}), slides), box(0.1, {0.5, -0.0098, 0}));
  for (int i = 0; i < 6; ++i) apart = beside(beside(apart, rests), stack(2, 0.3, {0.1 * i, -1, 0}));
  REQUIRE(apart.nc() >= 64);  // fewer are not worth two threads
  std::vector<Choice> all = pruned_choices();
  for (const char* solver : {"newton", "nsgs", "admm"}) {
    all.push_back({find_method("coulomb"), {}, std::string("coulomb ") + solver});
    all.back().options.solver = solver;
  }
  for (const Choice& choice : all)
    for (const bool warm : {false, true})
      for (const double e : {0.0, 0.5}) {
        INFO(choice.label << ", e = " << e << (warm ? ", warm" : ""));
        std::fill(apart.restitution.begin(), apart.restitution.end(), e);
        struct {
          ContactSolution first, second;
          LeftOut left_out;
          long warm_starts;
          std::map<std::string_view, long> answered_by;
        } of[2];
        for (const int at_once : {0, 1}) {
          MethodOptions options = choice.options;
          options.warm_start = warm;
          options.threads = 1 + 2 * at_once;
          options.warm_starts = std::make_shared<Counter>(0);
          options.answered_by = std::make_shared<AnsweredBy>();
          const auto left_out = std::make_shared<LeftOut>();
          const ContactMethod method = pruned(*choice.row, options, left_out);
          method(apart, of[at_once].first);
          ContactProblem next = apart;
          for (double& v : next.v_minus) v *= 0.999;
          method(next, of[at_once].second);
          of[at_once].left_out = *left_out;
          of[at_once].warm_starts = *options.warm_starts;
          of[at_once].answered_by = options.answered_by->counts;
        }
        for (const auto which : {&std::decay_t<decltype(of[0])>::first, &std::decay_t<decltype(of[0])>::second}) {
          const ContactSolution &alone = of[0].*which, &at_once = of[1].*which;
          CHECK(alone.status == at_once.status);
          CHECK(alone.impulse == at_once.impulse);
          CHECK(alone.iterations == at_once.iterations);
          CHECK(alone.size == at_once.size);
          CHECK(alone.claimed_residual == at_once.claimed_residual);
          CHECK(alone.restitution_scale == at_once.restitution_scale);
        }
        CHECK(of[0].left_out.islands == of[1].left_out.islands);
        CHECK(of[0].left_out.closed_forms == of[1].left_out.closed_forms);
        CHECK(of[0].left_out.idle_friction == of[1].left_out.idle_friction);
        CHECK(of[0].warm_starts == of[1].warm_starts);
        CHECK(of[0].answered_by == of[1].answered_by);
      }
}
