#include "scenario/near_name.h"

#include <algorithm>

namespace cb {

int edit_distance(std::string_view a, std::string_view b) {
  const std::size_t width = b.size() + 1;
  std::vector<int> before(width), last(width), now(width);  // rows i - 2, i - 1, i of the table
  for (std::size_t j = 0; j < width; ++j) now[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(last);
    last.swap(now);
    now[0] = static_cast<int>(i);
    for (std::size_t j = 1; j < width; ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
  }
  return now[b.size()];
}

std::string suggest(std::string_view unknown, const std::vector<std::string>& names, std::string_view list) {
  // Near: a third of the letters wrong at most, one in short names, and never all of them.
  constexpr std::size_t longest = 100;  // nobody mistypes a name into something longer
  const int bound = static_cast<int>(std::min(std::max<std::size_t>(1, unknown.size() / 3), unknown.size() - 1));
  std::vector<std::string> nearest;
  int least = bound;
  if (!unknown.empty() && unknown.size() <= longest) {
    for (const std::string& name : names) {
      const int distance = edit_distance(unknown, name);
      if (distance > least) continue;
      if (distance < least) nearest.clear();
      least = distance;
      nearest.push_back('"' + name + '"');
    }
  }
  constexpr std::size_t few = 3;
  if (!nearest.empty() && nearest.size() <= few) return "did you mean " + join(nearest, " or ") + "?";
  constexpr std::size_t shown = 20;
  if (names.size() <= shown) return std::string(list) + " " + join(names);
  return std::string(list) + " " + join({names.begin(), names.begin() + shown}) + ", ...";
}

std::string join(const std::vector<std::string>& names, std::string_view separator) {
  std::string text;
  for (const std::string& name : names) {
    if (!text.empty()) text += separator;
    text += name;
  }
  return text;
}

}  // namespace cb
