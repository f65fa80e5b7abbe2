// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/tool/inner_samples.hpp"
#include "controller/tool/mesh_surface.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/tool_meshes.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "tests/scene/support.hpp"
#include "tests/tool/stl_support.hpp"

using namespace kerf;
using extremes::fluted_bur;
using extremes::mesh_of_units;
using extremes::prism;

namespace {

using Triangles = std::vector<LooseTriangle>;

Triangles moved(Triangles triangles, float x, float y, float z) {
  for (LooseTriangle& t : triangles) {
    for (auto& corner : t) corner = {corner[0] + x, corner[1] + y, corner[2] + z};
  }
  return triangles;
}

Triangles both(Triangles a, const Triangles& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Whose sides lie in the planes x, z = +-half.
Triangles upright_bar(double half, double length) {
  return extremes::loft({-length / 2, length / 2}, 4, [&](double y, double angle) {
    const double diagonal = angle + std::numbers::pi / 4;
    return extremes::Point{half * std::round(std::sqrt(2) * std::cos(diagonal)), y,
                           half * std::round(std::sqrt(2) * std::sin(diagonal))};
  });
}

}  // namespace

TEST_CASE("the samples of a mesh are those of the same body as a shape") {
  // A corner of the sides is on each sample of the rim.
  const SceneTool lathe =
      make_tool("t", "cylinder", {.pitch_mm = 1, .radius_mm = 5.3, .length_mm = 16});
  const SceneTool mesh = mesh_of_units("t", prism(5.3, 16, 400));
  // The last layers are half a pitch from the rims: what is added there goes by places on them.
  const auto between = [](const SceneTool& tool) {
    std::vector<ToolOffset> offsets;
    std::ranges::copy_if(tool.offsets, std::back_inserter(offsets),
                         [](const ToolOffset& o) { return std::abs(o[1]) < 15; });
    return offsets;
  };
  CHECK(between(mesh) == between(lathe));
  CHECK(mesh.offsets.size() - lathe.offsets.size() <= 16);
  CHECK(mesh.size_vox == lathe.size_vox);
  CHECK(mesh.radius_mm == doctest::Approx(5.3));
  CHECK(mesh.length_mm == 16);
  CHECK_FALSE(mesh.round);
}

TEST_CASE("faces through samples keep them on all sides") {
  const SceneTool bar = mesh_of_units("t", upright_bar(4, 10));
  CHECK(bar.offsets.size() == 9 * 9 * 10);
  CHECK(bar.size_vox == std::array<std::int32_t, 3>{9, 10, 9});
}

TEST_CASE("bodies that overlap are one, and a body beside the axis stays there") {
  const SceneTool one = mesh_of_units("t", upright_bar(4.2, 10));
  const SceneTool twice = mesh_of_units("t", both(upright_bar(4.2, 10), upright_bar(3.3, 10)));
  CHECK(twice.offsets == one.offsets);
  const SceneTool beside = mesh_of_units("t", moved(upright_bar(2.2, 6), 5, 30, 0));
  CHECK(beside.offsets.size() == 5 * 5 * 6);
  for (const ToolOffset& offset : beside.offsets) CHECK(offset[0] >= 2 * 3);
}

TEST_CASE("a hollow body has no samples in its hollow") {
  Triangles hollow = upright_bar(2.3, 4);
  for (LooseTriangle& t : hollow) std::swap(t[0], t[1]);
  const SceneTool shell = mesh_of_units("t", both(upright_bar(5.2, 10), hollow));
  CHECK(shell.offsets.size() == 11 * 11 * 10 - 5 * 5 * 4);
}

TEST_CASE("samples fill the volume of a fluted bur, in any direction of its triangles") {
  const SceneTool bur = mesh_of_units("t", fluted_bur(40));
  double volume = 0;
  for (const auto& t : bur.mesh.triangles) {
    const auto [a, b, c] = bur.mesh.corners(t);
    volume += extremes::dot(a, extremes::cross(b, c)) / 6;
  }
  CHECK(static_cast<double>(bur.offsets.size()) ==
        doctest::Approx(volume).epsilon(0.03));  // edges of its blades too
  const std::set<ToolOffset> different(bur.offsets.begin(), bur.offsets.end());
  CHECK(different.size() == bur.offsets.size());
}

TEST_CASE("the surface of a mesh has even samples, rows of them along its rims") {
  const SceneTool bar = mesh_of_units("t", prism(6, 16, 4));
  const auto samples = surface_samples(bar, 1);
  CHECK(samples.size() == doctest::Approx(surface_mm2(bar.mesh)).epsilon(0.01));
  std::vector<double> nearest(samples.size(), 1e9);
  double away = 0;
  int at_corners = 0, at_rims = 0;
  const double half = 6 / std::sqrt(2.0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // Turned, so that the sides are at +-half.
    const auto& [x, y, z] = samples[i];
    const double u = std::abs(x + z) / std::sqrt(2.0), v = std::abs(x - z) / std::sqrt(2.0);
    const double from[3] = {half - u, half - v, 8 - std::abs(y)};
    away = std::max(away, std::abs(*std::min_element(from, from + 3)));
    const auto near = std::count_if(from, from + 3, [](double d) { return d < 0.1; });
    if (near == 3) ++at_corners;
    if (near >= 2) ++at_rims;
    for (std::size_t j = 0; j < samples.size(); ++j) {
      if (i == j) continue;
      nearest[i] = std::min(nearest[i], vec3::length(vec3::operator-(samples[i], samples[j])));
    }
  }
  CHECK(away < 0.05);
  CHECK(at_corners == 8);
  CHECK(at_rims == 8 + 8 * 7 + 4 * 15);  // edges of 8.49 and of 16
  const auto [least, most] = std::minmax_element(nearest.begin(), nearest.end());
  CHECK(*least > 0.5);
  CHECK(*most < 1.25);
}

TEST_CASE("a rim that bends has a sample in each corner") {
  const SceneTool bur = mesh_of_units("t", fluted_bur(32));
  const auto close = close_samples(bur, 1);
  const auto far = [&](const ToolMesh::Point& corner) {
    double nearest = 1e9;
    for (const SurfaceSample& sample : close) {
      nearest = std::min(nearest, vec3::length(vec3::operator-(sample.at, corner)));
    }
    return nearest;
  };
  double top = -1e9, widest = 0;
  for (const auto& p : bur.mesh.points_mm) {
    top = std::max(top, p[1]);
    widest = std::max(widest, std::hypot(p[0], p[2]));
  }
  int corners = 0;
  double farthest = 0;
  for (const auto& p : bur.mesh.points_mm) {  // where the blades end
    if (p[1] < top - 1e-9 || std::hypot(p[0], p[2]) < widest - 1e-3) continue;
    ++corners;
    farthest = std::max(farthest, far(p));
  }
  CHECK(corners >= 6);
  CHECK(farthest < 0.03);
}

TEST_CASE("a thin blade has samples on both of its sides") {
  const auto blade = extremes::loft({-8, 8}, 4, [](double y, double angle) {
    return extremes::Point{8 * std::round(std::cos(angle)), y, 0.2 * std::round(std::sin(angle))};
  });
  const auto samples = surface_samples(mesh_of_units("t", blade), 1);
  // Beyond, one row serves both rims of the narrow end.
  const auto count = [&](double sign) {
    return std::count_if(samples.begin(), samples.end(),
                         [&](const auto& s) { return sign * s[2] > 0.02 && std::abs(s[1]) < 7; });
  };
  const auto front = count(1), back = count(-1);
  CHECK(front > 180);
  CHECK(back == doctest::Approx(double(front)).epsilon(0.05));
}

TEST_CASE("a small mesh gets more samples, and one of too many is refused") {
  CHECK(surface_samples(mesh_of_units("t", prism(1, 4, 12)), 1).size() ==
        doctest::Approx(kMinSurfaceSamples).epsilon(0.02));
  const SceneTool large = mesh_of_units("large", prism(25, 60, 24));
  CHECK_THROWS_AS(static_cast<void>(surface_samples(large, 1)), LoadError);
  // Nothing but rims.
  const SceneTool thread = mesh_of_units("thread", prism(5e-5, 60, 4));
  CHECK_THROWS_AS(static_cast<void>(surface_samples(thread, 1)), LoadError);
}

TEST_CASE("a scene loads a mesh from beside its file, and tells what is wrong with one") {
  const test::TempFolder folder;
  constexpr VoxelGrid kGrid{30, 30, 24};
  static_cast<void>(folder.write(
      "block.nrrd",
      test::nrrd(kGrid, {0.1, 0.1, 0.1}, test::block(kGrid, {{5, 5, 7}, {25, 25, 17}}, 1000))));
  static_cast<void>(folder.write("bur.stl", test::binary_stl(fluted_bur(1))));
  static_cast<void>(folder.write("open.stl", "solid\nendsolid\n"));
  const auto load = [&](const std::string& lines) {
    return load_scene(
        folder.write("scene.toml", "[[volume]]\nfile = \"block.nrrd\"\n[[tool]]\n" + lines));
  };
  const auto error = [&](const std::string& lines) {
    return test::error_of([&] { static_cast<void>(load(lines)); });
  };
  const std::string place = (folder.write("x", "").parent_path() / "scene.toml").string();
  const SceneTool tool = load("shape = \"stl\"\nfile = \"bur.stl\"\nscale = 2.0\n").tools[0];
  CHECK(tool.name == "bur");
  CHECK(tool.length_mm == doctest::Approx(2));
  CHECK(tool.radius_mm == doctest::Approx(0.4).epsilon(0.001));
  CHECK(tool.pitch_mm == doctest::Approx(0.1));
  CHECK(tool.offsets.size() > 100);

  CHECK(error("shape = \"stl\"\n") == place + ":3: tool has no file; write file = \"bur.stl\"");
  CHECK(error("shape = \"stl\"\nfile = \"no.stl\"\n").find("no.stl: no such STL file") !=
        std::string::npos);
  CHECK(error("shape = \"stl\"\nfile = \"open.stl\"\n").find("open.stl: no triangles") !=
        std::string::npos);
  CHECK(error("shape = \"stl\"\nfile = \"bur.stl\"\nradius_mm = 1.0\n") ==
        place +
            ":6: tool.radius_mm = 1 is given with a mesh, which has its own size; leave it "
            "out, or set scale (mm per unit of the file)");
  CHECK(error("shape = \"ball\"\nsize_vox = 4\nfile = \"bur.stl\"\n")
            .find("tool.file = \"bur.stl\" is of the shape stl") != std::string::npos);
  CHECK(error("shape = \"stl\"\nfile = \"bur.stl\"\nscale = 10\n")
            .find("tool.file = \"bur.stl\" makes a tool of 100 samples along a side") !=
        std::string::npos);
  CHECK(error("shape = \"stl\"\nfile = \"bur.stl\"\nscale = 0.01\n")
            .find("reaches less than half a voxel (0.05 mm) from its axis; use a larger scale") !=
        std::string::npos);
}

TEST_CASE("the project's fluted bur is the one that the code makes") {
  const auto file = read_stl(std::filesystem::path(KERF_SCENES_DIR) / "burs" / "fluted.stl");
  const Triangles made = fluted_bur(4);
  REQUIRE(file.size() == made.size());
  for (std::size_t t = 0; t < made.size(); ++t) {
    for (std::size_t k = 0; k < 9; ++k) {
      CHECK(std::abs(file[t][k / 3][k % 3] - made[t][k / 3][k % 3]) < 1e-5F);
    }
  }
}
