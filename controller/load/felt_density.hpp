// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "controller/load/loaded_scene.hpp"

namespace kerf {

/// An unlabelled voxel this near to a labelled one is the edge of its material.
inline constexpr int kMaterialEdgeVoxels = 3;

/// Gives each material the surface that its `felt_iso` names: the densities of its voxels are
/// scaled so that `felt_iso` becomes `iso`, the one at which the whole volume is felt, drawn and
/// cropped, and held at full density above. A soft body then touches, and is cut, as a hard one of
/// the same shape, and a wall between two of them has no gap. Its unlabelled edge is scaled along
/// (docs/theory.md 2.1).
///
/// Nothing remembers the map: from here on the volume's densities are these, so a cut needs none.
/// Materials without `felt_iso` keep theirs, and so does an image without labels. Load time.
void scale_to_felt_iso(const std::vector<Material>& materials, Density iso, VolumeImage& image);

}  // namespace kerf
