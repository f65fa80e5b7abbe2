// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "controller/tool/scene_tool.hpp"

// Tools that are no balls.

namespace kerf::extremes {

/// A tool that is no ball, with the name of its rows.
struct EdgedTool {
  const char* name;
  SceneTool tool;
};

/// A cylinder, a cone and a mesh, 16 units long. Each is measured in any pose.
[[nodiscard]] std::array<EdgedTool, 3> edged_tools();

/// The fluted bur of scenes/fluted_bur.toml, 4 mm long and 0.8 mm in radius, on a grid of this
/// pitch; by default in voxels of 0.125 mm. Throws SceneError where its file cannot be read.
[[nodiscard]] SceneTool shipped_bur(double units_per_mm = 8, double pitch = 1);

}  // namespace kerf::extremes
