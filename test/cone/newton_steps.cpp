// Newton steps of the cone methods against the equations that they are said to solve, built as whole matrices.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "cone/cone_workspace.h"
#include "cone/dense_newton.h"
#include "cone/dense_system.h"
#include "cone/interior_point.h"
#include "cone/rows.h"
#include "cone/sparse_newton.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double drawn(std::mt19937& generator) { return std::uniform_real_distribution<double>(-1, 1)(generator); }

/// Blocks of 6, 3, 2 and 6 rows, contacts between them, to the ground, and to nothing but one; all its numbers drawn.
struct Program {
  BlockDiagonalMatrix M;
  BandMatrix J;
  BlockCholesky factor;
  std::vector<double> v0, offset, mu, weight, slack, share;
  std::vector<char> fixed;
  MatrixXd mass, jacobian;

  explicit Program(unsigned seed) {
    std::mt19937 generator(seed);
    const auto uniform = [&] { return drawn(generator); };
    for (const int n : {6, 3, 2, 6}) {
      M.add_block(n);
      const MatrixXd half = MatrixXd::NullaryExpr(n, n, uniform);
      M.block(M.blocks() - 1) = half * half.transpose() + MatrixXd::Identity(n, n);
    }
    const std::vector<std::vector<int>> touched = {{0}, {0, 1}, {1, 2}, {3}, {0, 3}, {2}};
    const int nc = static_cast<int>(touched.size()), nv = M.order();
    jacobian.setZero(3 * nc, nv);
    for (int c = 0; c < nc; ++c) {
      J.add_band();
      for (const int b : touched[c]) {
        const int n = M.block_size(b), e = J.add_entry(b, n);
        J.entry(e) = MatrixXd::NullaryExpr(3, n, uniform);
        jacobian.block(3 * c, M.first[b], 3, n) = J.entry(e);
      }
    }
    mass.setZero(nv, nv);
    for (int b = 0; b < M.blocks(); ++b) {
      const int at = M.first[b], n = M.block_size(b);
      mass.block(at, at, n, n) = M.block(b);
    }
    REQUIRE(factor.factor(M));
    for (int i = 0; i < nv; ++i) v0.push_back(uniform());
    for (int i = 0; i < 3 * nc; ++i) offset.push_back(0.1 * uniform());
    mu = {0.5, 2, 0, 0.3, 1, 0};
    const MatrixXd W = mobility();
    for (int c = 0; c < nc; ++c) weight.push_back(W.block(3 * c, 3 * c, 3, 3).trace() / 3);
    slack = {0, 0.25, 0, 0.5, 0, 0.125};
    share = {1, 0, 1, 1, 0, 1};
    fixed = {0, 0, 0, 1, 0, 0};
  }
  MatrixXd mobility() const { return jacobian * mass.inverse() * jacobian.transpose(); }
  VectorXd free_velocity() const {
    return jacobian * VectorXd::Map(v0.data(), static_cast<Eigen::Index>(v0.size())) +
           VectorXd::Map(offset.data(), static_cast<Eigen::Index>(offset.size()));
  }
  ConeProgram program(bool below, bool bound) const {
    ConeProgram p;
    p.M = &M;
    p.factor = &factor;
    p.J = &J;
    p.v0 = &v0;
    p.offset = &offset;
    p.mu = &mu;
    p.weight = &weight;
    p.bounded_below = below;
    if (below) {
      p.slack = &slack;
      p.fixed = &fixed;
    }
    if (bound) {
      p.kappa = 3;
      p.share = &share;
    }
    return p;
  }
  int nc() const { return J.bands(); }
};

MatrixXd definite(std::mt19937& generator) {
  const MatrixXd half = MatrixXd::NullaryExpr(3, 3, [&] { return drawn(generator); });
  return half * half.transpose() + 0.1 * MatrixXd::Identity(3, 3);
}

VectorXd vector(const std::vector<double>& x) { return VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size())); }

/// A point inside all cones.
template <class Real>
ConePoint<Real> inside(const Program& of, const Cones<Real>& cones, std::mt19937& generator) {
  ConePoint<Real> x;
  const int nc = of.nc();
  x.set_zero(nc);
  const auto above = [&] { return Real(0.2 + std::abs(drawn(generator))); };
  for (int c = 0; c < nc; ++c) {
    x.r[3 * c] = above();
    x.y[3 * c] = above();
    if (of.mu[c] > 0) {
      const double mu = of.mu[c];
      for (int i = 1; i < 3; ++i) {
        x.r[3 * c + i] = 0.6 * mu * drawn(generator) * double(x.r[3 * c]);
        x.y[3 * c + i] = 0.6 / mu * drawn(generator) * double(x.y[3 * c]);
      }
    }
    if (cones.eta) x.eta[c] = above();
    if (cones.inequality[c] != 0) x.a[c] = above();
  }
  if (cones.bound) {
    x.s = above();
    x.b = above();
  }
  return x;
}

}  // namespace

TEST_CASE("the Newton step of a program solves its equations, with multipliers, with the bound and without", "[cone]") {
  for (unsigned seed = 1; seed <= 4; ++seed)
    for (const bool below : {false, true})
      for (const double least_block : {0, 1000}) {
        const Program of(seed);
        const ConeProgram p = of.program(below, true);
        const int nc = of.nc();
        NewtonSystem newton;
        newton.prepare(p, least_block);
        std::mt19937 generator(seed + 10);
        for (int c = 0; c < nc; ++c) {
          mat3(&newton.G[9 * c]) = definite(generator);
          if (below) newton.D[c] = c == 2 ? 0 : std::abs(drawn(generator));
          if (below) newton.c_eta[c] = drawn(generator);
        }
        for (double& x : newton.c_r) x = drawn(generator);
        VectorXd d = VectorXd::Zero(3 * nc);
        for (int c = 0; c < nc; ++c) d[3 * c] = of.share[c];
        CHECK(vector(newton.d) == d);
        REQUIRE(newton.factor());
        const auto check = [&] {
          // M dv = J^T dr, dw = dv - M^-1 N^T deta.
          const VectorXd dr = vector(newton.dr), dv = of.mass.llt().solve(of.jacobian.transpose() * dr);
          VectorXd normal = VectorXd::Zero(3 * nc);
          for (int c = 0; c < nc; ++c) normal[3 * c] = newton.deta[c];
          const VectorXd dw = dv - of.mass.llt().solve(of.jacobian.transpose() * normal);
          const VectorXd J_dw = of.jacobian * dw, J_dv = of.jacobian * dv;
          CHECK((vector(newton.J_dw) - J_dw).norm() < 1e-11);
          for (int c = 0; c < nc; ++c) {
            const Eigen::Vector3d expected =
                vec3(&newton.c_r[3 * c]) -
                mat3(&newton.G[9 * c]) * (J_dw.segment<3>(3 * c) + newton.ds * d.segment<3>(3 * c));
            CHECK((dr.segment<3>(3 * c) - expected).norm() < 1e-11);
            if (!below) {
              CHECK(newton.deta[c] == 0);
              continue;
            }
            CHECK(newton.N_dv[c] == Approx(J_dv[3 * c]).margin(1e-11));
            CHECK(newton.deta[c] == Approx(newton.c_eta[c] - newton.D[c] * J_dv[3 * c]).margin(1e-11));
          }
        };
        for (const double ds : {0.0, 0.75, -2.0}) {
          newton.solve(ds);
          CHECK(newton.ds == ds);
          check();
        }
        for (const auto& [diagonal, rhs] : {std::pair{0.5, 1.25}, std::pair{0.0, -2.0}, std::pair{1e3, 0.25}}) {
          REQUIRE(newton.solve_bordered(diagonal, rhs));
          check();
          CHECK(d.dot(vector(newton.dr)) == Approx(rhs + diagonal * newton.ds).margin(1e-11));
        }
        // Nothing to divide by.
        for (double& g : newton.G) g = 0;
        REQUIRE(newton.factor());
        CHECK_FALSE(newton.solve_bordered(0, 1));
        CHECK(newton.solve_bordered(2, 1));
        CHECK(newton.ds == Approx((d.dot(vector(newton.c_r)) - 1) / 2));
      }
}

TEST_CASE("a contact's columns are the root of its mobility, and what is multiplied by them is", "[cone]") {
  const Program of(3);
  const ConeProgram p = of.program(false, false);
  const int nc = of.nc(), nv = p.nv();
  ContactColumns::Vector scale(nc), x(3 * nc);
  std::mt19937 generator(1);
  for (int c = 0; c < nc; ++c) scale[c] = 0.5 + c;
  for (int i = 0; i < 3 * nc; ++i) x[i] = drawn(generator);
  ContactColumns columns;
  columns.form(p, scale);
  CHECK(columns.rows() == nv);
  CHECK(columns.contacts() == nc);
  const MatrixXd L = of.mass.llt().matrixL();
  MatrixXd A = L.triangularView<Eigen::Lower>().solve(of.jacobian.transpose());
  for (int c = 0; c < nc; ++c) A.middleCols(3 * c, 3) *= 0.5 + c;
  DoubleDoubleVector momentum;
  columns.momentum(x, momentum);
  VectorXd x_low(3 * nc);
  for (int i = 0; i < 3 * nc; ++i) x_low[i] = double(x[i]);
  const VectorXd expected = A * x_low, velocity = A.transpose() * expected;
  for (int i = 0; i < nv; ++i) CHECK(double(momentum[i]) == Approx(expected[i]).margin(1e-13));
  ContactColumns::Vector u;
  columns.velocities(momentum, u);
  REQUIRE(u.size() == 3 * nc);
  for (int i = 0; i < 3 * nc; ++i) CHECK(double(u[i]) == Approx(velocity[i]).margin(1e-12));
  // A_c B A_c^T, read through the factors: no other way leads out of the matrix.
  const MatrixXd B = definite(generator);
  for (const int c : {0, 1, 4}) {
    DoubleDoubleLu lu;
    lu.resize(2 * nv);
    for (int i = 0; i < 2 * nv; ++i) lu.add(i, i, 1);
    Eigen::Matrix<DoubleDouble, 3, 3> middle = B.cast<DoubleDouble>();
    middle(0, 1) = middle(0, 1) + 0.5;  // not symmetric
    columns.add_congruence(middle, c, nv, 0, lu);
    MatrixXd whole = MatrixXd::Identity(2 * nv, 2 * nv), B_whole = B;
    B_whole(0, 1) += 0.5;
    whole.block(nv, 0, nv, nv) += A.middleCols(3 * c, 3) * B_whole * A.middleCols(3 * c, 3).transpose();
    DoubleDoubleVector b(2 * nv);
    VectorXd right(2 * nv);
    for (int i = 0; i < 2 * nv; ++i) b.set(i, right[i] = drawn(generator));
    REQUIRE(lu.factor());
    lu.solve_in_place(b);
    const VectorXd answer = whole.fullPivLu().solve(right);
    for (int i = 0; i < 2 * nv; ++i) CHECK(double(b[i]) == Approx(answer[i]).margin(1e-11));
  }
}

TEST_CASE("the dense systems are solved to thirty digits, whatever of multipliers and bound they have", "[cone]") {
  using Real = DoubleDouble;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  for (const bool below : {false, true})
    for (const bool bound : {false, true})
      for (const double ratio : {1.0, 1e-3}) {
        INFO((below ? "below " : "") << (bound ? "bound " : "") << ratio);
        const Program of(5);
        const ConeProgram p = of.program(below, bound);
        const int nc = of.nc(), nv = p.nv();
        DenseSystem::Vector scale(nc), d(nc);
        for (int c = 0; c < nc; ++c) {
          scale[c] = 1 / sqrt(Real(of.weight[c]));
          d[c] = of.share[c] * scale[c];
        }
        DenseSystem system;
        system.form(p, scale, d, ratio, below, bound);
        CHECK(system.at_e() == 3 * nc);
        CHECK(system.at_s() == 3 * nc + (below ? nc : 0));
        const int n = system.at_s() + (bound ? 1 : 0);
        REQUIRE(system.unknowns() == n);
        // The whole matrix, in as many digits.
        Matrix A(nv, 3 * nc);
        for (int c = 0; c < nc; ++c)
          A.middleCols(3 * c, 3) = of.jacobian.middleRows(3 * c, 3).transpose().cast<Real>() * scale[c];
        for (int b = 0; b < p.M->blocks(); ++b) {
          const Eigen::LLT<Matrix> llt(of.M.block(b).cast<Real>());
          Matrix rows = A.middleRows(of.M.first[b], of.M.block_size(b));
          llt.matrixL().solveInPlace(rows);
          A.middleRows(of.M.first[b], of.M.block_size(b)) = rows;
        }
        const Matrix W = A.transpose() * A;
        Matrix K = Matrix::Zero(n, n);
        K.topLeftCorner(3 * nc, 3 * nc) = Real(ratio) * W;
        std::mt19937 generator(7);
        for (int c = 0; c < nc; ++c) {
          const Eigen::Matrix<Real, 3, 3> G = definite(generator).cast<Real>(), G_inverse = G.inverse();
          const Real D_inverse = 0.5 + std::abs(drawn(generator));
          system.set(c, G, G_inverse, D_inverse);
          K.block(3 * c, 3 * c, 3, 3) += G_inverse;
          if (below) {
            K.block(0, system.at_e() + c, 3 * nc, 1) = -W.col(3 * c);
            K.block(system.at_e() + c, 0, 1, 3 * nc) = W.row(3 * c);
            K(system.at_e() + c, system.at_e() + c) = D_inverse;
          }
          if (bound) {
            K(3 * c, system.at_s()) = d[c];
            K(system.at_s(), 3 * c) = -d[c];
          }
        }
        if (bound) K(system.at_s(), system.at_s()) = 0.25;
        REQUIRE(system.factor(0.25));
        DenseSystem::Vector rhs(n), z;
        for (int i = 0; i < n; ++i) rhs[i] = drawn(generator);
        system.solve(rhs, z);
        REQUIRE(z.size() == n);
        const DenseSystem::Vector off = K * z - rhs;
        for (int i = 0; i < n; ++i) CHECK(std::abs(double(off[i])) < 1e-26);
      }
}

// Of velocities q that are known: U^2 = sum q^2 / w (tangents only where there is friction), R by the impulses.
TEST_CASE("what a program is of the size of is what its velocities make, or its impulses where they are less",
          "[cone]") {
  Program of(2);
  ConeProgram p = of.program(true, true);
  const VectorXd q = of.free_velocity();
  double square = 0, logs = 0;
  for (int c = 0; c < of.nc(); ++c) {
    square += (of.mu[c] > 0 ? q.segment<3>(3 * c).squaredNorm() : q[3 * c] * q[3 * c]) / of.weight[c];
    logs += std::log(of.weight[c]) / of.nc();
  }
  const double U = std::sqrt(square), mean = std::exp(logs);
  for (const double impulse :
       {std::numeric_limits<double>::infinity(), 2 * U / std::sqrt(mean), 1e-3 * U / std::sqrt(mean), 0.0}) {
    p.impulse_size = impulse;
    const bool small = impulse > 0 && impulse * std::sqrt(mean) < U;
    const double R = small ? impulse * std::sqrt(mean) : U;
    ConeWorkspace workspace;
    workspace.prepare(p, {});
    const ConeScales<double>& scales = workspace.scales;
    CHECK((vector(workspace.q) - q).norm() < 1e-13);
    CHECK(scales.size == Approx(std::sqrt(R * U)));
    CHECK(scales.ratio == Approx(R / U));
    CHECK(scales.mean_weight == Approx(mean * U / R));
    for (int c = 0; c < of.nc(); ++c) {
      CHECK(scales.w_r[c] == Approx(of.weight[c] * U / R));
      CHECK(scales.w_eta[c] == Approx(of.weight[c] * R / U));
    }
  }
}

namespace {

/// The complementarity of a step in scaled coordinates: W^-1 dr + W dy + lambda - more, of a contact.
template <class Real>
ConeVector<Real> off_complementarity(const CentralPath<Real>& path, int c, const ConeVector<Real>& more) {
  const auto& s = path.scaling[c];
  const Real mu = path.cones.mu[c];
  return s.apply_inverse(in_primal(&path.step.r[3 * c], mu)) + s.apply(in_dual(&path.step.y[3 * c], mu)) +
         s.apply(in_dual(&path.at.y[3 * c], mu)) - more;
}

/// Newton's equations of a step, predicted or corrected, within `digits`.
template <class Real, class System>
void check_steps(const Program& of, System& system, CentralPath<Real>& path, double digits, double proximal) {
  const int nc = of.nc();
  std::mt19937 generator(11);
  path.at = inside<Real>(of, path.cones, generator);
  ConePoint<Real>& x = path.at;
  path.step.set_zero(nc);
  path.scaling.resize(nc);
  path.second_order.contact.setZero(3 * nc);
  path.second_order.eta.setZero(nc);
  path.second_order.b = 0;
  const auto residuals = [&](const ConePoint<Real>& at, RealVector<Real>& y, RealVector<Real>& a, Real& b) {
    y.resize(3 * nc);
    a.resize(nc);
    system.slacks(at, y, a);
    y = (at.y - y).eval();
    a = (at.a - a).eval();
    b = at.b - path.cones.kappa;
    for (int c = 0; c < nc; ++c) {
      const Real d = path.cones.d[c];
      y[3 * c] -= at.s * d;
      b += d * at.r[3 * c];
    }
    if (!path.cones.bound) b = 0;
  };
  residuals(x, path.off.y, path.off.a, path.off.b);
  for (int c = 0; c < nc; ++c)
    if (const Real mu = path.cones.mu[c]; mu > 0)
      path.scaling[c] = ConeScaling<Real>::of(in_primal(&x.r[3 * c], mu), in_dual(&x.y[3 * c], mu));
  REQUIRE(system.factor(path));
  for (const bool corrected : {false, true}) {
    if (corrected) {
      for (int c = 0; c < nc; ++c) {
        for (int i = 0; i < (path.cones.mu[c] > 0 ? 3 : 1); ++i)
          path.second_order.contact[3 * c + i] = drawn(generator);
        if (path.cones.inequality[c] != 0) path.second_order.eta[c] = drawn(generator);
      }
      if (path.cones.bound) path.second_order.b = drawn(generator);
      system.add(path);
    }
    const SecondOrder<Real>& more = path.second_order;
    ConePoint<Real>& step = path.step;
    REQUIRE(system.solve(path, step));
    step.b = path.cones.bound ? -x.b - x.b / x.s * step.s + more.b : Real(0);
    // A whole step leaves nothing of the linear rows.
    ConePoint<Real> end = x;
    end.r += step.r;
    end.y += step.y;
    end.eta += step.eta;
    end.a += step.a;
    end.s += step.s;
    end.b += step.b;
    RealVector<Real> y, a;
    Real b;
    residuals(end, y, a, b);
    RealVector<Real> again_y(3 * nc), again_a(nc);
    system.slacks(x, again_y, again_a);  // the system is at the point again
    CHECK(std::abs(double(b)) < digits);
    for (int c = 0; c < nc; ++c) {
      INFO("contact " << c << (corrected ? ", corrected" : ""));
      if (path.cones.mu[c] > 0) {
        for (int i = 0; i < 3; ++i) CHECK(std::abs(double(y[3 * c + i])) < digits);
        const ConeVector<Real> off = off_complementarity<Real>(path, c, more.contact.template segment<3>(3 * c));
        for (int i = 0; i < 3; ++i) CHECK(std::abs(double(off[i])) < digits);
      } else {
        CHECK(std::abs(double(y[3 * c])) < digits);
        CHECK(std::abs(double(x.r[3 * c] * (x.y[3 * c] + step.y[3 * c]) + x.y[3 * c] * step.r[3 * c] -
                              more.contact[3 * c])) < digits);
        for (int i = 1; i < 3; ++i) CHECK(double(step.r[3 * c + i]) == 0);
      }
      if (!path.cones.eta) continue;
      // A fixed velocity is met but for the proximal term of its multiplier.
      const Real left = path.cones.inequality[c] != 0 ? Real(0) : proximal * path.scales.w_eta[c] * step.eta[c];
      CHECK(std::abs(double(a[c] - left)) < digits);
      if (path.cones.inequality[c] != 0)
        CHECK(std::abs(double(x.eta[c] * (x.a[c] + step.a[c]) + x.a[c] * step.eta[c] - more.eta[c])) < digits);
      else
        CHECK(double(step.a[c]) == 0);
    }
  }
}

}  // namespace

TEST_CASE("steps of the sparse method solve the equations of its path, the second order of them too", "[cone]") {
  for (const bool below : {false, true})
    for (const bool bound : {false, true}) {
      INFO((below ? "below " : "") << (bound ? "bound" : ""));
      const Program of(8);
      const ConeProgram p = of.program(below, bound);
      ConeOptions options;
      options.regularisation = 0;  // of which the equations know nothing
      options.proximal = 1e-3;
      ConeWorkspace workspace;
      workspace.prepare(p, options);
      SparseNewtonScratch scratch;
      SparseNewton system(p, options, workspace, scratch);
      CentralPath<double> path;
      system.describe(path);
      const int nc = of.nc();
      CHECK(path.cones.count == nc + (bound ? 1 : 0) + (below ? nc - 1 : 0));
      CHECK(path.cones.kappa == (bound ? 3 : 0));
      CHECK(path.cones.eta == below);
      CHECK(path.cones.bound == bound);
      const VectorXd q = of.free_velocity();
      for (int c = 0; c < nc; ++c) {
        CHECK(path.cones.inequality[c] == (below && c != 3 ? 1 : 0));
        CHECK(path.cones.d[c] == (bound ? of.share[c] : 1));
        CHECK(path.a_free[c] == Approx(q[3 * c] + (below ? of.slack[c] : 0)).margin(1e-14));
      }
      check_steps<double>(of, system, path, 1e-9, options.proximal);
    }
}

TEST_CASE("steps of the dense method solve the equations of its path to twenty digits", "[cone]") {
  using Real = DoubleDouble;
  for (const bool below : {false, true})
    for (const bool bound : {false, true})
      for (const double impulse : {std::numeric_limits<double>::infinity(), 1e-3}) {
        INFO((below ? "below " : "") << (bound ? "bound " : "") << impulse);
        const Program of(9);
        ConeProgram p = of.program(below, bound);
        p.impulse_size = impulse;
        if (below) p.fixed = nullptr;  // of a fixed velocity the proximal term is all there is
        DenseNewton system(p);
        CentralPath<Real> path;
        system.describe(path);
        // Sizes: U^2 = sum q^2 / w, R by the impulses.
        const int nc = of.nc();
        const VectorXd q = of.free_velocity();
        double square = 0, logs = 0;
        for (int c = 0; c < nc; ++c) {
          square += (of.mu[c] > 0 ? q.segment<3>(3 * c).squaredNorm() : q[3 * c] * q[3 * c]) / of.weight[c];
          logs += std::log(of.weight[c]) / nc;
        }
        const double U = std::sqrt(square), R = std::min(U, impulse * std::exp(logs / 2));
        CHECK(system.size() == Approx(U));
        CHECK((vector(system.q()) - q).norm() < 1e-13);
        CHECK(path.cones.count == nc + (bound ? 1 : 0) + (below ? nc : 0));
        CHECK(double(path.cones.kappa) == Approx(bound ? 3 / R : 0).margin(1e-14));
        CHECK(path.scales.mean_weight.high == Approx(std::exp(logs)));
        // Slacks of some impulses and multipliers, in units of U sqrt(w) and R sqrt(w).
        ConePoint<Real> point;
        point.set_zero(nc);
        std::mt19937 generator(2);
        VectorXd r(3 * nc), normal = VectorXd::Zero(3 * nc);
        for (int i = 0; i < 3 * nc; ++i) point.r[i] = drawn(generator);
        for (int c = 0; c < nc && below; ++c) point.eta[c] = drawn(generator);
        point.s = 0.75;
        ConeSolution rounded;
        system.round_off(point, rounded);
        for (int c = 0; c < nc; ++c) {
          for (int i = 0; i < 3; ++i) {
            r[3 * c + i] = double(point.r[3 * c + i]) * R / std::sqrt(of.weight[c]);
            CHECK(rounded.r[3 * c + i] == Approx(r[3 * c + i]));
          }
          normal[3 * c] = double(point.eta[c]) * U / std::sqrt(of.weight[c]);
          CHECK(rounded.eta[c] == Approx(normal[3 * c]).margin(1e-300));
        }
        CHECK(rounded.s == Approx(0.75 * U));
        const VectorXd u = of.mobility() * r + q, u_hat = u - of.mobility() * normal;
        RealVector<Real> y, a;
        system.slacks(point, y, a);
        for (int c = 0; c < nc; ++c) {
          const double root = std::sqrt(of.weight[c]);
          for (int i = 0; i < 3; ++i)
            CHECK(double(y[3 * c + i]) ==
                  Approx(i == 0 || of.mu[c] > 0 ? u_hat[3 * c + i] / root / U : 0).margin(1e-12));
          if (!below) continue;
          CHECK(double(a[c]) == Approx((u[3 * c] + of.slack[c]) / root / R).epsilon(1e-11).margin(1e-11));
          CHECK(double(path.a_free[c]) == Approx((q[3 * c] + of.slack[c]) / root / R).epsilon(1e-11));
        }
        check_steps<Real>(of, system, path, 1e-20, 0);
      }
}

TEST_CASE("programs with contacts of every kind are solved by both methods, to the same motion and a certificate",
          "[cone]") {
  // Without friction, with slack, fixed, beside the bound.
  for (unsigned seed = 1; seed <= 3; ++seed)
    for (const bool below : {false, true})
      for (const bool bound : {false, true}) {
        INFO("seed " << seed << (below ? ", below" : "") << (bound ? ", bound" : ""));
        Program of(seed);
        of.offset[9] -= 3;  // what is fixed approaches: nothing pulls
        of.slack[3] = 0;
        ConeProgram p = of.program(below, false);
        ConeSolution sparse, dense;
        if (bound) {
          p.share = &of.share;
          InteriorPoint().solve(p, sparse);
          p.kappa = (below ? 1.05 : 0.5) * sum_of_shares(p, sparse.r);  // less leaves what approaches
        }
        InteriorPoint().solve(p, sparse);
        solve_dense(p, {}, dense);
        std::vector<double> q(3 * of.nc());
        VectorXd::Map(q.data(), 3 * of.nc()) = of.free_velocity();
        ConeVelocities of_sparse, of_dense;
        const auto check = [&](const ConeSolution& x, ConeVelocities& velocities) {
          REQUIRE(x.status == ConeStatus::solved);
          const std::span<const double> eta = p.has_eta() ? std::span<const double>(x.eta) : std::span<const double>();
          velocities.evaluate(p, x.r, eta);
          const Certificate found = certify(p, x.r, eta, velocities, q);
          CHECK(std::abs(found.gap) <= 1e-11 * found.size * found.size);
          CHECK(found.infeasibility <= 1e-10);
          if (bound) CHECK(sum_of_shares(p, x.r) <= p.kappa * (1 + 1e-9));
          for (int c = 0; c < of.nc(); ++c)
            if (of.mu[c] == 0) CHECK(std::hypot(x.r[3 * c + 1], x.r[3 * c + 2]) == 0);
          if (below) CHECK(velocities.u[9] == Approx(0).margin(1e-10));
        };
        check(sparse, of_sparse);
        check(dense, of_dense);
        // One motion: v, by M definite.
        for (std::size_t i = 0; i < of_sparse.v.size(); ++i)
          CHECK(of_dense.v[i] == Approx(of_sparse.v[i]).margin(1e-5));  // the root of a gap
      }
}

TEST_CASE("Newton's method alone finds what one contact needs from nothing: to stick, to slide, to part", "[cone]") {
  // Of mobility 1 / m the answer is the projection of -m v on the cone, whatever the friction.
  for (const double mass : {1e-3, 1.0, 50.0})
    for (const double mu : {0.0, 0.2, 1.0, 4.0})
      for (const Eigen::Vector3d& v : {Eigen::Vector3d(-1, 0.05, -0.02), Eigen::Vector3d(-1, 3, -4),
                                       Eigen::Vector3d(0.5, 6, 8), Eigen::Vector3d(1, 0.1, 0)}) {
        INFO(mass << " kg, mu " << mu << ", v " << v.transpose());
        BlockDiagonalMatrix M;
        M.add_block(3);
        M.block(0) = mass * Eigen::Matrix3d::Identity();
        BlockCholesky factor;
        REQUIRE(factor.factor(M));
        BandMatrix J;
        J.add_band();
        J.entry(J.add_entry(0, 3)).setIdentity();
        const std::vector<double> v0{v[0], v[1], v[2]}, offset(3, 0.0), of_mu{mu}, weight{1 / mass};
        ConeProgram p;
        p.M = &M;
        p.factor = &factor;
        p.J = &J;
        p.v0 = &v0;
        p.offset = &offset;
        p.mu = &of_mu;
        p.weight = &weight;
        const Eigen::Vector3d z = -mass * v;
        const double t = std::hypot(z[1], z[2]), n = (z[0] + mu * t) / (1 + mu * mu);
        Eigen::Vector3d r = z;
        if (mu == 0)
          r = Eigen::Vector3d(std::max(z[0], 0.0), 0, 0);
        else if (mu * t <= -z[0])
          r.setZero();
        else if (t > mu * z[0])
          r = Eigen::Vector3d(n, mu * n * z[1] / t, mu * n * z[2] / t);
        const ConeOptions options;
        ConeSolution x;
        x.r.assign(3, 0.0);
        REQUIRE(InteriorPoint(options).polish(p, x, PolishRules::bold(options, options.guess_patience)));
        CHECK(x.status == ConeStatus::solved);
        CHECK((vec3(x.r.data()) - r).norm() <= 1e-9 * (mass + r.norm()));
      }
}
