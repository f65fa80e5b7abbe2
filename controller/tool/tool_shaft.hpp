// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/tool/scene_tool.hpp"

namespace kerf {

/// A part behind the head as contact feels it.
struct ToolPart {
  const char* name;                            ///< for a person
  std::vector<std::array<double, 2>> profile;  ///< its surface: {y, radius} in mm, upward
  double middle_mm = 0;                        ///< its height above the tool's centre
};

/// The shaft that a scene asks for, behind a head of this length. Its length counts from the tip.
[[nodiscard]] ToolShaft tool_shaft(const ShaftSize& size, double head_length_mm);

/// Shaft and handpiece, as far as there are any. The shaft begins where the head becomes narrower
/// than it, or with a face of its own behind a head that is nowhere as wide; one behind a mesh
/// always has that face. Faces that another part hides are left out.
[[nodiscard]] std::vector<ToolPart> parts_behind(const SceneTool& tool);

/// Their common outline from where the shaft begins, {y, radius} in mm; both ends are flat.
[[nodiscard]] std::vector<std::array<double, 2>> shaft_profile(const SceneTool& tool);

}  // namespace kerf
