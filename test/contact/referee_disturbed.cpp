// The referee against exact answers of which one part is wrong by a millionth.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "contact/exact_answers.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double accepted = 1e-9, disturbance = 1e-6;

bool held(const Exact& exact, Residuals* out = nullptr) {
  std::vector<double> v_plus;
  const Residuals residuals = Referee().check(exact.problem, exact.solution, exact.law, v_plus);
  if (out != nullptr) *out = residuals;
  return Referee::holds(residuals, accepted);
}

bool open(const Exact& exact, const std::string& part, int sign) {
  for (const auto& [name, side] : exact.open)
    if (name == part && (side == sign || side == 0)) return true;
  return false;
}

/// Every part of the answer in turn, up and down: what is refused but where the law leaves the part open?
void disturb_each(Exact exact) {
  INFO(exact.name);
  for (const Part& part : parts(exact))
    for (const int sign : {-1, 1}) {
      const double before = *part.value;
      *part.value += sign * disturbance * part.size;
      INFO(part.name << (sign > 0 ? " larger" : " smaller"));
      Residuals out;
      const bool passes = held(exact, &out);
      CAPTURE(out.model);
      CHECK(passes == open(exact, part.name, sign));
      *part.value = before;
    }
}

void disturb_all(const Exact& exact, unsigned seed) {
  Exact wrong = exact;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0.5, 1);
  std::bernoulli_distribution up;
  for (const Part& part : parts(wrong))
    *part.value += (up(generator) ? 1 : -1) * uniform(generator) * disturbance * part.size;
  INFO(exact.name << ", seed " << seed);
  CHECK_FALSE(held(wrong));
}

/// The same answers in other units, orders and frames.
std::vector<Exact> seen_otherwise(const Exact& exact) {
  const Matrix3d R = Eigen::AngleAxisd(1.1, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  std::vector<Exact> out = {in_units(exact, 1e3, 1, 1),
                            in_units(exact, 1, 1e-3, 1),
                            in_units(exact, 1, 1, 60),
                            in_units(exact, 1e-6, 1e4, 1e-3),
                            reversed(exact),
                            turned(exact, R),
                            other_tangents(exact)};
  out.push_back(turned(reversed(in_units(exact, 7, 0.3, 11)), R));
  return out;
}

}  // namespace

TEST_CASE("an exact answer holds under its law, and one with a single part wrong by 1e-6 does not") {
  for (const Exact& exact : exact_answers()) {
    INFO(exact.name);
    Residuals out;
    CHECK(held(exact, &out));
    CHECK(out.model < 1e-13);
    disturb_each(exact);
  }
}

TEST_CASE("an exact answer with everything wrong by 1e-6 does not hold") {
  for (const Exact& exact : exact_answers())
    for (unsigned seed = 0; seed < 20; ++seed) disturb_all(exact, seed);
}

TEST_CASE("an exact answer holds in other units, orders and frames, and with a part wrong by 1e-6 in none of them") {
  for (const Exact& exact : exact_answers())
    for (const Exact& other : seen_otherwise(exact)) {
      INFO(exact.name);
      CHECK(held(other));
      disturb_each(other);
    }
}
