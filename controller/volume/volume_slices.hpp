// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "controller/volume/volume_source.hpp"

namespace kerf::volume {

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
