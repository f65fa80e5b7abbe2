// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "controller/kernel/tool_pose.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/matrices.hpp"

namespace kerf {

/// Voxels per pitch along each axis of a tool that does not turn. A round tool is laid along the
/// volume's axes, so the volume's orientation does not matter to it; any other keeps the world's.
[[nodiscard]] Matrix unturned_steps(const SceneTool& tool, const SceneVolume& volume);

/// Where the tool's axes lie in the volume: each along one of its axes, forth (1) or back (-1).
using LatticeTurn = std::array<std::array<std::int16_t, 3>, 3>;

/// The turn between the lattice of a tool that does not turn and that of the volume, where the two
/// are one to the last bit of fixed-point numbers: pitch and voxel edges equal, axes parallel.
[[nodiscard]] std::optional<LatticeTurn> lattice_turn(const SceneTool& tool,
                                                      const SceneVolume& volume);

/// The samples as the volume's axes count them.
[[nodiscard]] std::vector<ToolOffset> turned(std::span<const ToolOffset> offsets,
                                             const LatticeTurn& turn);

}  // namespace kerf
