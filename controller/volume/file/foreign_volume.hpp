// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "controller/sandbox/sandbox_reader.hpp"
#include "controller/volume/file/voxel_values.hpp"
#include "shared/numeric/vec3.hpp"

namespace kerf::volume {

enum class VolumeKind : std::uint8_t {
  nrrd,
  meta,
  nifti,
  tiff,
  dicom_file,
  dicom_series,
  png_stack,
  tiff_stack,
  raw
};

/// What a volume file says of itself, as it crosses from the sandbox: plain bytes, none believed.
struct VolumeClaim {
  std::array<std::int64_t, 3> size{};
  std::uint32_t voxel_bytes = 0;  ///< of the memory that is asked for, at least those of a value
  ValueKind kind = ValueKind::float32;
  std::uint32_t has_spacing = 1;  ///< else `spacing_mm` is a library's guess
  std::array<double, 3> spacing_mm{1, 1, 1}, origin_mm{};
  std::array<vec3::Vec, 3> axes{};  ///< the way that each points
  std::array<char, 256> note{};     ///< what was chosen among several, for the user
};

/// Tells the claim and gives the memory for it.
using Offer = std::function<std::span<std::byte>(const VolumeClaim&)>;

/// In the sandbox: parses the file or folder with the libraries, offers a VolumeClaim and fills the
/// memory with a value for each voxel, x fastest, from its begin. What lies after them is the
/// file's own voxels, which were there first. `folder` holds the files of a folder, for slices;
/// other files may be among them. `series`: which of several, by its number or a part of its name.
/// Throws SceneError, or std::bad_alloc.
void read_foreign_volume(const std::filesystem::path& path, VolumeKind kind,
                         const std::vector<std::filesystem::path>& folder,
                         const std::string& series, SandboxReader& sandbox);

}  // namespace kerf::volume
