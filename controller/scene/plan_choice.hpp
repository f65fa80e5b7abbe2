// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/scene/lattice.hpp"
#include "controller/scene/scene.hpp"

namespace kerf {

/// How the contact and the cut of one tool in one volume are computed.
enum class Plan : std::uint8_t {
  aligned,  ///< a correlation of the density with one table (controller/kernel/aligned_table.hpp)
  gather    ///< stored gradients, weighted at every sample
};

[[nodiscard]] constexpr const char* name_of(Plan plan) noexcept {
  return plan == Plan::aligned ? "aligned" : "gather";
}

struct PlanChoice {
  Plan plan = Plan::gather;
  std::string why;   ///< one reason for a person
  LatticeTurn turn;  ///< of the plan `aligned`: the tool's axes in the volume
};

/// The plan of `tool` in `volume`; the scene alone decides, never the machine. Load time.
[[nodiscard]] PlanChoice choose_plan(const Scene& scene, const SceneTool& tool,
                                     const SceneVolume& volume);

}  // namespace kerf
