// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/volume_io.hpp"

// Source values to densities, Otsu's threshold, and the box of the solid voxels.

namespace kerf {

/// Two classes of a histogram: below `bin`, and from there on.
struct OtsuSplit {
  double bin = 0;                      ///< between two bins if a whole range splits equally well
  double low_mean = 0, high_mean = 0;  ///< of the classes, in bins
};

/// Otsu's threshold (IEEE Trans. SMC 9, 1979): the one with the largest variance between the two
/// classes, in the middle of the range if several split them equally well. If all counts are in one
/// bin, the middle of the histogram; the means are 0 then.
[[nodiscard]] OtsuSplit otsu_split(std::span<const double> counts);

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

/// Rounds to the nearest density. Throws LoadError unless lo < hi and both are finite.
[[nodiscard]] VolumeImage apply_window(const SourceVolume& source, Window window);

/// Otsu's threshold (IEEE Trans. SMC 9, 1979) over 4096 bins: the density that splits the voxels
/// into two classes with the largest variance between them. Every voxel counts. In the middle of
/// the gap if a whole range of thresholds splits them equally well; 32768 for a uniform image.
///
/// It finds the strongest edge, which is not always bone: in a CT of a whole body it splits air
/// from skin (-490 HU). A window that begins at soft tissue (0 HU) hides that edge; then it finds
/// bone (about 200 HU).
[[nodiscard]] Density otsu_threshold(const VolumeImage& image);

/// Tightest box around the voxels of at least `iso`; empty if there are none.
[[nodiscard]] VoxelBox solid_box(const VolumeImage& image, Density iso) noexcept;

}  // namespace kerf
