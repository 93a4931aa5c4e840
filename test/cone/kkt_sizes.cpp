// The linear systems of the cone programs where blocks are of several sizes, as trees of joints are beside free bodies.

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "cone/contact_columns.h"
#include "cone/kkt_system.h"

using namespace cb;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST_CASE("both kernels solve the equations of motion of blocks of several sizes", "[kkt]") {
  std::mt19937 generator(5);
  const auto drawn = [&] { return std::uniform_real_distribution<double>(-1, 1)(generator); };
  BlockDiagonalMatrix M;
  for (const int n : {1, 6, 2, 1, 3, 1}) {
    const MatrixXd half = MatrixXd::NullaryExpr(n, n, drawn);
    M.block(M.add_block(n)) = half * half.transpose() + MatrixXd::Identity(n, n);
  }
  const std::vector<std::vector<int>> touched = {{0, 1}, {1, 2}, {1, 4}, {1, 3}, {4, 5}, {2}, {0, 4}};
  const int nv = M.order(), nc = static_cast<int>(touched.size());
  MatrixXd mass = MatrixXd::Zero(nv, nv), friction = mass, normal = mass;  // M, J^T G J, N^T D N
  for (int b = 0; b < M.blocks(); ++b)
    mass.block(M.first[b], M.first[b], M.block_size(b), M.block_size(b)) = M.block(b);
  BandMatrix J;
  std::vector<double> G(9 * touched.size()), D(touched.size());
  for (int c = 0; c < nc; ++c) {
    J.add_band();
    MatrixXd rows = MatrixXd::Zero(3, nv);
    for (const int b : touched[c]) {
      const int n = M.block_size(b), e = J.add_entry(b, n);
      const MatrixXd entry = MatrixXd::NullaryExpr(3, n, drawn);
      J.entry(e) = entry;
      rows.middleCols(M.first[b], n) = entry;
    }
    const MatrixXd half = MatrixXd::NullaryExpr(3, 3, drawn);
    const Eigen::Matrix3d of_contact = half * half.transpose() + 0.1 * MatrixXd::Identity(3, 3);
    std::copy_n(of_contact.data(), 9, G.data() + 9 * c);
    D[c] = c % 3 == 0 ? 0 : 0.5 + std::abs(drawn());
    friction += rows.transpose() * of_contact * rows;
    normal += D[c] * rows.row(0).transpose() * rows.row(0);
  }
  MatrixXd whole(2 * nv, 2 * nv);
  whole << mass + normal, -mass, mass, friction;
  const VectorXd h = VectorXd::NullaryExpr(2 * nv, drawn), both = whole.partialPivLu().solve(h);
  const VectorXd one = (mass + friction).llt().solve(h.tail(nv));
  for (const double least_block : {0.0, 1000.0}) {
    INFO((least_block == 0 ? "by blocks" : "sparse"));
    KktSystem system;
    system.prepare(M, J, least_block);
    REQUIRE(system.factor(G, D));
    std::vector<double> dv(h.data(), h.data() + nv), dw(h.data() + nv, h.data() + 2 * nv);
    system.solve_in_place(dv, dw);
    for (int i = 0; i < nv; ++i) {
      CHECK(dv[i] == Approx(both[i]).margin(1e-10));
      CHECK(dw[i] == Approx(both[nv + i]).margin(1e-10));
    }
    REQUIRE(system.factor(G, {}));
    dw.assign(h.data() + nv, h.data() + 2 * nv);
    system.solve_in_place(dw);
    for (int i = 0; i < nv; ++i) CHECK(dw[i] == Approx(one[i]).margin(1e-10));
  }
}

TEST_CASE("columns of contacts are those of the program at hand, to all their digits, whatever was formed before",
          "[cone]") {
  struct Posed {
    BlockDiagonalMatrix M;
    BandMatrix J;
  };
  const auto posed = [](const std::vector<int>& sizes) {
    Posed out;
    out.J.add_band();
    double number = 0;
    for (const int n : sizes) {
      const int b = out.M.add_block(n);
      out.M.block(b).setConstant(0.2);
      out.M.block(b).diagonal().array() += 1.0;
      auto J = out.J.entry(out.J.add_entry(b, n));
      for (int j = 0; j < n; ++j)
        for (int row = 0; row < 3; ++row) J(row, j) = std::sin(++number);
    }
    return out;
  };
  const Posed large = posed({6, 3}), small = posed({2, 1});
  const auto same = [](const DoubleDouble& a, const DoubleDouble& b) { return a.high == b.high && a.low == b.low; };
  ContactColumns kept;
  for (const Posed* of : {&large, &small, &large}) {
    ConeProgram program;
    program.M = &of->M;
    program.J = &of->J;
    const ContactColumns::Vector d = ContactColumns::Vector::Constant(1, DoubleDouble(0.7)),
                                 x = ContactColumns::Vector::Constant(3, DoubleDouble(1.0) / DoubleDouble(3.0));
    ContactColumns fresh;
    kept.form(program, d);
    fresh.form(program, d);
    DoubleDoubleVector p, p_fresh;
    kept.momentum(x, p);
    fresh.momentum(x, p_fresh);
    CHECK(p.high == p_fresh.high);
    CHECK(p.low == p_fresh.low);
    ContactColumns::Vector u, u_fresh;
    kept.velocities(p_fresh, u);
    fresh.velocities(p_fresh, u_fresh);
    REQUIRE(u.size() == u_fresh.size());
    for (Eigen::Index i = 0; i < u.size(); ++i) CHECK(same(u[i], u_fresh[i]));
  }
}
