// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/surface/block_mesh.hpp"
#include "visualizer/surface/neighbourhood.hpp"

namespace kerf {

/// Fills in all but the position of a vertex of the block that starts at `start`; `near` is its
/// neighbourhood. A pure function of position and volume.
void dress(SurfaceVertex& vertex, const SurfaceSource& source, VoxelIndex start,
           const Neighbourhood& near);

/// What `extract_block` would give when only voxels in `changed` are others, and none of the
/// block's own: dresses those vertices again that depend on them. Returns where it looks different.
DifferentCells update_look(const SurfaceSource& source, VoxelIndex block, const VoxelBox& changed,
                           BlockMesh& mesh);

}  // namespace kerf
