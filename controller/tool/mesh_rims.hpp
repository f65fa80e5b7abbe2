// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "controller/tool/tool_mesh.hpp"

namespace kerf {

/// Samples of what is sharp on a mesh: one on each point, and rows along its rims, one every
/// `pitch_mm` or nearly so. They lie a little inside of the rim. None is nearer to another than 0.6
/// of that, so that a rough surface gets no more than a smooth one.
///
/// A rim is an edge that sticks out by more than 9.2 degrees between its faces: a lathe of 40 sides
/// and more is round. A point is a corner that lacks more than a twentieth of the full angle, or in
/// which a rim bends or ends. Load time.
[[nodiscard]] std::vector<ToolMesh::Point> rim_samples(const ToolMesh& mesh, double pitch_mm);

}  // namespace kerf
