// What tests of engines read: which are here, and the rows of what they did.
#pragma once

#include <catch2/catch.hpp>
#include <cstdlib>
#include <map>

#include "program/program.h"

namespace program {

using Words = std::vector<std::string>;
using Row = std::map<std::string, double>;

inline const std::string preflight_scenes = std::string(SOURCE_ROOT) + "/scenarios/preflight/";

inline Words joined(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// What the program says of the engines that are here, by name.
inline std::map<std::string, Json> engines_here(const fs::path& directory) {
  std::map<std::string, Json> here;
  for (const Json& engine : Json::parse(run(directory, {"list", "engines", "--json"}).out))
    if (engine["unavailable"].is_null()) here[engine["name"].get<std::string>()] = engine;
  return here;
}

/// Rows of a table, (what is in its second column, numbers by the names of their columns); words count as 0.
inline std::vector<std::pair<std::string, Row>> named_rows(const fs::path& csv) {
  const Words all = lines(read_file(csv));
  REQUIRE(all.size() > 1);
  const Words names = cells(all[0]);
  std::vector<std::pair<std::string, Row>> rows;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const Words row = cells(all[i]);
    REQUIRE(row.size() == names.size());
    rows.emplace_back(row[1], Row());
    for (std::size_t c = 0; c < names.size(); ++c) rows.back().second[names[c]] = std::strtod(row[c].c_str(), nullptr);
  }
  return rows;
}

}  // namespace program
