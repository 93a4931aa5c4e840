// What: numpy's .npz, written by ourselves: a zip archive of .npy files, stored as they are.
// Source: numpy, "NPY format", version 1.0; PKWARE, APPNOTE.TXT, 4.3 (local headers, central directory).
// Fails: error() is errno; EFBIG where the file would pass 4 GiB.
#include "output/npz.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>

namespace cb {

namespace {

constexpr std::uint64_t most_bytes = std::numeric_limits<std::uint32_t>::max();

/// CRC-32 of zip, taken up where `crc` ended.
std::uint32_t crc32(const void* data, std::size_t size, std::uint32_t crc) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < t.size(); ++i) {
      std::uint32_t x = i;
      for (int k = 0; k < 8; ++k) x = (x & 1) != 0 ? 0xEDB88320U ^ (x >> 1) : x >> 1;
      t[i] = x;
    }
    return t;
  }();
  crc = ~crc;
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) crc = table[(crc ^ bytes[i]) & 0xFF] ^ (crc >> 8);
  return ~crc;
}

void put(std::string& out, std::uint32_t x, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(x >> (8 * i) & 0xFF);
}

/// The head of a .npy file, padded so that the numbers start on a line of 64 bytes.
std::string npy_header(const std::string& type, const std::vector<std::size_t>& shape) {
  std::string dict = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t n : shape) dict += std::to_string(n) + (shape.size() == 1 ? "," : ", ");
  dict += "), }";
  constexpr std::size_t before = 10, line = 64;
  dict.resize((before + dict.size() + 1 + line - 1) / line * line - before - 1, ' ');
  dict += '\n';
  std::string head = "\x93NUMPY\x01";
  head += '\0';
  put(head, static_cast<std::uint32_t>(dict.size()), 2);
  return head + dict;
}

/// What local and central headers share: version, flags, method 0 (stored), no time (1980-01-01), sums and sizes.
std::string common(std::uint32_t crc, std::uint32_t size, std::size_t name) {
  std::string out;
  put(out, 20, 2);
  put(out, 0, 2);
  put(out, 0, 2);
  put(out, 0, 2);
  put(out, 0x21, 2);
  put(out, crc, 4);
  put(out, size, 4);
  put(out, size, 4);
  put(out, static_cast<std::uint32_t>(name), 2);
  put(out, 0, 2);
  return out;
}

}  // namespace

NpzFile::NpzFile(const std::string& path) : file_(std::fopen(path.c_str(), "wb")) {
  if (!file_) error_ = errno;
}

NpzFile::~NpzFile() {
  if (file_) std::fclose(file_);
}

void NpzFile::write(const void* data, std::size_t size) {
  if (error_ != 0) return;
  if (written_ + size > most_bytes) {
    error_ = EFBIG;
    return;
  }
  if (std::fwrite(data, 1, size, file_) != size) error_ = errno != 0 ? errno : EIO;
  written_ += size;
}

void NpzFile::add_file(const std::string& name, const std::string& header, const void* data, std::size_t size) {
  if (header.size() + size > most_bytes) error_ = EFBIG;
  const Entry entry{name, crc32(data, size, crc32(header.data(), header.size(), 0)),
                    static_cast<std::uint32_t>(header.size() + size), static_cast<std::uint32_t>(written_)};
  std::string local = "PK\x03\x04" + common(entry.crc, entry.size, name.size()) + name;
  write(local.data(), local.size());
  write(header.data(), header.size());
  write(data, size);
  entries_.push_back(entry);
}

void NpzFile::add(const std::string& name, const std::vector<std::size_t>& shape, const std::vector<double>& values) {
  add_file(name + ".npy", npy_header("<f8", shape), values.data(), values.size() * sizeof(double));
}

// Words in UTF-32, as numpy keeps them, all as long as the longest.
void NpzFile::add(const std::string& name, const std::vector<std::string>& words) {
  std::vector<std::u32string> wide;
  std::size_t longest = 1;
  for (const std::string& word : words) {
    std::u32string& to = wide.emplace_back();
    for (std::size_t i = 0; i < word.size(); ++i) {
      const auto c = static_cast<unsigned char>(word[i]);
      if ((c & 0xC0) == 0x80 && !to.empty())
        to.back() = to.back() << 6 | (c & 0x3F);
      else
        to += c < 0x80 ? c : c < 0xE0 ? c & 0x1F : c < 0xF0 ? c & 0x0F : c & 0x07;
    }
    longest = std::max(longest, to.size());
  }
  std::u32string all;
  for (std::u32string& word : wide) {
    word.resize(longest);
    all += word;
  }
  add_file(name + ".npy", npy_header("<U" + std::to_string(longest), {words.size()}), all.data(),
           all.size() * sizeof(char32_t));
}

bool NpzFile::finish() {
  const auto at = static_cast<std::uint32_t>(written_);
  std::string directory;
  for (const Entry& entry : entries_) {
    directory += "PK\x01\x02";
    put(directory, 20, 2);
    directory += common(entry.crc, entry.size, entry.name.size());
    put(directory, 0, 2);  // comment
    put(directory, 0, 2);  // disk
    put(directory, 0, 2);  // attributes
    put(directory, 0, 4);
    put(directory, entry.at, 4);
    directory += entry.name;
  }
  std::string end = "PK\x05\x06";
  put(end, 0, 4);
  for (int i = 0; i < 2; ++i) put(end, static_cast<std::uint32_t>(entries_.size()), 2);
  put(end, static_cast<std::uint32_t>(directory.size()), 4);
  put(end, at, 4);
  put(end, 0, 2);
  directory += end;
  write(directory.data(), directory.size());
  if (file_ && std::fclose(file_) != 0 && error_ == 0) error_ = errno;
  file_ = nullptr;
  return error_ == 0;
}

namespace {

constexpr std::size_t row_numbers = 13;  // of trajectory.csv after t and body

/// t, the body's cell, and the numbers after it.
bool split(std::string_view line, double& t, std::string_view& body, std::array<double, row_numbers>& x) {
  const auto number = [](std::string_view cell, double& out) {
    out = std::numeric_limits<double>::quiet_NaN();  // an empty cell
    return cell.empty() || std::from_chars(cell.data(), cell.data() + cell.size(), out).ec == std::errc();
  };
  for (std::size_t i = row_numbers; i-- > 0;) {
    const std::size_t comma = line.rfind(',');
    if (comma == std::string_view::npos || !number(line.substr(comma + 1), x[i])) return false;
    line = line.substr(0, comma);
  }
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos) return false;
  body = line.substr(comma + 1);
  return number(line.substr(0, comma), t);
}

/// The word of a cell of CSV.
std::string word_of(std::string_view cell) {
  if (!cell.starts_with('"')) return std::string(cell);
  std::string out;
  for (std::size_t i = 1; i + 1 < cell.size(); ++i) {
    out += cell[i];
    if (cell[i] == '"') ++i;  // stands for one
  }
  return out;
}

}  // namespace

bool trajectory_as_npz(const std::string& folder, std::size_t bodies, int& error) {
  const std::string csv = folder + "/trajectory.csv", npz = folder + "/trajectory.npz", part = npz + ".part";
  std::ifstream in(csv);
  std::vector<double> time, position, orientation, velocity, rotation;
  std::vector<std::string> names;
  std::string line;
  std::getline(in, line);
  for (std::size_t row = 0; std::getline(in, line); ++row) {
    double t = 0;
    std::string_view body;
    std::array<double, row_numbers> x{};
    if (!split(line, t, body, x)) break;
    if (row < bodies) names.push_back(word_of(body));
    if (row % bodies == 0) time.push_back(t);
    position.insert(position.end(), x.begin(), x.begin() + 3);
    orientation.insert(orientation.end(), x.begin() + 3, x.begin() + 7);
    velocity.insert(velocity.end(), x.begin() + 7, x.begin() + 10);
    rotation.insert(rotation.end(), x.begin() + 10, x.end());
  }
  const std::size_t n = time.size();
  if (position.size() != 3 * n * bodies) {
    error = EIO;
    return false;
  }
  NpzFile out(part);
  out.add("t", {n}, time);
  out.add("bodies", names);
  out.add("position", {n, bodies, 3}, position);
  out.add("orientation", {n, bodies, 4}, orientation);
  out.add("velocity", {n, bodies, 3}, velocity);
  out.add("angular_velocity", {n, bodies, 3}, rotation);
  std::error_code failed;
  if (out.finish()) std::filesystem::rename(part, npz, failed);
  error = out.error() != 0 ? out.error() : failed.value();
  std::filesystem::remove(error == 0 ? csv : part, failed);
  return error == 0;
}

}  // namespace cb
