#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace cb {

/// Arrays in a file that numpy.load() reads: a zip archive, nothing compressed, of one .npy each. No times: the same
/// arrays give the same bytes. At most 4 GiB.
class NpzFile {
 public:
  explicit NpzFile(const std::string& path);
  ~NpzFile();
  NpzFile(const NpzFile&) = delete;
  NpzFile& operator=(const NpzFile&) = delete;

  /// Row-major, the last index first.
  void add(const std::string& name, const std::vector<std::size_t>& shape, const std::vector<double>& values);
  void add(const std::string& name, const std::vector<std::string>& words);
  /// Writes what ends the file. False where it, or anything before, could not be written; error() says why.
  bool finish();
  int error() const { return error_; }

 private:
  void add_file(const std::string& name, const std::string& header, const void* data, std::size_t size);
  void write(const void* data, std::size_t size);

  struct Entry {
    std::string name;
    std::uint32_t crc, size, at;
  };
  std::vector<Entry> entries_;
  std::FILE* file_;
  std::uint64_t written_ = 0;
  int error_ = 0;
};

/// trajectory.csv of a run of so many bodies as trajectory.npz beside it, and gone: t (n), bodies (nb, words),
/// position (n, nb, 3), orientation (n, nb, 4: w, x, y, z), velocity and angular_velocity (n, nb, 3). False where that
/// cannot be; `error` says why (errno), and trajectory.csv stays.
bool trajectory_as_npz(const std::string& folder, std::size_t bodies, int& error);

}  // namespace cb
