#include "linalg/block_pattern.h"

#include <algorithm>
#include <iterator>

namespace cb {

void BlockPattern::analyse(std::span<const int> sizes, const SymmetricPattern& graph) {
  const int n = static_cast<int>(sizes.size());
  std::vector<int> order;
  block_order(graph, order);
  place_of.resize(n);
  for (int k = 0; k < n; ++k) place_of[order[k]] = k;

  // Rows of each column: its later neighbours, and what the columns hand on whose first row it is.
  std::vector<std::vector<int>> rows(n);
  for (int j = 0; j < n; ++j)
    for (int e = graph.column[j]; e < graph.column[j + 1]; ++e) {
      const auto [low, high] = std::minmax(place_of[j], place_of[graph.row[e]]);
      if (low != high) rows[low].push_back(high);
    }
  for (auto& list : rows) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  std::vector<int> merged;
  for (int k = 0; k < n; ++k) {
    if (rows[k].empty()) continue;
    auto& parent = rows[rows[k].front()];
    merged.clear();
    std::set_union(rows[k].begin() + 1, rows[k].end(), parent.begin(), parent.end(), std::back_inserter(merged));
    parent = merged;
  }

  size.resize(n);
  first.assign(1, 0);
  diagonal.resize(n);
  column.assign(1, 0);
  lower.clear();
  tall = 0;
  int at = 0;
  for (int k = 0; k < n; ++k) size[k] = sizes[order[k]];
  for (int k = 0; k < n; ++k) {
    diagonal[k] = at;
    at += padded(size[k]) * size[k];
    int column_rows = 0;
    for (const int j : rows[k]) {
      lower.push_back({j, at});
      at += padded(size[j]) * size[k];
      column_rows += padded(size[j]);
    }
    tall = std::max(tall, column_rows * size[k]);
    column.push_back(static_cast<int>(lower.size()));
    first.push_back(first.back() + padded(size[k]));
  }
  x_at.resize(n);
  for (int b = 0; b < n; ++b) x_at[b] = first[place_of[b]];
  entries = at + lanes;
  find_targets();
}

void BlockPattern::clear_padding(std::vector<double>& x) const {
  for (std::size_t k = 0; k < size.size(); ++k)
    std::fill(x.begin() + first[k] + size[k], x.begin() + first[k + 1], 0.0);
}

void BlockPattern::find_targets() {
  target.clear();
  for (int k = 0; k < blocks(); ++k)
    for (int e = column[k]; e < column[k + 1]; ++e)
      for (int f = e; f < column[k + 1]; ++f) {
        const int to = lower[e].row, row = lower[f].row;
        target.push_back(row == to ? diagonal[to] : find(to, row).at);
      }
}

const BlockPattern::Lower& BlockPattern::find(int place, int row) const {
  const auto begin = lower.begin() + column[place], end = lower.begin() + column[place + 1];
  return *std::lower_bound(begin, end, row, [](const Lower& block, int r) { return block.row < r; });
}

BlockPattern::Place BlockPattern::place(int row, int col) const {
  const int low = std::min(place_of[row], place_of[col]), high = std::max(place_of[row], place_of[col]);
  const int stride = padded(size[high]);
  if (low == high) return {diagonal[low], stride, false};
  return {find(low, high).at, stride, place_of[row] < place_of[col]};
}

}  // namespace cb
