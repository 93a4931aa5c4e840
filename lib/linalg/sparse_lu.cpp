// Sparse LU through KLU (T. A. Davis, E. Palamadai Natarajan, ACM TOMS 37 (2010), algorithm 907), without its
// block-triangular ordering, which costs more than it gives on bases of contact problems; columns ordered by AMD.

#include "linalg/sparse_lu.h"

#include <klu.h>

#include <algorithm>

namespace cb {

struct SparseLu::Data {
  klu_common common;
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;

  Data() {
    klu_defaults(&common);
    common.btf = 0;
  }
  ~Data() { release(); }
  Data(const Data&) = delete;
  Data& operator=(const Data&) = delete;
  void release() {
    if (numeric != nullptr) klu_free_numeric(&numeric, &common);
    if (symbolic != nullptr) klu_free_symbolic(&symbolic, &common);
  }
};

SparseLu::SparseLu() : data_(std::make_unique<Data>()) {}
SparseLu::~SparseLu() = default;

bool SparseLu::factor(std::span<const int> starts, std::span<const int> rows, std::span<const double> values) {
  auto& d = *data_;
  order_ = static_cast<int>(starts.size()) - 1;
  if (order_ == 0) return true;
  // KLU takes mutable pointers but only reads.
  int* p = const_cast<int*>(starts.data());
  int* i = const_cast<int*>(rows.data());
  double* x = const_cast<double*>(values.data());
  const auto regular = [&] {
    return klu_rcond(d.symbolic, d.numeric, &d.common) != 0 && d.common.rcond > singular_below;
  };
  const bool same_pattern =
      d.symbolic != nullptr && std::ranges::equal(starts, starts_) && std::ranges::equal(rows, rows_);
  if (same_pattern && d.numeric != nullptr && klu_refactor(p, i, x, d.symbolic, d.numeric, &d.common) != 0 &&
      d.common.status == KLU_OK && regular() && klu_rgrowth(p, i, x, d.symbolic, d.numeric, &d.common) != 0 &&
      d.common.rgrowth > growth_below)
    return true;

  if (d.numeric != nullptr) klu_free_numeric(&d.numeric, &d.common);
  if (!same_pattern) {
    if (d.symbolic != nullptr) klu_free_symbolic(&d.symbolic, &d.common);
    starts_.assign(starts.begin(), starts.end());
    rows_.assign(rows.begin(), rows.end());
    d.symbolic = klu_analyze(order_, p, i, &d.common);
  }
  if (d.symbolic == nullptr) return false;
  d.numeric = klu_factor(p, i, x, d.symbolic, &d.common);
  if (d.numeric == nullptr || d.common.status != KLU_OK) return false;
  return regular();
}

void SparseLu::forget_pivots() {
  if (data_->numeric != nullptr) klu_free_numeric(&data_->numeric, &data_->common);
}

void SparseLu::solve(std::span<double> x) {
  if (order_ > 0) klu_solve(data_->symbolic, data_->numeric, order_, 1, x.data(), &data_->common);
}

double SparseLu::entries() const {
  return order_ > 0 && data_->numeric != nullptr ? double(data_->numeric->lnz) + double(data_->numeric->unz) : 0;
}

double SparseLu::flops() {
  auto& d = *data_;
  if (order_ == 0 || d.numeric == nullptr) return 0;
  klu_flops(d.symbolic, d.numeric, &d.common);
  return d.common.flops;
}

void ProductForm::resize(int n) {
  if (n != padded_) columns_.clear();
  padded_ = n;
  rows_.clear();
}

void ProductForm::push(const double* change, int row) {
  const std::size_t at = rows_.size();
  if (at == columns_.size()) columns_.emplace_back(padded_);
  std::copy(change, change + padded_, columns_[at].data());
  rows_.push_back(row);
}

void ProductForm::apply(double* y) const {
  Block block;
  for (std::size_t e = 0; e < rows_.size(); ++e) {
    const int r = rows_[e];
    const double now = block.value(y, r);
    if (now == 0) continue;
    block.put(columns_[e], -now / columns_[e][r], r);
    if (block.count == Block::most) block.carry_out(y, padded_);
  }
  block.carry_out(y, padded_);
}

// y[row] after the exchanges that wait.
double ProductForm::Block::value(const double* y, int row) const {
  double now = y[row];
  for (int j = 0; j < count; ++j) now = rows[j] == row ? steps[j] : now + steps[j] * (*columns[j])[row];
  return now;
}

// The sums are those of one exchange after the other, to the bit.
void ProductForm::Block::carry_out(double* y, int padded) {
  std::array<double, most> pivots;
  for (int j = 0; j < count; ++j) pivots[j] = value(y, rows[j]);
  Eigen::Map<Eigen::VectorXd, Eigen::Aligned64> all(y, padded);
  if (count == most)
    all = all + steps[0] * *columns[0] + steps[1] * *columns[1] + steps[2] * *columns[2] + steps[3] * *columns[3];
  else
    for (int j = 0; j < count; ++j) all += steps[j] * *columns[j];
  for (int j = 0; j < count; ++j) y[rows[j]] = pivots[j];
  count = 0;
}

}  // namespace cb
