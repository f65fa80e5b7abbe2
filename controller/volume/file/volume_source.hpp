// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "controller/volume/file/volume_io.hpp"
#include "shared/numeric/vec3.hpp"

/// The steps that fill a SourceVolume, whatever library read the file. Each checks what it sets and
/// throws SceneError with `path` as the place.

namespace kerf::volume {

using Place = vec3::Vec;
using vec3::cross, vec3::dot, vec3::length, vec3::unit;
using vec3::operator-, vec3::operator*;

/// Refuses sizes that are empty or above the limits.
void set_grid(const std::filesystem::path& path, const std::array<std::int64_t, 3>& size,
              SourceVolume& volume);

/// Takes the spacing of the option, else the file's. Where both lack it, refuses unless the options
/// allow that.
void set_spacing(const std::filesystem::path& path, const ReadOptions& options, bool in_file,
                 const std::array<double, 3>& from_file, SourceVolume& volume);

/// Refuses a place that is not finite.
void set_origin(const std::filesystem::path& path, const std::array<double, 3>& origin_mm,
                SourceVolume& volume);

/// The distances in a DICOM value: decimal numbers, finite and above 0, with backslashes between
/// (PS3.5 6.2, DS). None where any part is something else.
[[nodiscard]] std::vector<double> dicom_distances(std::string_view text);

/// Sets `min` and `max` from the values; refuses NaN and infinity.
void set_range(const std::filesystem::path& path, SourceVolume& volume);

/// Sets the direction from three axes that should be at right angles, exactly so afterwards. A
/// left-handed file has its last axis reversed: same picture, right-handed axes. After the values,
/// the spacing and the origin.
void set_frame(const std::filesystem::path& path, Place x, Place y, Place z, SourceVolume& volume);

/// One slice of a DICOM series and where it lies along the normal.
struct Slice {
  std::filesystem::path file;
  Place origin_mm;
  double depth_mm;
};

/// The common distance along `normal`, mm, of two slices or more in the order of their depths.
/// Refuses gaps and a slanted stack: throws SceneError with `folder` as the place.
[[nodiscard]] double slice_distance(const std::filesystem::path& folder,
                                    const std::vector<Slice>& slices, const Place& normal);

}  // namespace kerf::volume
