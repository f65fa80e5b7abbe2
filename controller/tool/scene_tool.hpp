// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/kernel/tool_pose.hpp"
#include "controller/tool/tool_mesh.hpp"

namespace kerf {

/// What is behind a tool's head: felt, and never cutting. Cylinders about the tool's y axis;
/// heights count from the tool's centre.
struct ToolShaft {
  double radius_mm = 0;  ///< 0: no shaft is felt
  double end_mm = 0;
  double handpiece_radius_mm = 0;  ///< 0: there is none
  double handpiece_end_mm = 0;     ///< it begins where the shaft ends
};

/// One [[tool]]: voxel-offset list in the tool frame (tip at the centre of the cutting head, shaft
/// along +y). `round` tools feel and cut the same in every orientation.
struct SceneTool {
  std::string name;
  std::string shape;
  double pitch_mm = 0.125;
  double radius_mm = 1.0;
  double length_mm = 2.0;
  bool round = false;
  bool turns = true;  ///< with the stylus; else it keeps the world's axes
  std::array<std::int32_t, 3> size_vox{};
  std::vector<ToolOffset> offsets;
  ToolMesh mesh;  ///< of the shape "stl"; else empty, and the shape says all
  ToolShaft shaft;
};

}  // namespace kerf
