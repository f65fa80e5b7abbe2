// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// The longest side of a voxel over its shortest: thick slices have 50, and in longer voxels a tool
/// has more samples than the loop can count.
inline constexpr double kMostStretched = 60;
[[nodiscard]] bool is_stretched(const VolumeFrame& frame);

/// What speaks against the voxel size that a file names, for a message that begins with
/// "spacing"; empty where it may be right:
///
/// - 1 x 1 x 1 mm without HU: libraries write that where nobody knows it.
/// - What is solid is longer than 2 m, the reach of a scanner, or no longer than 0.5 mm: then the
///   numbers are micrometres or metres.
/// - A voxel is stretched.
[[nodiscard]] std::string odd_spacing(const VolumeFrame& frame, const VoxelBox& solid,
                                      bool hounsfield);

}  // namespace kerf
