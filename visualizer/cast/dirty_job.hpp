// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "visualizer/cast/cast_job.hpp"
#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// The footprint of a ray: a voxel farther from the ray than this, on any axis, has no share in the
/// ray's colour. In half voxel edges. It includes half an edge of slack, for rounding and because
/// rays are tested at discrete places.
struct RayFootprint {
  int along = 0;   ///< before the ray's end
  int at_end = 0;  ///< at the ray's end; 0: as before it. Else both are odd, or both even
  /// The ray ends on a surface, whose shading samples the volume along the normal
  /// (`kShadingTapsVox`).
  bool taps_normal = false;
};

/// Marks of the cells of a `DirtyJob`.
inline constexpr std::uint8_t kDirtyAlong = 1;  ///< a ray that crosses the cell may have changed
inline constexpr std::uint8_t kDirtyAtEnd = 2;  ///< a ray that ends in the cell may have changed

/// Where the shading of a surface point samples the volume, in voxel edges along its outward
/// normal: on both sides for the material, and outside for ambient occlusion (iso.frag).
inline constexpr float kShadingTapsVox[] = {-2.5F, -1.25F, 1.25F, 2.5F, 6.0F, 12.0F};
inline constexpr float kLongestTapVox = 12.0F;

/// Input of the kernels that test rays against the dirty cells of a volume (`DirtyCells`): plain
/// pointers, as in `CastVolumeJob`. Places are in voxel edges from the lowest corner of the cells.
struct DirtyJob {
  CastEye eye;
  float origin[3] = {};         ///< the eye
  float from_eye[3][3] = {};    ///< [to][from]: mm of eye space to voxel edges
  float step_vox = 0.9F;        ///< between two tests, along the longest axis of a ray
  std::int32_t most_tests = 0;  ///< of one ray

  const std::uint8_t* cells = nullptr;  ///< marks, x fastest; 4 bytes can be read at the last one
  std::int32_t row = 0, plane = 0;
  float size[3] = {};  ///< cells along each axis
  float last[3] = {};  ///< the largest float below `size`

  /// Window depth at which rays end, row by row, of the pixels of `window`; null: rays go on.
  const float* depth = nullptr;
  PixelRect window;

  /// All of the volume, for surfaces whose shading samples it (`kShadingTapsVox`); else null.
  const std::uint16_t* density = nullptr;
  std::int32_t extent[3] = {};  ///< of the volume
  float first_voxel[3] = {};    ///< place of voxel (0, 0, 0)
  float centre_mm[3] = {};      ///< of the marked cells, in eye space
  float half_mm[3][3] = {};     ///< half their edges, in eye space: [axis of the volume]
  float edge_mm = 1.0F;         ///< of a voxel, the longest
};

}  // namespace kerf
