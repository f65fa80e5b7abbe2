// SPDX-License-Identifier: Apache-2.0
// Meshes that follow cuts, against meshes made afresh.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <utility>

#include <doctest/doctest.h>

#include "tests/visualizer/surface/mesh_checks.hpp"

namespace kerf::surface_update_test {

using namespace kerf::test;

namespace {

/// Applies `change(density, world mm)` to the voxels of a box and returns their bricks.
template <typename Change>
ChangedBricks edit(TestVolume& volume, VoxelIndex centre, int reach, const Change& change) {
  const VoxelGrid& grid = volume.view.bricks.grid;
  const VoxelBox box =
      VoxelBox{centre, {centre.x + 1, centre.y + 1, centre.z + 1}}.grown(reach).clipped(grid.box());
  for_each_voxel(box, [&](int x, int y, int z) {
    Density& density = volume.density[grid.index(x, y, z)];
    density = change(density, glm::dvec3(volume.view.world_from_voxel * glm::dvec4(x, y, z, 1)));
  });
  return changed_in(volume.view.bricks, box);
}

/// Removes a ball, antialiased over `ramp_mm`.
ChangedBricks cut(TestVolume& volume, glm::dvec3 centre_mm, double radius_mm, double ramp_mm) {
  const glm::dvec3 voxel(glm::inverse(volume.view.world_from_voxel) * glm::dvec4(centre_mm, 1));
  const double edge_mm = glm::length(glm::dvec3(volume.view.world_from_voxel[0]));
  const auto left =
      density_of([=](glm::dvec3 at) { return radius_mm - glm::length(at - centre_mm); }, ramp_mm);
  return edit(volume,
              {static_cast<int>(std::lround(voxel.x)), static_cast<int>(std::lround(voxel.y)),
               static_cast<int>(std::lround(voxel.z))},
              static_cast<int>((radius_mm + ramp_mm) / edge_mm) + 1,
              [&](Density before, glm::dvec3 at) {
                const double fraction = std::clamp(left(at), 0.0, 1.0);
                return std::min(before, static_cast<Density>(std::lround(fraction * kDensityMax)));
              });
}

glm::dvec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> part;
  return glm::normalize(glm::dvec3(part(random), part(random), part(random)));
}

/// Triangles of a mesh of `block` that another one of it does not have, with the same vertices, and
/// that are not among `told`.
int untold(const BlockMesh& mesh, const BlockMesh& other, VoxelIndex block,
           std::span<const FineTriangle> told) {
  const auto corners = [](const BlockMesh& of, const BlockTriangle& triangle) {
    return std::array{of.vertices[triangle[0]], of.vertices[triangle[1]], of.vertices[triangle[2]]};
  };
  const VoxelIndex start = block_start(block);
  return static_cast<int>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& triangle) {
        const auto seen = corners(mesh, triangle);
        const bool stays =
            std::any_of(other.triangles.begin(), other.triangles.end(),
                        [&](const auto& one) { return corners(other, one) == seen; });
        const FineTriangle place{fine_place(seen[0], start), fine_place(seen[1], start),
                                 fine_place(seen[2], start)};
        return !stays && std::find(told.begin(), told.end(), place) == told.end();
      }));
}

}  // namespace

// A ball of radius R cut by balls whose centres are so far out (c^2 >= R^2 + r^2) that no ray from
// its middle leaves a cut below R: what is left has one surface without a handle. The torus in the
// same way. The cuts are so shallow that no ridge between them is thinner than a voxel.
TEST_CASE(
    "after 100 cuts ball and torus are closed, keep their Euler number, and equal a mesh "
    "made afresh") {
  const VoxelGrid grid{72, 72, 48};
  constexpr double kEdge = 0.25;
  constexpr double kRamp = 0.75;
  struct Body {
    Shape shape;
    double radius;  ///< of the ball, of the torus's tube
    double ring;    ///< 0 for the ball
    long euler;
  };
  for (const Body& body :
       {Body{ball_shape({}, 5.0), 5.0, 0.0, 2}, Body{torus_shape(5.0, 2.5), 2.5, 5.0, 0}}) {
    TestVolume volume(grid, centred(grid, glm::dvec3(kEdge)), density_of(body.shape, kRamp));
    VolumeSurface surface = surface_of(volume);
    const double before_mm3 = measure(closed(surface, volume)).volume_mm3;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> angle(0.0, 2.0 * std::numbers::pi);
    std::uniform_real_distribution<double> radius(0.3, 0.6);  // of the body's
    for (int i = 0; i < 100; ++i) {
      const double r = radius(random) * body.radius;
      const double away = body.radius + 0.7 * r;
      glm::dvec3 centre = away * random_direction(random);
      if (body.ring > 0.0) {
        const double around = angle(random);
        const double across = angle(random);
        const glm::dvec3 out(std::cos(around), std::sin(around), 0.0);
        centre = out * (body.ring + away * std::cos(across)) +
                 glm::dvec3(0.0, 0.0, away * std::sin(across));
      }
      surface.update(volume.density, cut(volume, centre, r, kRamp));
      if (i % 20 == 19) CHECK(surface.meshes() == surface_of(volume).meshes());
    }
    const ClosedMesh mesh = closed(surface, volume);
    CHECK(open_sides(mesh.triangles) == 0);
    CHECK(euler_number(mesh) == body.euler);
    CHECK(measure(mesh).volume_mm3 < 0.96 * before_mm3);
  }
}

#ifdef KERF_FEWER_CASES
constexpr int kRoughEdits = 15;
#else
constexpr int kRoughEdits = 60;
#endif

TEST_CASE("after rough edits an update equals a fresh mesh, coloured by labels or by density") {
  const VoxelGrid grid{43, 37, 50};
  const std::vector<MaterialView> materials{
      {"none", 0.0, {0, 0, 0}}, {"enamel", 0.6, {0.9, 0.9, 0.8}}, {"dentin", 0.4, {0.7, 0.6, 0.4}}};
  for (const bool has_labels : {true, false}) {
    CAPTURE(has_labels);
    // Unequal voxel edges, and density that grows inwards.
    TestVolume volume(grid, centred(grid, {0.2, 0.25, 0.15}), ball({}, 3.2, 3.0));
    std::vector<Label> labels;
    for (std::size_t i = 0; has_labels && i < volume.density.size(); ++i) {
      labels.push_back(static_cast<Label>(i / 50 % 3));
    }
    VolumeSurface surface(volume.view, materials, volume.density, labels);
    std::mt19937 random(11);
    const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
    int wrong = 0;
    int told_wrong = 0;
    int triangles_untold = 0;
    std::size_t triangles_told = 0;
    for (int i = 0; i < kRoughEdits; ++i) {
      const int value = i % 3 == 0 ? 65535 : i % 3 == 1 ? 0 : -1;  // regrows, cuts, noise
      const auto changed = edit(volume, {pick(grid.nx), pick(grid.ny), pick(grid.nz)}, pick(6),
                                [&](Density, glm::dvec3) {
                                  return static_cast<Density>(value < 0 ? pick(65536) : value);
                                });
      const std::vector<BlockMesh> before = surface.meshes();
      const auto told = surface.update(volume.density, changed);
      const VolumeSurface fresh(volume.view, materials, volume.density, labels);
      wrong += surface.meshes() == fresh.meshes() ? 0 : 1;
      // What it tells to be another mesh now is all of that and nothing else.
      std::vector<std::uint32_t> really;
      for (std::uint32_t id = 0; id < before.size(); ++id) {
        if (before[id] == surface.meshes()[id]) continue;
        really.push_back(id);
        for (const auto& [one, other] : {std::pair(&before[id], &surface.meshes()[id]),
                                         std::pair(&surface.meshes()[id], &before[id])}) {
          triangles_untold += untold(*one, *other, surface.block(id), surface.changed_triangles());
        }
      }
      triangles_told = std::max(triangles_told, surface.changed_triangles().size());
      told_wrong += std::equal(told.begin(), told.end(), really.begin(), really.end()) ? 0 : 1;
    }
    CHECK(wrong == 0);
    CHECK(told_wrong == 0);
    CHECK(triangles_untold == 0);
    CHECK(triangles_told > 0);
  }
}

}  // namespace kerf::surface_update_test
