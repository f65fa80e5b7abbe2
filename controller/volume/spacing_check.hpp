// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// What speaks against the voxel size that a file names, for a message; empty where it may be
/// right:
///
/// - 1 x 1 x 1 mm without HU: libraries write that where nobody knows it.
/// - What is solid is longer than 2 m, the reach of a scanner, or no longer than 0.5 mm: then the
///   numbers are micrometres or metres.
[[nodiscard]] std::string odd_spacing(const VolumeFrame& frame, const VoxelBox& solid,
                                      bool hounsfield);

}  // namespace kerf
