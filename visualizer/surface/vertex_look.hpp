// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/surface/block_mesh.hpp"
#include "visualizer/surface/neighbourhood.hpp"

namespace kerf {

/// Computes normal, colour and openness of a vertex from its position and the volume. The vertex
/// belongs to the block that starts at `start`; `near` is that block's neighbourhood. Pure.
void dress(SurfaceVertex& vertex, const SurfaceSource& source, VoxelIndex start,
           const Neighbourhood& near);

/// Brings the mesh of a block up to date after a change of densities in `changed` that touches none
/// of the block's own voxels: positions stay, and the vertices that depend on `changed` are
/// computed again. The result is that of `extract_block`. Returns the cells whose colours changed.
DirtyMeshCells update_look(const SurfaceSource& source, VoxelIndex block, const VoxelBox& changed,
                           BlockMesh& mesh);

}  // namespace kerf
