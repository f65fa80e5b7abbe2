// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "controller/kernel/aligned_table.hpp"
#include "controller/load/loaded_scene.hpp"

namespace kerf {

// How many voxels a tool covers at most: those that any of its samples gives a weight to. Load
// time.

/// In every place and orientation that the tool takes in the volume.
///
/// A covered voxel's middle is less than a spacing h from a sample along each axis, so its whole
/// cell lies within 1.5 h of it. Cells do not overlap: their number is at most the volume of the
/// samples' hull, grown by that box, over a cell's. The hull is taken for a cylinder K about the
/// tool's axis, and grown by boxes of edge b it has
/// V(K) + b SUM A_i + b^2 SUM w_i + b^3, A_i and w_i its shadow and its width along the axes, at
/// their largest for any direction of K's axis. Where the box around the tool is smaller, that
/// counts.
[[nodiscard]] std::size_t most_covered(const SceneTool& tool, const SceneVolume& volume);

/// How many groups of kCoverGroup neighbours those voxels lie in; by the table of a tool of the
/// method `aligned`, whose samples share one place within their cells, exact where they lie on no
/// voxel's middle along any axis.
///
/// Groups begin at a covered voxel, so a row that spans w voxels has (w + 15) / 16 at most. The
/// rows are no more than the shadow of the grown hull along x has room for, and their spans
/// together no more than the hull itself: it is convex. Of the two together the largest counts that
/// one direction of K's axis has.
[[nodiscard]] std::size_t most_groups(const SceneTool& tool, const SceneVolume& volume);
[[nodiscard]] std::size_t most_groups(const AlignedTable& table);

}  // namespace kerf
