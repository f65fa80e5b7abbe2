// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/tool/scene_tool.hpp"
#include "controller/tool/tool_mesh.hpp"

namespace kerf {

/// Largest number of pitches along one side that the tool would have; cheap, for checks before
/// `make_mesh_tool` allocates.
[[nodiscard]] double mesh_side_vox(const ToolMesh& mesh, double pitch_mm);

/// The samples of one tool: those of a grid whose middle across the axis is a sample, as tools
/// with a radius have it, kept when they are inside or on the surface. `mesh_side_vox` is at most
/// kMaxToolSide. None where the mesh is thinner than the grid. Ordered by y, then z, then x.
///
/// Inside means a winding number above 0, so bodies that overlap are one. It is counted along
/// columns of samples in whole numbers, with ties broken the same way for both triangles of an
/// edge: a closed mesh has no leak. Load time.
[[nodiscard]] SceneTool make_mesh_tool(std::string name, ToolMesh mesh, double pitch_mm);

}  // namespace kerf
