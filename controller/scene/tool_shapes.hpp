// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene.hpp"

namespace kerf {

inline constexpr std::int32_t kMaxToolSide = 64;  ///< pitches; larger sums leave the kernels' range
inline constexpr std::size_t kMaxToolOffsets = 262144;  // a full cube of that side

/// The shapes a [[tool]] can have. Every shape is a solid of revolution about the tool's y axis,
/// with its tip (the lowest point of the head) toward -y and the shaft toward +y:
///
///   ball           a sphere
///   cylinder       flat at both ends
///   cone           pointed at the tip, widest at the shaft
///   inverted_cone  widest at the tip, 0.6 of that at the shaft
///   flame          a pointed ogive up to 0.6 of the length, then drawn in to half at the shaft
///   wheel          a flat disc whose rim is half of a torus as thick as the disc
inline constexpr std::array<std::string_view, 6> kToolShapes = {
    "ball", "cylinder", "cone", "inverted_cone", "flame", "wheel"};

/// What the scene says about the size of one tool; all in mm unless counted in pitches.
struct ToolSize {
  double pitch_mm = 0.125;                 ///< distance of the samples
  double radius_mm = 1.0;                  ///< largest radius; used when `size_vox` is empty
  std::optional<double> length_mm{};       ///< height of the head; not for a ball
  std::optional<std::int32_t> size_vox{};  ///< the head fills a cube of so many pitches
};

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
