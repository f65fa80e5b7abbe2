// SPDX-License-Identifier: Apache-2.0
// Which rays a change in a volume can reach, without any GL.
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/cast/cast_volume.hpp"
#include "visualizer/redraw/redraw_tiles.hpp"
#include "visualizer/surface/vertex_shading.hpp"

namespace kerf::changed_cells_test {

using namespace kerf::test;

namespace {

constexpr PictureSize kSize{61, 47};  // no multiple of a packet
constexpr VoxelGrid kGrid{40, 36, 32};
constexpr RayFootprint kReach{.along = {3, 3, 3}, .at_end = {5, 5, 5}};

/// A ball whose surface looks into a hollow, seen by an eye 60 voxel edges, here mm, away.
struct LoadedScene {
  std::vector<Density> density;
  std::vector<double> ends_mm;
  std::vector<float> depth;
  std::optional<GradientRows> gradient;
  View view = look_at({50, 38, 40}, {20, 18, 16}, 20, 90);

  LoadedScene() {
    for_each_voxel(kGrid.box(), [&](int x, int y, int z) {
      const double outside = glm::length(glm::dvec3(x - 20, y - 18, z - 16)) - 12.0;
      const double hollow = 7.0 - glm::length(glm::dvec3(x - 27, y - 23, z - 22));
      const double fraction = std::clamp(0.5 - 0.5 * std::max(outside, hollow), 0.0, 1.0);
      density.push_back(static_cast<Density>(fraction * kDensityMax));
    });
    gradient.emplace(GradientPlan(kDefaultGradient), kGrid, density);
    view.aspect = static_cast<double>(kSize.width) / kSize.height;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        ends_mm.push_back(end_mm(ray(x, y)));
        depth.push_back(
            static_cast<float>(window_depth(ends_mm.back(), view.near_mm, view.far_mm)));
      }
    }
  }
  /// Row 0 is the lowest.
  [[nodiscard]] PixelRay ray(int x, int y) const {
    return pixel_ray(view, kSize, x, kSize.height - 1 - y);
  }
  [[nodiscard]] double end_mm(const PixelRay& ray) const {
    for (double t = view.near_mm; t < view.far_mm; t += 0.05) {
      const glm::ivec3 at(glm::round(ray.origin_mm + t * ray.direction));
      if (kGrid.contains({at.x, at.y, at.z}) && density[kGrid.index(at.x, at.y, at.z)] > 30'000) {
        return t;
      }
    }
    return view.far_mm;
  }
};

RedrawJob job_of(const LoadedScene& scene, const ChangedCells& cells) {
  const glm::dmat4 eye_from_cell = glm::translate(scene.view.eye_from_world, cells.low());
  const glm::dmat4 cell_from_eye = glm::inverse(eye_from_cell);
  RedrawJob job;
  job.eye = cast_eye(scene.view, kSize.width, kSize.height);
  put(job.origin, glm::dvec3(cell_from_eye[3]));
  put(job.from_eye, glm::dmat3(cell_from_eye));
  cells.put(job);
  job.depth = scene.depth.data();
  job.window = {0, 0, kSize.width, kSize.height};
  job.gradient = scene.gradient->view();
  put(job.border, -1.0 - cells.low());
  const glm::dvec3 half = 0.5 * (cells.high() - cells.low());
  put(job.centre_mm, glm::dvec3(eye_from_cell * glm::dvec4(half, 1.0)));
  for (int axis = 0; axis < 3; ++axis) {
    put(job.half_mm[axis], half[axis] * glm::dvec3(eye_from_cell[axis]));
  }
  put(job.square_edges, glm::dvec3(1.0));
  put(job.tap_reach, VertexShading::tap_reach_vox(glm::dvec3(1.0)));
  job.least_slope = 0.15F;
  return job;
}

VoxelBox random_box(std::mt19937& random) {
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  const VoxelIndex lo{10 + below(20), 8 + below(20), 6 + below(20)};
  return {lo, {lo.x + 1 + below(3), lo.y + 1 + below(3), lo.z + 1 + below(3)}};
}

/// Whether a place lies less than `reach` edges from a voxel of the box, on each axis.
bool is_near(const VoxelBox& box, const glm::dvec3& at, double reach) {
  return at.x > box.lo.x - reach && at.x < box.hi.x - 1 + reach &&  //
         at.y > box.lo.y - reach && at.y < box.hi.y - 1 + reach &&  //
         at.z > box.lo.z - reach && at.z < box.hi.z - 1 + reach;
}

}  // namespace

TEST_CASE("a ray that passes a changed voxel before it ends is found, one far off is not") {
  const LoadedScene scene;
  std::mt19937 random(1);
  int met = 0, passed_by = 0;
  for (int round = 0; round < 20; ++round) {
    const std::vector<VoxelBox> boxes{random_box(random), random_box(random)};
    const ChangedCells cells(boxes, kReach);
    const RedrawJob job = job_of(scene, cells);
    for (int i = 0; i < 500; ++i) {
      const int x = static_cast<int>(random() % kSize.width);
      const int y = static_cast<int>(random() % kSize.height);
      const PixelRay ray = scene.ray(x, y);
      const double end_mm = scene.ends_mm[static_cast<std::size_t>(y * kSize.width + x)];
      const auto passes = [&](double reach, double until_mm) {
        for (double t = scene.view.near_mm; t <= until_mm; t += 0.05) {
          for (const VoxelBox& box : boxes) {
            if (is_near(box, ray.origin_mm + t * ray.direction, reach)) return true;
          }
        }
        return false;
      };
      const bool meets = cast_kernels()[0]->rays_touch(job, {x, y, x + 1, y + 1});
      if (passes(1.0, end_mm)) {
        ++met;
        CHECK(meets);
      } else if (!passes(2.6, end_mm + 3.0)) {
        ++passed_by;
        CHECK_FALSE(meets);
      }
    }
  }
  CHECK(met > 50);
  CHECK(passed_by > 1000);
}

TEST_CASE("every instruction set finds the rays that one at a time finds") {
  const LoadedScene scene;
  std::mt19937 random(2);
  int met = 0, felt = 0;
  for (int round = 0; round < 20; ++round) {
    const std::vector<VoxelBox> boxes{random_box(random), random_box(random)};
    const ChangedCells cells(boxes, kReach);
    const RedrawJob job = job_of(scene, cells);
    for (int y = 0; y < kSize.height; y += 4) {
      for (int x = 0; x < kSize.width; x += 4) {
        const PixelRect tile =
            PixelRect{x, y, x + 4, y + 4}.clipped({0, 0, kSize.width, kSize.height});
        const bool meets = kCastScalar.rays_touch(job, tile);
        const bool feels = kCastScalar.shading_touches(job, tile);
        met += meets ? 1 : 0;
        felt += feels && !meets ? 1 : 0;
        for (const CastKernels* const* set = cast_kernels(); *set != nullptr; ++set) {
          CAPTURE((*set)->name);
          CHECK((*set)->rays_touch(job, tile) == meets);
          CHECK((*set)->shading_touches(job, tile) == feels);
        }
      }
    }
  }
  CHECK(met > 100);
  CHECK(felt > 10);
}

}  // namespace kerf::changed_cells_test
