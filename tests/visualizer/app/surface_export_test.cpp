// SPDX-License-Identifier: Apache-2.0
// Exported meshes are read back as another program would.
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <tuple>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "shared/posix/atomic_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/surface/mesh_checks.hpp"
#include "visualizer/scene/visualizer_error.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf::surface_export_test {

using namespace kerf::test;
namespace fs = std::filesystem;

namespace {

/// Two balls side by side, the second one turned, and a body that is not solid.
struct LoadedScene {
  static constexpr VoxelGrid kGrid{24, 26, 28};
  TestVolume left{kGrid, centred(kGrid, glm::dvec3(0.25), {-4, 100, 0}),
                  ball({-4, 100, 0}, 2.5, 0.75)};
  TestVolume right{kGrid,
                   glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(4, 100, 0)), 0.5,
                               glm::dvec3(0, 1, 0)) *
                       centred(kGrid, glm::dvec3(0.25)),
                   ball({4, 100, 0}, 2.0, 0.75)};
  TestVolume ghost{kGrid, glm::dmat4(1.0), [](glm::dvec3) { return 1.0; }};
  SceneView view;

  LoadedScene() {
    ghost.view.solid = false;
    view.volumes = {ghost.view, left.view, right.view};
    view.materials = {{"none", 0.0, {0, 0, 0}}, {"bone", 0.3, {0.5, 0.25, 0.0}}};
  }
  [[nodiscard]] std::array<VolumeContent, 3> contents() const {
    return {ghost.content(), left.content(), right.content()};
  }
};

template <typename T>
T take(const std::string& bytes, std::size_t& at) {
  T value;
  REQUIRE(at + sizeof(T) <= bytes.size());
  std::memcpy(&value, &bytes[at], sizeof(T));
  at += sizeof(T);
  return value;
}

/// Corners at the same place become one vertex, as readers of STL do.
ClosedMesh read_stl(const std::string& bytes) {
  ClosedMesh mesh;
  std::map<std::tuple<float, float, float>, std::uint32_t> known;
  std::size_t at = 80;
  const auto triangles = take<std::uint32_t>(bytes, at);
  double wrong = 0.0;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const auto normal = take<glm::vec3>(bytes, at);
    std::array<std::uint32_t, 3> corners{};
    for (std::uint32_t& corner : corners) {
      const auto p = take<glm::vec3>(bytes, at);
      const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
      const auto [place, fresh] = known.try_emplace({p.x, p.y, p.z}, next);
      if (fresh) mesh.vertices.push_back({p, normal, {}});
      corner = place->second;
    }
    CHECK(take<std::uint16_t>(bytes, at) == 0);
    mesh.triangles.push_back(corners);
    const glm::dvec3 a = mesh.vertices[corners[0]].position_mm;
    const glm::dvec3 across = glm::cross(glm::dvec3(mesh.vertices[corners[1]].position_mm) - a,
                                         glm::dvec3(mesh.vertices[corners[2]].position_mm) - a);
    wrong = std::max(wrong, glm::length(glm::normalize(across) - glm::dvec3(normal)));
  }
  CHECK(at == bytes.size());
  CHECK(wrong < 1e-6);
  return mesh;
}

/// Colours as in the file, 0..255.
ClosedMesh read_ply(const std::string& bytes) {
  const std::string end = "end_header\n";
  std::size_t at = bytes.find(end);
  REQUIRE(at != std::string::npos);
  std::istringstream header(bytes.substr(0, at));
  at += end.size();
  std::string line;
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::string properties;
  std::getline(header, line);
  CHECK(line == "ply");
  std::getline(header, line);
  CHECK(line == "format binary_little_endian 1.0");
  while (std::getline(header, line)) {
    if (line.rfind("element vertex ", 0) == 0) vertices = std::stoul(line.substr(15));
    if (line.rfind("element face ", 0) == 0) faces = std::stoul(line.substr(13));
    if (line.rfind("property ", 0) == 0) properties += line.substr(9) + ";";
  }
  CHECK(properties ==
        "float x;float y;float z;float nx;float ny;float nz;uchar red;uchar green;uchar blue;"
        "list uchar int vertex_indices;");
  ClosedMesh mesh;
  for (std::size_t i = 0; i < vertices; ++i) {
    ClosedMesh::Vertex vertex{take<glm::vec3>(bytes, at), take<glm::vec3>(bytes, at), {}};
    for (int c = 0; c < 3; ++c) vertex.colour[c] = take<std::uint8_t>(bytes, at);
    mesh.vertices.push_back(vertex);
  }
  for (std::size_t i = 0; i < faces; ++i) {
    CHECK(take<std::uint8_t>(bytes, at) == 3);
    mesh.triangles.push_back(take<std::array<std::uint32_t, 3>>(bytes, at));
  }
  CHECK(at == bytes.size());
  return mesh;
}

}  // namespace

TEST_CASE("an exported STL is closed, in world mm, and holds the solid volumes alone") {
  const TemporaryFolder folder;
  const LoadedScene scene;
  const fs::path file = folder / "two.stl";
  export_surface(file, scene.view, scene.contents());
  const std::string bytes = text_of(file);
  CHECK(bytes.substr(0, 5) != "solid");  // such a file would be taken for text
  const ClosedMesh mesh = read_stl(bytes);
  CHECK(open_sides(mesh.triangles) == 0);
  CHECK(euler_number(mesh) == 4);  // two pieces
  const double balls_mm3 = 4.0 / 3.0 * 3.14159265 * (2.5 * 2.5 * 2.5 + 2.0 * 2.0 * 2.0);
  CHECK(measure(mesh).volume_mm3 == doctest::Approx(balls_mm3).epsilon(0.01));
  glm::vec3 lo(1e9F);
  glm::vec3 hi(-1e9F);
  for (const auto& vertex : mesh.vertices) {
    lo = glm::min(lo, vertex.position_mm);
    hi = glm::max(hi, vertex.position_mm);
  }
  CHECK(lo.x == doctest::Approx(-6.5).epsilon(0.005));
  CHECK(hi.x == doctest::Approx(6.0).epsilon(0.005));
  CHECK(lo.y == doctest::Approx(97.5).epsilon(0.005));
}

TEST_CASE("an exported PLY has the same mesh, with outward normals and sRGB colours") {
  const TemporaryFolder folder;
  const LoadedScene scene;
  export_surface(folder / "two.stl", scene.view, scene.contents());
  export_surface(folder / "two.ply", scene.view, scene.contents());
  const ClosedMesh stl = read_stl(text_of(folder / "two.stl"));
  const ClosedMesh ply = read_ply(text_of(folder / "two.ply"));
  CHECK(open_sides(ply.triangles) == 0);
  CHECK(ply.vertices.size() == stl.vertices.size());
  CHECK(ply.triangles.size() == stl.triangles.size());
  CHECK(measure(ply).volume_mm3 == doctest::Approx(measure(stl).volume_mm3));
  double worst = 1.0;
  int miscoloured = 0;
  for (const auto& vertex : ply.vertices) {
    const glm::dvec3 centre(vertex.position_mm.x < 0.0F ? -4.0 : 4.0, 100.0, 0.0);
    const glm::dvec3 out = glm::normalize(glm::dvec3(vertex.position_mm) - centre);
    worst = std::min(worst, glm::dot(out, glm::dvec3(vertex.normal)));
    miscoloured += vertex.colour == glm::vec3(188, 137, 0) ? 0 : 1;  // linear 0.5, 0.25, 0
  }
  CHECK(worst > 0.99);
  CHECK(miscoloured == 0);
}

TEST_CASE(
    "with nothing solid left the files are valid and empty; with no solid volume the first "
    "one is written") {
  const TemporaryFolder folder;
  LoadedScene scene;
  std::fill(scene.left.density.begin(), scene.left.density.end(), Density{0});
  std::fill(scene.right.density.begin(), scene.right.density.end(), Density{0});
  export_surface(folder / "none.stl", scene.view, scene.contents());
  export_surface(folder / "none.ply", scene.view, scene.contents());
  CHECK(text_of(folder / "none.stl").size() == 84);
  CHECK(read_ply(text_of(folder / "none.ply")).vertices.empty());
  for (VolumeView& volume : scene.view.volumes) volume.solid = false;
  export_surface(folder / "ghost.stl", scene.view, scene.contents());
  CHECK(euler_number(read_stl(text_of(folder / "ghost.stl"))) == 2);
}

TEST_CASE("an export that cannot work is refused in one line, and leaves no file") {
  const TemporaryFolder folder;
  const LoadedScene scene;
  for (const char* name : {"mesh.obj", "mesh", "stl", ".stl"}) {
    CAPTURE(name);
    const fs::path file = folder / name;
    CHECK_THROWS_WITH_AS(
        check_export(file),
        doctest::Contains(("--export: " + file.string() + ": the name says no format; ").c_str()),
        VisualizerError);
    CHECK_THROWS_AS(export_surface(file, scene.view, scene.contents()), VisualizerError);
  }
  CHECK_THROWS_AS(check_export(folder / "nowhere/mesh.stl"), FileError);
  check_export(folder / "mesh.ply");
  CHECK(folder.count() == 0);
}

}  // namespace kerf::surface_export_test
