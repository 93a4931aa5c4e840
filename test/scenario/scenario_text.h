#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "scenario/scenario.h"

namespace cb::test {

/// A scenario file that lives as long as this object.
class TextFile {
 public:
  explicit TextFile(const std::string& text, const std::string& name = "written_by_test.xml")
      : folder_(std::filesystem::temp_directory_path() / ("contactbench_test_" + std::to_string(::getpid()))),
        path_((folder_ / name).string()) {
    std::filesystem::create_directories(folder_);
    std::ofstream(path_, std::ios::binary) << text;
  }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;
  ~TextFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  std::filesystem::path folder_;
  std::string path_;
};

inline std::string file_text(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

inline Scenario load_text(const std::string& text, const Overrides& overrides = {}) {
  const TextFile file(text);
  return load_scenario(file.path(), overrides);
}

/// The message that loading ends with; empty where it succeeds.
inline std::string message_of(const std::string& path, const Overrides& overrides = {}) {
  try {
    load_scenario(path, overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

/// `text` with its one occurrence of `old_part` replaced; a part that is not there exactly once is a mistake in the
/// test.
inline std::string replaced(std::string text, const std::string& old_part, const std::string& new_part) {
  const std::size_t at = text.find(old_part);
  if (at == std::string::npos || text.find(old_part, at + 1) != std::string::npos)
    throw std::logic_error("not there exactly once: " + old_part);
  return text.replace(at, old_part.size(), new_part);
}

}  // namespace cb::test
