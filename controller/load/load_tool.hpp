// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/sandbox/sandbox.hpp"

namespace kerf {

/// What the tools are measured against: the volumes that can be touched.
struct TouchedVolumes {
  double voxel_mm = std::numeric_limits<double>::infinity();  ///< smallest edge
  double side_mm = 0;                                         ///< longest side of a box
};
[[nodiscard]] TouchedVolumes touched_volumes(const std::vector<SceneVolume>& volumes);

/// The samples of one tool, or its mesh's from a file in `folder`. Throws SceneError where it does
/// not fit the volumes. Load time.
[[nodiscard]] SceneTool load_tool(const ToolSpec& spec, const TouchedVolumes& touched,
                                  const std::filesystem::path& folder, int cpu_s = kReadCpuSeconds);

}  // namespace kerf
