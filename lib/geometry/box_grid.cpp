// Pairs of boxes that overlap, by a hierarchy of grids.
//
// A box belongs to the level k with 2^(k-1) < its longest edge <= 2^k = cell (m), and to the cell of that grid that its
// low corner is in. A box meets those of its own level and of coarser ones in cells from (low - cell) to high, three
// along each axis as a rule, since no box there reaches further than one cell. Cells are kept in a hash table.
// Source: M. Overmars, Point location in fat subdivisions (1992); C. Ericson, Real-Time Collision Detection (2005),
// section 7.2 (hierarchical grids, hashed).
#include "geometry/box_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "linalg/stop.h"

namespace cb {

namespace {

constexpr double furthest = 0x1p30;  // edges from the origin: beyond, edges are mostly rounding
constexpr double rounding = 1e-6;    // -: of an edge, by which a box may reach further than that

std::int64_t cell_of(double x, int level) { return static_cast<std::int64_t>(std::floor(std::ldexp(x, -level))); }

}  // namespace

std::size_t BoxGrid::bucket(const Cell& cell) const {
  // Odd multipliers, then the high bits down: neighbours are to come apart.
  std::uint64_t hash = static_cast<std::uint64_t>(cell.x) * 0x9e3779b97f4a7c15U;
  hash = (hash ^ static_cast<std::uint64_t>(cell.y)) * 0xbf58476d1ce4e5b9U;
  hash = (hash ^ static_cast<std::uint64_t>(cell.z)) * 0x94d049bb133111ebU;
  hash ^= static_cast<std::uint64_t>(static_cast<std::int64_t>(cell.level)) * 0x9e3779b97f4a7c15U;
  return (hash ^ (hash >> 32)) & (heads_.size() - 1);
}

// Each box into its cell.
bool BoxGrid::put(const std::vector<SweptBox>& boxes) {
  heads_.assign(std::bit_ceil(2 * boxes.size()), -1);
  places_.resize(boxes.size());
  levels_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const SweptBox& box = boxes[i];
    const double edge = (box.high - box.low).maxCoeff();
    const double far = std::max(box.low.cwiseAbs().maxCoeff(), box.high.cwiseAbs().maxCoeff());
    if (!box.low.allFinite() || !box.high.allFinite() || !std::isnormal(edge) || !(far < furthest * edge)) return false;
    int level = 0;
    if (std::frexp(edge, &level) == 0.5) --level;
    Place& place = places_[i];
    place.cell = {cell_of(box.low[0], level), cell_of(box.low[1], level), cell_of(box.low[2], level), level};
    int& head = heads_[bucket(place.cell)];
    place.next = head;
    head = static_cast<int>(i);
    const auto at = std::lower_bound(levels_.begin(), levels_.end(), level);
    if (at == levels_.end() || *at != level) levels_.insert(at, level);
  }
  return true;
}

void BoxGrid::look(const std::vector<SweptBox>& boxes, int box, int level,
                   std::vector<std::pair<int, int>>& found) const {
  const SweptBox& a = boxes[box];
  const bool own = level == places_[box].cell.level;
  const double cell = std::ldexp(1.0, level);
  std::int64_t from[3], to[3];
  for (int i = 0; i < 3; ++i) {
    from[i] = cell_of(a.low[i] - (1 + rounding) * cell, level);
    to[i] = cell_of(a.high[i], level);
  }
  // Of its own level the cells after its own: the pairs with those before are found from there.
  const Cell& here = places_[box].cell;
  for (std::int64_t z = own ? here.z : from[2]; z <= to[2]; ++z)
    for (std::int64_t y = own && z == here.z ? here.y : from[1]; y <= to[1]; ++y)
      for (std::int64_t x = own && z == here.z && y == here.y ? here.x : from[0]; x <= to[0]; ++x) {
        const Cell at{x, y, z, level};
        const bool same = own && at == here;
        for (int other = heads_[bucket(at)]; other >= 0; other = places_[other].next) {
          if ((same && other >= box) || !(places_[other].cell == at) || !a.meets(boxes[other])) continue;
          found.emplace_back(std::minmax(a.shape, boxes[other].shape));
        }
      }
}

bool BoxGrid::pairs(const std::vector<SweptBox>& boxes, std::vector<std::pair<int, int>>& found) {
  if (!put(boxes)) return false;
  for (int box = 0; box < static_cast<int>(boxes.size()); ++box) {
    poll_stop();
    for (auto level = std::lower_bound(levels_.begin(), levels_.end(), places_[box].cell.level); level != levels_.end();
         ++level)
      look(boxes, box, *level, found);
  }
  return true;
}

}  // namespace cb
