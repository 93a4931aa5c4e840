// Least displacements of many points against their dual, solved contact by contact on a dense matrix.

#include "simulation/least_displacement.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <random>

using namespace cb;

namespace {

struct Island {
  ContactProblem problem;
  std::vector<int> points, blocks;
  std::vector<double> wanted, scale;
  Eigen::MatrixXd N, MNT;  // dense: points x nv, nv x points
};

// Bodies in a chain, each pair of neighbours with `rows` points whose normals are random; some displacement opens all
// as is wanted, half of them no further.
Island chain(int bodies, int rows, int seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> entry(-1, 1);
  Island out;
  ContactProblem& p = out.problem;
  for (int b = 0; b < bodies; ++b) {
    out.blocks.push_back(p.M.add_block(6));
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(6, 6, [&] { return entry(random); });
    p.M.block(b) = A * A.transpose() + 0.1 * Eigen::MatrixXd::Identity(6, 6);
  }
  p.v_minus.assign(6 * bodies, 0.0);
  const int n = (bodies - 1) * rows;
  out.N.setZero(n, 6 * bodies);
  for (int c = 0; c < n; ++c) {
    p.J.add_band();
    for (const int b : {c / rows, c / rows + 1}) {
      auto entries = p.J.entry(p.J.add_entry(b, 6));
      for (int k = 0; k < 6; ++k) out.N(c, 6 * b + k) = entries(0, k) = entry(random);
      entries.bottomRows<2>().setOnes();  // tangents, which are no matter
    }
    p.mu.push_back(0.5);
    p.restitution.push_back(0);
    out.points.push_back(c);
  }
  p.offset.assign(3 * n, 0.0);
  const Eigen::VectorXd possible = 1e-3 * Eigen::VectorXd::NullaryExpr(6 * bodies, [&] { return entry(random); });
  for (int c = 0; c < n; ++c) out.wanted.push_back(out.N.row(c) * possible - std::max(0.0, 1e-3 * entry(random)));
  out.MNT = out.N.transpose();
  for (int b = 0; b < bodies; ++b)
    out.MNT.middleRows(6 * b, 6) = p.M.block(b).llt().solve(out.MNT.middleRows(6 * b, 6));
  for (int c = 0; c < n; ++c) out.scale.push_back(1 / std::sqrt(out.N.row(c) * out.MNT.col(c)));
  return out;
}

// d = M^-1 N^T r, 0 <= r _|_ N d - wanted >= 0, by Gauss and Seidel.
Eigen::VectorXd by_sweeps(const Island& island) {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(island.N.cols()), r = Eigen::VectorXd::Zero(island.N.rows());
  double change = 1;
  for (int sweep = 0; sweep < 200000 && change > 1e-14; ++sweep) {
    change = 0;
    for (Eigen::Index c = 0; c < r.size(); ++c) {
      const double G = island.N.row(c) * island.MNT.col(c), opened = island.N.row(c) * d;
      const double next = std::max(0.0, r[c] + (island.wanted[c] - opened) / G);
      d += (next - r[c]) * island.MNT.col(c);
      change = std::max(change, std::abs(next - r[c]) * std::sqrt(G));
      r[c] = next;
    }
  }
  return d;
}

}  // namespace

TEST_CASE("the least displacement is that of its dual, whichever points hold") {
  int compared = 0;
  for (const auto& [bodies, rows] : {std::pair(2, 3), {8, 4}, {30, 10}, {40, 8}})
    for (int seed = 1; seed <= 5; ++seed) {
      const Island island = chain(bodies, rows, seed);
      Eigen::VectorXd d = Eigen::VectorXd::Constant(island.N.cols(), 7);
      INFO(bodies << " bodies, " << rows << " points a pair, seed " << seed);
      REQUIRE(LeastDisplacement().solve(island.problem, island.points, island.blocks, island.wanted, island.scale, d));
      const Eigen::VectorXd expected = by_sweeps(island);
      CHECK((d - expected).norm() <= 1e-5 * expected.norm());
      CHECK(((island.N * d).array() >= Eigen::Map<const Eigen::ArrayXd>(island.wanted.data(), island.N.rows()) - 1e-8)
                .all());
      ++compared;
    }
  CHECK(compared == 20);
}

// Three times as many rows as velocities: of the hardest springs Newton's method comes to a stand in 17 of 20.
TEST_CASE("where the hardest springs come to no answer, that of softer ones leaves a fifth at most") {
  for (int seed = 0; seed < 20; ++seed) {
    INFO("seed " << seed);
    const Island island = chain(30, 20, seed);
    Eigen::VectorXd d = Eigen::VectorXd::Zero(island.N.cols());
    REQUIRE(LeastDisplacement().solve(island.problem, island.points, island.blocks, island.wanted, island.scale, d));
    const Eigen::Map<const Eigen::VectorXd> wanted(island.wanted.data(), island.N.rows());
    CHECK((wanted - island.N * d).maxCoeff() <= 0.2 * wanted.maxCoeff());
  }
}

TEST_CASE("points that contradict each other are missed alike") {
  Island island = chain(2, 3, 1);
  // The same row both ways, opened by 1 mm each.
  ContactProblem& p = island.problem;
  for (const int e : {p.J.band[0], p.J.band[0] + 1}) p.J.entry(e + 2) = -p.J.entry(e);
  island.scale[1] = island.scale[0];
  std::fill(island.wanted.begin(), island.wanted.begin() + 2, 1e-3);
  Eigen::VectorXd d = Eigen::VectorXd::Constant(12, 7);
  REQUIRE(LeastDisplacement().solve(p, island.points, island.blocks, island.wanted, island.scale, d));
  CHECK(std::abs(island.N.row(0) * d) <= 1e-9);
  CHECK(d.norm() <= 1);
}

TEST_CASE("a limit of a joint holds where points contradict it") {
  ContactProblem p;
  p.M.add_block(1);
  p.M.block(0)(0, 0) = 2;
  p.v_minus.assign(1, 0.0);
  for (const double way : {1.0, -1.0}) {  // a contact, whose tangents say so, and a limit
    p.J.add_band();
    auto entries = p.J.entry(p.J.add_entry(0, 1));
    entries(0, 0) = way;
    if (way > 0) entries(1, 0) = 0.3;
    p.mu.push_back(0);
    p.restitution.push_back(0);
  }
  p.offset.assign(6, 0.0);
  const std::vector<int> points{0, 1}, blocks{0};
  const std::vector<double> wanted{1e-3, 1e-4}, scale(2, std::sqrt(2.0));
  Eigen::VectorXd d(1);
  d[0] = 0;
  const bool came = LeastDisplacement().solve(p, points, blocks, wanted, scale, d);
  INFO(d[0]);
  CHECK(came);
  CHECK(d[0] == Approx(-1e-4).epsilon(0.2));
}

TEST_CASE("an island within a larger problem moves as it does alone, and nothing else does") {
  const Island alone = chain(6, 4, 3);
  const ContactProblem& p = alone.problem;
  // Bodies in reverse order, with a smaller block of another island between them; points of that island, and one
  // without a scale that would ask for much, between its own.
  Island island;
  ContactProblem& q = island.problem;
  std::vector<int> place(6);
  for (int b = 5; b >= 0; --b) {
    const int other = q.M.add_block(b == 3 ? 1 : 6);
    q.M.block(other).setIdentity();
    place[static_cast<std::size_t>(b)] = q.M.add_block(6);
    q.M.block(place[static_cast<std::size_t>(b)]) = p.M.block(b);
  }
  for (int b = 0; b < 6; ++b) island.blocks.push_back(place[static_cast<std::size_t>(b)]);
  const auto add_point = [&](double wanted, double scale) {
    q.J.add_band();
    q.mu.push_back(0.5);
    q.restitution.push_back(0);
    island.wanted.push_back(wanted);
    island.scale.push_back(scale);
    return q.nc() - 1;
  };
  for (int c = 0; c < p.nc(); ++c) {
    add_point(1, 1);  // of another island
    q.J.entry(q.J.add_entry(place[0] - 1, 6)).setOnes();
    if (c == 5) {
      island.points.push_back(add_point(1, 0));
      q.J.entry(q.J.add_entry(place[2], 6)).setOnes();
    }
    const auto at = static_cast<std::size_t>(c);
    island.points.push_back(add_point(alone.wanted[at], alone.scale[at]));
    for (int e = p.J.band[at]; e < p.J.band[at + 1]; ++e)
      q.J.entry(q.J.add_entry(place[static_cast<std::size_t>(p.J.block[e])], 6)) = p.J.entry(e);
  }
  q.v_minus.assign(static_cast<std::size_t>(q.M.order()), 0.0);
  q.offset.assign(3 * island.wanted.size(), 0.0);
  const Eigen::VectorXd expected = by_sweeps(alone);
  Eigen::VectorXd d = Eigen::VectorXd::Constant(q.M.order(), 7);
  LeastDisplacement least;
  Eigen::VectorXd before = Eigen::VectorXd::Zero(alone.N.cols());
  REQUIRE(least.solve(p, alone.points, alone.blocks, alone.wanted, alone.scale, before));  // scratch of another problem
  REQUIRE(least.solve(q, island.points, island.blocks, island.wanted, island.scale, d));
  for (int b = 0; b < 6; ++b) {
    const int first = q.M.first[place[static_cast<std::size_t>(b)]];
    CHECK((d.segment<6>(first) - expected.segment<6>(6 * b)).norm() <= 1e-5 * expected.norm());
    d.segment<6>(first).setConstant(7);
  }
  CHECK((d.array() == 7).all());
}

TEST_CASE("where masses are none, nothing is moved") {
  Island island = chain(3, 3, 2);
  island.problem.M.block(1) *= -1;
  Eigen::VectorXd d = Eigen::VectorXd::Constant(18, 7);
  CHECK_FALSE(LeastDisplacement().solve(island.problem, island.points, island.blocks, island.wanted, island.scale, d));
  CHECK((d.array() == 7).all());
}

TEST_CASE("what was solved before, limits of joints among it, leaves nothing behind") {
  Island limits = chain(3, 2, 11);
  for (const int c : limits.points) {
    limits.problem.mu[static_cast<std::size_t>(c)] = 0;
    for (int e = 0; e < 2; ++e) limits.problem.J.entry(2 * c + e).bottomRows<2>().setZero();
    REQUIRE(is_limit(limits.problem, c));
  }
  const Island points = chain(3, 4, 12);
  REQUIRE_FALSE(is_limit(points.problem, 0));
  const auto solve = [](LeastDisplacement& least, const Island& island) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(island.N.cols());
    REQUIRE(least.solve(island.problem, island.points, island.blocks, island.wanted, island.scale, d));
    return d;
  };
  LeastDisplacement used, fresh;
  solve(used, limits);
  CHECK(solve(used, points) == solve(fresh, points));
}
