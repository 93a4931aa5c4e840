// The readers take paths: bytes reach them through a file in memory (Linux).
#include "fuzz/inputs.h"

#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include "contact/problem_files.h"
#include "lcp/lcp_files.h"
#include "linalg/matrix_market.h"
#include "scenario/scenario.h"
#include "scenario/urdf.h"
#include "scenario/xml_tree.h"

namespace cb::test {

namespace {

/// A file that holds `bytes` as long as this object lives.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("input", 0)) {
    std::size_t done = 0;
    while (descriptor_ >= 0 && done < bytes.size()) {
      const ssize_t written = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
      if (written <= 0) break;
      done += static_cast<std::size_t>(written);
    }
    if (descriptor_ < 0 || done != bytes.size()) throw std::logic_error("no file in memory");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(descriptor_); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

void demand_one_line(const std::exception& error) {
  const std::string_view message = error.what();
  if (message.empty() || message.find('\n') != message.npos)
    throw std::logic_error("a message must be one line: " + std::string(message));
}

template <class Refusal, class Reader>
void read(const Reader& reader) {
  try {
    reader();
  } catch (const Refusal& refusal) {
    demand_one_line(refusal);
  }
}

}  // namespace

void read_as_scene(std::string_view bytes) {
  if (bytes.starts_with("<robot") || bytes.starts_with("<?xml version=\"1.0\"?>\n<robot")) {
    read<InputError>([&] { read_urdf({"input.urdf", std::string(bytes)}, true, "robot_"); });
    return;
  }
  const MemoryFile file(bytes);
  read<InputError>([&] { load_scenario(file.path(), {}); });
}

void read_as_problem(std::string_view bytes) {
  const MemoryFile file(bytes);
  if (bytes.starts_with("%%")) {
    read<FileError>([&] { read_matrix_market(file.path()); });
    return;
  }
  read<FileError>([&] { read_contact_problem(file.path()); });
  if (!bytes.starts_with("\x89HDF")) read<FileError>([&] { read_lcp_siconos(file.path()); });
}

}  // namespace cb::test
