#include "output/row_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "output/number.h"

namespace cb {

std::string csv_cell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell += '"';
    cell += c;
  }
  return cell + '"';
}

std::size_t write_all(int file, std::string_view text, long offset, int& error) {
  std::size_t done = 0;
  while (done < text.size()) {
    const std::size_t rest = text.size() - done;
    const ssize_t n = offset < 0 ? ::write(file, text.data() + done, rest)
                                 : ::pwrite(file, text.data() + done, rest, offset + static_cast<long>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      error = n < 0 ? errno : ENOSPC;
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  return done;
}

RowFile::RowFile(const std::filesystem::path& path, std::string_view header) : path_(path.string()) {
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) error_ = errno;
  end_row(print_text(begin_row(header.size()), header));
  flush();
}

RowFile::~RowFile() {
  if (file_ < 0) return;
  flush();
  ::close(file_);
}

void RowFile::make_room(std::size_t room) {
  flush();
  if (room <= size_) return;
  size_ = std::max(room, capacity);
  buffer_.reset(new char[size_]);
}

void RowFile::flush() {
  const std::string_view rows(buffer_.get(), used_);
  used_ = 0;
  if (error_ != 0 || rows.empty()) return;
  const std::size_t done = write_all(file_, rows, -1, error_);
  if (done == rows.size()) {
    written_ += static_cast<long>(done);
    return;
  }
  // Cut the row that did not fit; where the file cannot be cut (a device), there is nothing to mend.
  const std::size_t last = rows.substr(0, done).rfind('\n');
  if (last != std::string_view::npos) written_ += static_cast<long>(last) + 1;
  if (::ftruncate(file_, written_) != 0) return;
}

}  // namespace cb
