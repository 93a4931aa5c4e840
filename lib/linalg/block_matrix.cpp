#include "linalg/block_matrix.h"

#include <cmath>

namespace cb {

namespace {

using Eigen::Map;
using Eigen::Matrix;
using ConstVec = Map<const Eigen::VectorXd>;
using Vec = Map<Eigen::VectorXd>;

// A free body's block has six rows: the size known at compile time is worth a factor of three.
template <class F6, class FX>
void by_size(int size, F6&& six, FX&& any) {
  if (size == 6)
    six();
  else
    any();
}

}  // namespace

void BlockDiagonalMatrix::clear() {
  first.assign(1, 0);
  offset.assign(1, 0);
  values.clear();
}

int BlockDiagonalMatrix::add_block(int size) {
  first.push_back(first.back() + size);
  offset.push_back(offset.back() + size * size);
  values.resize(offset.back(), 0.0);
  return blocks() - 1;
}

void multiply(const BlockDiagonalMatrix& A, std::span<const double> x, std::span<double> y) {
  for (int b = 0; b < A.blocks(); ++b) {
    const int at = A.first[b], n = A.block_size(b);
    by_size(
        n,
        [&] {
          Map<Matrix<double, 6, 1>>(y.data() + at).noalias() =
              Map<const Matrix<double, 6, 6>>(A.values.data() + A.offset[b]) *
              Map<const Matrix<double, 6, 1>>(x.data() + at);
        },
        [&] { Vec(y.data() + at, n).noalias() = A.block(b) * ConstVec(x.data() + at, n); });
  }
}

double quadratic_form(const BlockDiagonalMatrix& A, std::span<const double> x) {
  double sum = 0;
  for (int b = 0; b < A.blocks(); ++b) {
    const int at = A.first[b], n = A.block_size(b);
    by_size(
        n,
        [&] {
          const Map<const Matrix<double, 6, 1>> xb(x.data() + at);
          sum += xb.dot(Map<const Matrix<double, 6, 6>>(A.values.data() + A.offset[b]) * xb);
        },
        [&] {
          const ConstVec xb(x.data() + at, n);
          for (int j = 0; j < n; ++j) sum += x[at + j] * A.block(b).col(j).dot(xb);
        });
  }
  return sum;
}

bool BlockCholesky::factor(const BlockDiagonalMatrix& A) {
  lower_.first = A.first;
  lower_.offset = A.offset;
  lower_.values = A.values;
  for (int b = 0; b < A.blocks(); ++b) {
    auto L = lower_.block(b);
    const int n = A.block_size(b);
    for (int j = 0; j < n; ++j) {
      double d = L(j, j);
      for (int k = 0; k < j; ++k) d -= L(j, k) * L(j, k);
      if (!(d > 1e-300) || !std::isfinite(d)) return false;
      d = std::sqrt(d);
      L(j, j) = d;
      for (int i = j + 1; i < n; ++i) {
        double s = L(i, j);
        for (int k = 0; k < j; ++k) s -= L(i, k) * L(j, k);
        L(i, j) = s / d;
      }
    }
  }
  return true;
}

void BlockCholesky::solve_block_in_place(int b, double* x, int cols) const {
  const int n = lower_.block_size(b);
  by_size(
      n,
      [&] {
        const Map<const Matrix<double, 6, 6>> L(lower_.values.data() + lower_.offset[b]);
        Map<Matrix<double, 6, Eigen::Dynamic>> X(x, 6, cols);
        L.triangularView<Eigen::Lower>().solveInPlace(X);
        L.transpose().triangularView<Eigen::Upper>().solveInPlace(X);
      },
      [&] {
        Map<Eigen::MatrixXd> X(x, n, cols);
        lower_.block(b).triangularView<Eigen::Lower>().solveInPlace(X);
        lower_.block(b).transpose().triangularView<Eigen::Upper>().solveInPlace(X);
      });
}

void BlockCholesky::solve_in_place(std::span<double> x) const {
  for (int b = 0; b < lower_.blocks(); ++b) {
    const int n = lower_.block_size(b);
    const auto L = lower_.block(b);
    double* xb = x.data() + lower_.first[b];
    for (int i = 0; i < n; ++i) {
      double s = xb[i];
      for (int k = 0; k < i; ++k) s -= L(i, k) * xb[k];
      xb[i] = s / L(i, i);
    }
    for (int i = n - 1; i >= 0; --i) {
      double s = xb[i];
      for (int k = i + 1; k < n; ++k) s -= L(k, i) * xb[k];
      xb[i] = s / L(i, i);
    }
  }
}

void BandMatrix::clear() {
  band.assign(1, 0);
  block.clear();
  offset.assign(1, 0);
  values.clear();
}

void BandMatrix::add_band() { band.push_back(band.back()); }

int BandMatrix::add_entry(int block_index, int cols) {
  block.push_back(block_index);
  offset.push_back(offset.back() + 3 * cols);
  values.resize(offset.back(), 0.0);
  return band.back()++;
}

void multiply(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> v, std::span<double> u) {
  for (int c = 0; c < J.bands(); ++c) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* x = v.data() + columns.first[J.block[e]];
      by_size((J.offset[e + 1] - J.offset[e]) / 3,
              [&] {
                sum.noalias() +=
                    Map<const Matrix<double, 3, 6>>(J.values.data() + J.offset[e]) * Map<const Matrix<double, 6, 1>>(x);
              },
              [&] { sum.noalias() += J.entry(e) * ConstVec(x, J.entry(e).cols()); });
    }
    Map<Eigen::Vector3d>(u.data() + 3 * c) = sum;
  }
}

void multiply_transposed_add(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> r,
                             std::span<double> y) {
  for (int c = 0; c < J.bands(); ++c) {
    const Map<const Eigen::Vector3d> rc(r.data() + 3 * c);
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      double* x = y.data() + columns.first[J.block[e]];
      by_size((J.offset[e + 1] - J.offset[e]) / 3,
              [&] {
                Map<Matrix<double, 6, 1>>(x).noalias() +=
                    Map<const Matrix<double, 3, 6>>(J.values.data() + J.offset[e]).transpose() * rc;
              },
              [&] { Vec(x, J.entry(e).cols()).noalias() += J.entry(e).transpose() * rc; });
    }
  }
}

}  // namespace cb
