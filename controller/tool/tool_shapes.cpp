// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_shapes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace kerf {
namespace {

constexpr double kInvertedConeNeck = 0.6;  // radius at the shaft over radius at the tip
constexpr double kFlameBelly = 0.6;        // where a flame is widest, as a part of its length
constexpr double kFlameNeck = 0.5;         // its radius at the shaft over the largest

/// Radius at `rise` = 0 (tip) .. 1 (shaft) over the largest radius; for shapes that only stretch.
double relative_radius(std::string_view shape, double rise) {
  if (shape == "cone") return rise;
  if (shape == "inverted_cone") return 1.0 - (1.0 - kInvertedConeNeck) * rise;
  if (shape == "flame") {
    if (rise <= kFlameBelly) {
      const double from_belly = 1.0 - rise / kFlameBelly;
      return 1.0 - from_belly * from_belly;
    }
    const double from_belly = (rise - kFlameBelly) / (1.0 - kFlameBelly);
    return 1.0 - (1.0 - kFlameNeck) * from_belly * from_belly;
  }
  return 1.0;  // cylinder
}

struct HeadSize {
  double radius_mm, length_mm;
};

HeadSize head_size(std::string_view shape, const ToolSize& size) {
  if (size.size_vox) {
    const double side_mm = *size.size_vox * size.pitch_mm;
    return {side_mm / 2, shape == "wheel" ? default_length_mm(shape, side_mm / 2) : side_mm};
  }
  return {size.radius_mm, size.length_mm.value_or(default_length_mm(shape, size.radius_mm))};
}

/// Samples across (x and z) and along the head (y).
struct HeadGrid {
  double across, along;
};

HeadGrid head_grid(std::string_view shape, const ToolSize& size) {
  const HeadSize head = head_size(shape, size);
  // A radius of exactly n pitches reaches n samples, however the quotient was rounded.
  const double reach = std::floor(head.radius_mm / size.pitch_mm * (1 + 1e-12));
  const double across = size.size_vox ? *size.size_vox : 2 * reach + 1;
  if (shape == "ball") return {across, across};
  return {across, std::max(1.0, std::round(head.length_mm / size.pitch_mm))};
}

}  // namespace

double default_length_mm(std::string_view shape, double radius_mm) {
  if (shape == "ball" || shape == "inverted_cone") return 2 * radius_mm;
  if (shape == "wheel") return radius_mm;
  if (shape == "flame") return 5 * radius_mm;
  return 4 * radius_mm;
}

double tool_side_vox(std::string_view shape, const ToolSize& size) {
  const HeadGrid grid = head_grid(shape, size);
  return std::max(grid.across, grid.along);
}

SceneTool make_tool(std::string name, std::string shape, const ToolSize& size) {
  assert(tool_side_vox(shape, size) <= kMaxToolSide);
  const HeadSize head = head_size(shape, size);
  const HeadGrid grid = head_grid(shape, size);
  const auto across = static_cast<std::int32_t>(grid.across);
  const auto along = static_cast<std::int32_t>(grid.along);

  SceneTool tool;
  tool.name = std::move(name);
  tool.shape = std::move(shape);
  tool.pitch_mm = size.pitch_mm;
  tool.radius_mm = head.radius_mm;
  tool.length_mm = head.length_mm;
  tool.round = tool.shape == "ball";
  tool.size_vox = {across, along, across};

  const double half_pitch_mm = size.pitch_mm / 2;
  // A sample that lies on the surface is kept, however the radius was rounded.
  const double on_surface = 1e-9 * head.radius_mm * head.radius_mm;
  for (std::int32_t y = 1 - along; y < along; y += 2) {
    const double radius_mm = profile_radius_mm(tool, y * half_pitch_mm);
    const double limit = (radius_mm * radius_mm + on_surface) / (half_pitch_mm * half_pitch_mm);
    for (std::int32_t z = 1 - across; z < across; z += 2) {
      for (std::int32_t x = 1 - across; x < across; x += 2) {
        if (x * x + z * z > limit) continue;
        tool.offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                static_cast<std::int16_t>(z)});
      }
    }
  }
  assert(!tool.offsets.empty() && tool.offsets.size() <= kMaxToolOffsets);
  return tool;
}

double profile_radius_mm(const SceneTool& tool, double y_mm) {
  const double half_mm = tool.length_mm / 2;
  if (!(std::abs(y_mm) <= half_mm)) return 0.0;
  if (tool.shape == "ball") return std::sqrt(half_mm * half_mm - y_mm * y_mm);
  if (tool.shape == "wheel") {
    return tool.radius_mm - half_mm + std::sqrt(half_mm * half_mm - y_mm * y_mm);
  }
  return tool.radius_mm * relative_radius(tool.shape, (y_mm + half_mm) / tool.length_mm);
}

std::vector<std::array<double, 2>> tool_profile(const SceneTool& tool, int steps) {
  const double half_mm = tool.length_mm / 2;
  std::vector<std::array<double, 2>> line{{-half_mm, 0.0}};
  for (int i = 0; i <= steps; ++i) {
    const double y_mm =
        std::clamp(-half_mm * std::cos(std::numbers::pi * i / steps), -half_mm, half_mm);
    const double radius_mm = profile_radius_mm(tool, y_mm);
    if (radius_mm > 0) line.push_back({y_mm, radius_mm});
  }
  line.push_back({half_mm, 0.0});
  return line;
}

}  // namespace kerf
