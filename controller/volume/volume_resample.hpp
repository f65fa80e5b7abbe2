// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// The same volume on another spacing. Per axis: linear interpolation where the new voxels are
/// smaller, the mean over the new voxel's extent where they are larger; labels take the nearest.
///
/// The outer face of the first voxel stays in place; only new voxels that lie whole inside the old
/// extent are made (at least one). A density ramp is kept exactly by refinement and by whole
/// ratios, else within an eighth of an old voxel's step; each is rounded once, at the end. Throws
/// SceneError for a spacing that is not positive or a result above the limits.
[[nodiscard]] VolumeImage resample(const VolumeImage& image,
                                   const std::array<double, 3>& spacing_mm);

}  // namespace kerf
