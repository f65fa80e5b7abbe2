// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/check_scene.hpp"

#include <doctest/doctest.h>

#include "controller/tool/tool_shapes.hpp"

using namespace kerf;

TEST_CASE("a scene tells up to which speed no tool is dragged in air, and warns of hands beyond") {
  LoadedScene scene;
  scene.tools = {make_tool("ball 1 mm", "ball", {.pitch_mm = 0.1, .radius_mm = 0.5}),
                 make_tool("fissure", "cylinder", {.pitch_mm = 0.1, .radius_mm = 0.5})};
  SceneCosts costs;
  CHECK(air_lines(scene, costs).empty());  // the paper's force drags nothing
  costs.air_speeds_mm_per_s = {2500, 1000};
  CHECK(air_lines(scene, costs) == "free_of_drag_m_per_s=1.00\n");
  costs.air_speeds_mm_per_s = {2500, 340};
  CHECK(air_lines(scene, costs) ==
        "free_of_drag_m_per_s=0.34\nnote=beside a surface tool fissure is dragged in air from 0.34 "
        "m/s on; a higher rate or larger voxels raise that\n");
}
