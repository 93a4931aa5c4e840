#pragma once

#include <span>
#include <vector>

#include "contact/problem.h"

namespace cb {

/// Connected components of a contact problem: blocks of M joined by contacts.
struct Islands {
  std::vector<int> of_block;    ///< blocks of M: island index, or -1 where no contact touches the block
  std::vector<int> of_contact;  ///< nc: island index
  int count = 0;
  std::vector<int> scratch;  ///< kept between calls
};
/// Islands are numbered by their first contact. Time and memory linear in the problem's size.
void find_islands(const ContactProblem& problem, Islands& islands);

/// Per island: has any of its contacts restitution? Its answer is that of two phases, whatever moves on other islands.
/// Returns whether any island has.
bool find_elastic(const ContactProblem& problem, const Islands& islands, std::vector<char>& elastic);

/// Threads that are worth their start, of at most `most`, where islands are solved at once.
int worthwhile_threads(const Islands& islands, int most);

/// The island that contact c is in, as a problem of its own: its contacts and blocks in their order.
ContactProblem island_of(const ContactProblem& problem, int c);

/// Members by group, for what goes through a problem island by island.
struct Groups {
  std::vector<int> start, members;
  /// `group`: per member, -1 where it is in none. Linear in members and groups.
  void assign(const std::vector<int>& group, int count);
  /// Members of group g, ascending.
  std::span<const int> operator[](int g) const {
    return {members.data() + start[g], static_cast<std::size_t>(start[g + 1] - start[g])};
  }
};

}  // namespace cb
