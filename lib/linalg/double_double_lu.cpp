// Gaussian elimination in DoubleDouble: row_i -= l_ik row_k. Eigen's LU takes any type of number, but treats a number
// at a time.

#include "linalg/double_double_lu.h"

#include <algorithm>
#include <utility>

namespace cb {

// As DoubleDouble's sum and product, but all that is small is added up at once: errors of some 2^-102 of the larger.
void add_multiple(const DoubleDouble& a, const double* x_high, const double* x_low, double* y_high, double* y_low,
                  int count) {
  const double a_high = a.high, a_low = a.low;
  for (int i = 0; i < count; ++i) {
    const double p = a_high * x_high[i];
    const double p_low = __builtin_fma(a_high, x_high[i], -p) + (a_high * x_low[i] + a_low * x_high[i]);
    const double y = y_high[i], s = y + p, t = s - y;
    const double rest = ((y - (s - t)) + (p - t)) + (y_low[i] + p_low);
    y_high[i] = s + rest;
    y_low[i] = rest - (y_high[i] - s);
  }
}

DoubleDouble dot(const double* x_high, const double* x_low, const double* y_high, const double* y_low, int count) {
  constexpr int lanes = 8;
  double high[lanes] = {}, low[lanes] = {};
  int i = 0;
  for (; i + lanes <= count; i += lanes)
    for (int l = 0; l < lanes; ++l) {
      const double a = x_high[i + l], b = y_high[i + l], p = a * b;
      const double p_low = __builtin_fma(a, b, -p) + (a * y_low[i + l] + x_low[i + l] * b);
      const double s = high[l] + p, t = s - high[l];
      const double rest = ((high[l] - (s - t)) + (p - t)) + (low[l] + p_low);
      high[l] = s + rest;
      low[l] = rest - (high[l] - s);
    }
  DoubleDouble sum;
  for (int l = 0; l < lanes; ++l) sum += DoubleDouble(high[l], low[l]);
  for (; i < count; ++i) sum += DoubleDouble(x_high[i], x_low[i]) * DoubleDouble(y_high[i], y_low[i]);
  return sum;
}

void DoubleDoubleLu::resize(int n) {
  n_ = n;
  high_.assign(static_cast<std::size_t>(n) * n, 0.0);
  low_.assign(high_.size(), 0.0);
  pivot_.resize(n);
  inverse_.resize(n);
}

bool DoubleDoubleLu::factor() {
  for (int k = 0; k < n_; ++k) {
    int best = k;
    for (int i = k + 1; i < n_; ++i)
      if (std::abs(high_[at(i, k)]) > std::abs(high_[at(best, k)])) best = i;
    pivot_[k] = best;
    if (best != k) {
      std::swap_ranges(&high_[at(k, 0)], &high_[at(k, 0)] + n_, &high_[at(best, 0)]);
      std::swap_ranges(&low_[at(k, 0)], &low_[at(k, 0)] + n_, &low_[at(best, 0)]);
    }
    const DoubleDouble pivot(high_[at(k, k)], low_[at(k, k)]);
    if (pivot.high == 0 || !isfinite(pivot)) return false;
    inverse_[k] = DoubleDouble(1) / pivot;
    const std::size_t next = at(k, k) + 1;
    for (int i = k + 1; i < n_; ++i) {
      const std::size_t ik = at(i, k);
      if (high_[ik] == 0) continue;
      const DoubleDouble factor = DoubleDouble(high_[ik], low_[ik]) * inverse_[k];
      add_multiple(-factor, high_.data() + next, low_.data() + next, high_.data() + ik + 1, low_.data() + ik + 1,
                   n_ - k - 1);
      high_[ik] = factor.high;
      low_[ik] = factor.low;
    }
  }
  return true;
}

void DoubleDoubleLu::solve_in_place(DoubleDoubleVector& x) const {
  for (int k = 0; k < n_; ++k) {
    std::swap(x.high[k], x.high[pivot_[k]]);
    std::swap(x.low[k], x.low[pivot_[k]]);
  }
  const auto known = [&](int i, int first, int count) {
    return dot(high_.data() + at(i, 0) + first, low_.data() + at(i, 0) + first, x.high.data() + first,
               x.low.data() + first, count);
  };
  for (int i = 1; i < n_; ++i) x.set(i, x[i] - known(i, 0, i));
  for (int i = n_ - 1; i >= 0; --i) x.set(i, (x[i] - known(i, i + 1, n_ - 1 - i)) * inverse_[i]);
}

}  // namespace cb
