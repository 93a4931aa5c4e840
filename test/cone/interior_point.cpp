#include "cone/interior_point.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "cone/rows.h"

using namespace cb;

namespace {

Eigen::Map<Eigen::Vector3d> map(double* x) { return Eigen::Map<Eigen::Vector3d>(x); }

// What a cone program is about.
struct Bodies {
  BlockDiagonalMatrix M;
  BandMatrix J;
  BlockCholesky factor;
  std::vector<double> v0, offset, mu, weight;

  ConeProgram program() const {
    ConeProgram p;
    p.M = &M;
    p.factor = &factor;
    p.J = &J;
    p.v0 = &v0;
    p.offset = &offset;
    p.mu = &mu;
    p.weight = &weight;
    return p;
  }
};

// A chain of `bodies` blocks of six; each contact joins a body to the one before it (the first to the ground), or to
// the first.
struct Chain : Bodies {
  Chain(int bodies, int contacts, unsigned seed, bool to_the_first = false) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int b = 0; b < bodies; ++b) {
      M.add_block(6);
      for (int i = 0; i < 6; ++i) M.block(b)(i, i) = 0.5 + std::abs(normal(random));
    }
    for (int b = 0; b < bodies; ++b)
      for (int c = 0; c < contacts; ++c) {
        J.add_band();
        if (b > 0) fill(J.add_entry(to_the_first ? 0 : b - 1, 6), random);
        fill(J.add_entry(b, 6), random);
        mu.push_back(0.5);
        weight.push_back(6);
      }
    v0.resize(M.order());
    for (double& v : v0) v = normal(random);
    offset.assign(3 * J.bands(), 0.0);
    factor.factor(M);
  }
  void fill(int entry, std::mt19937& random) {
    std::normal_distribution<double> normal;
    for (int i = 0; i < 18; ++i) J.values[J.offset[entry] + i] = normal(random);
  }
};

// A point of `mass` kg that moves with v; one contact for each of `sides`, its rows n, t1, t2 the identity or its
// opposite.
struct PointMass : Bodies {
  PointMass(double mass, const std::vector<double>& v, const std::vector<double>& sides) {
    M.add_block(3);
    M.block(0) = mass * Eigen::Matrix3d::Identity();
    for (const double side : sides) {
      J.add_band();
      J.add_entry(0, 3);
      J.entry(J.bands() - 1) = side * Eigen::Matrix3d::Identity();
    }
    v0 = v;
    offset.assign(3 * sides.size(), 0.0);
    mu.assign(sides.size(), 0.4);
    weight.assign(sides.size(), 1 / mass);
    REQUIRE(factor.factor(M));
  }
};

}  // namespace

TEST_CASE("both kernels solve the equations of motion that they are given", "[kkt]") {
  for (int bodies : {1, 2, 7}) {
    const Chain chain(bodies, 2, 3);
    const int nv = chain.M.order(), nc = chain.J.bands();
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<double> G(9 * nc), D(nc), h1(nv), h2(nv);
    for (int c = 0; c < nc; ++c) {
      Eigen::Matrix3d A;
      for (int i = 0; i < 9; ++i) A.data()[i] = normal(random);
      Eigen::Map<Eigen::Matrix3d> block(&G[9 * c]);
      block = A * A.transpose();
      D[c] = c % 3 == 0 ? 0 : std::abs(normal(random));
    }
    for (double& x : h1) x = normal(random);
    for (double& x : h2) x = normal(random);
    for (double least_block : {0, 1000}) {
      KktSystem system;
      system.prepare(chain.M, chain.J, least_block);
      REQUIRE(system.factor(G, D));
      std::vector<double> dv = h1, dw = h2;
      system.solve_in_place(dv, dw);
      // Residuals, term by term: (M + N^T D N) dv - M dw = h1, M dv + J^T G J dw = h2.
      std::vector<double> Mv(nv), Mw(nv), u(3 * nc), r1(nv), r2(nv), t(3 * nc);
      multiply(chain.M, dv, Mv);
      multiply(chain.M, dw, Mw);
      multiply(chain.J, chain.M, dv, u);
      for (int c = 0; c < nc; ++c) t[3 * c] = D[c] * u[3 * c];
      multiply_transposed_add(chain.J, chain.M, t, r1);
      multiply(chain.J, chain.M, dw, u);
      for (int c = 0; c < nc; ++c) map(&t[3 * c]) = Eigen::Map<Eigen::Matrix3d>(&G[9 * c]) * map(&u[3 * c]);
      multiply_transposed_add(chain.J, chain.M, t, r2);
      for (int i = 0; i < nv; ++i) {
        CHECK(r1[i] + Mv[i] - Mw[i] == Approx(h1[i]).margin(1e-11));
        CHECK(r2[i] + Mv[i] == Approx(h2[i]).margin(1e-11));
      }
      REQUIRE(system.factor(G, {}));
      dw = h2;
      system.solve_in_place(dw);
      multiply(chain.M, dw, Mw);
      multiply(chain.J, chain.M, dw, u);
      std::fill(r2.begin(), r2.end(), 0.0);
      for (int c = 0; c < nc; ++c) map(&t[3 * c]) = Eigen::Map<Eigen::Matrix3d>(&G[9 * c]) * map(&u[3 * c]);
      multiply_transposed_add(chain.J, chain.M, t, r2);
      for (int i = 0; i < nv; ++i) CHECK(r2[i] + Mw[i] == Approx(h2[i]).margin(1e-11));
    }
  }
}

TEST_CASE("a system that was factored takes another whose contacts are as many, and of other bodies", "[kkt]") {
  const Chain chain(5, 2, 3), star(5, 2, 4, true);
  std::vector<double> G(9 * star.J.bands(), 0.0), D(star.J.bands(), 0.5), h(star.M.order(), 1.0);
  for (int c = 0; c < star.J.bands(); ++c) G[9 * c] = G[9 * c + 4] = G[9 * c + 8] = 1;
  for (double least_block : {0, 1000}) {
    KktSystem used, fresh;
    used.prepare(chain.M, chain.J, least_block);
    REQUIRE(used.factor(G, D));
    REQUIRE(used.factor(G, {}));
    std::vector<std::vector<double>> answers;
    for (KktSystem* system : {&used, &fresh}) {
      system->prepare(star.M, star.J, least_block);
      REQUIRE(system->factor(G, {}));
      std::vector<double> one = h, first = h, second = h;
      system->solve_in_place(one);
      REQUIRE(system->factor(G, D));
      system->solve_in_place(first, second);
      answers.insert(answers.end(), {one, first, second});
    }
    for (int i = 0; i < 3; ++i) CHECK(answers[i] == answers[3 + i]);
  }
}

// Point mass m on a plane, rows n, t1, t2 of the identity: sticks where |p_t| <= mu p_n, else the projection of -p on
// the cone: r_n = (p_n + mu |p_t|) / (1 + mu^2) with p = -m v, r_t along p_t at mu r_n.
TEST_CASE("a point mass on a plane gets the projection of its momentum on the cone", "[cone]") {
  const double mass = 2.5;
  for (double slip : {0.1, 3.0}) {
    const PointMass point(mass, {-1, slip, 0.5 * slip}, {1});
    const ConeProgram p = point.program();
    InteriorPoint solver;
    ConeSolution x;
    solver.solve(p, x);
    REQUIRE(x.status == ConeStatus::solved);
    const double p_n = mass, p_t = mass * slip * std::sqrt(1.25);
    const double r_n = p_t <= 0.4 * p_n ? p_n : (p_n + 0.4 * p_t) / 1.16;
    CHECK(x.r[0] == Approx(r_n).epsilon(1e-13));
    CHECK(x.r[1] == Approx(-std::min(mass * slip, 0.4 * r_n / std::sqrt(1.25))).epsilon(1e-13));
    CHECK(x.r[2] == Approx(0.5 * x.r[1]).epsilon(1e-13));
    CHECK(std::abs(x.gap) <= 1e-13);
  }
}

TEST_CASE("the same answer comes from both kernels, and its gap is at rounding", "[cone]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Chain chain(4, 2, seed);
    const ConeProgram p = chain.program();
    ConeSolution blocks, sparse;
    ConeOptions options;
    options.least_block = 0;
    InteriorPoint(options).solve(p, blocks);
    options.least_block = 1000;
    InteriorPoint(options).solve(p, sparse);
    REQUIRE(blocks.status == ConeStatus::solved);
    REQUIRE(sparse.status == ConeStatus::solved);
    for (std::size_t i = 0; i < blocks.r.size(); ++i) CHECK(blocks.r[i] == Approx(sparse.r[i]).margin(1e-9));
    CHECK(std::abs(blocks.gap) < 1e-11);
    CHECK(blocks.infeasibility < 1e-11);
  }
}

// Masses from 1e-3 to 1e3 kg and friction from 1e-5 to 1e5: the certificate of the rounded answer decides.
TEST_CASE("the dense method gives the same motion, and a certificate where scales differ by decades", "[cone]") {
  const auto certificate = [](const ConeProgram& p, const ConeSolution& x) {
    ConeVelocities velocities;
    velocities.evaluate(p, x.r, x.eta);
    std::vector<double> q(x.r.size());
    multiply(*p.J, *p.M, *p.v0, q);
    return certify(p, x.r, x.eta, velocities, q);
  };
  for (unsigned seed = 0; seed < 10; ++seed) {
    Chain chain(4, 2, seed);
    ConeSolution sparse, dense;
    InteriorPoint().solve(chain.program(), sparse);
    solve_dense(chain.program(), {}, dense);
    REQUIRE(dense.status == ConeStatus::solved);
    ConeVelocities of_sparse, of_dense;
    of_sparse.evaluate(chain.program(), sparse.r, {});
    of_dense.evaluate(chain.program(), dense.r, {});
    for (std::size_t i = 0; i < of_sparse.v.size(); ++i) CHECK(of_dense.v[i] == Approx(of_sparse.v[i]).margin(1e-9));

    for (int b = 0; b < 4; ++b)
      for (int i = 0; i < 6; ++i) chain.M.block(b)(i, i) *= std::pow(10, 2 * b - 3);
    chain.factor.factor(chain.M);
    for (std::size_t c = 0; c < chain.mu.size(); ++c) {
      const int decade = static_cast<int>(c / 2);
      chain.mu[c] = std::pow(10, 2.5 * (static_cast<int>(c) % 5) - 5);
      chain.weight[c] = 6 * std::pow(10, 3 - 2 * decade);
    }
    for (const bool bounded : {false, true}) {
      ConeProgram p = chain.program();
      p.bounded_below = bounded;
      if (bounded) p.kappa = 1e3;
      solve_dense(p, {}, dense);
      const Certificate good = certificate(p, dense);
      CHECK(std::abs(good.gap) <= 1e-9 * good.size * good.size);
      CHECK(good.infeasibility <= 1e-10);
    }
  }
}

// Eighteen impulses for the six freedoms of each body: what cancels among them could be as large as friction lets it.
TEST_CASE("impulses that cancel do not grow with the strength of friction", "[cone]") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Chain chain(3, 6, seed);
    chain.mu.assign(chain.mu.size(), 5e5);
    ConeProgram p = chain.program();
    p.bounded_below = true;
    p.kappa = 1;
    ConeSolution x;
    solve_dense(p, {}, x);
    CHECK(x.status == ConeStatus::solved);
    std::vector<double> q(x.r.size());
    multiply(*p.J, *p.M, *p.v0, q);
    const auto norm = [](std::vector<double>& values) {
      return Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).norm();
    };
    const double weight = chain.weight[0], size = norm(q) / std::sqrt(weight);
    CHECK(std::sqrt(weight) * norm(x.r) < 10 * size);
    CHECK(x.gap < 1e-9 * size * size);
    CHECK(x.infeasibility <= 1e-12);
  }
}

TEST_CASE("a program with NaN, or without iterations, says so", "[cone]") {
  Chain chain(2, 2, 1);
  ConeOptions short_of;
  short_of.iteration_limit = 1;
  short_of.careful_limit = 0;
  InteriorPoint solver(short_of);
  ConeSolution x;
  solver.solve(chain.program(), x);
  CHECK(x.status == ConeStatus::nonconverged);
  for (double r : x.r) CHECK(std::isfinite(r));
  chain.v0[0] = std::nan("");
  solver.solve(chain.program(), x);
  CHECK(x.status == ConeStatus::not_finite);
  for (double r : x.r) CHECK(r == 0);
}

TEST_CASE("a body at rest needs no impulse and no iteration", "[cone]") {
  const PointMass rest(2.5, {0, 0, 0}, {1});
  ConeSolution sparse, dense;
  InteriorPoint().solve(rest.program(), sparse);
  solve_dense(rest.program(), {}, dense);
  for (const ConeSolution* x : {&sparse, &dense}) {
    CHECK(x->status == ConeStatus::solved);
    CHECK(x->r == std::vector<double>(3, 0.0));
    CHECK(x->gap == 0);
    CHECK(x->infeasibility == 0);
    CHECK(x->iterations == 0);
  }
}

TEST_CASE("the interior point method alone comes to a small gap, with normal velocities bounded and with the sum",
          "[cone]") {
  // No Newton step on a guess of what is active, neither on the way nor at the end.
  ConeOptions alone;
  alone.polish_from = 0;
  alone.careful_limit = 0;
  alone.feasibility = 1e-9;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Chain chain(4, 2, seed);
    ConeProgram p = chain.program();
    p.gap = 1e-8;
    ConeSolution free, below, bounded;
    InteriorPoint(alone).solve(p, free);
    double sum = 0;
    for (int c = 0; c < p.nc(); ++c) sum += free.r[3 * c];
    p.kappa = 0.7 * sum;
    InteriorPoint(alone).solve(p, bounded);
    double bounded_sum = 0;
    for (int c = 0; c < p.nc(); ++c) bounded_sum += bounded.r[3 * c];
    CHECK(bounded_sum <= p.kappa * (1 + 1e-8));
    p.kappa = std::numeric_limits<double>::infinity();
    p.bounded_below = true;
    InteriorPoint(alone).solve(p, below);
    for (const ConeSolution* x : {&free, &below, &bounded}) {
      INFO("seed " << seed << (x == &below ? ", below" : x == &bounded ? ", bounded" : ""));
      CHECK(x->status == ConeStatus::solved);
      CHECK(x->iterations <= 40);
    }
  }
}

TEST_CASE("Newton's method comes from the answer without a bound to that with one", "[cone]") {
  int came = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Chain chain(4, 2, seed);
    ConeProgram p = chain.program();
    p.gap = 1e-10;
    const ConeOptions options;
    ConeSolution x, bounded;
    InteriorPoint(options).solve(p, x);
    REQUIRE(x.status == ConeStatus::solved);
    double sum = 0;
    for (int c = 0; c < p.nc(); ++c) sum += x.r[3 * c];
    p.kappa = (1 - 1e-3) * sum;
    InteriorPoint(options).solve(p, bounded);
    if (!InteriorPoint(options).polish(p, x, PolishRules::careful(options))) continue;
    ++came;
    for (std::size_t i = 0; i < x.r.size(); ++i) CHECK(x.r[i] == Approx(bounded.r[i]).margin(1e-4 * sum));
  }
  CHECK(came >= 8);
}

// A joint at its limit is a contact whose impulse is no part of what kappa bounds.
TEST_CASE("Newton's method bounds the sum of normal impulses without those of limits", "[cone]") {
  int came = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Chain chain(4, 2, seed);
    ConeProgram p = chain.program();
    std::vector<double> share(p.nc(), 1.0);
    share[0] = share[3] = 0;
    p.share = &share;
    p.gap = 1e-10;
    const ConeOptions options;
    ConeSolution x;
    InteriorPoint(options).solve(p, x);
    REQUIRE(x.status == ConeStatus::solved);
    const auto sum = [&] {
      double out = 0;
      for (int c = 0; c < p.nc(); ++c) out += share[c] * x.r[3 * c];
      return out;
    };
    p.kappa = (1 - 1e-3) * sum();
    if (!InteriorPoint(options).polish(p, x, PolishRules::careful(options))) continue;
    came += x.r[0] + x.r[9] > 0.1 * p.kappa;
    CHECK(sum() == Approx(p.kappa).epsilon(1e-9));
  }
  CHECK(came >= 2);
}

TEST_CASE("the proximal point of a mass on a plane is the projection of its momentum, over 1 + t", "[cone]") {
  for (const double t : {1e-3, 1.0, 100.0})
    for (const double slip : {0.3, 2.0, -5.0}) {  // sticks, slides
      INFO("t = " << t << ", slip " << slip << " m/s");
      const PointMass point(2, {-1, slip, 0}, {1});
      ConeProgram p = point.program();
      ConeOptions options;
      PolishRules rules{60, 6, options.proximal, false};
      rules.anchor = t;
      ConeSolution x;
      x.r.assign(3, 0.0);
      REQUIRE(InteriorPoint(options).polish(p, x, rules));
      // The cone of mu = 0.4; its dual's edge is along (0.4, 1).
      const double size = std::abs(slip), along = std::max(0.0, (1 + 0.4 * size) / (1 + 0.4 * 0.4));
      const Eigen::Vector3d momentum =
          size <= 0.4 ? Eigen::Vector3d(1, -slip, 0) : Eigen::Vector3d(along, -std::copysign(0.4 * along, slip), 0);
      CHECK((map(x.r.data()) - 2 / (1 + t) * momentum).norm() <= 1e-9);
    }
}

TEST_CASE("proximal points lead from nothing to the answer, with normal velocities bounded and without", "[cone]") {
  for (unsigned seed = 0; seed < 10; ++seed)
    for (const bool bounded : {false, true}) {
      INFO("seed " << seed << (bounded ? ", bounded" : ""));
      const Chain chain(4, 3, seed);
      ConeProgram p = chain.program();
      p.bounded_below = bounded;
      p.gap = 1e-10;
      ConeSolution x, y;
      InteriorPoint().solve(p, x);
      REQUIRE(x.status == ConeStatus::solved);
      y.r.assign(3 * p.nc(), 0.0);
      y.eta.assign(p.nc(), 0.0);
      CHECK(InteriorPoint().go_by_points(p, y));
      CHECK(y.status == ConeStatus::solved);
      CHECK(y.iterations > 0);
      ConeVelocities by_path, by_points;
      by_path.evaluate(p, x.r, x.eta);
      by_points.evaluate(p, y.r, y.eta);
      for (int i = 0; i < 3 * p.nc(); ++i) CHECK(by_points.u[i] == Approx(by_path.u[i]).margin(1e-8));
    }
}

TEST_CASE("an answer that violates its constraints is not solved, whatever gap is asked for", "[cone]") {
  ConeOptions hasty;
  hasty.polish_from = 0;
  hasty.careful_limit = 0;
  int violating = 0;
  for (unsigned seed = 0; seed < 10; ++seed)
    for (hasty.iteration_limit = 1; hasty.iteration_limit <= 6; ++hasty.iteration_limit) {
      const Chain chain(4, 2, seed);
      ConeProgram p = chain.program();
      p.bounded_below = true;
      p.gap = 1e9;
      ConeSolution x;
      InteriorPoint(hasty).solve(p, x);
      if (!(x.infeasibility > 1e-9)) continue;
      ++violating;
      CHECK(x.status != ConeStatus::solved);
    }
  CHECK(violating > 0);
}

TEST_CASE("the rounding of a contact's velocity is that of the terms it is the sum of, entry by entry", "[cone]") {
  Chain chain(3, 2, 4);
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (double& w : chain.offset) w = normal(random);
  const ConeProgram p = chain.program();
  const int nc = p.nc(), nv = p.nv();
  std::vector<double> r(3 * nc), eta(nc);
  for (double& x : r) x = normal(random);
  for (double& x : eta) x = normal(random);  // of either sign where the normal velocity is fixed
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(nv, nv), J = Eigen::MatrixXd::Zero(3 * nc, nv);
  for (int b = 0; b < p.M->blocks(); ++b) M.block(6 * b, 6 * b, 6, 6) = p.M->block(b);
  for (int c = 0; c < nc; ++c)
    for (int e = chain.J.band[c]; e < chain.J.band[c + 1]; ++e)
      J.block(3 * c, 6 * chain.J.block[e], 3, 6) = chain.J.entry(e);
  // eta acts along the normals like r_n.
  Eigen::VectorXd load = Eigen::Map<Eigen::VectorXd>(r.data(), 3 * nc).cwiseAbs();
  for (int c = 0; c < nc; ++c) load[3 * c] += std::abs(eta[c]);
  Eigen::VectorXd terms = Eigen::Map<const Eigen::VectorXd>(chain.v0.data(), nv).cwiseAbs();
  for (int c = 0; c < nc; ++c)
    terms += M.llt().solve(J.middleRows(3 * c, 3).transpose()).cwiseAbs() * load.segment<3>(3 * c);
  const Eigen::VectorXd sums =
      J.cwiseAbs() * terms + Eigen::Map<const Eigen::VectorXd>(chain.offset.data(), 3 * nc).cwiseAbs();
  ConeVelocities velocities;
  velocities.evaluate(p, r, eta);
  velocities.bound_rounding(p, r, eta);
  for (int c = 0; c < nc; ++c)
    CHECK(velocities.rounding[c] ==
          Approx(std::numeric_limits<double>::epsilon() * sums.segment<3>(3 * c).norm() / std::sqrt(chain.weight[c])));
}

TEST_CASE("an approach that is left is one of what approached, however large the impulses", "[cone]") {
  // Between two walls that oppose each other, pressed by 1e8 N s from both sides.
  const PointMass point(1, {-1, 0, 0}, {1, -1});
  ConeProgram p = point.program();
  p.bounded_below = true;
  const double left = 0x1p-20;  // m/s of the one that approached
  const std::vector<double> r{0x1p27 + 1 - left, 0, 0, 0x1p27, 0, 0}, eta(2, 0.0), q{-1, 0, 0, 1, 0, 0};
  ConeVelocities velocities;
  velocities.evaluate(p, r, eta);
  REQUIRE(velocities.u[0] == -left);
  CHECK(certify(p, r, eta, velocities, q).infeasibility == Approx(left / std::sqrt(2)));
}

TEST_CASE("the gap counts what the sum of normal impulses leaves of its bound, by the bound's multiplier", "[cone]") {
  // A point that 1 N s stopped beside a wall it slides along at 3 m/s: s = mu |u_t| - u_n, and 2 of kappa's 3 are left.
  const PointMass point(1, {0, 3, 0}, {1});
  ConeProgram p = point.program();
  p.bounded_below = true;
  p.kappa = 3;
  const std::vector<double> r{1, 0, 0}, eta{0}, q{-1, 3, 0};
  ConeVelocities velocities;
  velocities.evaluate(p, r, eta);
  const Certificate certificate = certify(p, r, eta, velocities, q);
  const double s = p.mu->front() * std::hypot(velocities.u_hat[1], velocities.u_hat[2]) - velocities.u_hat[0];
  REQUIRE(s > 0);
  const double along = r[0] * velocities.u_hat[0];
  CHECK(certificate.gap == Approx(along + s * 3));
}

TEST_CASE("what still approaches violates by its speed over the root of its weight", "[cone]") {
  for (const double mass : {0.25, 1.0, 100.0}) {
    INFO(mass << " kg");
    const PointMass point(mass, {-1, 0, 0}, {1});
    const ConeProgram p = point.program();
    REQUIRE_FALSE(p.has_bound());
    const std::vector<double> r{0.5 * mass, 0, 0}, eta(1, 0.0), q{-1, 0, 0};
    ConeVelocities velocities;
    velocities.evaluate(p, r, eta);
    REQUIRE(velocities.u[0] == Approx(-0.5));
    CHECK(certify(p, r, eta, velocities, q).infeasibility == Approx(0.5));  // of what approached at 1 m/s
  }
}

TEST_CASE("what pulls is in no cone, friction or not", "[cone]") {
  for (const double mu : {0.0, 0.5}) {
    const double pulls[] = {-1e-9, 0, 0}, carries[] = {1, 0, 0}, rests[] = {0, 0, 0};
    CHECK_FALSE(in_cone(pulls, mu));
    CHECK(in_cone(carries, mu));
    CHECK(in_cone(rests, mu));
  }
  const double within[] = {1, 0.3, -0.39}, beyond[] = {1, 0.3, -0.41};
  CHECK(in_cone(within, 0.5));
  CHECK_FALSE(in_cone(beyond, 0.5));
}
