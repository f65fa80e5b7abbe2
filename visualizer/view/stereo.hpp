// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "visualizer/view/camera.hpp"

namespace kerf {

/// Two eyes before one window: parallel view axes and asymmetric frusta whose middles meet at the
/// convergence distance. Eyes that toe in would shift things up and down against each other in the
/// corners, which hurts (P. Bourke, "Calculating stereo pairs", 1999; A. Woods, T. Docherty and
/// R. Koch, "Image distortions in stereoscopic video systems", 1993).
///
/// A point at distance z is seen by the left eye farther right than by the right one by
///
///     eyes_mm (1 / z - 1 / convergence_mm) / (tan_half_height aspect)
///
/// half widths of the picture: 0 at the convergence distance, which is that of the screen.
struct StereoBase {
  double eyes_mm;         ///< between the eyes; negative: crossed, for pictures seen cross-eyed
  double convergence_mm;  ///< from the eyes to what seems to lie in the screen; positive
};

/// The left and the right eye on either side of `middle`.
[[nodiscard]] std::array<View, 2> eye_views(const View& middle, const StereoBase& base);

/// Eyes that lie a thirtieth of the convergence distance apart: 65 mm at two metres, as if the
/// tooth had the size of a person. The photographers' rule; what is a quarter nearer or farther
/// than the screen then stays within 0.7 degrees of it, where eyes can rest.
inline constexpr double kEyesPerConvergence = 1.0 / 30.0;

}  // namespace kerf
