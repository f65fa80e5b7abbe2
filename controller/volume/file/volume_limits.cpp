// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_limits.hpp"

#include <sstream>

#include "controller/scene/scene_error.hpp"

namespace kerf {

void check_grid(const std::string& place, std::int64_t nx, std::int64_t ny, std::int64_t nz,
                const char* way_out) {
  std::ostringstream size;
  size << place << ": " << nx << " x " << ny << " x " << nz;
  if (nx <= 0 || ny <= 0 || nz <= 0) {
    throw SceneError(size.str() + " voxels is empty; every extent must be at least 1");
  }
  const bool long_axis = nx > kMaxVoxelsPerAxis || ny > kMaxVoxelsPerAxis || nz > kMaxVoxelsPerAxis;
  if (long_axis || nx * ny * nz > kMaxVoxels) {
    size << " voxels is above the limit of " << kMaxVoxelsPerAxis << " per axis and "
         << (kMaxVoxels >> 20) << " Mi in all; " << way_out;
    throw SceneError(size.str());
  }
}

void check_spacing(const std::string& place, const std::array<double, 3>& spacing_mm) {
  constexpr double kSmallestMm = 1e-6;
  constexpr double kLargestMm = 1e3;
  for (const double s : spacing_mm) {
    if (s >= kSmallestMm && s <= kLargestMm) continue;
    std::ostringstream text;
    text
        << place << ": " << spacing_mm[0] << " " << spacing_mm[1] << " " << spacing_mm[2]
        << " mm is not a voxel size; give three positive numbers of mm with `spacing_mm = [..]` in "
           "the scene or `--spacing`";
    throw SceneError(text.str());
  }
}

}  // namespace kerf
