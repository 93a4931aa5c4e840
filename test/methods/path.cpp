// The path-following solver on Anitescu and Potra's problem, against Lemke's method.

#include <catch2/catch.hpp>
#include <random>

#include "methods/registry.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// v+ of both solvers agrees where the answer is unique; both claim 1e-10.
void check_agreement(const ContactProblem& p, int k) {
  std::vector<double> v[2];
  for (const bool path : {false, true}) {
    MethodOptions options;
    options.k = k;
    options.solver = path ? "path" : "lemke";
    ContactSolution s;
    find_method("ap")->make(options)(p, s);
    INFO(options.solver << ": " << s.reason);
    REQUIRE(s.status == Status::ok);
    CHECK(s.claimed_residual <= 1e-10);
    BlockCholesky factor;
    factor.factor(p.M);
    apply_impulse(p, factor, s.impulse, v[path]);
  }
  double difference = 0;
  for (std::size_t i = 0; i < v[0].size(); ++i) difference = std::max(difference, std::abs(v[0][i] - v[1][i]));
  CHECK(difference < 1e-9);
}

}  // namespace

TEST_CASE("spheres and sliding boxes leave with the velocity that lemke finds", "[path]") {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return uniform(generator); };
  for (int k : {4, 8, 16})
    for (int i = 0; i < 40; ++i) {
      const Vector3d v(draw(), -std::abs(draw()), draw()), w(draw(), draw(), draw());
      check_agreement(sphere(v, w, 0.5), k);
      check_agreement(box(0.3, {draw(), -0.0981, draw()}), k);
      // All ties: along an edge, no spin.
      check_agreement(box(0.3, {std::abs(draw()), -0.0981, 0}), k);
    }
}

TEST_CASE("a stack of four at rest stays at rest, and one that slides slides as lemke says", "[path]") {
  for (int k : {4, 8, 16}) {
    check_agreement(stack(4, 0.5, {0, -0.0981, 0}), k);
    check_agreement(stack(4, 0.2, {0.7, -0.0981, 0.3}), k);
  }
}

TEST_CASE("a restitution in two phases is followed twice", "[path]") {
  check_agreement(sphere({0.5, -1, 0}, {0, 0, 2}, 0.3, 0.7), 8);
}

// What friction leaves of velocities is rounding: it decides nothing in the crash.
TEST_CASE("a stack of 16 at rest asks for no more pivots where its velocities are off by rounding", "[path]") {
  MethodOptions options;
  options.solver = "path";
  ContactSolution exact, rounded;
  find_method("ap")->make(options)(stack(16, 0.5, {0, -0.0098, 0}), exact);
  find_method("ap")->make(options)(stack(16, 0.5, {0, -0.0098, 0}, 1e-17), rounded);
  REQUIRE(exact.status == Status::ok);
  REQUIRE(rounded.status == Status::ok);
  CHECK(exact.iterations <= 100);
  CHECK(rounded.iterations <= exact.iterations + 10);
}
