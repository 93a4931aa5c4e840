#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace cb {

/// A text file that grows by whole rows through one large buffer. What is on the disk always ends with a whole row:
/// rows are written together, and where a disk fills up in the middle of one, the file is cut back to the last that
/// fits. Only SIGKILL in the middle of a write may leave a row without its end. The first error is kept; what follows
/// it is dropped.
class RowFile {
 public:
  RowFile() = default;
  /// Creates or empties the file and writes `header` at once. See ok().
  RowFile(const std::filesystem::path& path, std::string_view header);
  RowFile(const RowFile&) = delete;
  RowFile& operator=(const RowFile&) = delete;
  /// Flushes.
  ~RowFile();

  bool ok() const { return error_ == 0; }
  /// errno of the first failure, 0 where there is none.
  int error() const { return error_; }
  const std::string& path() const { return path_; }

  /// Room for one row of at most `room` characters.
  char* begin_row(std::size_t room) {
    if (used_ + room > size_) make_room(room);
    return buffer_.get() + used_;
  }
  /// `end`: one past the last character of the row, its line break included.
  void end_row(const char* end) { used_ = static_cast<std::size_t>(end - buffer_.get()); }
  /// Hands all rows to the system.
  void flush();

  /// Characters written at a time: enough that the system calls cost nothing beside the printing, few enough that the
  /// files of a run fill a disk side by side.
  static constexpr std::size_t capacity = std::size_t(1) << 16;

 private:
  void make_room(std::size_t room);

  std::unique_ptr<char[]> buffer_;
  std::size_t size_ = 0, used_ = 0;
  long written_ = 0;  // bytes in the file, whole rows
  int file_ = -1;
  int error_ = 0;
  std::string path_;
};

/// Writes all of `text` at the file's position, or at `offset` where it is not negative. Returns the bytes written;
/// less than all of them sets `error` to errno.
std::size_t write_all(int file, std::string_view text, long offset, int& error);

}  // namespace cb
