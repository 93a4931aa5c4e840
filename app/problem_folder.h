#pragma once

#include <filesystem>
#include <optional>

#include "folder_lock.h"

namespace cb {

/// The folder that --save-problems names, for runs of methods and of engines: there, writable, and this process' own.
class ProblemFolder {
 public:
  /// Makes it; empty: none was asked for. Throws UsageError where it cannot be written, or another run has it.
  explicit ProblemFolder(const std::filesystem::path& folder);
  /// Is it `other`, too?
  bool is(const std::filesystem::path& other) const;
  /// Removes what an earlier run stored there, a method's or an engine's: a folder holds the problems of one run. What
  /// no run names so stays.
  void clear() const;

 private:
  std::filesystem::path folder_;
  std::optional<FolderLock> lock_;
};

}  // namespace cb
