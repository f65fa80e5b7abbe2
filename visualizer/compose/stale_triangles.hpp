// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <glm/glm.hpp>

#include "visualizer/compose/stale_tiles.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/surface/volume_samples.hpp"

namespace kerf {

/// Marks the tiles in which one of `triangles` may cover the centre of a pixel. A triangle that
/// came and one that went count alike. A tile stays clean where the depth of `kept`, the last
/// picture, is everywhere nearer than the triangle. Marks a little more than needed, never less: a
/// GPU rounds.
void mark_triangles(StaleTiles& tiles, std::span<const FineTriangle> triangles,
                    const glm::dmat4& clip_from_voxel, const RenderTarget& kept);

}  // namespace kerf
