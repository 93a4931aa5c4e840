// The scenes that come with the program: beside an installed program, else in the source tree it was built from.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "scenario/near_name.h"
#include "scenario/scenario.h"

namespace cb {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> scenes_in(const fs::path& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().extension() == ".xml" && entry->is_regular_file(error)) files.push_back(entry->path().string());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

std::vector<std::string> bundled_scenarios() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path installed = program.parent_path().parent_path() / "share" / "contactbench" / "scenarios";
    std::vector<std::string> files = scenes_in(installed);
    if (!files.empty()) return files;
  }
  return scenes_in(SCENARIO_SOURCE_DIR);
}

std::string find_scenario(const std::string& name) {
  std::error_code error;
  const bool is_folder = fs::is_directory(name, error);
  if (fs::exists(name, error) && !is_folder) return name;

  std::vector<std::string> names;
  for (const std::string& file : bundled_scenarios()) {
    const fs::path path(file);
    if (name == path.filename() || name == path.stem()) return file;
    names.push_back(path.stem().string());
  }
  if (is_folder) return name;  // load_scenario says what is wrong with it
  if (names.empty()) throw InputError(fmt::format("{}: there is no such file; name a scenario's .xml file", name));
  const fs::path wanted = fs::path(name).extension() == ".xml" ? fs::path(name).stem() : fs::path(name).filename();
  const std::string near = suggest(wanted.string(), names, "");
  throw InputError(
      fmt::format("{}: there is no such file, nor such a scene among those that come with the program;{} "
                  "these are: {}",
                  name, near.rfind("did you", 0) == 0 ? " " + near : "", join(names)));
}

}  // namespace cb
