// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "controller/scene/scene.hpp"
#include "controller/tool/tool_mesh.hpp"

// Tools: the type, heads that are solids of revolution, and the shaft and handpiece behind a head.

namespace kerf {

/// The parts behind a tool's head, which are in contact and never cut. Cylinders about the tool's y
/// axis; heights count from the centre of the tool.
struct ToolShaft {
  double radius_mm = 0;  ///< 0: no shaft
  double end_mm = 0;
  double handpiece_radius_mm = 0;  ///< 0: there is none
  double handpiece_end_mm = 0;     ///< it begins where the shaft ends
};

/// One [[tool]]: voxel-offset list in the tool frame (tip at the centre of the cutting head, shaft
/// along +y). `round` tools are in contact and cut alike in every orientation.
struct SceneTool {
  std::string name;
  std::string shape;
  double pitch_mm = 0.125;
  double radius_mm = 1.0;
  double length_mm = 2.0;
  bool round = false;
  bool turns = true;  ///< with the stylus; else it keeps the world's axes
  std::array<std::int32_t, 3> size_vox{};
  std::vector<ToolOffset> offsets;
  ToolMesh mesh;  ///< of the shape "stl"; else empty, as the shape defines the tool
  ToolShaft shaft;
  BurLaw law;
};

inline constexpr std::int32_t kMaxToolSide = 64;  ///< pitches; larger sums leave the kernels' range
inline constexpr std::size_t kMaxToolOffsets = 262144;  // a full cube of that side

/// Height of a head if the scene gives none: the proportions of dental burs.
[[nodiscard]] double default_length_mm(std::string_view shape, double radius_mm);

/// Largest number of pitches along one side of the tool; cheap, for checks before `make_tool`
/// allocates.
[[nodiscard]] double tool_side_vox(std::string_view shape, const ToolSize& size);

/// The samples of one tool. `shape` is one of kToolShapes, sizes are positive, a radius is at least
/// half a pitch, and `tool_side_vox` is at most kMaxToolSide (the loader refuses anything else), so
/// the list is never empty and never longer than kMaxToolOffsets. Ordered by y, then z, then x.
///
/// With `size_vox` = n the grid is n^3 about the centre (16 gives a ball of 2176 samples, 10 one of
/// 552). With a radius the middle of the grid is a sample (R = 5 pitches: 515). In both cases a
/// sample represents one pitch^3 of the tool, and is kept if its centre is in the profile.
[[nodiscard]] SceneTool make_tool(std::string name, std::string shape, const ToolSize& size);

/// Radius of the generating profile at height `y_mm` above the centre of the head; 0 outside.
[[nodiscard]] double profile_radius_mm(const SceneTool& tool, double y_mm);

/// The profile as a closed polyline of {y, radius} in mm from tip to shaft, denser toward the ends,
/// where heads are round. Both ends lie on the axis, so a lathe of it is a closed mesh. With 32
/// steps a ball keeps within 0.2 % of its radius.
[[nodiscard]] std::vector<std::array<double, 2>> tool_profile(const SceneTool& tool,
                                                              int steps = 32);

/// A part behind the head, for contact.
struct ToolPart {
  const char* name;                            ///< for a person
  std::vector<std::array<double, 2>> profile;  ///< its surface: {y, radius} in mm, upward
  double middle_mm = 0;                        ///< its height above the tool's centre
};

/// The shaft that a scene asks for, behind a head of this length. Its length counts from the tip.
[[nodiscard]] ToolShaft tool_shaft(const ShaftSize& size, double head_length_mm);

/// Shaft and handpiece, if there are any. The shaft begins where the head becomes narrower than it,
/// or with a face of its own behind a head that is nowhere as wide; one behind a mesh always has
/// that face. Hidden faces are left out.
[[nodiscard]] std::vector<ToolPart> shaft_parts(const SceneTool& tool);

/// Their common outline from the begin of the shaft, {y, radius} in mm; both ends are flat.
[[nodiscard]] std::vector<std::array<double, 2>> shaft_profile(const SceneTool& tool);

}  // namespace kerf
