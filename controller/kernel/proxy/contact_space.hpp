// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/vec.hpp"

namespace kerf {

/// Where the swept contact is solved: axes and origin of the world; one unit is the edge of the
/// finest voxel of the scene's solid volumes (docs/theory.md 1.2). docs/contact.md calls it a
/// voxel.
struct ContactSpace;

template <class S>
using ContactVec = Vec<S, ContactSpace>;

}  // namespace kerf
