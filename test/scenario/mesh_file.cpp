// Points of OBJ and STL files, and what is wrong with a file.

#include "scenario/mesh_file.h"

#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

const std::vector<Vec3> tetrahedron{Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(0, 1, 0), Vec3(1, 0, 0)};  // in order
const int facets[4][3] = {{0, 2, 3}, {0, 3, 1}, {0, 1, 2}, {1, 3, 2}};

std::string stl_text() {
  std::string out = "solid part\n";
  for (const auto& facet : facets) {
    out += "  facet normal 0 0 0\n    outer loop\n";
    for (const int i : facet) {
      const Vec3& x = tetrahedron[static_cast<std::size_t>(i)];
      out +=
          "      vertex " + std::to_string(x.x()) + " " + std::to_string(x.y()) + " +" + std::to_string(x.z()) + "\n";
    }
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid part\n";
}

void append(std::string& out, std::uint32_t word) {
  for (int k = 0; k < 4; ++k) out += static_cast<char>(word >> (8 * k) & 0xFF);
}
std::string stl_binary() {
  std::string out = "solid is how some binary files begin";
  out.resize(80, ' ');
  append(out, 4);
  for (const auto& facet : facets) {
    out.append(12, '\0');
    for (const int i : facet)
      for (int k = 0; k < 3; ++k)
        append(out, std::bit_cast<std::uint32_t>(static_cast<float>(tetrahedron[static_cast<std::size_t>(i)][k])));
    out.append(2, '\0');
  }
  return out;
}

std::vector<Vec3> points_of(const std::string& text, const std::string& name, double scale = 1) {
  const TextFile file(text, name);
  return read_mesh_points(file.path(), scale);
}
std::string message(const std::string& text, const std::string& name) {
  try {
    points_of(text, name);
  } catch (const NoMesh& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("OBJ, STL in text and STL in binary give the same points, each once, in one order") {
  CHECK(points_of("# part\nv 1 0 0\nvn 0 0 1\nv 0 1 0 1.0\r\nv 0 0 1\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", "a.obj") ==
        tetrahedron);
  CHECK(points_of(stl_text(), "a.stl") == tetrahedron);
  CHECK(points_of(stl_binary(), "a.STL") == tetrahedron);
  CHECK(points_of(stl_binary(), "a.stl", 1e-3).back() == Vec3(1e-3, 0, 0));
  // Words stand apart by tabs as well, and lines may be empty, those after the last word included.
  CHECK(points_of("v\t1 0\t0\nv 0 1 0\n\nv 0 0 1\nv 0 0 0\n\n", "a.obj") == tetrahedron);
  CHECK(points_of(stl_text() + "\n \n", "a.stl") == tetrahedron);
}

TEST_CASE("The triangles of an OBJ file are fans of its faces, of an STL file its facets, in their order") {
  const TextFile file("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2/2 3//3 -1\nvn 0 0 1\nf 4 3 2\n", "a.obj");
  const auto triangles = read_mesh_triangles(file.path(), 2);
  REQUIRE(triangles.size() == 3);
  CHECK(triangles[0] == std::array<Vec3, 3>{Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(2, 2, 0)});
  CHECK(triangles[1] == std::array<Vec3, 3>{Vec3(0, 0, 0), Vec3(2, 2, 0), Vec3(0, 2, 0)});
  CHECK(triangles[2] == std::array<Vec3, 3>{Vec3(0, 2, 0), Vec3(2, 2, 0), Vec3(2, 0, 0)});
  for (const std::string& text : {stl_text(), stl_binary()}) {
    const TextFile stl(text, "a.stl");
    const auto facets_read = read_mesh_triangles(stl.path(), 1);
    REQUIRE(facets_read.size() == 4);
    for (std::size_t f = 0; f < 4; ++f)
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(facets_read[f][k] == tetrahedron[static_cast<std::size_t>(facets[f][k])]);
  }
}

TEST_CASE("Corners of an STL file that no facet ends are no triangle") {
  for (int corners = 1; corners < 6; ++corners) {
    std::string text = "solid part\n";
    for (int i = 0; i < corners; ++i) text += "vertex " + std::to_string(i) + " 0 0\n";
    const TextFile file(text + "endsolid part\n", "a.stl");
    INFO(corners);
    if (corners % 3 == 0)
      CHECK(read_mesh_triangles(file.path(), 1).size() == 1);
    else
      CHECK_THROWS_WITH(read_mesh_triangles(file.path(), 1), Catch::EndsWith("a.stl has a facet without three points"));
  }
}

TEST_CASE("A mesh that is cut off anywhere, or holds what is no number, is refused with the place") {
  const std::string text = stl_text(), binary = stl_binary();
  for (std::size_t length = 0; length + 14 < text.size(); ++length)
    REQUIRE_FALSE(message(text.substr(0, length), "a.stl").empty());
  for (std::size_t length = 0; length < binary.size(); ++length)
    REQUIRE_FALSE(message(binary.substr(0, length), "a.stl").empty());
  // Of two solids, the second.
  CHECK(message(text + text, "a.stl").empty());
  for (std::size_t length = 1; length + 14 < text.size(); ++length)
    REQUIRE_FALSE(message(text + text.substr(0, length), "a.stl").empty());
  CHECK_THAT(message(binary + "x", "a.stl"), Catch::Contains("4 facets take 284"));
  CHECK_THAT(message("v 1 2 3\nv 1 2\n", "a.obj"), Catch::Contains("a.obj, line 2: \"\" is no finite number"));
  CHECK_THAT(message("v 1 2 nan\n", "a.obj"), Catch::Contains("\"nan\" is no finite number"));
  CHECK_THAT(message("v 1 2 1e999\n", "a.obj"), Catch::Contains("line 1"));
  CHECK_THAT(message("f 1 2 3\n", "a.obj"), Catch::Contains("has no v line"));
  CHECK_THAT(message(std::string(text).insert(text.find("      vertex"), "vertex 0 0 0\n"), "a.stl"),
             Catch::Contains("a facet of 4 points"));
  std::string two = text;
  const std::size_t vertex = two.find("      vertex");
  CHECK_THAT(message(two.erase(vertex, two.find('\n', vertex) + 1 - vertex), "a.stl"),
             Catch::Contains("a facet of 2 points"));
  std::string infinite = binary;
  infinite[84 + 50 + 12 + 2] = '\x80';
  infinite[84 + 50 + 12 + 3] = '\x7F';
  CHECK_THAT(message(infinite, "a.stl"), Catch::Contains("facet 2: a point that is not finite"));
  // The second corner of the fourth facet, each of its coordinates.
  for (std::size_t coordinate = 0; coordinate < 3; ++coordinate) {
    std::string one = binary;
    const std::size_t at = 84 + 3 * 50 + 12 + 12 + 4 * coordinate;
    one[at + 2] = '\x80';
    one[at + 3] = '\x7F';
    CHECK_THAT(message(one, "a.stl"), Catch::Contains("facet 4: a point that is not finite"));
  }
  CHECK_THAT(message(text, "a.dae"), Catch::Contains("neither .obj nor .stl"));
  CHECK_THAT(message(std::string(100, '\0'), "a.obj"), Catch::Contains("no text"));
  for (const std::string word : {"3x", "1,5"})
    CHECK_THAT(message("v 1 2 " + word + "\n", "a.obj"),
               Catch::Contains("a.obj, line 1: \"" + word + "\" is no finite number"));
  CHECK_THAT(message("solid part\nendsolid part\n", "a.stl"), Catch::EndsWith("a.stl has no facet"));
  CHECK_THAT(message(std::string(80, ' ') + std::string(4, '\0'), "a.stl"), Catch::EndsWith("a.stl has no facet"));
}

TEST_CASE("A face has three points or more of those that stand before it, counted from 1, or back from -1") {
  const auto said = [](const std::string& face) {
    const TextFile file("v 0 0 0\nv 1 0 0\nv 0 1 0\nf " + face + "\nv 0 0 1\n", "a.obj");
    try {
      read_mesh_triangles(file.path(), 1);
    } catch (const NoMesh& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(said("1 2 3").empty());
  CHECK(said("-3 -2 -1").empty());
  for (const std::string none : {"0", "4", "-4"})
    CHECK_THAT(said("1 2 " + none), Catch::Contains("a.obj, line 4: \"" + none + "\" names none of the 3 points"));
  CHECK_THAT(said("1 2"), Catch::Contains("a.obj, line 4: a face of 2 points; it has three or more"));
  CHECK_THAT(said("1 2 3.5"), Catch::Contains("\"3.5\" names no point"));
  CHECK_THAT(said("1 2 x"), Catch::Contains("\"x\" names no point"));
  CHECK_THAT(said("1 2 /3"), Catch::Contains("\"/3\" names no point"));
}

TEST_CASE("A mesh may be long, but not beyond 64 MB") {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  CHECK(points_of(text + std::string(std::size_t{1} << 20U, '#') + "\n", "a.obj").size() == 4);
  const TextFile file(text, "a.obj");
  std::filesystem::resize_file(file.path(), (std::size_t{64} << 20U) + 1);
  CHECK_THROWS_WITH(read_mesh_points(file.path(), 1), Catch::Contains("a.obj is longer than 64 MB"));
}

TEST_CASE("A mesh that holds less than its length tells cannot be read") {
  // The system tells a length of its own files that they do not have.
  const std::filesystem::path told = "/sys/devices/system/cpu/online";
  std::error_code none;
  if (std::filesystem::file_size(told, none) < 1000 || none) return;
  const TextFile beside("", "beside.txt");
  const std::filesystem::path link = std::filesystem::path(beside.path()).parent_path() / "a.obj";
  std::filesystem::create_symlink(told, link);
  CHECK_THROWS_WITH(read_mesh_points(link.string(), 1), Catch::EndsWith("a.obj cannot be read"));
}

TEST_CASE("A scene's hull names the file that is wrong, and the place in the scene") {
  const std::string text = replaced(file_text(std::string(TEST_DATA) + "/scenes/small.xml"),
                                    "<sphere name=\"ball\" radius=\"0.5\" ", "<hull name=\"ball\" file=\"part.obj\" ");
  const auto said = [&](const std::string& mesh) {
    const TextFile part(mesh, "part.obj");
    return message_of(TextFile(text).path());
  };
  CHECK(said("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n").empty());
  CHECK_THAT(said("v 0 0 0\nv 1 x 0\n"), Catch::Contains(":19:") && Catch::Contains("part.obj, line 2"));
  CHECK_THAT(said("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"), Catch::Contains("in one plane"));
  std::string many;
  for (int i = 0; i < 1100; ++i) {
    // A parabola turned: all points are vertices.
    const double a = 0.1 * i, r = 1 + 1e-3 * i;
    many += "v " + std::to_string(r * std::cos(a)) + " " + std::to_string(r * std::sin(a)) + " " +
            std::to_string(r * r) + "\n";
  }
  CHECK_THAT(said(many), Catch::Contains("more than 1000 vertices") && Catch::Contains("simplify the mesh"));
  const TextFile part("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", "part.obj");
  const Scenario s = load_text(text);
  CHECK(s.files.size() == 2);
  CHECK(s.model.bodies[2].mass == Approx(1000.0 / 6));
}
