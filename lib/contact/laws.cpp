#include "contact/laws.h"

#include <algorithm>
#include <array>

namespace cb {

std::span<const Law> laws() {
  static const std::array rows{newton_law(), mirtich_law(), anitescu_potra_law(),
                               convex_law(), coulomb_law(), soft_law()};
  return rows;
}

void scatter(std::span<const int> contacts, const std::vector<double>& from, std::size_t first, std::size_t width,
             std::vector<double>& to, std::size_t to_first) {
  if (from.size() < first + contacts.size() * width) return;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    std::copy_n(from.begin() + static_cast<long>(first + i * width), width,
                to.begin() + static_cast<long>(to_first + width * contacts[i]));
}

}  // namespace cb
