// SPDX-License-Identifier: Apache-2.0
// Which triangles of a block are drawn through parts of the picture; ranges of a buffer.
#include "visualizer/surface/surface_on_gpu.hpp"

#include <algorithm>
#include <array>
#include <random>

#include <doctest/doctest.h>

#include "tests/visualizer/surface/mesh_checks.hpp"

namespace kerf::surface_on_gpu_test {

using namespace kerf::test;

TEST_CASE("of a block those triangles are picked that touch a part of the picture, and no others") {
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 4.0, 0.5));
  const VolumeSurface surface = surface_of(volume);
  const View view = look_at({7, 9, 12}, {}, 1, 40);
  const glm::dmat4 clip_from_voxel =
      view.clip_from_eye() * view.eye_from_world * volume.view.world_from_voxel;
  const std::vector<FrustumCulling::Part> parts{{{-0.1, -0.2}, {0.05, -0.05}},
                                                {{0.1, 0.0}, {0.2, 0.25}}};
  const FrustumCulling culling(clip_from_voxel, std::nullopt, parts);
  int missed = 0, picked_for_nothing = 0;
  std::size_t picked = 0;
  for (std::uint32_t id = 0; id < surface.meshes().size(); ++id) {
    const BlockMesh& mesh = surface.meshes()[id];
    const BlockBounds bounds = bounds_of(mesh, surface.block(id));
    std::vector<BlockTriangle> seen;
    if (culling.visible(bounds) != FrustumCulling::Visible::nothing) {
      culling.append_visible(mesh, bounds, surface.block(id), seen);
    }
    picked += seen.size();
    for (const BlockTriangle& triangle : mesh.triangles) {
      glm::dvec2 corner[3];
      for (std::size_t i = 0; i < 3; ++i) {
        const FinePoint at = fine_place(mesh.vertices[triangle[i]], block_start(surface.block(id)));
        const glm::dvec4 clip =
            clip_from_voxel * glm::dvec4(glm::dvec3(at) / double{kFinePerVoxel}, 1.0);
        corner[i] = glm::dvec2(clip) / clip.w;
      }
      const glm::dvec2 low = glm::min(corner[0], glm::min(corner[1], corner[2]));
      const glm::dvec2 high = glm::max(corner[0], glm::max(corner[1], corner[2]));
      const glm::dvec2 middle = (corner[0] + corner[1] + corner[2]) / 3.0;
      const auto within = [&](const glm::dvec2& at) {
        return std::any_of(parts.begin(), parts.end(), [&](const FrustumCulling::Part& part) {
          return part.lo.x < at.x && at.x < part.hi.x && part.lo.y < at.y && at.y < part.hi.y;
        });
      };
      const bool touches =
          within(middle) || std::any_of(std::begin(corner), std::end(corner), within);
      constexpr double kSpare = 0.01;  // far less than a voxel is high here
      const bool far_off =
          std::all_of(parts.begin(), parts.end(), [&](const FrustumCulling::Part& part) {
            return glm::any(glm::lessThan(high, part.lo - kSpare)) ||
                   glm::any(glm::greaterThan(low, part.hi + kSpare));
          });
      const bool is_picked = std::find(seen.begin(), seen.end(), triangle) != seen.end();
      missed += touches && !is_picked ? 1 : 0;
      picked_for_nothing += far_off && is_picked ? 1 : 0;
    }
  }
  CHECK(picked > 100);
  CHECK(missed == 0);
  CHECK(picked_for_nothing == 0);
}

TEST_CASE("ranges hold what they were asked for, never overlap, and are used again") {
  RangePool pool;
  std::array<RangePool::Range, 40> ranges{};
  std::array<std::uint32_t, 40> counts{};
  std::mt19937 random(2);
  int wrong = 0;
  std::uint32_t size_half_way = 0;
  for (int step = 0; step < 4000; ++step) {
    const std::size_t i = random() % ranges.size();
    counts[i] = static_cast<std::uint32_t>(random() % 4 == 0 ? 0 : random() % 1900);
    ranges[i] = pool.fit(ranges[i], counts[i]);
    for (std::size_t j = 0; j < ranges.size(); ++j) {
      const RangePool::Range& a = ranges[i];
      const RangePool::Range& b = ranges[j];
      wrong += b.capacity < counts[j] || b.first + b.capacity > pool.size() ? 1 : 0;
      wrong += i != j && a.first < b.first + b.capacity && b.first < a.first + a.capacity ? 1 : 0;
    }
    if (step == 2000) size_half_way = pool.size();
  }
  CHECK(wrong == 0);
  CHECK(pool.size() < 1.2 * size_half_way);  // what comes and goes takes no new room
}

}  // namespace kerf::surface_on_gpu_test
