// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "record/recorder.hpp"

namespace kerf {

inline constexpr std::string_view kTickLogName = "ticks.npy";
inline constexpr std::string_view kManifestName = "manifest.json";
inline constexpr std::string_view kSceneName = "scene.json";
inline constexpr std::string_view kStillRunning = "running";

/// What a log needs beside its rows.
struct Manifest {
  std::uint32_t tick_ns = 0;
  std::vector<double> voxel_mm3;  ///< per volume
  std::string end_reason;
  std::uint64_t lost_ticks = 0;  ///< by the recorder; a killed one has not told yet
  std::uint64_t missed_before_start = 0;
  [[nodiscard]] bool complete() const { return end_reason != kStillRunning; }
};

/// The files of a recording, of which none may become an output beside it.
[[nodiscard]] inline std::vector<std::filesystem::path> recording_files(
    const std::filesystem::path& folder) {
  return {folder / kTickLogName, folder / kManifestName, folder / kSceneName};
}

/// Writes manifest.json, whole or not at all.
void write_manifest(const std::filesystem::path& folder, const SegmentInfo& info,
                    const Recorder& recorder, std::uint64_t rows, std::string_view end_reason);

/// Throws `RecordError` where it is missing or holds no such values.
[[nodiscard]] Manifest read_manifest(const std::filesystem::path& folder);

}  // namespace kerf
