// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "record/kept_volumes.hpp"
#include "shared/volume/voxel_grid.hpp"

// The volumes of a run as they were at its start (record/kept_volumes.hpp), copied from it.

namespace kerf {

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

/// Writes such a volume, whole or not at all, over an older one. Throws `RecordError`, or
/// FileError.
void write_starting_volume(const std::filesystem::path& folder, std::string_view hash,
                           const VoxelGrid& grid, std::span<const Density> density,
                           std::span<const Label> labels);

}  // namespace kerf
