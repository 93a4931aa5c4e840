#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/shapes.h"

namespace cb {

/// Bounding box of a shape (no half-space) over the horizon, widened by half the margin; m.
struct SweptBox {
  Vec3 low, high;
  int shape;
  bool fixed;

  bool meets(const SweptBox& b) const {
    return !(fixed && b.fixed) && (low.array() <= b.high.array()).all() && (b.low.array() <= high.array()).all();
  }
};

/// Pairs of boxes that overlap, by grids: linear in their number wherever the neighbours of each are few, however they
/// are spread (box_grid.cpp). Does not allocate after its first calls.
class BoxGrid {
 public:
  /// Appends the pairs (shapes, the lower first) in no particular order, each once; two fixed ones are none. False, and
  /// nothing appended, where a box is too far away for its size to be given a cell.
  bool pairs(const std::vector<SweptBox>& boxes, std::vector<std::pair<int, int>>& found);

 private:
  struct Cell {
    std::int64_t x, y, z;
    int level;
    bool operator==(const Cell&) const = default;
  };
  struct Place {
    Cell cell;
    int next;  ///< box in the same bucket; -1: none
  };
  bool put(const std::vector<SweptBox>& boxes);
  void look(const std::vector<SweptBox>& boxes, int box, int level, std::vector<std::pair<int, int>>& found) const;
  std::size_t bucket(const Cell& cell) const;

  std::vector<Place> places_;  // per box
  std::vector<int> heads_;     // per bucket: first box, -1: none; a power of two of them
  std::vector<int> levels_;    // that there are boxes of, ascending
};

}  // namespace cb
