// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "shared/volume/voxel_grid.hpp"

// Upper bounds of a tool in any pose: the box of its cells, the voxels that it covers. Load time.

namespace kerf {

/// Sizes of boxes, in low corners of cells as TickBox::size: in every orientation that the tool
/// takes in the volume, one of them holds the cells of all its samples.
///
/// Around the tool's axis the samples lie on rings of height y and radius r at most. With the axis
/// along the unit vector n the box spans, along axis i,
/// E_i = max(y n_i + r s_i) + max(-y n_i + r s_i), s_i = sqrt(1 - n_i^2), for any roll. A rotation
/// by an angle changes E_i by no more than the tool's diameter times that angle, so a lattice of
/// directions bounds all. For a tool that does not turn, E_i is known.
[[nodiscard]] std::vector<VoxelIndex> box_sizes(const SceneTool& tool, const SceneVolume& volume);

/// Most voxels that a tool covers, at any position and orientation in the volume. A covered voxel
/// has a weight from at least one sample.
///
/// A covered voxel's middle is less than a spacing h from a sample along each axis, so its whole
/// cell lies within 1.5 h of it. Cells do not overlap: their number is at most the volume of the
/// samples' hull, grown by that box, over a cell's. The hull is taken for a cylinder K about the
/// tool's axis, and grown by boxes of edge b it has
/// V(K) + b SUM A_i + b^2 SUM w_i + b^3, A_i and w_i its shadow and its width along the axes, at
/// their largest for any direction of K's axis. The box around the tool is another bound, as
/// far as the volume goes; the smaller one counts.
[[nodiscard]] std::size_t max_covered_voxels(const SceneTool& tool, const SceneVolume& volume);

/// Most groups of kCoverGroup neighbours that contain those voxels. From the table of a tool of the
/// method `aligned`, whose samples have one position within their cells, exact if they lie on no
/// voxel's middle along any axis.
///
/// Groups begin at a covered voxel, so a row that spans w voxels has (w + 15) / 16 at most. The
/// shadow of the grown hull along x bounds the number of rows, and the hull itself the sum of their
/// spans, as it is convex. The largest sum of both for one direction of K's axis counts.
[[nodiscard]] std::size_t max_cover_groups(const SceneTool& tool, const SceneVolume& volume);
[[nodiscard]] std::size_t max_cover_groups(const AlignedTable& table);

}  // namespace kerf
