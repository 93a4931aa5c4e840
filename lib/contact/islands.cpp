#include "contact/islands.h"

#include <algorithm>

namespace cb {

void find_islands(const ContactProblem& problem, Islands& islands) {
  const BandMatrix& J = problem.J;
  const int nc = problem.nc();
  std::vector<int>& parent = islands.of_block;
  if (nc > 0 && problem.M.blocks() == 1 && J.band[nc] == nc) {  // all contacts are those of one body
    parent.assign(1, 0);
    islands.of_contact.assign(nc, 0);
    islands.count = 1;
    return;
  }
  parent.resize(problem.M.blocks());
  for (int b = 0; b < problem.M.blocks(); ++b) parent[b] = b;
  const auto root = [&](int b) {
    while (parent[b] != b) b = parent[b] = parent[parent[b]];
    return b;
  };
  for (int c = 0; c < nc; ++c)
    for (int e = J.band[c] + 1; e < J.band[c + 1]; ++e) {
      const int a = root(J.block[J.band[c]]), b = root(J.block[e]);
      if (a != b) parent[std::max(a, b)] = std::min(a, b);
    }

  islands.of_contact.assign(nc, -1);
  islands.count = 0;
  // Roots are the smallest block of their island; number them in the order contacts meet them.
  std::vector<int>& number = islands.scratch;
  number.assign(problem.M.blocks(), -1);
  for (int c = 0; c < nc; ++c) {
    if (J.band[c] == J.band[c + 1]) {  // a contact between fixed bodies: an island of its own
      islands.of_contact[c] = islands.count++;
      continue;
    }
    int& island = number[root(J.block[J.band[c]])];
    if (island < 0) island = islands.count++;
    islands.of_contact[c] = island;
  }
  for (int b = 0; b < problem.M.blocks(); ++b) root(b);
  for (int b = problem.M.blocks() - 1; b >= 0; --b) parent[b] = number[root(b)];
}

bool find_elastic(const ContactProblem& problem, const Islands& islands, std::vector<char>& elastic) {
  elastic.assign(islands.count, 0);
  for (int c = 0; c < problem.nc(); ++c)
    if (problem.restitution[c] != 0) elastic[islands.of_contact[c]] = 1;
  return std::find(elastic.begin(), elastic.end(), 1) != elastic.end();
}

int worthwhile_threads(const Islands& islands, int most) {
  constexpr int contacts_of_thread = 32;  // less is solved before a thread has begun
  const int contacts = static_cast<int>(islands.of_contact.size());
  return std::max(1, std::min({most, islands.count, contacts / contacts_of_thread}));
}

ContactProblem island_of(const ContactProblem& problem, int contact) {
  Islands islands;
  find_islands(problem, islands);
  const int island = islands.of_contact[contact];
  ContactProblem out;
  std::vector<int> place(problem.M.blocks(), -1);
  for (int b = 0; b < problem.M.blocks(); ++b) {
    if (islands.of_block[b] != island) continue;
    place[b] = out.M.add_block(problem.M.block_size(b));
    out.M.block(place[b]) = problem.M.block(b);
    out.v_minus.insert(out.v_minus.end(), problem.v_minus.begin() + problem.M.first[b],
                       problem.v_minus.begin() + problem.M.first[b + 1]);
  }
  for (int c = 0; c < problem.nc(); ++c) {
    if (islands.of_contact[c] != island) continue;
    out.J.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const int at = out.J.add_entry(place[problem.J.block[e]], static_cast<int>(problem.J.entry(e).cols()));
      out.J.entry(at) = problem.J.entry(e);
    }
    out.mu.push_back(problem.mu[c]);
    out.restitution.push_back(problem.restitution[c]);
    out.offset.insert(out.offset.end(), problem.offset.begin() + 3 * c, problem.offset.begin() + 3 * c + 3);
  }
  return out;
}

void Groups::assign(const std::vector<int>& group, int count) {
  // Each start moves to its end while its group fills, and is the next one's start then.
  start.assign(count + 2, 0);
  for (const int g : group)
    if (g >= 0) ++start[g + 2];
  for (int g = 0; g < count; ++g) start[g + 2] += start[g + 1];
  members.resize(start[count + 1]);
  for (std::size_t i = 0; i < group.size(); ++i)
    if (group[i] >= 0) members[start[group[i] + 1]++] = static_cast<int>(i);
  start.pop_back();
}

}  // namespace cb
