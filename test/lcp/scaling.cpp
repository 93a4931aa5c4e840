// What the pairs of an LCP are scaled by (lcp/scaling.h), as the natural residual shows it, by hand.

#include "lcp/scaling.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "lcp/lcp.h"

using namespace cb;

namespace {

LcpProblem dense(const Eigen::Matrix2d& M) {
  LcpProblem p;
  p.M = M;
  p.q = Eigen::Vector2d(-4, 10);
  return p;
}

/// The same with a free unknown, by which the first diagonal is what it is: 4 x - 2 z_1 = 0, w_1 = 2 x + ...
LcpProblem expanded(const Eigen::Matrix2d& M) {
  LcpProblem p = dense(M);
  p.expanded = true;
  p.A = Eigen::MatrixXd::Constant(1, 1, 4).sparseView();
  p.B = Eigen::MatrixXd(Eigen::RowVector2d(-2, 0)).sparseView();
  p.C = Eigen::MatrixXd(Eigen::Vector2d(2, 0)).sparseView();
  p.D = Eigen::MatrixXd(M - Eigen::Matrix2d{{1, 0}, {0, 0}}).sparseView();
  p.a = Eigen::VectorXd::Zero(1);
  return p;
}

}  // namespace

// At z = (2, 1), w = (0.5 or 0, 4 or 10). The first pair has rho = 2; errors are |min(w / s, z s)|, s = sqrt(rho), and
// the size is max |q| / s.
TEST_CASE("a pair without a diagonal is as large as its coupling makes it: there and back, one way, or not at all") {
  struct Case {
    const char* what;
    double there, back, diagonal, residual;
  };
  for (const Case& known :
       {Case{"its own", 0.5, -3, 8, std::sqrt(8) / (10 / std::sqrt(8))}, Case{"there and back", 0.5, -3, 0, 0.75 / 10},
        Case{"one way", 0, -3, 0, 4. / 10}, Case{"the other way", 0.5, 0, 0, 0.125 / 10},
        Case{"not at all", 0, 0, 0, 1. / 10},
        // Beside 1e-12 sqrt(3 0.5) = 1.22e-12 it is none, or one.
        Case{"of rounding", 0.5, -3, 1e-12, 0.75 / 10},
        Case{"of more than that", 0.5, -3, 1.4e-12, 0.5 / std::sqrt(2) / (10 / std::sqrt(1.4e-12))}})
    for (const bool free : {false, true}) {
      INFO(known.what << (free ? ", with a free unknown" : ""));
      const Eigen::Matrix2d M{{2, known.there}, {known.back, known.diagonal}};
      CHECK(natural_residual(free ? expanded(M) : dense(M), Eigen::Vector2d(2, 1)) ==
            Approx(known.residual).epsilon(1e-6));
    }
}

TEST_CASE("a residual of a problem that is about nothing is what it is") {
  LcpProblem p = dense(Eigen::Matrix2d::Identity());
  p.q.setZero();
  CHECK(natural_residual(p, Eigen::Vector2d(0.5, 0)) == Approx(0.5));
  CHECK(natural_residual(p, Eigen::Vector2d::Zero()) == 0);
}

// rho = (2, 8), as the diagonal of D has it: at z = (3, 0) the first pair's error is sqrt 2, beside the second's q of
// 10 / sqrt 8. What goes into a free unknown and does not come back, or has no diagonal there, adds nothing to rho.
TEST_CASE("a free unknown scales a pair only where it moves with the pair and acts on it again") {
  const Eigen::MatrixXd D = Eigen::Vector2d(2, 8).asDiagonal();
  const auto residual = [&](const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, const Eigen::MatrixXd& C) {
    LcpProblem p;
    p.q = Eigen::Vector2d(-4, 10);
    p.expanded = true;
    p.A = A.sparseView();
    p.B = B.sparseView();
    p.C = C.sparseView();
    p.D = D.sparseView();
    p.a = Eigen::VectorXd::Zero(A.rows());
    return natural_residual(p, Eigen::Vector2d(3, 0));
  };
  const Eigen::MatrixXd four = Eigen::MatrixXd::Constant(1, 1, 4), across{{0, 1}, {1, 0}}, first{{1, 0}, {0, 0}};
  CHECK(residual(four, Eigen::RowVector2d(-2, 0), Eigen::Vector2d(0, 2)) == Approx(0.4));
  CHECK(residual(four, Eigen::RowVector2d(0, -2), Eigen::Vector2d(2, 0)) == Approx(0.4));
  CHECK(residual(across, first, first) == Approx(0.4));
}

TEST_CASE("an answer of another size, or whose velocities are no numbers, has no residual") {
  const LcpProblem p = dense(Eigen::Matrix2d{{1e300, -1e300}, {-1e300, 1e300}});
  CHECK(natural_residual(p, Eigen::Vector2d::Zero()) == Approx(0.4));   // 4 of 10
  CHECK(natural_residual(p, Eigen::Vector2d(1e10, 1e10)) == HUGE_VAL);  // w is infinite less infinite
  CHECK(natural_residual(p, Eigen::VectorXd::Ones(1)) == HUGE_VAL);
  CHECK(natural_residual(p, Eigen::VectorXd::Ones(3)) == HUGE_VAL);
}
