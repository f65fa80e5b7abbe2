// SPDX-License-Identifier: Apache-2.0
#include "lab/extremes/shipped_bur.hpp"

#include "controller/scene/scene_error.hpp"
#include "controller/tool/mesh_tool.hpp"
#include "controller/tool/stl_file.hpp"
#include "hil/hil_error.hpp"

namespace kerf::extremes {

SceneTool shipped_bur() {
  constexpr const char* kFile = "scenes/burs/fluted.stl";
  constexpr double kUnitsPerMm = 8;
  try {
    return make_mesh_tool("bur", join_triangles(read_stl(kFile), kUnitsPerMm, kFile), 1);
  } catch (const SceneError& error) {
    throw HilError(error.what());
  }
}

}  // namespace kerf::extremes
