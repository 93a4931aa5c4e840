// What pruning leaves out changes nothing in the answer: every method and solver, with and without.

#include "methods/pruned.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "contact/referee.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

struct Choice {
  const MethodRow* row;
  MethodOptions options;
  std::string label;
};

std::vector<Choice> choices() {
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

std::vector<std::pair<Choice, ContactProblem>> all_of(const std::vector<Choice>& choices,
                                                      const std::vector<ContactProblem>& problems) {
  std::vector<std::pair<Choice, ContactProblem>> all;
  for (const Choice& choice : choices)
    for (const ContactProblem& problem : problems) all.emplace_back(choice, problem);
  return all;
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
    long islands, parted, closed;  // with ap; -1: not counted here
  };
  const ContactProblem sticks = sphere({1, -10, 0.4}, {0, 0, 0}), slides = sphere({20, -3, 1}, {0, 2, 0});
  const ContactProblem leaves = sphere({3, 2, 0}, {0, 0, 0}), rests = box(0.5, {0, -0.0098, 0});
  const std::vector<Case> cases = {
      {"a sphere sticks", sticks, 0, 0, 1},
      {"a sphere slides", slides, 0, 0, 1},
      {"a sphere without friction", sphere({1, -1, 0.3}, {0, 0, 0}, 0), 0, 0, 1},
      {"a sphere leaves", leaves, 0, 1, 0},
      {"two spheres apart", beside(sticks, slides), 2, 0, 2},
      {"a box beside a sphere that leaves", beside(rests, leaves), 0, 1, 0},
      {"two boxes and a sphere apart", beside(beside(rests, slides), rests), 3, 0, 1},
      {"a stack beside a sliding box", beside(stack(2, 0.5, {0, -0.0098, 0}), box(0.1, {0.5, -0.0098, 0})), 2, 0, 0}};
  for (const Choice& choice : choices())
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
        CHECK(left_out->parted_contacts == c.parted);
        CHECK(left_out->closed_forms == c.closed);
      }
    }
}

TEST_CASE("a contact brought back does not become an island of its own beside the rest of its island", "[pruned]") {
  // Three spheres on each other. The lowest hits the ground; the middle one leaves it fast, and the uppermost leaves
  // the middle one so slowly, while it slides, that the certificate of convex fails. Its bound spans all three.
  ContactProblem p;
  const std::vector<Vector3d> velocities = {{0.5, -1, 0}, {0, 5, 0}, {3, 5.01, 0}};
  for (int i = 0; i < 3; ++i) {
    add_body(p, 1, Vector3d::Constant(0.4), velocities[i]);
    add_contact(p, i, {0, -1, 0}, i - 1, {0, 1, 0}, ground_axes(), 0.5);
  }
  for (const Choice& choice : choices()) {
    INFO(choice.label);
    const auto left_out = std::make_shared<LeftOut>();
    const Answer plain = judge(choice.row->make(choice.options), *choice.row, p);
    const Answer less = judge(pruned(*choice.row, choice.options, left_out), *choice.row, p);
    CHECK(plain.holds);
    CHECK(less.holds);
    CHECK(distance(plain.v_plus, less.v_plus) <= 1e-10 * 5);
    if (choice.row->law == convex_law() && choice.options.compression_bound) {
      CHECK(left_out->brought_back == 2);
      CHECK(left_out->parted_contacts == 0);
    }
  }
}

TEST_CASE("a box that rests has nothing to leave out, and its answer is the same to the last bit", "[pruned]") {
  for (const Choice& choice : choices()) {
    INFO(choice.label);
    const auto left_out = std::make_shared<LeftOut>();
    ContactSolution plain, less;
    choice.row->make(choice.options)(box(0.5, {0.01, -0.0098, 0}), plain);
    pruned(*choice.row, choice.options, left_out)(box(0.5, {0.01, -0.0098, 0}), less);
    REQUIRE(plain.impulse.size() == less.impulse.size());
    CHECK(std::memcmp(plain.impulse.data(), less.impulse.data(), plain.impulse.size() * sizeof(double)) == 0);
    CHECK(left_out->islands + left_out->parted_contacts + left_out->closed_forms + left_out->solver_calls == 0);
  }
}

// The left corners of a turning box hit; the impulse turns it back, and the right corners, which parted, come down.
TEST_CASE("a contact that was left out and approaches after all is brought back", "[pruned]") {
  // Smooth, at 3 rad/s they would just rest: slower by 1e-3 they approach at 2e-4 of the fastest.
  const ContactProblem fast = box(0.3, {0, -1, 0}, {0, 0, 2.5}), slow = box(0, {0, -1, 0}, {0, 0, 3 - 1e-3});
  for (const auto& [choice, p] : all_of(choices(), {fast, slow})) {
    INFO(choice.label << ", turning at " << p.v_minus[5]);
    const auto left_out = std::make_shared<LeftOut>();
    const Answer plain = judge(choice.row->make(choice.options), *choice.row, p);
    const Answer less = judge(pruned(*choice.row, choice.options, left_out), *choice.row, p);
    CHECK(plain.holds);
    CHECK(less.holds);
    if (choice.row->law == convex_law() || choice.row->law == anitescu_potra_law()) {
      CHECK(left_out->brought_back >= 1);
      CHECK(distance(plain.v_plus, less.v_plus) <= 1e-10);
    } else {  // sweeps may meet a contact that parts on the way: it stays
      CHECK(left_out->parted_contacts == 0);
      CHECK(plain.v_plus == less.v_plus);
    }
  }
}

TEST_CASE("where every contact parts no solver is called", "[pruned]") {
  for (const Choice& choice : choices()) {
    INFO(choice.label);
    const auto left_out = std::make_shared<LeftOut>();
    const ContactProblem p = sphere({0, 2, 0}, {0, 0, 0});
    const Answer less = judge(pruned(*choice.row, choice.options, left_out), *choice.row, p);
    CHECK(less.holds);
    CHECK(left_out->solver_calls == 1);
    CHECK(less.v_plus == p.v_minus);
  }
}

TEST_CASE("each thing left out can be left in", "[pruned]") {
  const MethodRow& row = *find_method("ap");
  const ContactProblem apart =
      beside(beside(box(0.5, {0, -0.0098, 0}), sphere({20, -3, 1}, {0, 2, 0})), sphere({3, 2, 0}, {0, 0, 0}));
  const Answer plain = judge(row.make({}), row, apart);
  for (int item = 0; item < 3; ++item) {
    PruneOptions prune;
    (item == 0 ? prune.islands : item == 1 ? prune.parted_contacts : prune.closed_forms) = false;
    const auto left_out = std::make_shared<LeftOut>();
    const Answer less = judge(pruned(row, {}, left_out, prune), row, apart);
    INFO("without item " << item);
    CHECK(less.holds);
    CHECK(distance(plain.v_plus, less.v_plus) <= 1e-10);
    CHECK((left_out->islands == 0) == (item == 0));
    CHECK((left_out->parted_contacts == 0) == (item == 1));
    CHECK((left_out->closed_forms == 0) == (item == 0 || item == 2));
  }
}

// A stack that is pushed, on ice and with ice below every second box, by the dense and the sparse form of the LCP.
TEST_CASE("the friction of contacts without any gets no unknowns, and nothing else changes", "[pruned]") {
  for (const Choice& choice : choices())
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

// Two boxes that touch a third at contacts which part: the bound of the convex model is one of the whole island.
TEST_CASE("an island of the convex model is not torn by leaving out a contact", "[pruned]") {
  ContactProblem p = beside(box(0.5, {0, -0.5, 0}), box(0.5, {3, -0.5, 0}));
  add_contact(p, 1, {-0.5, 0, 0}, 0, {0.5, 0, 0}, (Matrix3d() << 1, 0, 0, 0, 1, 0, 0, 0, 1).finished(), 0.5);
  const MethodRow& row = *find_method("convex");
  const auto left_out = std::make_shared<LeftOut>();
  const Answer plain = judge(row.make({}), row, p), less = judge(pruned(row, {}, left_out), row, p);
  CHECK(plain.holds);
  CHECK(less.holds);
  CHECK(left_out->parted_contacts == 0);
  CHECK(distance(plain.v_plus, less.v_plus) <= 1e-12);
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
