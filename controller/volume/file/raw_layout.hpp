// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/voxel_values.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// What a file of voxels without a header cannot tell.
struct RawLayout {
  VoxelGrid grid;
  VoxelType type = VoxelType::uint16;
  bool big_endian = false;
  std::uint64_t skip = 0;  ///< bytes before the first voxel
};

}  // namespace kerf

namespace kerf::volume {

/// In the sandbox. Throws SceneError for a file whose size is not that of the layout.
void read_raw(const std::filesystem::path& path, const RawLayout& layout, const Offer& offer);

}  // namespace kerf::volume
