// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/vec.hpp"

namespace kerf {

/// Where the swept contact is solved: world axes, origin of the world, and one unit is the edge of
/// the finest voxel of the scene's solid volumes. All lengths of contact.md ("voxels") are units.
struct ContactSpace;

template <class S>
using ContactVec = Vec<S, ContactSpace>;

}  // namespace kerf
