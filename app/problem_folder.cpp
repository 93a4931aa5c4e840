#include "problem_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <vector>

#include "commands.h"

namespace cb {

namespace {

namespace fs = std::filesystem;

/// event_N.hdf5 of a method's run; step_N.hdf5 and step_N.json of an engine's, N of nine digits or more.
bool is_stored_problem(std::string_view name) {
  constexpr std::size_t digits = 9;
  const bool event = name.starts_with("event_"), json = name.ends_with(".json");
  if (!(event || name.starts_with("step_")) || !(name.ends_with(".hdf5") || (json && !event))) return false;
  name.remove_prefix(name.find('_') + 1);
  name.remove_suffix(5);
  return name.size() >= digits && std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

ProblemFolder::ProblemFolder(const fs::path& folder) : folder_(folder) {
  if (folder_.empty()) return;
  std::error_code refused;
  fs::create_directories(folder_, refused);
  if (!refused && access(folder_.c_str(), W_OK) != 0) refused.assign(errno, std::generic_category());
  if (refused)
    throw UsageError(fmt::format("--save-problems: {} cannot be written: {}; name a directory that can",
                                 folder_.string(), refused.message()));
  lock_.emplace(folder_);
  if (lock_->taken()) refuse_taken("save-problems", folder_);
}

bool ProblemFolder::is(const fs::path& other) const {
  std::error_code unknown;
  return !folder_.empty() && fs::equivalent(folder_, other, unknown);
}

void ProblemFolder::clear() const {
  if (folder_.empty()) return;
  std::error_code ignored;
  std::vector<fs::path> stored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored))
    if (is_stored_problem(entry.path().filename().string())) stored.push_back(entry.path());
  for (const fs::path& path : stored) fs::remove(path, ignored);
}

}  // namespace cb
