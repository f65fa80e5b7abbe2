// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "visualizer/view/camera.hpp"
#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// Pixels of a picture that what lies within the hull of `corners` can cover; all of them where a
/// corner is not in front of the near plane.
[[nodiscard]] PixelRect screen_bounds(std::span<const glm::dvec3> corners, const View& view,
                                      PictureSize size);

}  // namespace kerf
