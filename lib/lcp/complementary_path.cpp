// What solvers share that follow a path of complementary bases (complementary_path.h).
//
// Source of the ratio test: P. M. J. Harris, Mathematical Programming 5 (1973). Difference: no shifting of bounds; a
// row that falls below zero by up to the allowance stays there until the vertex is recomputed from the original data.
// The allowance has to cover the rounding of the values themselves: of masses 1e6 apart, z is 1e6 of the load, and
// values that are zero lie 1e-10 to either side of it. Rows would then block, or not, by their rounding, and paths end
// in rays.

#include "lcp/complementary_path.h"

#include <cstdint>

#include "lcp/vector_lanes.h"
#include "linalg/finite.h"

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
  const auto whole = [](const double* x, Eigen::Index size) { return all_finite({x, static_cast<std::size_t>(size)}); };
  if (!whole(problem.q.data(), problem.q.size())) return false;
  if (!problem.expanded) return whole(problem.M.data(), problem.M.size());
  for (const SparseMatrix* matrix : {&problem.A, &problem.B, &problem.C, &problem.D})
    if (!whole(matrix->valuePtr(), matrix->nonZeros())) return false;
  return whole(problem.a.data(), problem.a.size());
}

bool ScaledLoad::set(const LcpProblem& problem) {
  of = &problem;
  root = scales.rho.cwiseSqrt();
  size = 0;
  for (Eigen::Index i = 0; i < original.size(); ++i) size = std::max(size, std::abs(original[i]) / root[i]);
  if (size == 0) size = 1;
  judged = std::max(size, problem.size);
  q = original.cwiseProduct(scales.rows) / size;
  return std::isfinite(q.sum() + scales.rows.sum() + scales.columns.sum());
}

// Errors of z, whose w is in w_, as they stand.
Judgement PathJudge::first_look(const ScaledLoad& load, const Eigen::VectorXd& z) {
  const auto n = static_cast<int>(z.size());
  const LcpGroups& groups = load.of->groups;
  error_.resize(n);
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    error_[i] = std::abs(std::min(z[i] * load.root[i], w_[i] / load.root[i]));
    if (!(error_[i] <= worst)) worst = error_[i];
  }
  if (!std::isfinite(worst)) return {};
  Judgement found{worst / load.judged, worst / load.judged};
  if (groups.of_pair.empty()) return found;
  size_ = groups.size;
  for (int i = 0; i < n; ++i) {
    const double of_z = z[i] * groups.root[i];
    error_[i] = std::abs(std::min(of_z, w_[i] / groups.root[i]));
    double& size = size_[groups.of_pair[i]];
    size = std::max(size, of_z);
  }
  found.beyond_rounding = worst_of_groups(load);
  return found;
}

// The same without what rounding of the terms may be, |M| z being in product_: first what a solver can do, then what
// the data leave open.
void PathJudge::second_look(const ScaledLoad& load, Judgement& found) {
  const LcpGroups& groups = load.of->groups;
  const bool grouped = !groups.of_pair.empty();
  const auto n = static_cast<int>(error_.size());
  double shared = 0;
  for (int i = 0; i < n; ++i) {
    const double root = grouped ? groups.root[i] : load.root[i];
    product_[i] += std::abs(load.original[i]);
    if (grouped && groups.shares[i]) shared = std::max(shared, product_[i]);
    error_[i] = std::max(0.0, error_[i] - round_off * product_[i] / root);
  }
  found.beyond_rounding = worst_of_groups(load);
  if (!grouped) return;
  if (found.beyond_rounding <= beyond_doubt) {
    found.residual = std::max(found.residual, found.beyond_rounding);
    return;
  }
  for (int i = 0; i < n; ++i) {
    const double root = groups.root[i], open = groups.shares[i] ? shared : product_[i];
    error_[i] = std::max(0.0, error_[i] - std::max(0.0, term_rounding * open - round_off * product_[i]) / root);
    if (!groups.shares[i]) continue;
    double& size = size_[groups.of_pair[i]];
    size = std::max(size, product_[i] / root);
  }
  found.residual = std::max(found.residual, worst_of_groups(load));
}

// Of error_ over size_, or over all that the problem is about where it has no groups.
double PathJudge::worst_of_groups(const ScaledLoad& load) {
  const std::vector<int>& group = load.of->groups.of_pair;
  if (group.empty()) return error_.maxCoeff() / load.judged;
  squares_.setZero(size_.size());
  for (Eigen::Index i = 0; i < error_.size(); ++i) squares_[group[i]] += error_[i] * error_[i];
  double worst = 0;
  for (Eigen::Index g = 0; g < size_.size(); ++g)
    if (squares_[g] > worst * size_[g] * size_[g])
      worst = size_[g] > 0 ? squares_[g] / (size_[g] * size_[g]) : HUGE_VAL;
  return std::sqrt(worst);
}

// First pass: how far all rows can go if each may fall to -allowance; `largest`: of the basic values.
double RatioTest::nearest(const double* column, const double* rhs, double allowance, double& largest) const {
  const auto padded = static_cast<int>(score_.size());
  const Lanes infinity = Lanes{} + HUGE_VAL;
  Lanes nearest = infinity, top = Lanes{};
  for (int i = 0; i < padded; i += lane_count) {
    Lanes c, x;
    load(column + i, c);
    load(rhs + i, x);
    const Lanes limit = (x + allowance) / -c, size = x < 0 ? -x : x;
    const Lanes candidate = c < -pivot_tolerance ? limit : infinity;
    nearest = candidate < nearest ? candidate : nearest;
    top = size > top ? size : top;
  }
  largest = largest_lane(top);
  return -largest_lane(-nearest);
}

int RatioTest::row(const double* column, const double* rhs, int preferred) {
  const auto padded = static_cast<int>(score_.size());
  double largest_value = 0;
  double bound = nearest(column, rhs, harris, largest_value);
  if (round_off * largest_value > harris) bound = nearest(column, rhs, round_off * largest_value, largest_value);
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
  const double top = largest_lane(largest);
  if (!(top > 0)) return -1;
  int best = 0;
  while (score_[best] != top) ++best;
  return best;
}

}  // namespace cb
