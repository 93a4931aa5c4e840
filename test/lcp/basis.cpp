// The two kernels of a basis are one dictionary (lcp/basis.h), and what stands in front of the solvers (lcp/front.h).
#include "lcp/basis.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <random>

#include "lcp/front.h"
#include "lcp/normal_map.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A positive definite problem in both forms, M = J A^-1 J^T + D, with scales for both.
struct TwoForms {
  LcpProblem expanded, dense;
  PairScales scales;
  VectorXd cover;
};

TwoForms two_forms(int n, int nx, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random = [&](int rows, int columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return uniform(generator); }));
  };
  const MatrixXd S = random(nx, nx), A = S * S.transpose() + MatrixXd::Identity(nx, nx), J = random(n, nx);
  const MatrixXd T = random(n, n), D = 0.2 * T * T.transpose();
  TwoForms forms;
  LcpProblem& p = forms.expanded;
  p.expanded = true;
  p.A = A.sparseView();
  p.B = (-J.transpose()).sparseView();
  p.C = J.sparseView();
  p.D = D.sparseView();
  p.a = random(nx, 1);
  p.q = random(n, 1);
  forms.dense.M = J * A.inverse() * J.transpose() + D;
  forms.dense.q = p.q - J * (A.inverse() * p.a);
  pair_scales(forms.dense, forms.scales);
  forms.cover = VectorXd::Ones(n) + 0.5 * random(n, 1);
  return forms;
}

double difference(const double* a, const double* b, int n) {
  return (Eigen::Map<const VectorXd>(a, n) - Eigen::Map<const VectorXd>(b, n)).lpNorm<Eigen::Infinity>();
}

}  // namespace

TEST_CASE("a basis has one dictionary, kept as a table or solved for") {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const int n = 13;
    const TwoForms forms = two_forms(n, 6, seed);
    Kernels kernels;
    Basis &table = kernels.of(forms.dense), &factors = kernels.of(forms.expanded);
    const VectorXd load = forms.dense.q.cwiseProduct(forms.scales.rows);
    for (const auto& [basis, problem] : {std::pair{&table, &forms.dense}, std::pair{&factors, &forms.expanded}}) {
      basis->start(*problem, forms.scales);
      REQUIRE(basis->eliminate());
      basis->restart();
      basis->set_load(load);
      basis->set_cover(forms.cover);
    }
    CHECK((table.eliminated_load() - factors.eliminated_load()).lpNorm<Eigen::Infinity>() < 1e-12);
    // z_0 for w_4, z_4 for w_7, z_7 for z_4: the same rows in both.
    for (const auto& [row, entering] : {std::pair{4, 2 * n}, std::pair{7, n + 4}, std::pair{7, n + 7}}) {
      CAPTURE(seed, row, entering);
      CHECK(difference(table.column(entering), factors.column(entering), n) < 1e-10);
      REQUIRE(table.pivot(row, entering));
      REQUIRE(factors.pivot(row, entering));
      CHECK(difference(table.rhs(), factors.rhs(), n) < 1e-10);
      for (int v = 0; v <= 2 * n; ++v) REQUIRE(table.is_basic(v) == factors.is_basic(v));
    }
    // Taken up from the matrix, that basis is the one that the pivots led to, its rows in another order.
    const VectorXd carried = Eigen::Map<const VectorXd>(table.rhs(), n);
    std::vector<int> variables(n);
    for (int i = 0; i < n; ++i) variables[i] = table.basic(i);
    for (Basis* basis : {&table, &factors}) {
      REQUIRE(basis->renew({7}, 4, load, forms.cover));
      for (int i = 0; i < n; ++i) CHECK(std::abs(basis->rhs()[basis->row_of(variables[i])] - carried[i]) < 1e-10);
    }
  }
}

TEST_CASE("a basis multiplies, sums sizes and solves its active set as the whole matrix does, in both forms") {
  const int n = 13;
  TwoForms forms = two_forms(n, 6, 3);
  // Rows and columns of different scales; signs that the sizes of terms must not see.
  for (int i = 0; i < n; ++i) {
    forms.scales.rows[i] = std::exp2(i % 5 - 2);
    forms.scales.columns[i] = std::exp2(i % 3 - 1);
  }
  const LcpProblem& p = forms.expanded;
  const MatrixXd &M = forms.dense.M, A = p.A, B = p.B, C = p.C, D = p.D;
  const VectorXd z = VectorXd::LinSpaced(n, 0, 2);
  const MatrixXd scaled = forms.scales.rows.asDiagonal() * M * forms.scales.columns.asDiagonal();
  Kernels kernels;
  for (const LcpProblem* problem : {&forms.dense, &forms.expanded}) {
    Basis& basis = kernels.of(*problem);
    basis.start(*problem, forms.scales);
    REQUIRE(basis.eliminate());
    VectorXd w, terms;
    basis.multiply(z, w);
    CHECK((w - M * z).norm() < 1e-12);
    basis.magnitudes(z, terms);
    const VectorXd through = (A.inverse() * (B.cwiseAbs() * z)).cwiseAbs();
    const VectorXd sizes =
        problem->expanded ? VectorXd(D.cwiseAbs() * z + C.cwiseAbs() * through) : VectorXd(M.cwiseAbs() * z);
    CHECK((terms - sizes).norm() < 1e-12 * sizes.norm());

    const std::vector<int> active{1, 4, 5, 12};
    const VectorXd load = VectorXd::LinSpaced(n, -1, 1);
    REQUIRE(basis.renew(active, -1, load, forms.cover));
    MatrixXd of_active(4, 4);
    VectorXd x = VectorXd::LinSpaced(n, 3, -2), right(4), scratch(basis.padded());
    for (int i = 0; i < 4; ++i) {
      right[i] = x[active[i]];
      for (int j = 0; j < 4; ++j) of_active(i, j) = scaled(active[i], active[j]);
    }
    const VectorXd expected = of_active.fullPivLu().solve(right);
    basis.solve_active(active, x.data(), scratch.data());
    for (int i = 0; i < 4; ++i) CHECK(x[active[i]] == Approx(expected[i]).epsilon(1e-10));
    // Basic values: w = M z + q + c z_0 of the scaled problem, for a load and by the cover.
    VectorXd z_now = VectorXd::Zero(n), dz = z_now;
    const double* by_cover = basis.column(2 * n);
    for (const int i : active) {
      z_now[i] = basis.rhs()[basis.row_of(n + i)];
      dz[i] = by_cover[basis.row_of(n + i)];
    }
    const VectorXd w_now = scaled * z_now + load, dw = scaled * dz + forms.cover;
    for (int i = 0; i < n; ++i) {
      const bool is_active = basis.is_basic(n + i);
      CHECK(std::abs(w_now[i] - (is_active ? 0 : basis.rhs()[basis.row_of(i)])) < 1e-11);
      CHECK(std::abs(dw[i] - (is_active ? 0 : by_cover[basis.row_of(i)])) < 1e-11);
    }
    // And by a w that is not basic, and a z.
    for (const int entering : {4, n + 2}) {
      VectorXd of_z = VectorXd::Zero(n), of_w = of_z;
      const double* column = basis.column(entering);
      for (int i = 0; i < n; ++i) (basis.basic(i) < n ? of_w : of_z)[basis.basic(i) % n] = column[i];
      (entering < n ? of_w : of_z)[entering % n] = 1;
      CHECK((scaled * of_z - of_w).lpNorm<Eigen::Infinity>() < 1e-11);
    }
    CHECK(basis.factorisations() > 0);
  }
  VectorXd x;
  kernels.sparse.free_unknowns(z, x);
  CHECK((A * x + B * z + p.a).norm() < 1e-12);
}

TEST_CASE("a basis of hundreds of pairs has its dictionary as one of a few has") {
  // Beyond what a pivot keeps in registers: 65 pairs and more.
  for (const int n : {7, 8, 9, 64, 65, 80}) {
    const TwoForms forms = two_forms(n, 20, 7);
    DenseBasis basis;
    basis.start(forms.dense, forms.scales);
    std::vector<int> active;
    for (int i = 0; i < n; i += 3) active.push_back(i);
    const VectorXd load = forms.dense.q.cwiseProduct(forms.scales.rows);
    REQUIRE(basis.renew(active, -1, load, forms.cover));
    VectorXd z = VectorXd::Zero(n), w = z;
    for (int i = 0; i < n; ++i) (basis.basic(i) < n ? w : z)[basis.basic(i) % n] = basis.rhs()[i];
    const MatrixXd scaled = forms.scales.rows.asDiagonal() * forms.dense.M * forms.scales.columns.asDiagonal();
    CHECK((scaled * z + load - w).lpNorm<Eigen::Infinity>() < 1e-9);
    const double* column = basis.column(2 * n);
    for (int i = 0; i < n; ++i) (basis.basic(i) < n ? w : z)[basis.basic(i) % n] = column[i];
    CHECK((scaled * z + forms.cover - w).lpNorm<Eigen::Infinity>() < 1e-9);
    for (int i = n; i < basis.padded(); ++i) CHECK(basis.rhs()[i] == 0);
  }
}

TEST_CASE("no basis takes a pivot that is zero or not finite, or a set without an inverse") {
  for (const bool expanded : {false, true}) {
    LcpProblem p;
    const MatrixXd M{{0, 1, 0}, {1, 0, 0}, {0, 0, 1e-320}};
    p.expanded = expanded;
    p.M = M;
    p.A = MatrixXd::Identity(1, 1).sparseView();
    p.B.resize(1, 3);
    p.C.resize(3, 1);
    p.D = M.sparseView();
    p.a = VectorXd::Zero(1);
    p.q = VectorXd{{1, 2, 3}};
    PairScales scales;
    scales.rho = scales.rows = scales.columns = VectorXd::Ones(3);
    Kernels kernels;
    Basis& basis = kernels.of(p);
    basis.start(p, scales);
    REQUIRE(basis.eliminate());
    basis.restart();
    basis.set_load(p.q);
    CHECK_FALSE(basis.pivot(0, 3));
    CHECK_FALSE(basis.pivot(2, 5));
    for (int i = 0; i < 3; ++i) {
      CHECK(basis.is_basic(i));
      CHECK(basis.rhs()[i] == p.q[i]);
    }
    CHECK_FALSE(basis.renew({0}, -1, p.q, VectorXd::Ones(3)));
    CHECK(basis.renew({0, 1}, -1, p.q, VectorXd::Ones(3)));
    CHECK(basis.rhs()[basis.row_of(3)] == -2);
    CHECK(basis.rhs()[basis.row_of(4)] == -1);
    CHECK(basis.rhs()[basis.row_of(2)] == 3);
  }
}

TEST_CASE("a basis whose exchanges lose digits is taken up from the matrix twice as often, until they do not") {
  // z_1 for w_1 where z_0 is basic: a pivot of `part`, there and back again, which leaves 1e-16 / part.
  const auto factorisations = [](double part) {
    LcpProblem p;
    p.expanded = true;
    p.A = MatrixXd::Identity(1, 1).sparseView();
    p.B.resize(1, 2);
    p.C.resize(2, 1);
    p.D = MatrixXd{{1, 1}, {1, 1 + part}}.sparseView();
    p.a = VectorXd::Zero(1);
    p.q = VectorXd{{0.3, 0.7}};
    PairScales scales;
    pair_scales(p, scales);
    Kernels kernels;
    Basis& basis = kernels.of(p);
    basis.start(p, scales);
    REQUIRE(basis.eliminate());
    basis.restart();
    basis.set_load(p.q.cwiseProduct(scales.rows));
    REQUIRE(basis.pivot(0, 2));
    const int before = basis.factorisations();
    for (int exchange = 1; exchange < 200; ++exchange) REQUIRE(basis.pivot(1, basis.basic(1) == 1 ? 3 : 1));
    return basis.factorisations() - before;
  };
  CHECK(factorisations(0.1) == 2);  // every hundredth
  CHECK(factorisations(1e-8) == 3);
}

TEST_CASE("a basis owes nothing to the problem before: the same bits as one that never saw it") {
  const std::vector<std::vector<int>> sets = {{}, {0, 3, 7}};
  const auto turning = [](double diagonal) {
    MatrixXd A = diagonal * MatrixXd::Identity(6, 6);
    for (int i = 0; i < 6; i += 2) A(i, i + 1) = 1 + 0.1 * i, A(i + 1, i) = -A(i, i + 1);
    return Eigen::SparseMatrix<double>(A.sparseView());
  };
  const auto values = [&](Basis& basis, const TwoForms& forms) {
    const int n = 13;
    const VectorXd load = forms.expanded.q.cwiseProduct(forms.scales.rows);
    basis.start(forms.expanded, forms.scales);
    REQUIRE(basis.eliminate());
    VectorXd all = basis.eliminated_load();
    for (const std::vector<int>& active : sets) {
      REQUIRE(basis.renew(active, -1, load, forms.cover));
      all.conservativeResize(all.size() + n);
      all.tail(n) = Eigen::Map<const VectorXd>(basis.rhs(), n);
    }
    return all;
  };
  for (const unsigned seed : {1u, 2u, 3u}) {
    CAPTURE(seed);
    TwoForms before = two_forms(13, 6, seed), forms = two_forms(13, 6, seed + 10);
    before.expanded.A = turning(1e-4);  // its pivots are off the diagonal, and would do
    forms.expanded.A = turning(0.5);
    Kernels used, fresh;
    Basis& basis = used.of(before.expanded);
    values(basis, before);
    CHECK(values(basis, forms) == values(fresh.of(forms.expanded), forms));
  }
}

TEST_CASE("the basis is not taken up anew between the two exchanges of a block") {
  // Two pairs that only both at once can be exchanged; 97 with small diagonals, which come in the second pass; two more
  // with small couplings, whose first exchange is then the hundredth.
  const int n = 101;
  MatrixXd M = MatrixXd::Zero(n, n);
  M(0, 1) = M(1, 0) = 1;
  for (int i = 2; i < n - 2; ++i) M(i, i) = 1e-5;
  M(n - 2, n - 1) = M(n - 1, n - 2) = 1e-5;
  LcpProblem p;
  p.expanded = true;
  p.A = MatrixXd::Identity(1, 1).sparseView();
  p.B.resize(1, n);
  p.C.resize(n, 1);
  p.D = M.sparseView();
  p.a = VectorXd::Zero(1);
  p.q = VectorXd::Ones(n);
  PairScales scales;
  scales.rho = scales.rows = scales.columns = VectorXd::Ones(n);
  Kernels kernels;
  Basis& basis = kernels.of(p);
  basis.start(p, scales);
  REQUIRE(basis.eliminate());
  basis.restart();
  basis.set_load(p.q);
  NormalMap map;
  map.scales = &scales;
  map.want.assign(n, 1);
  PivotCount pivots;
  pivots.limit = 1000;
  map.reach(basis, pivots);
  CHECK(map.waiting.empty());
  CHECK(pivots.done == n);
  for (int i = 0; i < n; ++i) CHECK(basis.is_basic(n + i));
  CHECK(VectorXd(Eigen::Map<const VectorXd>(basis.rhs(), n)).cwiseAbs().maxCoeff() == Approx(1e5));
}

TEST_CASE("solved at an active set the equations of the set hold, in both forms alike") {
  const int n = 13;
  const TwoForms forms = two_forms(n, 6, 5);
  const std::vector<int> active{1, 2, 6, 11};
  Kernels kernels;
  for (const LcpProblem* problem : {&forms.dense, &forms.expanded}) {
    Basis& basis = kernels.of(*problem);
    basis.start(*problem, forms.scales);
    VectorXd z, w;
    CHECK(basis.solve_at(active, z, w) < 1e-12);
    // w = M z + q everywhere; z is zero off the set and w on it.
    CHECK((forms.dense.M * z + forms.dense.q - w).lpNorm<Eigen::Infinity>() < 1e-12);
    for (int i = 0; i < n; ++i)
      CHECK(std::abs(std::find(active.begin(), active.end(), i) != active.end() ? w[i] : z[i]) < 1e-12);
  }
  // Two pairs that are one: the sparse kernel says so, of the dense one w does.
  TwoForms twins = forms;
  for (LcpProblem* problem : {&twins.dense, &twins.expanded}) {
    problem->q = VectorXd::LinSpaced(2, -1, -2);
    problem->M = MatrixXd::Ones(2, 2);
  }
  LcpProblem& p = twins.expanded;
  p.A = MatrixXd::Identity(1, 1).sparseView();
  p.B = MatrixXd::Constant(1, 2, -1).sparseView();
  p.C = MatrixXd::Ones(2, 1).sparseView();
  p.D.resize(2, 2);
  p.D.setZero();
  p.a = VectorXd::Zero(1);
  pair_scales(twins.dense, twins.scales);
  VectorXd z, w;
  kernels.sparse.start(p, twins.scales);
  CHECK(kernels.sparse.solve_at({0, 1}, z, w) == HUGE_VAL);
  kernels.dense.start(twins.dense, twins.scales);
  kernels.dense.solve_at({0, 1}, z, w);
  CHECK(!(w.lpNorm<Eigen::Infinity>() < 0.1));
}

TEST_CASE("the front refuses what no solver can use, in one way for all of them") {
  const TwoForms forms = two_forms(9, 4, 7);
  LcpProblem no_number = forms.expanded, undetermined = forms.expanded;
  no_number.a[1] = NAN;
  undetermined.A.coeffRef(2, 2) = 0;
  for (int k = 0; k < 4; ++k) undetermined.A.coeffRef(2, k) = undetermined.A.coeffRef(k, 2) = 0;
  for (const Wants wants : {Wants::dense_matrix, Wants::basis})
    for (const int dense_limit : {0, 100}) {
      LcpOptions options;
      options.dense_limit = dense_limit;
      Front front(options, wants);
      LcpSolution solution;
      solution.x = solution.z = VectorXd::Ones(3);
      solution.pivots = 5;
      CHECK_FALSE(front.open(no_number, solution));
      CHECK(solution.status == LcpStatus::not_finite);
      CHECK(solution.reason == "the data are not finite");
      CHECK(solution.z == VectorXd::Zero(9));
      CHECK(solution.x.size() == 0);
      CHECK(solution.pivots == 0);
      CHECK_FALSE(front.open(undetermined, solution));
      CHECK(solution.status == LcpStatus::singular);
      CHECK(solution.reason == "the block of the free unknowns is singular");
      REQUIRE(front.open(forms.expanded, solution));
      CHECK(front.form().expanded == (wants == Wants::basis && dense_limit == 0));
      // Nothing is left to solve of a problem without pairs: x = -A^-1 a.
      LcpProblem free = forms.expanded;
      free.B.resize(4, 0);
      free.C.resize(0, 4);
      free.D.resize(0, 0);
      free.q.resize(0);
      CHECK_FALSE(front.open(free, solution));
      CHECK(solution.status == LcpStatus::solved);
      REQUIRE(solution.x.size() == 4);
      CHECK((free.A * solution.x + free.a).lpNorm<Eigen::Infinity>() < 1e-12);
    }
}
