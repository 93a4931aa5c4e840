// The linear systems of Newton's method: what is kept from one to the next must not outlive what it was made of.

#include "ncp/velocity_system.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "cone/kkt_system.h"
#include "contact/problem.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// |(M + J^T G J) dv - h|.
double misses(const ContactProblem& p, const std::vector<double>& G, const std::vector<double>& h,
              const std::vector<double>& dv) {
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

/// The same for the dv that the system gives.
double misses(VelocitySystem& system, const ContactProblem& p, const std::vector<double>& G,
              const std::vector<double>& h) {
  REQUIRE(system.factor(G));
  std::vector<double> dv = h;
  system.solve_in_place(dv);
  return misses(p, G, h, dv);
}
double misses(KktSystem& system, const ContactProblem& p, const std::vector<double>& G, const std::vector<double>& h) {
  REQUIRE(system.factor(G, {}));
  std::vector<double> dv = h;
  system.solve_in_place(dv);
  return misses(p, G, h, dv);
}

/// Blocks of one size, and contacts that each join some of them.
ContactProblem joined(int blocks, int size, const std::vector<std::vector<int>>& contacts) {
  ContactProblem p;
  for (int b = 0; b < blocks; ++b) {
    auto M = p.M.block(p.M.add_block(size));
    M.setConstant(0.2);
    M.diagonal().array() += 1.0 + b;
  }
  p.v_minus.assign(static_cast<std::size_t>(p.nv()), 1.0);
  double number = 0;
  for (const std::vector<int>& of : contacts) {
    p.J.add_band();
    for (const int b : of) {
      auto J = p.J.entry(p.J.add_entry(b, size));
      for (int j = 0; j < size; ++j)
        for (int row = 0; row < 3; ++row) J(row, j) = std::sin(++number);
    }
  }
  return p;
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

// Of two in a row each differs in one thing: how large the blocks are, how many a contact joins, or which.
TEST_CASE("a system takes blocks of other sizes, and contacts that join others of them, as its first") {
  const std::vector<ContactProblem> events = {joined(2, 8, {{0, 1}}),
                                              joined(2, 6, {{0, 1}}),
                                              joined(2, 6, {{0, 1}, {0, 1}}),
                                              joined(2, 6, {{0}, {1}, {0, 1}}),
                                              joined(3, 6, {{0}, {0, 1}, {1, 2}}),
                                              joined(3, 6, {{0}, {0, 1}, {0, 2}}),
                                              joined(3, 2, {{0}, {0, 1}, {0, 2}}),
                                              joined(3, 2, {{0}, {0, 1}, {1, 2}})};
  VelocitySystem velocities;
  KktSystem blocks, sparse;
  for (std::size_t event = 0; event < events.size(); ++event) {
    INFO("event " << event);
    const ContactProblem& p = events[event];
    const auto nc = static_cast<std::size_t>(p.nc());
    std::vector<double> G(9 * nc);
    for (std::size_t i = 0; i < G.size(); ++i) G[i] = i % 9 % 4 == 0 ? 2.0 : 0.25;
    velocities.prepare(p.M, p.J);
    CHECK(misses(velocities, p, G, p.v_minus) < 1e-10);
    for (KktSystem* system : {&blocks, &sparse}) {
      const double least_block = system == &blocks ? 0 : 1000;
      system->prepare(p.M, p.J, least_block);
      CHECK(misses(*system, p, G, p.v_minus) < 1e-10);
      KktSystem fresh;
      fresh.prepare(p.M, p.J, least_block);
      const std::vector<double> D(nc, 0.5);
      std::vector<double> v = p.v_minus, w = v, v_fresh = v, w_fresh = v;
      REQUIRE(system->factor(G, D));
      REQUIRE(fresh.factor(G, D));
      system->solve_in_place(v, w);
      fresh.solve_in_place(v_fresh, w_fresh);
      CHECK(v == v_fresh);
      CHECK(w == w_fresh);
    }
  }
}
