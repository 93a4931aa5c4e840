// Points and triangles of OBJ and STL files.
//
// Sources: Wavefront's object files (1995), v and f lines; 3D Systems' stereolithography interface (1989), text
// (`solid`, `facet`, `outer loop`, `vertex`, ..., `endsolid`) and binary (80 bytes, a count, 50 bytes a facet, little
// endian). Differences from other readers: a binary file is told by its length, which its count gives, since such files
// begin with `solid` too; what is cut off is an error.
#include "scenario/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace cb {

namespace {

constexpr std::uintmax_t size_limit = 64u << 20;
constexpr std::size_t head = 84, facet_size = 50;  // bytes of a binary STL file

std::string ending(const std::string& path) {
  std::string out = std::filesystem::path(path).extension().string();
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

std::string read_all(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || !std::filesystem::is_regular_file(path, error))
    throw NoMesh(fmt::format("{} cannot be read; name an OBJ or STL file", path));
  if (size > size_limit) throw NoMesh(fmt::format("{} is longer than 64 MB; simplify the mesh", path));
  std::string text(size, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(text.data(), static_cast<std::streamsize>(size));
  if (!stream || static_cast<std::uintmax_t>(stream.gcount()) != size)
    throw NoMesh(fmt::format("{} cannot be read", path));
  return text;
}

std::string_view next_word(std::string_view& line) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!line.empty() && blank(line.front())) line.remove_prefix(1);
  std::size_t length = 0;
  while (length < line.size() && !blank(line[length])) ++length;
  const std::string_view word = line.substr(0, length);
  line.remove_prefix(length);
  return word;
}

/// The lines of a text, with their words and numbers.
class Lines {
 public:
  Lines(const std::string& path, std::string_view text) : path_(path), rest_(text) {}
  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
    return true;
  }
  Vec3 point(std::string_view line) const {
    Vec3 out;
    for (int i = 0; i < 3; ++i) {
      std::string_view word = next_word(line);
      if (word.starts_with('+')) word.remove_prefix(1);
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out[i]);
      if (word.empty() || error != std::errc() || end != word.data() + word.size() || !std::isfinite(out[i]))
        fail(fmt::format("\"{}\" is no finite number; a point has three", word));
    }
    return out;
  }
  [[noreturn]] void fail(const std::string& message) const {
    throw NoMesh(fmt::format("{}, line {}: {}", path_, number_, message));
  }

 private:
  const std::string& path_;
  std::string_view rest_;
  int number_ = 0;
};

/// Three points each, in the order of a file: its triangles.
using Corners = std::vector<Vec3>;

// The fan of an f line, whose words are v, v/vt, v//vn or v/vt/vn: numbers of points from 1, or back from -1.
void add_fan(const Lines& lines, std::string_view line, const std::vector<Vec3>& points, Corners& corners) {
  Corners polygon;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    const std::string_view number = word.substr(0, word.find('/'));
    long i = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), i);
    const long count = static_cast<long>(points.size()), at = i < 0 ? count + i : i - 1;
    if (error != std::errc() || end != number.data() + number.size())
      lines.fail(fmt::format("\"{}\" names no point; a corner is v, v/vt, v//vn or v/vt/vn", word));
    if (at < 0 || at >= count) lines.fail(fmt::format("\"{}\" names none of the {} points before it", word, count));
    polygon.push_back(points[static_cast<std::size_t>(at)]);
  }
  if (polygon.size() < 3) lines.fail(fmt::format("a face of {} points; it has three or more", polygon.size()));
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    corners.insert(corners.end(), {polygon[0], polygon[k], polygon[k + 1]});
}

// `corners`: where the f lines go; null: they are not looked at.
std::vector<Vec3> points_of_obj(const std::string& path, const std::string& text, Corners* corners) {
  if (text.find('\0') != std::string::npos) throw NoMesh(fmt::format("{} is no text; an OBJ file is", path));
  std::vector<Vec3> points;
  Lines lines(path, text);
  for (std::string_view line; lines.next(line);) {
    const std::string_view word = next_word(line);
    if (word == "v") points.push_back(lines.point(line));
    if (word == "f" && corners != nullptr) add_fan(lines, line, points, *corners);
  }
  if (points.empty()) throw NoMesh(fmt::format("{} has no v line; an OBJ file has one for each point", path));
  return points;
}

std::vector<Vec3> points_of_stl_text(const std::string& path, const std::string& text) {
  std::vector<Vec3> points;
  Lines lines(path, text);
  bool ended = false;
  std::size_t in_facet = 0;
  for (std::string_view line; lines.next(line);) {
    const std::string_view word = next_word(line);
    ended = word == "endsolid" || (ended && word.empty());
    if (word == "vertex") {
      points.push_back(lines.point(line));
      ++in_facet;
    }
    if (word == "endfacet" && in_facet != 3) lines.fail(fmt::format("a facet of {} points; it has three", in_facet));
    if (word == "endfacet") in_facet = 0;
  }
  if (!ended) lines.fail("the file ends without endsolid; it was cut off");
  if (points.empty()) throw NoMesh(fmt::format("{} has no facet", path));
  return points;
}

std::uint32_t word_at(const std::string& text, std::size_t at) {
  std::uint32_t out = 0;
  for (std::size_t k = 4; k-- > 0;) out = out << 8 | static_cast<unsigned char>(text[at + k]);
  return out;
}

std::vector<Vec3> points_of_stl(const std::string& path, const std::string& text) {
  const std::uint64_t count = text.size() >= head ? word_at(text, 80) : 0;
  const std::uint64_t expected = head + facet_size * count;
  if (text.size() < head || expected != text.size()) {
    if (text.starts_with("solid") && text.find('\0') == std::string::npos) return points_of_stl_text(path, text);
    throw NoMesh(fmt::format("{} has {} bytes, and its {} facets take {}; it was cut off, or is no STL file", path,
                             text.size(), count, expected));
  }
  std::vector<Vec3> points;
  for (std::uint64_t facet = 0; facet < count; ++facet) {
    const std::size_t at = head + facet_size * facet + 12;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 x;
      for (std::size_t i = 0; i < 3; ++i)
        x[static_cast<int>(i)] = std::bit_cast<float>(word_at(text, at + 12 * k + 4 * i));
      if (!x.allFinite()) throw NoMesh(fmt::format("{}, facet {}: a point that is not finite", path, facet + 1));
      points.push_back(x);
    }
  }
  if (points.empty()) throw NoMesh(fmt::format("{} has no facet", path));
  return points;
}

}  // namespace

bool is_mesh_name(const std::string& path) { return ending(path) == ".obj" || ending(path) == ".stl"; }

namespace {

std::vector<Vec3> points_of(const std::string& path, Corners* corners) {
  if (!is_mesh_name(path)) throw NoMesh(fmt::format("{} is named neither .obj nor .stl, which are read", path));
  const std::string text = read_all(path);
  if (ending(path) == ".obj") return points_of_obj(path, text, corners);
  std::vector<Vec3> points = points_of_stl(path, text);
  if (corners != nullptr) *corners = points;
  return points;
}

}  // namespace

std::vector<std::array<Vec3, 3>> read_mesh_triangles(const std::string& path, double scale) {
  Corners corners;
  points_of(path, &corners);
  if (corners.empty()) throw NoMesh(fmt::format("{} has no f line; an OBJ file has one for each face", path));
  if (corners.size() % 3 != 0) throw NoMesh(fmt::format("{} has a facet without three points", path));
  std::vector<std::array<Vec3, 3>> triangles;
  for (std::size_t i = 0; i < corners.size(); i += 3)
    triangles.push_back({scale * corners[i], scale * corners[i + 1], scale * corners[i + 2]});
  return triangles;
}

std::vector<Vec3> read_mesh_points(const std::string& path, double scale) {
  std::vector<Vec3> points = points_of(path, nullptr);
  const auto before = [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (Vec3& x : points) x *= scale;
  return points;
}

}  // namespace cb
