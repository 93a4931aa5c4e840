// Pivoting along a path of complementary bases (complementary_path.h).
//
// Source of the ratio test: P. M. J. Harris, Mathematical Programming 5 (1973). Difference: no shifting of bounds; a
// row that falls below zero by up to the allowance stays there until the vertex is recomputed from the original data.
// The allowance has to cover the rounding of the values themselves: of masses 1e6 apart, z is 1e6 of the load, and
// values that are zero lie 1e-10 to either side of it. Rows would then block, or not, by their rounding, and paths end
// in rays.

#include "lcp/complementary_path.h"

#include <algorithm>

#include "linalg/pack.h"
#include "linalg/stop.h"

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

namespace {

/// Row whose variable z_0 replaces: the one that needs most of it to be feasible; -1 where none needs any, or z_0 would
/// help none.
int neediest_row(Basis& basis) {
  const double *cover = basis.column(basis.artificial()), *rhs = basis.rhs();
  int best = -1;
  double worst = 0;
  for (int i = 0; i < basis.n(); ++i)
    if (rhs[i] < worst * cover[i] && cover[i] > 0) {
      worst = rhs[i] / cover[i];
      best = i;
    }
  return best;
}

}  // namespace

PathEnd ComplementaryPath::follow(Basis& basis) {
  const int row = neediest_row(basis);
  if (row < 0) return PathEnd::solution;
  if (!enter(basis, row)) return PathEnd::bad_pivot;
  while (goes_on(basis)) {  // until z_0 has left, nothing blocks, a pivot is no good, or the limit is reached
    const int entering = complement(left, basis.n());
    exchange(basis, entering, blocking_row(basis, entering));
  }
  return end;
}

bool ComplementaryPath::enter(Basis& basis, int row) {
  left = basis.basic(row);
  ended_ = !basis.pivot(row, basis.artificial());
  end = PathEnd::bad_pivot;
  pivots.done += !ended_;
  return !ended_;
}

bool ComplementaryPath::goes_on(const Basis& basis) {
  if (ended_) return false;
  const auto ends = [&](PathEnd how) {
    end = how;
    return false;
  };
  if (left == basis.artificial()) return ends(PathEnd::solution);
  if (pivots.spent()) return ends(PathEnd::pivot_limit);
  poll_stop();
  if (basis.rhs()[basis.row_of(basis.artificial())] > retreat) return ends(PathEnd::turned_back);
  return true;
}

int ComplementaryPath::blocking_row(Basis& basis, int entering) {
  return ratio.row(basis.column(entering), basis.rhs(), basis.row_of(basis.artificial()));
}

void ComplementaryPath::exchange(Basis& basis, int entering, int row) {
  if (row < 0) {
    ray_variable = entering;
    end = PathEnd::ray;
    ended_ = true;
    return;
  }
  left = basis.basic(row);
  end = PathEnd::bad_pivot;
  ended_ = !basis.pivot(row, entering);
  pivots.done += !ended_;
}

int drop_artificial(Basis& basis, int variable, double pivot_tolerance) {
  const int row = basis.row_of(basis.artificial()), other = complement(variable, basis.n());
  const double p = std::abs(basis.column(variable)[row]), p_other = std::abs(basis.column(other)[row]);
  const int in = p > p_other ? variable : other;
  return std::max(p, p_other) > pivot_tolerance && basis.pivot(row, in) ? in : -1;
}

bool ComplementaryPath::drop_artificial(Basis& basis) {
  const bool out = cb::drop_artificial(basis, ray_variable, ratio.pivot_tolerance) >= 0;
  pivots.done += out;
  return out;
}

// First pass: how far all rows can go if each may fall to -allowance; `largest`: of the basic values.
double RatioTest::nearest(const double* column, const double* rhs, double allowance, double& largest) const {
  const auto padded = static_cast<int>(score_.size());
  const Pack infinity = Pack{} + HUGE_VAL;
  Pack nearest = infinity, top = Pack{};
  for (int i = 0; i < padded; i += pack_size) {
    Pack c, x;
    load_aligned(column + i, c);
    load_aligned(rhs + i, x);
    const Pack limit = (x + allowance) / -c, size = x < 0 ? -x : x;
    const Pack candidate = c < -pivot_tolerance ? limit : infinity;
    nearest = candidate < nearest ? candidate : nearest;
    top = size > top ? size : top;
  }
  largest = largest_of(top);
  return -largest_of(-nearest);
}

int RatioTest::row(const double* column, const double* rhs, int preferred) {
  const auto padded = static_cast<int>(score_.size());
  double largest_value = 0;
  double bound = nearest(column, rhs, harris, largest_value);
  if (round_off * largest_value > harris) bound = nearest(column, rhs, round_off * largest_value, largest_value);
  if (!(bound < HUGE_VAL)) return -1;
  bound = std::max(bound, 0.0);
  if (preferred >= 0 && column[preferred] < -pivot_tolerance &&
      rhs[preferred] + column[preferred] * bound <= vanishing * largest_value)
    return preferred;

  // Second pass: the largest pivot among the rows that block within it.
  Pack largest = Pack{};
  for (int i = 0; i < padded; i += pack_size) {
    Pack c, x;
    load_aligned(column + i, c);
    load_aligned(rhs + i, x);
    const Pack blocking = x <= -c * bound ? -c : Pack{};
    const Pack size = c < -pivot_tolerance ? blocking : Pack{};
    largest = size > largest ? size : largest;
    store_aligned(size, score_.data() + i);
  }
  const double top = largest_of(largest);
  if (!(top > 0)) return -1;
  int best = 0;
  while (score_[best] != top) ++best;
  return best;
}

}  // namespace cb
