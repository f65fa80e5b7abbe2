// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

// The volumes of a run as they were at its start, beside its log, so that a recording can be
// replayed on a machine that has none of the scene's files.
//
//   volumes/HASH.npy.gz         densities, uint16 [z, y, x]; HASH: `density_hash` of scene.json,
//                               which is `volume_hash`: it includes the labels
//   volumes/HASH-labels.npy.gz  labels, uint8, of the same shape; only if the volume has some
//
// Two volumes of equal content are one file. NumPy: `np.load(gzip.open(path))`.

namespace kerf {

inline constexpr std::string_view kVolumesName = "volumes";

/// The content of one volume.
struct VolumeContent {
  std::vector<Density> density;  ///< x fastest
  std::vector<Label> labels;     ///< empty, or one per voxel
};

/// Reads the volume of content `hash`, 16 hexadecimal digits, from the recording in `folder`;
/// nothing if it has none. Throws `RecordError` if the file is not of that grid or that content.
[[nodiscard]] std::optional<VolumeContent> read_starting_volume(const std::filesystem::path& folder,
                                                                std::string_view hash,
                                                                const VoxelGrid& grid);

/// Whether `text` may be the name of such a volume: scene.json of another machine may hold
/// anything, and the name becomes a part of a path.
[[nodiscard]] bool is_volume_hash(std::string_view text);
[[nodiscard]] std::filesystem::path density_path(const std::filesystem::path& folder,
                                                 std::string_view hash);
[[nodiscard]] std::filesystem::path labels_path(const std::filesystem::path& folder,
                                                std::string_view hash);
/// The header of the file of a volume whose voxels are numbers of so many bytes, 1 or 2.
[[nodiscard]] std::string volume_header(const VoxelGrid& grid, std::size_t voxel_bytes);

}  // namespace kerf
