// What solvers share that follow a path of complementary bases (complementary_path.h).
//
// Source of the ratio test: P. M. J. Harris, Mathematical Programming 5 (1973). Difference: no shifting of bounds; a
// row that falls below zero by up to `harris` stays there until the vertex is recomputed from the original data.

#include "lcp/complementary_path.h"

#include <cstdint>

#include "lcp/vector_lanes.h"

namespace cb {

std::string_view text(PathEnd end) {
  switch (end) {
    case PathEnd::solution:
      return "vertex refused by the check";
    case PathEnd::ray:
      return "ray";
    case PathEnd::doubtful_ray:
      return "ray that the original data refute";
    case PathEnd::turned_back:
      return "path turned back";
    case PathEnd::pivot_limit:
      return "pivot limit";
    case PathEnd::time_limit:
      return "time limit";
    case PathEnd::bad_pivot:
      return "pivot too small";
  }
  return "";
}

// splitmix64
double draw(unsigned seed, unsigned i) {
  std::uint64_t x = (std::uint64_t(seed) << 32 | i) + 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

bool finite(const LcpProblem& problem) {
  const auto whole = [](const SparseMatrix& matrix) {
    return Eigen::Map<const Eigen::VectorXd>(matrix.valuePtr(), matrix.nonZeros()).allFinite();
  };
  if (!problem.expanded) return problem.M.allFinite() && problem.q.allFinite();
  return whole(problem.A) && whole(problem.B) && whole(problem.C) && whole(problem.D) && problem.a.allFinite() &&
         problem.q.allFinite();
}

double below_zero(double lowest, double largest) {
  constexpr double ulps = 16;
  return std::max(0.0, -lowest - ulps * std::numeric_limits<double>::epsilon() * largest);
}

bool ScaledLoad::set() {
  root = scales.rho.cwiseSqrt();
  size = 0;
  for (Eigen::Index i = 0; i < original.size(); ++i) size = std::max(size, std::abs(original[i]) / root[i]);
  if (size == 0) size = 1;
  judged = std::max(size, about);
  q = original.cwiseProduct(scales.rows) / size;
  return std::isfinite(q.sum() + scales.rows.sum() + scales.columns.sum());
}

int RatioTest::row(const double* column, const double* rhs, int preferred) {
  const auto padded = static_cast<int>(score_.size());
  const Lanes infinity = Lanes{} + HUGE_VAL;

  // First pass: how far all rows can go if each may fall to -harris.
  Lanes nearest = infinity;
  for (int i = 0; i < padded; i += lane_count) {
    Lanes c, x;
    load(column + i, c);
    load(rhs + i, x);
    const Lanes limit = (x + harris) / -c;
    const Lanes candidate = c < -pivot_tolerance ? limit : infinity;
    nearest = candidate < nearest ? candidate : nearest;
  }
  double bound = HUGE_VAL;
  for (int l = 0; l < lane_count; ++l) bound = std::min(bound, nearest[l]);
  if (!(bound < HUGE_VAL)) return -1;
  bound = std::max(bound, 0.0);

  // Second pass: the largest pivot among the rows that block within it.
  Lanes largest = Lanes{};
  for (int i = 0; i < padded; i += lane_count) {
    Lanes c, x;
    load(column + i, c);
    load(rhs + i, x);
    const Lanes blocking = x <= -c * bound ? -c : Lanes{};
    const Lanes size = c < -pivot_tolerance ? blocking : Lanes{};
    largest = size > largest ? size : largest;
    store(size, score_.data() + i);
  }
  if (preferred >= 0 && score_[preferred] > 0) return preferred;
  double top = 0;
  for (int l = 0; l < lane_count; ++l) top = std::max(top, largest[l]);
  if (!(top > 0)) return -1;
  int best = 0;
  while (score_[best] != top) ++best;
  return best;
}

}  // namespace cb
