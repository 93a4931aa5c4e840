// The linear systems of Newton's method: what is kept from one to the next must not outlive what it was made of.

#include "ncp/velocity_system.h"

#include <catch2/catch.hpp>

#include "contact/problem.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// |(M + J^T G J) dv - h| for the dv that the system gives.
double misses(VelocitySystem& system, const ContactProblem& p, const std::vector<double>& G, std::vector<double> h) {
  REQUIRE(system.factor(G));
  std::vector<double> dv = h;
  system.solve_in_place(dv);
  std::vector<double> left(h.size()), u(3 * static_cast<std::size_t>(p.nc())), r(u.size());
  multiply(p.M, dv, left);
  multiply(p.J, p.M, dv, u);
  for (int c = 0; c < p.nc(); ++c) {
    Eigen::Map<Eigen::Vector3d> load(&r[3 * c]);
    load = Eigen::Map<const Eigen::Matrix3d>(&G[9 * c]) * Eigen::Map<const Eigen::Vector3d>(&u[3 * c]);
  }
  multiply_transposed_add(p.J, p.M, r, left);
  double most = 0;
  for (std::size_t i = 0; i < h.size(); ++i) most = std::max(most, std::abs(left[i] - h[i]));
  return most;
}

}  // namespace

TEST_CASE("a system is factored anew where G, M or J is another, and answers the same where none is") {
  ContactProblem p = stack(3, 0.5, {0, -1, 0});
  const std::vector<double> h = p.v_minus;
  std::vector<double> G(9 * static_cast<std::size_t>(p.nc()));
  for (std::size_t i = 0; i < G.size(); ++i) G[i] = i % 4 == 0 ? 2.0 : 0.25 * static_cast<double>(i % 3);
  VelocitySystem system;
  system.prepare(p.M, p.J);
  CHECK(misses(system, p, G, h) < 1e-12);
  CHECK(misses(system, p, G, h) < 1e-12);
  G[4] = 7;
  CHECK(misses(system, p, G, h) < 1e-12);
  for (double& x : p.M.values) x *= 2;
  system.prepare(p.M, p.J);
  CHECK(misses(system, p, G, h) < 1e-12);
  for (double& x : p.J.values) x *= 3;
  system.prepare(p.M, p.J);
  CHECK(misses(system, p, G, h) < 1e-11);
}
