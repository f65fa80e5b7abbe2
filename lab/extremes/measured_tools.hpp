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

/// The fluted bur of scenes/fluted_bur.toml in voxels of 0.125 mm: 32 units long, 6.4 in radius.
/// Throws SceneError where its file cannot be read.
[[nodiscard]] SceneTool shipped_bur();

}  // namespace kerf::extremes
