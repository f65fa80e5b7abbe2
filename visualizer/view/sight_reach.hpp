// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// How near to a ray, on each axis, a voxel must be to have a share in its colour, in half voxel
/// edges. Half an edge of it is to spare: for what is rounded, and because rays are looked at from
/// place to place.
struct SightReach {
  int along = 0;   ///< anywhere before the ray's end
  int at_end = 0;  ///< there; 0: no more, else both are odd or both even
  /// The end is a surface that is shaded by what lies along its normal: see `kFeelersVox`.
  bool feels_ahead = false;
};

}  // namespace kerf
