// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>

#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/volume_density.hpp"
#include "controller/volume/volume_noise.hpp"

namespace kerf {

/// The figures of `kerf-volume info`.
struct VolumeInfo : VolumeFrame {
  static constexpr std::size_t kHistogramBins = 64;

  std::string file;
  bool has_spacing = true;
  double min = 0, max = 0;  ///< values of the file
  Window window;
  Density otsu = 0;
  double otsu_value = 0;   ///< the same threshold in values of the file
  Noise noise;             ///< of what is at or above it
  VoxelBox solid;          ///< tightest box of what is at or above it
  double solid_ratio = 0;  ///< its share of all voxels, 0..1
  std::array<std::uint64_t, kHistogramBins> histogram{};  ///< over the window, equal steps
};

[[nodiscard]] VolumeInfo describe(const std::string& file, const SourceVolume& volume,
                                  Window window);
void print(const VolumeInfo& info, std::ostream& out);
/// As JSON. Throws SceneError when it cannot be written.
void write_report(const VolumeInfo& info, const std::filesystem::path& path);

}  // namespace kerf
