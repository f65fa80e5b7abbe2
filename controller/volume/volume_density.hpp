// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/volume_io.hpp"

namespace kerf {

/// Nearest density to a value in density steps; clamped.
[[nodiscard]] inline Density nearest_density(double value) noexcept {
  return static_cast<Density>(std::lround(std::clamp(value, 0.0, kDensityMax)));
}

/// Source values that become density 0 and 65535; linear between, clamped outside.
struct Window {
  double lo = 0, hi = 0;
};

/// The whole range of the file: nothing is clamped.
[[nodiscard]] Window range_window(const SourceVolume& source) noexcept;

/// Rounds to the nearest density. Throws SceneError unless lo < hi and both are finite.
[[nodiscard]] VolumeImage apply_window(const SourceVolume& source, Window window);

/// Otsu's threshold (IEEE Trans. SMC 9, 1979) over 4096 bins: the density that parts the voxels
/// into two classes with the largest variance between them. Every voxel counts. In the middle of
/// the gap where a whole range of thresholds parts them equally; 32768 for a uniform image.
///
/// It finds the strongest edge, and that is not always bone: in a CT of a whole body it parts air
/// from skin (-490 HU). A window that begins at soft tissue (0 HU) hides that edge; then it finds
/// bone (about 200 HU).
[[nodiscard]] Density otsu_threshold(const VolumeImage& image);

/// Tightest box around the voxels of at least `iso`; empty where there are none.
[[nodiscard]] VoxelBox solid_box(const VolumeImage& image, Density iso) noexcept;

}  // namespace kerf
