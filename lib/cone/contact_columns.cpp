// A body has six rows: what a contact does is a few sums of short vectors (linalg/double_double_lu.h).

#include "cone/contact_columns.h"

#include <Eigen/Cholesky>

namespace cb {

void ContactColumns::form(const ConeProgram& p, const Vector& d) {
  using Matrix = Eigen::Matrix<DoubleDouble, Eigen::Dynamic, Eigen::Dynamic>;
  rows_ = p.nv();
  high_.clear();
  low_.clear();
  transposed_high_.clear();
  transposed_low_.clear();
  std::vector<Eigen::LLT<Matrix>> factors;
  for (int b = 0; b < p.M->blocks(); ++b) factors.emplace_back(p.M->block(b).cast<DoubleDouble>());
  ranges_.assign(p.nc(), {});
  for (int c = 0; c < p.nc(); ++c)
    for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
      const int b = p.J->block[e], rows = p.M->block_size(b);
      Matrix A = p.J->entry(e).transpose().cast<DoubleDouble>() * d[c];
      factors[b].matrixL().solveInPlace(A);
      ranges_[c].push_back({p.M->first[b], rows, high_.size(), transposed_high_.size()});
      for (const DoubleDouble& x : A.reshaped()) {
        high_.push_back(x.high);
        low_.push_back(x.low);
      }
      for (int i = 0; i < rows; ++i)
        for (int k = 0; k < 4; ++k) {
          transposed_high_.push_back(k < 3 ? A(i, k).high : 0);
          transposed_low_.push_back(k < 3 ? A(i, k).low : 0);
        }
    }
}

void ContactColumns::momentum(const Vector& x, DoubleDoubleVector& p) const {
  p.set_zero(rows_);
  for (std::size_t c = 0; c < ranges_.size(); ++c)
    for (const Range& r : ranges_[c])
      for (int k = 0; k < 3; ++k) {
        const std::size_t column = r.at + static_cast<std::size_t>(k) * r.rows;
        add_multiple(x[3 * c + k], &high_[column], &low_[column], &p.high[r.first], &p.low[r.first], r.rows);
      }
}

void ContactColumns::velocities(const DoubleDoubleVector& p, Vector& u) const {
  u.resize(3 * static_cast<Eigen::Index>(ranges_.size()));
  for (std::size_t c = 0; c < ranges_.size(); ++c) {
    double high[4] = {}, low[4] = {};
    for (const Range& r : ranges_[c])
      for (int i = 0; i < r.rows; ++i) {
        const std::size_t row = r.transposed_at + 4 * static_cast<std::size_t>(i);
        add_multiple(p[r.first + i], &transposed_high_[row], &transposed_low_[row], high, low, 4);
      }
    for (int k = 0; k < 3; ++k) u[3 * c + k] = {high[k], low[k]};
  }
}

void ContactColumns::add_congruence(const Eigen::Matrix<DoubleDouble, 3, 3>& B, int contact, int row, int column,
                                    DoubleDoubleLu& matrix) const {
  for (const Range& r : ranges_[contact])
    for (int i = 0; i < r.rows; ++i) {
      const std::size_t at = r.transposed_at + 4 * static_cast<std::size_t>(i);
      for (int k = 0; k < 3; ++k) {
        DoubleDouble left;
        for (int l = 0; l < 3; ++l) left += DoubleDouble(transposed_high_[at + l], transposed_low_[at + l]) * B(l, k);
        if (left.high == 0) continue;
        for (const Range& s : ranges_[contact]) {
          const std::size_t of = s.at + static_cast<std::size_t>(k) * s.rows;
          matrix.add(row + r.first + i, column + s.first, left, &high_[of], &low_[of], s.rows);
        }
      }
    }
}

}  // namespace cb
