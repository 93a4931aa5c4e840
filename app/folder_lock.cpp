#include "folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "commands.h"

namespace cb {

FolderLock::FolderLock(const std::filesystem::path& folder)
    : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  taken_ = folder_ >= 0 && ::flock(folder_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

FolderLock::~FolderLock() {
  if (folder_ >= 0) ::close(folder_);
}

void refuse_taken(std::string_view flag, const std::filesystem::path& folder) {
  throw UsageError(
      fmt::format("--{} {}: another run is writing into this folder; wait for it, or name a folder for this one", flag,
                  folder.string()));
}

}  // namespace cb
