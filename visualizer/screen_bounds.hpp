// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "visualizer/camera.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/pixel_rect.hpp"
#include "visualizer/scene_view.hpp"

namespace kerf {

/// Pixels of a picture that what lies within the hull of `corners` can cover; all of them where a
/// corner is not in front of the near plane.
[[nodiscard]] PixelRect screen_bounds(std::span<const glm::dvec3> corners, const View& view,
                                      PictureSize size);

/// How far from a voxel, in voxel edges, its density can change a pixel: the shading of a surface
/// looks that far along its normal for what darkens it (`openness_at` in the shaders), and one more
/// voxel for the interpolation.
inline constexpr double kShadingReachVox = 13.0;

/// Pixels that may change when the densities of bricks `changed` do.
[[nodiscard]] PixelRect brick_bounds(const VolumeView& volume,
                                     std::span<const std::uint32_t> changed, const View& view,
                                     PictureSize size);

}  // namespace kerf
