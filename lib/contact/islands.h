#pragma once

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

}  // namespace cb
