#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cb {

/// Least number of letters to insert, delete, replace or swap with their neighbour that turns `a` into `b`.
int edit_distance(std::string_view a, std::string_view b);

/// What would be right in place of an unknown name: `did you mean "x"?` where names are near, else all of them after
/// `list`, as in `it takes: x, y`.
std::string suggest(std::string_view unknown, const std::vector<std::string>& names, std::string_view list);

/// a, b, c
std::string join(const std::vector<std::string>& names, std::string_view separator = ", ");

}  // namespace cb
