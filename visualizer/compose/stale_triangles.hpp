// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <glm/glm.hpp>

#include "visualizer/compose/stale_tiles.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/surface/volume_samples.hpp"

namespace kerf {

/// Marks the tiles of which pixels show one of `triangles`, or would if it was there: those that
/// `kept`, a picture with its depth, hides behind something nearer are left out. Exact but for what
/// a GPU rounds: a pixel shows a triangle only where its centre lies within.
void mark_triangles(StaleTiles& tiles, std::span<const FineTriangle> triangles,
                    const glm::dmat4& clip_from_voxel, const RenderTarget& kept);

}  // namespace kerf
