// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

// The volumes of a run as they were at its start, beside its log: so a recording replays on a
// machine that has none of the scene's files.
//
//   volumes/HASH.npy.gz         densities, uint16 [z, y, x]; HASH: `density_hash` of scene.json,
//                               which is `volume_hash`: labels count, too
//   volumes/HASH-labels.npy.gz  labels, uint8, of the same shape; only if the volume has some
//
// Two volumes of equal content are one file. NumPy: `np.load(gzip.open(path))`.

namespace kerf {

inline constexpr std::string_view kVolumesName = "volumes";

/// Copies the volumes of controller `name` into `folder`, beside the recorder, which must not wait:
/// in a thread and with a connection of its own.
class StartingVolumes {
 public:
  StartingVolumes(std::string name, std::filesystem::path folder);

  /// Whether the volumes are copied into memory, or could not be: from here on they may be cut.
  [[nodiscard]] bool copied() const noexcept { return copied_; }

  /// Whether nothing more is done.
  [[nodiscard]] bool done() const noexcept { return done_; }

  /// Waits until the files are complete. Returns one line for each volume that has none, and why.
  [[nodiscard]] const std::vector<std::string>& finish();

 private:
  void run();
  void copy();

  std::string name_;
  std::filesystem::path folder_;
  std::vector<std::string> problems_;
  std::atomic<bool> copied_{false}, done_{false};
  std::jthread thread_;  // last: it uses the members above
};

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

/// Writes such a volume, whole or not at all, over an older one. Throws `RecordError`, or
/// FileError.
void write_starting_volume(const std::filesystem::path& folder, std::string_view hash,
                           const VoxelGrid& grid, std::span<const Density> density,
                           std::span<const Label> labels);

}  // namespace kerf
