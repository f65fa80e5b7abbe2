// SPDX-License-Identifier: Apache-2.0
#include "lab/extremes/measured_tools.hpp"

#include "controller/tool/mesh_tool.hpp"
#include "controller/tool/stl_file.hpp"
#include "lab/rig/contact_rig.hpp"
#include "lab/rig/loft.hpp"

namespace kerf::extremes {

std::array<EdgedTool, 3> edged_tools() {
  return {{{"cylinder, any pose", tool_of_units("cylinder", 5, 16)},
           {"cone, any pose", tool_of_units("cone", 5, 16)},
           {"STL, square bar, any pose", mesh_of_units("bar", prism(6, 16, 4))}}};
}

SceneTool shipped_bur(double units_per_mm, double pitch) {
  constexpr const char* kFile = "scenes/burs/fluted.stl";
  return make_mesh_tool("bur", join_triangles(read_stl(kFile), units_per_mm, kFile), pitch);
}

}  // namespace kerf::extremes
