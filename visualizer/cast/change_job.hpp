// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "visualizer/cast/cast_job.hpp"
#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// Marks of the cells of a `ChangeJob`.
inline constexpr std::uint8_t kChangedAlong = 1;  ///< a ray through here may look different
inline constexpr std::uint8_t kChangedAtEnd = 2;  ///< a ray that ends here may

/// How far along its normal a point of a surface looks for what coats and what darkens it, in voxel
/// edges (iso.frag).
inline constexpr float kFeelersVox[] = {-2.5F, -1.25F, 1.25F, 2.5F, 6.0F, 12.0F};
inline constexpr float kLongestFeelerVox = 12.0F;

/// What a kernel needs to tell whether rays can show a change in a volume: plain pointers, as in
/// `CastVolumeJob`. Places are in voxel edges from the lowest corner of the marked cells.
struct ChangeJob {
  CastEye eye;
  float origin[3] = {};       ///< the eye
  float from_eye[3][3] = {};  ///< [to][from]: mm of eye space to voxel edges
  float step_vox = 0.9F;      ///< along the longest part of a ray: between looks at the cells
  std::int32_t most_looks = 0;

  const std::uint8_t* cells = nullptr;  ///< marks, x fastest, and room to load four at the last
  std::int32_t row = 0, plane = 0;
  float size[3] = {};  ///< cells along each axis
  float last[3] = {};  ///< a hair less

  /// Window depth at which rays end, of the pixels of `window` row by row; none: nothing ends them.
  const float* depth = nullptr;
  PixelRect window;

  /// For surfaces that feel ahead (`kFeelersVox`), else none: all of the volume.
  const std::uint16_t* density = nullptr;
  std::int32_t extent[3] = {};  ///< of the volume
  float first_voxel[3] = {};    ///< place of voxel (0, 0, 0)
  float centre_mm[3] = {};      ///< of the marked cells, in eye space
  float half_mm[3][3] = {};     ///< half their edges, in eye space: [axis of the volume]
  float edge_mm = 1.0F;         ///< of a voxel, the longest
};

}  // namespace kerf
