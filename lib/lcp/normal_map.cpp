// Points of the normal map, and bases at their active sets (normal_map.h). Bases of redundant contacts are singular:
// pairs whose exchange has no usable pivot stay where they are.

#include "lcp/normal_map.h"

#include <algorithm>
#include <cmath>

#include "linalg/stop.h"

namespace cb {

double NormalMap::evaluate(Basis& basis, const Eigen::VectorXd& q, const Eigen::VectorXd& point) {
  product_ = point.cwiseProduct(scales->columns);
  basis.multiply(product_, F);
  F = F.cwiseProduct(scales->rows) + q;
  double sum = 0;
  for (int i = 0; i < basis.n(); ++i) {
    const double h = std::hypot(point[i], F[i]);
    // sqrt(z^2 + F^2) - z - F without cancellation, z >= 0.
    const double phi = F[i] > 0 ? -2 * point[i] * F[i] / (h + point[i] + F[i] + 1e-300) : h - point[i] - F[i];
    sum += phi * phi;
  }
  return std::sqrt(sum);
}

void read_point(const Basis& basis, Eigen::VectorXd& z) {
  const int n = basis.n();
  z.setZero(n);
  for (int i = 0; i < n; ++i)
    if (basis.is_basic(n + i)) z[i] = std::max(0.0, basis.rhs()[basis.row_of(n + i)]);
}

void perturb_diagonal(const LcpProblem& form, const PairScales& scales, double eps, LcpProblem& perturbed) {
  const int n = form.n();
  const auto added = [&](int i) { return eps / (scales.rows[i] * scales.columns[i]); };
  perturbed = form;
  if (form.expanded) {
    SparseMatrix diagonal(n, n);
    diagonal.reserve(Eigen::VectorXi::Constant(n, 1));
    for (int i = 0; i < n; ++i) diagonal.insert(i, i) = added(i);
    perturbed.D += diagonal;
  } else {
    for (int i = 0; i < n; ++i) perturbed.M(i, i) += added(i);
  }
}

bool NormalMap::out_of_budget(const Basis& basis, const PivotCount& pivots) {
  poll_stop();
  tried += basis.column_solves();
  return pivots.spent() || tried > tries;
}

void NormalMap::reach(Basis& basis, PivotCount& pivots) {
  const int n = basis.n();
  if (basis.is_basic(basis.artificial())) basis.restart();
  const auto pending = [&](int i) { return basis.is_basic(n + i) != bool(want[i]); };
  const auto drop_done = [&] { std::erase_if(waiting, [&](int i) { return !pending(i); }); };
  waiting.clear();
  for (int i = 0; i < n; ++i)
    if (pending(i)) waiting.push_back(i);
  blocks_ = 0;
  for (const double smallest : smallest_pivots) {
    std::size_t before = waiting.size() + 1;
    while (waiting.size() < before && !waiting.empty()) {
      before = waiting.size();
      for (const int i : waiting) {
        if (out_of_budget(basis, pivots)) return;
        pivots.done += exchange_one(basis, i, smallest);
      }
      drop_done();
      if (smallest == smallest_pivots.front() && waiting.size() < before) continue;
      for (const int i : waiting)
        if (pending(i) && !out_of_budget(basis, pivots)) pivots.done += exchange_two(basis, i, smallest);
      drop_done();
    }
  }
}

// Returns the pivots made.
int NormalMap::exchange_one(Basis& basis, int i, double smallest) {
  const int n = basis.n(), entering = want[i] ? n + i : i, row = basis.row_of(complement(entering, n));
  return std::abs(basis.column(entering)[row]) > smallest && basis.pivot(row, entering) ? 1 : 0;
}

// Exchanges pair i and the waiting pair that gives the largest pivot, both at once, or neither.
int NormalMap::exchange_two(Basis& basis, int i, double smallest) {
  const int n = basis.n();
  const auto entering = [&](int k) { return want[k] ? n + k : k; };
  const auto leaving = [&](int k) { return complement(entering(k), n); };
  const double* column = basis.column(entering(i));
  int partner = -1;
  double largest = smallest;
  for (const int j : waiting)
    if (j != i && basis.is_basic(leaving(j)) && std::abs(column[basis.row_of(leaving(j))]) > largest) {
      partner = j;
      largest = std::abs(column[basis.row_of(leaving(j))]);
    }
  if (partner < 0) return 0;
  // A fresh factorisation must not fall between the two: the basis is not complementary there.
  const bool fresh = blocks_++ % block_exchanges != 0 && basis.exchanges_left() > 1;
  if (!fresh && !basis.refresh()) return 0;
  const int first = basis.row_of(leaving(partner)), second = basis.row_of(leaving(i));
  if (!basis.pivot(first, entering(i))) return 0;
  if (std::abs(basis.column(entering(partner))[second]) > smallest && basis.pivot(second, entering(partner))) return 2;
  basis.pivot(first, leaving(partner));
  return 0;
}

}  // namespace cb
