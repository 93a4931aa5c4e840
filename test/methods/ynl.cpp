// The stored-candidate LCP solver on contact problems, against Lemke's method.

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "contact/referee.h"
#include "methods/registry.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

struct Answer {
  ContactSolution solution;
  Residuals residuals;
  std::vector<double> v_plus;
};

class Solver {
 public:
  Solver(const char* solver, int k) {
    MethodOptions options;
    options.solver = solver;
    options.k = k;
    method_ = find_method("ap")->make(options);
  }
  Answer operator()(const ContactProblem& problem) {
    Answer answer;
    method_(problem, answer.solution);
    answer.residuals = Referee().check(problem, answer.solution, anitescu_potra_law(), answer.v_plus);
    return answer;
  }

 private:
  ContactMethod method_;
};

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

/// What the scenes of the paper ask for, step by step, with the fall of one step of 1 ms.
std::vector<ContactProblem> sphere_stream() {
  std::vector<ContactProblem> stream;
  for (int i = 0; i < 20; ++i)
    stream.push_back(sphere({0.3 * i, -1 - 0.1 * i, 0.05 * i}, {0.2 * i, 0.01 * i * i, -0.7 * i}));
  return stream;
}

std::vector<ContactProblem> sliding_stream() {
  std::vector<ContactProblem> stream;
  for (int i = 0; i < 20; ++i) stream.push_back(box(0.4, {2 - 0.09 * i, -0.00981, 0}));
  return stream;
}

std::vector<ContactProblem> sticking_stream() {
  std::vector<ContactProblem> stream;
  for (int i = 0; i < 20; ++i) stream.push_back(box(0.9, {0.003 * std::sin(i), -0.00981, 0.002 * std::cos(2 * i)}));
  return stream;
}

std::vector<ContactProblem> circle_stream() {
  std::vector<ContactProblem> stream;
  for (int i = 0; i < 20; ++i)
    stream.push_back(box(0.5, {0.01 * std::cos(0.3 * i), -0.00981, 0.01 * std::sin(0.3 * i)}));
  return stream;
}

std::vector<ContactProblem> stack_stream() {
  std::vector<ContactProblem> stream;
  for (int i = 0; i < 5; ++i) stream.push_back(stack(4, 0.2 + 0.2 * i, {0, -0.00981 * (1 + i), 0}));
  return stream;
}

}  // namespace

TEST_CASE("Searched and perturbed pivoting give the sphere, the boxes and the stack at rest the same velocity") {
  const std::vector<std::vector<ContactProblem>> streams = {sphere_stream(), sliding_stream(), sticking_stream(),
                                                            circle_stream(), stack_stream()};
  for (const int k : {4, 8, 16}) {
    Solver ynl("ynl", k), lemke("lemke", k);
    for (std::size_t s = 0; s < streams.size(); ++s)
      for (std::size_t i = 0; i < streams[s].size(); ++i) {
        const Answer a = ynl(streams[s][i]), b = lemke(streams[s][i]);
        CAPTURE(k, s, i, a.solution.reason);
        REQUIRE(a.solution.status == Status::ok);
        CHECK(a.solution.claimed_residual <= 1e-10);
        CHECK(Referee::holds(a.residuals, 1e-10));
        CHECK(largest_difference(a.v_plus, b.v_plus) <= 1e-9);
      }
  }
}

TEST_CASE("A box on a ramp whose friction is a hair below the tangent slides, a hair above it sticks") {
  // Velocities along the ground's axes after a fall of g h on a ramp of 30 degrees: down along x, and into it. Its
  // friction takes away mu times the second: of the first, tan(30) (1 - d) leaves the part d.
  const double fall = 9.8e-3, tangent = std::tan(M_PI / 6);
  const Eigen::Vector3d v{0.5 * fall, -0.5 / tangent * fall, 0};
  for (const int k : {4, 8}) {
    Solver ynl("ynl", k);
    for (const double d : {1e-2, 1e-6, 1e-9, 1e-10, 2e-11}) {
      const Answer slides = ynl(box(tangent * (1 - d), v)), sticks = ynl(box(tangent * (1 + d), v));
      CAPTURE(k, d, slides.solution.reason, sticks.solution.reason);
      REQUIRE(slides.solution.status == Status::ok);
      REQUIRE(sticks.solution.status == Status::ok);
      CHECK(slides.v_plus[0] == Approx(d * v[0]).epsilon(1e-3));
      CHECK(std::abs(sticks.v_plus[0]) < 1e-14 * fall);
    }
  }
}

TEST_CASE("A tumbling box and a shaken stack pass the referee after the search") {
  for (const int k : {4, 8}) {
    Solver ynl("ynl", k);
    for (unsigned seed = 1; seed <= 10; ++seed) {
      const double s = seed;
      for (const ContactProblem& p :
           {box(0.6, {std::sin(s), -1, std::cos(3 * s)}, {std::sin(5 * s), 0.3, std::cos(s)}),
            stack(2, 0.5, {0.1, -0.3, 0}, 0.5, seed), stack(4, 0.7, {0, -0.1, 0}, 0.2, seed)}) {
        const Answer a = ynl(p);
        CAPTURE(k, seed, p.nc(), a.solution.reason);
        REQUIRE(a.solution.status == Status::ok);
        CHECK(Referee::holds(a.residuals, 1e-9));
      }
    }
  }
}

TEST_CASE("Gauss-Seidel says that it cannot divide by the slip bounds of Anitescu and Potra") {
  Solver pgs("pgs", 4);
  const Answer a = pgs(sphere({1, -1, 0}, {0, 0, 0}));
  CHECK(a.solution.status == Status::singular);
  CHECK(a.solution.reason.find("no positive diagonal") != std::string::npos);
}
