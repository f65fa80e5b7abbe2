// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shared/segment/reader.hpp"

namespace kerf::bridge {

/// OpenIGTLink's device name of each volume: its name in the scene, at most 20 bytes, all
/// different; "volume 1" and so on if the scene's text has none.
[[nodiscard]] std::vector<std::string> device_names(const SegmentInfo& segment);

/// Of the labels of volumes of these names: "NAME labels", by the same rules.
[[nodiscard]] std::vector<std::string> label_names(const std::vector<std::string>& volumes);

/// One packed message; several clients may wait for the same.
using IgtlBytes = std::shared_ptr<const std::vector<std::byte>>;

/// Whether all densities fit into one IMAGE: the library counts its bytes in 31 bits.
[[nodiscard]] bool fits_an_image(const VoxelGrid& grid) noexcept;

/// `part` of a volume as IMAGE with the volume's size and pose: 16 bits a voxel. OpenIGTLink's
/// origin is the middle of the image, between the centres of its corner voxels. `part` is not empty
/// and lies in the volume; `linear` has the densities of all its voxels, x fastest.
[[nodiscard]] IgtlBytes image_message(const std::string& device, const SegmentVolumeInfo& volume,
                                      const std::vector<Density>& linear, const VoxelBox& part);

/// All labels of a volume as IMAGE of the same size and pose: 8 bits a voxel.
[[nodiscard]] IgtlBytes label_message(const std::string& device, const SegmentVolumeInfo& volume,
                                      std::span<const Label> linear);

/// World from the tool of an arm as TRANSFORM "Tool", of the second "Tool 2"; none if the pose is
/// not known yet.
[[nodiscard]] std::optional<IgtlBytes> tool_message(const TickRecord& tick, std::size_t arm = 0);

/// The force that was sent to the hand as SENSOR "Force", of the second arm "Force 2": x, y, z in
/// newtons, along the same axes.
[[nodiscard]] IgtlBytes force_message(const TickRecord& tick, std::size_t arm = 0);

}  // namespace kerf::bridge
