#pragma once

#include <filesystem>
#include <string_view>

namespace cb {

/// Keeps a folder for one process: two runs that write the same files would mix their rows. Lasts as long as the
/// object, and no longer than the process, however that ends; leaves nothing behind.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// Has another process the folder? False too where the file system knows no locks.
  bool taken() const { return taken_; }

 private:
  int folder_ = -1;
  bool taken_ = false;
};

/// Throws UsageError: the folder that `flag` names is another run's.
[[noreturn]] void refuse_taken(std::string_view flag, const std::filesystem::path& folder);

}  // namespace cb
