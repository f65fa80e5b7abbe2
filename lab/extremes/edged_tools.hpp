// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "lab/rig/contact_rig.hpp"
#include "lab/rig/loft.hpp"

namespace kerf::extremes {

/// A tool that is no ball, with the name of its rows.
struct EdgedTool {
  const char* name;
  SceneTool tool;
};

/// A cylinder, a cone and a mesh, 16 units long. Each is measured in any pose.
[[nodiscard]] inline std::array<EdgedTool, 3> edged_tools() {
  return {{{"cylinder, any pose", tool_of_units("cylinder", 5, 16)},
           {"cone, any pose", tool_of_units("cone", 5, 16)},
           {"STL, square bar, any pose", mesh_of_units("bar", prism(6, 16, 4))}}};
}

}  // namespace kerf::extremes
