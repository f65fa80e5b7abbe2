// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/tool/scene_tool.hpp"

namespace kerf {

inline constexpr std::int32_t kMaxToolSide = 64;  ///< pitches; larger sums leave the kernels' range
inline constexpr std::size_t kMaxToolOffsets = 262144;  // a full cube of that side

/// The height that a head gets when the scene gives none: the proportions of dental burs.
[[nodiscard]] double default_length_mm(std::string_view shape, double radius_mm);

/// Largest number of pitches along one side that the tool would have; cheap, for checks before
/// `make_tool` allocates.
[[nodiscard]] double tool_side_vox(std::string_view shape, const ToolSize& size);

/// The samples of one tool. `shape` is one of kToolShapes, sizes are positive, a radius is at least
/// half a pitch, and `tool_side_vox` is at most kMaxToolSide (the loader refuses anything else), so
/// the list is never empty and never longer than kMaxToolOffsets. Ordered by y, then z, then x.
///
/// With `size_vox` = n the grid is n^3 about the centre (16 gives a ball of 2176 samples, 10 one of
/// 552). With a radius the middle of the grid is a sample (R = 5 pitches: 515). Either way a
/// sample stands for one pitch^3 of the tool, and it is kept when its centre is in the profile.
[[nodiscard]] SceneTool make_tool(std::string name, std::string shape, const ToolSize& size);

/// Radius of the generating profile at height `y_mm` above the centre of the head; 0 outside.
[[nodiscard]] double profile_radius_mm(const SceneTool& tool, double y_mm);

/// The profile as a closed polyline of {y, radius} in mm from tip to shaft, denser toward the ends
/// where heads are round. Both ends lie on the axis, so a lathe of it is a closed mesh. With 32
/// steps a ball keeps within 0.2 % of its radius.
[[nodiscard]] std::vector<std::array<double, 2>> tool_profile(const SceneTool& tool,
                                                              int steps = 32);

}  // namespace kerf
