// SPDX-License-Identifier: Apache-2.0
// Marching cubes against balls and tori, whose shape is known, and against noise.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <tuple>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/surface/mesh_checks.hpp"
#include "visualizer/surface/block_mesh.hpp"

namespace kerf::surface_mesh_test {

using namespace kerf::test;

namespace {

/// Random densities; about half of the voxels are solid, so all cases of a cube occur.
TestVolume noise(VoxelGrid grid, unsigned seed) {
  std::mt19937 random(seed);
  return TestVolume(grid, glm::dmat4(1.0),
                    [&](glm::dvec3) { return std::uniform_real_distribution<>(0, 1)(random); });
}

/// How much smaller an error gets when the voxels have half the edge: log2 of the ratio.
double order(double coarse, double fine) {
  return std::log2(coarse / fine);
}

}  // namespace

TEST_CASE("a cube with one solid corner has one triangle, seen from outside") {
  REQUIRE(cube_triangles(1).size() == 1);
  CHECK(cube_triangles(1)[0] == CubeTriangle{0, 4, 8});  // on the x, y and z edge of corner 0
  CHECK(cube_triangles(0).empty());
  CHECK(cube_triangles(255).empty());
}

TEST_CASE("a surface through noise is closed: every case of a cube fits every neighbour") {
  std::vector<bool> seen(256);
  for (const unsigned seed : {1U, 2U, 3U}) {
    const TestVolume volume = noise({27, 19, 34}, seed);
    const VoxelGrid& grid = volume.view.bricks.grid;
    for (int z = 0; z + 1 < grid.nz; ++z) {
      for (int y = 0; y + 1 < grid.ny; ++y) {
        for (int x = 0; x + 1 < grid.nx; ++x) {
          unsigned corners = 0;
          for (int c = 0; c < 8; ++c) {
            const auto at = grid.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
            corners |= (volume.density[at] >= volume.view.iso ? 1U : 0U) << c;
          }
          seen[corners] = true;
        }
      }
    }
    const ClosedMesh mesh = closed(volume);
    CHECK(mesh.triangles.size() > 10'000);
    CHECK(open_sides(mesh.triangles) == 0);
  }
  CHECK(std::count(seen.begin(), seen.end(), true) == 256);
}

TEST_CASE("no two vertices meet, also where densities are exactly at iso") {
  TestVolume volume = noise({17, 18, 19}, 4);
  for (std::size_t i = 0; i < volume.density.size(); i += 3) volume.density[i] = volume.view.iso;
  for (std::size_t i = 1; i < volume.density.size(); i += 5) volume.density[i] = 65535;
  const ClosedMesh mesh = closed(volume);
  CHECK(open_sides(mesh.triangles) == 0);
  CHECK(measure(mesh).least_area_mm2 > 0.0);
  std::map<std::tuple<float, float, float>, int> places;
  for (const auto& vertex : mesh.vertices) {
    const glm::vec3& at = vertex.position_mm;
    ++places[{at.x, at.y, at.z}];
  }
  CHECK(places.size() == mesh.vertices.size());
}

TEST_CASE("blocks that meet have the same vertices on the face between them") {
  const VoxelGrid grid{40, 33, 29};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({0.3, 0.1, -0.2}, 3.1, 1.0));
  const VolumeSurface surface = surface_of(volume);
  std::map<std::tuple<int, int, int>, std::pair<SurfaceVertex, int>> found;
  int shared = 0;
  int different = 0;
  for (std::uint32_t id = 0; id < surface.meshes().size(); ++id) {
    for (SurfaceVertex vertex : surface.meshes()[id].vertices) {
      const FinePoint at = fine_place(vertex, block_start(surface.block(id)));
      vertex.position = {};
      const auto [first, fresh] = found.try_emplace({at.x, at.y, at.z}, vertex, 1);
      if (fresh) continue;
      ++shared;
      different += first->second.first == vertex ? 0 : 1;
    }
  }
  CHECK(shared > 500);
  CHECK(different == 0);
}

TEST_CASE("a ball: vertices, normals, area and volume converge with the second order") {
  struct Errors {  // root mean squares; what is missing
    double position_mm = 0.0, normal = 0.0, area = 0.0, volume = 0.0;
  };
  constexpr double kRadius = 4.0, kRampMm = 3.0;
  const glm::dvec3 centre{0.11, -0.07, 0.05};
  // Unequal edges and a turned volume: normals must follow.
  const glm::dmat4 turn = glm::rotate(glm::dmat4(1.0), 0.7, glm::normalize(glm::dvec3(1, 2, 3)));
  std::vector<Errors> all;
  for (const double edge_mm : {0.4, 0.2, 0.1}) {
    const auto side = [&](double stretch) {
      return static_cast<int>(std::lround(11.0 / (edge_mm * stretch)));
    };
    const VoxelGrid grid{side(1.0), side(1.25), side(0.8)};
    const glm::dmat4 pose = turn * centred(grid, edge_mm * glm::dvec3(1.0, 1.25, 0.8));
    const TestVolume volume(grid, pose, density_of(ball_shape(centre, kRadius), kRampMm));
    // The other gradients are wider than the ramp on the coarsest voxels.
    const ClosedMesh mesh =
        closed(VolumeSurface(volume.view, {}, volume.density, {}, GradientFilter::corners), volume);
    CHECK(open_sides(mesh.triangles) == 0);
    CHECK(euler_number(mesh) == 2);
    Errors errors;
    for (const auto& vertex : mesh.vertices) {
      const glm::dvec3 out = glm::dvec3(vertex.position_mm) - centre;
      const glm::dvec3 off = glm::normalize(out) - glm::dvec3(vertex.normal);
      errors.position_mm += std::pow(glm::length(out) - kRadius, 2);
      errors.normal += glm::dot(off, off);
    }
    const auto vertices = static_cast<double>(mesh.vertices.size());
    errors.position_mm = std::sqrt(errors.position_mm / vertices);
    errors.normal = std::sqrt(errors.normal / vertices);
    const Measures is = measure(mesh);
    errors.area = 4.0 * std::numbers::pi * kRadius * kRadius - is.area_mm2;
    errors.volume = 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius, 3) - is.volume_mm3;
    all.push_back(errors);
  }
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    CAPTURE(i);
    for (const auto part :
         {&Errors::position_mm, &Errors::normal, &Errors::area, &Errors::volume}) {
      const double reached = order(all[i].*part, all[i + 1].*part);
      const bool is_rounded = i == 1 && part == &Errors::normal;
      if (!is_rounded) CHECK(reached > 1.8);
      CHECK(reached < 2.2);
    }
  }
  // Stored gradients have steps of 1/32767; one is the rise of the density over two edges.
  const double rounding = std::sqrt(2.0 / 12.0) / 32767.0 / (2.0 * 0.08 / kRampMm);
  CHECK(all[2].normal < std::hypot(all[1].normal / std::exp2(1.8), rounding));
  CHECK(all.back().position_mm < 0.005 * 0.1);  // of a voxel
}

TEST_CASE("a torus has no Euler number, and area and volume by Pappus") {
  constexpr double kRing = 4.0;
  constexpr double kTube = 1.5;
  std::vector<Measures> missing;
  for (const double edge_mm : {0.25, 0.125}) {
    const int side = static_cast<int>(std::lround(14.0 / edge_mm));
    const VoxelGrid grid{side, side, side / 2};
    const TestVolume volume(grid, centred(grid, glm::dvec3(edge_mm), {0.03, 0.05, 0.02}),
                            density_of(torus_shape(kRing, kTube), 1.5));
    const ClosedMesh mesh = closed(volume);
    CHECK(open_sides(mesh.triangles) == 0);
    CHECK(euler_number(mesh) == 0);
    const Measures is = measure(mesh);
    const double around = 2.0 * std::numbers::pi * kRing;
    missing.push_back({around * 2.0 * std::numbers::pi * kTube - is.area_mm2,
                       around * std::numbers::pi * kTube * kTube - is.volume_mm3});
  }
  CHECK(order(missing[0].area_mm2, missing[1].area_mm2) == doctest::Approx(2.0).epsilon(0.1));
  CHECK(order(missing[0].volume_mm3, missing[1].volume_mm3) == doctest::Approx(2.0).epsilon(0.1));
}

TEST_CASE("empty, full and single-voxel volumes") {
  const auto filled = [](VoxelGrid grid, double fraction) {
    return TestVolume(grid, glm::dmat4(1.0), [=](glm::dvec3) { return fraction; });
  };
  CHECK(closed(filled({20, 9, 8}, 0.0)).triangles.empty());
  // Full up to its border: a box that ends half a voxel beyond the last centres.
  const ClosedMesh box = closed(filled({20, 9, 8}, 1.0));
  CHECK(open_sides(box.triangles) == 0);
  CHECK(euler_number(box) == 2);
  CHECK(measure(box).volume_mm3 > 0.9 * 20 * 9 * 8);
  CHECK(measure(box).volume_mm3 < 20 * 9 * 8);
  // One voxel: an octahedron.
  const ClosedMesh one = closed(filled({1, 1, 1}, 1.0));
  CHECK(one.vertices.size() == 6);
  CHECK(one.triangles.size() == 8);
  CHECK(open_sides(one.triangles) == 0);
  for (const auto& vertex : one.vertices) {
    CHECK(glm::dot(vertex.normal, glm::normalize(vertex.position_mm)) ==
          doctest::Approx(1.0).epsilon(1e-4));
  }
  CHECK(measure(one).volume_mm3 == doctest::Approx(4.0 / 3.0 / 8.0).epsilon(0.01));
}

TEST_CASE("iso at both ends of its range") {
  TestVolume volume = noise({12, 13, 14}, 9);
  for (std::size_t i = 0; i < volume.density.size(); i += 2) {
    volume.density[i] = i % 4 == 0 ? 65535 : 0;
  }
  for (const Density iso : {Density{1}, Density{65535}}) {
    CAPTURE(iso);
    volume.view.iso = iso;
    const ClosedMesh mesh = closed(volume);
    CHECK_FALSE(mesh.triangles.empty());
    CHECK(open_sides(mesh.triangles) == 0);
    bool finite = true;
    for (const auto& vertex : mesh.vertices) {
      finite = finite && std::abs(glm::length(vertex.normal) - 1.0F) < 1e-3F;
    }
    CHECK(finite);
  }
}

TEST_CASE("a vertex has the colour of the label below it, and is darker in a cavity") {
  const VoxelGrid grid{48, 48, 48};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.125)), [](glm::dvec3 at) {
    // A ball with a well from above, which two of the samples of ambient occlusion cross.
    const double well = 0.3 - std::hypot(at.x, at.z);
    return std::min(ball({}, 2.25, 0.25)(at), at.y > 0.0 ? 0.5 - well / 0.25 : 1.0);
  });
  std::vector<Label> labels;
  for (std::size_t i = 0; i < volume.density.size(); ++i) {
    labels.push_back(i / (48 * 48) < 24 ? 1 : 2);  // by z
  }
  const std::vector<MaterialView> materials{
      {"none", 0.0, {0, 0, 0}}, {"red", 0.8, {1, 0, 0}}, {"green", 0.4, {0, 1, 0}}};
  const VolumeSurface surface(volume.view, materials, volume.density, labels);
  double open = 0.0;
  double deep = 1.0;
  for (std::uint32_t id = 0; id < surface.meshes().size(); ++id) {
    for (const SurfaceVertex& vertex : surface.meshes()[id].vertices) {
      const glm::dvec3 at(
          volume.view.world_from_voxel *
          glm::dvec4(glm::dvec3(fine_place(vertex, block_start(surface.block(id)))) /
                         double{kFinePerVoxel},
                     1));
      if (at.z < -0.375) CHECK(vertex.colour == std::array<std::uint16_t, 3>{65535, 0, 0});
      if (at.z > 0.375) CHECK(vertex.colour == std::array<std::uint16_t, 3>{0, 65535, 0});
      if (at.y < -2.0) open = std::max(open, vertex.ao_factor / 65535.0);
      if (std::hypot(at.x, at.z) < 0.35 && std::abs(at.y - 0.5) < 0.25) {
        deep = std::min(deep, vertex.ao_factor / 65535.0);
      }
    }
  }
  CHECK(open == 1.0);
  CHECK(deep < 0.5);
}

}  // namespace kerf::surface_mesh_test
