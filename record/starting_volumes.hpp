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
#include "shared/text/json.hpp"
#include "shared/volume/voxel_grid.hpp"

// The volumes of a run as they were at its start (record/kept_volumes.hpp), copied from it.

namespace kerf {

/// Copies the volumes of controller `name` into `folder`, in its own thread and with its own
/// connection, because the recorder must not wait.
class StartingVolumes {
 public:
  StartingVolumes(std::string name, std::filesystem::path folder);

  /// Whether the volumes were copied into memory, or cannot be: from now on they may be cut.
  [[nodiscard]] bool copied() const noexcept { return copied_; }

  /// Whether all work has ended.
  [[nodiscard]] bool done() const noexcept { return done_; }

  /// After `done`: the checksums of the files, by name, as a manifest has them.
  [[nodiscard]] const Json& checksums() const noexcept { return checksums_; }

  /// Waits until the files are complete. Returns one line for each volume that has none, and why.
  [[nodiscard]] const std::vector<std::string>& finish();

 private:
  void run();
  void copy();

  std::string name_;
  std::filesystem::path folder_;
  std::vector<std::string> problems_;
  Json checksums_ = Json::Members{};
  std::atomic<bool> copied_{false}, done_{false};
  std::jthread thread_;  // last: it uses the members above
};

/// Writes such a volume, whole or not at all, over an older one. Throws `RecordError`, or
/// FileError.
void write_starting_volume(const std::filesystem::path& folder, std::string_view hash,
                           const VoxelGrid& grid, std::span<const Density> density,
                           std::span<const Label> labels);

}  // namespace kerf
