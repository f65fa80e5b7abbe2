// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <random>
#include <vector>

#include "visualizer/render/iso_renderer.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf::test {

/// True where an OpenGL 4.5 context is current, made at the first call; else says what is skipped.
[[nodiscard]] bool have_gl();

/// A volume with its densities, filled from a function of the voxel's world position (0..1).
struct TestVolume {
  VolumeView view;
  std::vector<Density> density;

  TestVolume(VoxelGrid grid, const glm::dmat4& world_from_voxel,
             const std::function<double(glm::dvec3)>& density_at_mm);
  [[nodiscard]] VolumeContent content() const { return {density, {}}; }
};

/// Density of a ball whose border goes from 1 to 0 over `ramp_mm`, with 1/2 at the radius.
[[nodiscard]] std::function<double(glm::dvec3)> ball(glm::dvec3 centre_mm, double radius_mm,
                                                     double ramp_mm);

/// Voxels of `spacing_mm` with the middle of the grid at `centre_mm`.
[[nodiscard]] glm::dmat4 centred(VoxelGrid grid, glm::dvec3 spacing_mm, glm::dvec3 centre_mm = {});

/// The paper's equation (1): window depth, 0 at the near and 1 at the far plane, of a point
/// `eye_mm` away along the view axis. Every renderer writes this, so that volumes, meshes and the
/// tool hide one another as they should.
[[nodiscard]] constexpr double window_depth(double eye_mm, double near_mm, double far_mm) noexcept {
  const double f = far_mm;
  const double n = near_mm;
  return ((f + n) / (f - n) - 2.0 * f * n / ((f - n) * eye_mm) + 1.0) / 2.0;
}

/// Distance along the view axis; the inverse of equation (1).
[[nodiscard]] double eye_distance_mm(double window_depth, const View& view);

/// Camera at `eye_mm` that looks at `at_mm`.
[[nodiscard]] View look_at(glm::dvec3 eye_mm, glm::dvec3 at_mm, double near_mm, double far_mm);

/// A point of the picture: pixel centre (x, y), first row at the top, as a ray in world mm whose
/// parameter is the distance along the view axis.
struct PixelRay {
  glm::dvec3 origin_mm;
  glm::dvec3 direction;
};
[[nodiscard]] PixelRay pixel_ray(const View& view, PictureSize size, int x, int y);

/// A change of every voxel in a box.
[[nodiscard]] ChangedBricks changed_in(const BrickGrid& grid, const VoxelBox& box);

/// Sets a small box of voxels anywhere in the volume to `density`; returns the box.
VoxelBox fill_random_box(TestVolume& volume, Density density, std::mt19937& random);

struct Drawn {
  std::vector<std::uint8_t> rgb;
  std::vector<float> depth;
};
/// Clears `target`, draws, reads back.
[[nodiscard]] Drawn draw(Renderer& renderer, const View& view, const RenderTarget& target);

}  // namespace kerf::test
