// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace kerf
