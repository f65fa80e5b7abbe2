// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/lattice.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

struct PlanChoice {
  Plan plan = Plan::gather;
  std::string why;   ///< one reason for a person
  LatticeTurn turn;  ///< of the plan `aligned`: the tool's axes in the volume
};

/// The plan of `tool` in `volume`; the scene alone decides, never the machine. Throws SceneError
/// for a tool that no plan of fixed-point numbers can hold. Load time.
[[nodiscard]] PlanChoice choose_plan(const LoadedScene& scene, const SceneTool& tool,
                                     const SceneVolume& volume);

}  // namespace kerf
