// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/gl/gl_fixture.hpp"

#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/gl/context.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::test {

bool have_gl() {
  static const std::unique_ptr<GlContext> context = []() -> std::unique_ptr<GlContext> {
    try {
      return make_headless_context();
    } catch (const VisualizerError&) {
      return nullptr;
    }
  }();
  if (context == nullptr) MESSAGE("skipped: there is no OpenGL 4.5 context here");
  return context != nullptr;
}

TestVolume::TestVolume(VoxelGrid grid, const glm::dmat4& world_from_voxel,
                       const std::function<double(glm::dvec3)>& density_at_mm) {
  view.name = "test";
  view.bricks = BrickGrid::of(grid);
  view.world_from_voxel = world_from_voxel;
  density.reserve(grid.voxel_count());
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    const glm::dvec3 at(world_from_voxel * glm::dvec4(x, y, z, 1));
    const double fraction = std::clamp(density_at_mm(at), 0.0, 1.0);
    density.push_back(static_cast<Density>(std::lround(fraction * kDensityMax)));
  });
}

std::function<double(glm::dvec3)> ball(glm::dvec3 centre_mm, double radius_mm, double ramp_mm) {
  return [=](glm::dvec3 at) { return 0.5 + (radius_mm - glm::length(at - centre_mm)) / ramp_mm; };
}

glm::dmat4 centred(VoxelGrid grid, glm::dvec3 spacing_mm, glm::dvec3 centre_mm) {
  const glm::dvec3 middle = 0.5 * glm::dvec3(grid.nx - 1, grid.ny - 1, grid.nz - 1);
  return glm::translate(glm::scale(glm::translate(glm::dmat4(1.0), centre_mm), spacing_mm),
                        -middle);
}

ChangedBricks changed_in(const BrickGrid& grid, const VoxelBox& box) {
  ChangedBricks changed;
  for (std::uint32_t id = 0; id < grid.count(); ++id) {
    ChangedBrick brick{id};
    const VoxelBox all = grid.voxels(id), part = all.clipped(box);
    if (part.empty()) continue;
    for_each_voxel(part, [&](int x, int y, int z) {
      brick.voxels[static_cast<std::size_t>(z - all.lo.z)] |=
          std::uint64_t{1} << (kBrickEdge * (y - all.lo.y) + x - all.lo.x);
    });
    changed.add(brick);
  }
  return changed;
}

VoxelBox fill_random_box(TestVolume& volume, Density density, std::mt19937& random) {
  const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  const VoxelGrid& grid = volume.view.bricks.grid;
  const VoxelIndex at{pick(grid.nx), pick(grid.ny), pick(grid.nz)};
  const VoxelBox box =
      VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}}.grown(2 + pick(6)).clipped(grid.box());
  for (int z = box.lo.z; z < box.hi.z; ++z) {
    for (int y = box.lo.y; y < box.hi.y; ++y) {
      std::fill_n(&volume.density[grid.index(box.lo.x, y, z)], box.extent().x, density);
    }
  }
  return box;
}

double eye_distance_mm(double window_depth, const View& view) {
  const double f = view.far_mm;
  const double n = view.near_mm;
  return 2.0 * f * n / (f + n - (2.0 * window_depth - 1.0) * (f - n));
}

View look_at(glm::dvec3 eye_mm, glm::dvec3 at_mm, double near_mm, double far_mm) {
  View view;
  view.eye_from_world = glm::lookAt(eye_mm, at_mm, glm::dvec3(0, 1, 0));
  view.near_mm = near_mm;
  view.far_mm = far_mm;
  return view;
}

PixelRay pixel_ray(const View& view, PictureSize size, int x, int y) {
  const double right =
      ((x + 0.5) / size.width * 2.0 - 1.0) * view.tan_half_height * view.aspect + view.middle_right;
  const double up = (1.0 - (y + 0.5) / size.height * 2.0) * view.tan_half_height;
  const glm::dmat4 world_from_eye = glm::inverse(view.eye_from_world);
  return {glm::dvec3(world_from_eye[3]), glm::dmat3(world_from_eye) * glm::dvec3(right, up, -1.0)};
}

Drawn draw(Renderer& renderer, const View& view, const RenderTarget& target) {
  target.bind();
  glClearColor(0.0F, 0.0F, 0.0F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  renderer.draw(view, target);
  return {target.read_rgb(), target.read_depth()};
}

}  // namespace kerf::test
