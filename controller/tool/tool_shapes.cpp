// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_shapes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "controller/tool/inner_samples.hpp"
#include "shared/numeric/elementary.hpp"

namespace kerf {
namespace {

constexpr double kInvertedConeNeck = 0.6;  // radius at the shaft over radius at the tip
constexpr double kFlameBelly = 0.6;        // widest height of a flame over its length
constexpr double kFlameNeck = 0.5;         // its radius at the shaft over the largest
constexpr double kPearBelly = 0.3;         // widest height of a pear over its length
constexpr double kPearNeck = 0.65;         // its radius at the shaft over the largest

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
  if (shape == "pear") {
    if (rise >= kPearBelly) {
      return 1.0 - (1.0 - kPearNeck) * (rise - kPearBelly) / (1.0 - kPearBelly);
    }
    const double from_belly = 1.0 - rise / kPearBelly;
    return std::sqrt(1.0 - from_belly * from_belly);  // half of an ellipse
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
  // A radius of exactly n pitches reaches n samples, for any rounding of the quotient. Except for a
  // ball the lattice reaches as far as the surface (SampleLattice::cover).
  const double pitches = head.radius_mm / size.pitch_mm;
  const double reach =
      shape == "ball" ? std::floor(pitches * (1 + 1e-12)) : std::ceil(pitches * (1 - 1e-12));
  const double across = size.size_vox ? *size.size_vox : 2 * reach + 1;
  if (shape == "ball") return {across, across};
  return {across, std::max(1.0, std::round(head.length_mm / size.pitch_mm))};
}

/// Covers rings a quarter of a pitch apart, at positions as far apart.
void cover_surface(const SceneTool& tool, SampleLattice& lattice) {
  const double apart_mm = tool.pitch_mm / 4;
  const double long_mm = std::numbers::pi / 2 * (tool.length_mm + tool.radius_mm);
  std::vector<CirclePoint> ring;  // of radius 1, as the last one had it
  for (const auto& [y_mm, radius_mm] :
       tool_profile(tool, static_cast<int>(std::ceil(long_mm / apart_mm)))) {
    // As many in each eighth, so that all are alike.
    const double eighth_mm = std::numbers::pi / 4 * radius_mm;
    const int count = 8 * std::max(1, static_cast<int>(std::ceil(eighth_mm / apart_mm)));
    if (ring.size() != static_cast<std::size_t>(count)) {
      ring.clear();
      for (int i = 0; i < count; ++i) ring.push_back(on_circle(2 * std::numbers::pi * i / count));
    }
    for (const auto& [x, z] : ring) {
      lattice.cover(
          {radius_mm * x / tool.pitch_mm, y_mm / tool.pitch_mm, radius_mm * z / tool.pitch_mm});
    }
  }
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

  SampleLattice lattice(across, along);
  const double half_pitch_mm = size.pitch_mm / 2;
  // A sample on the surface is kept for any rounding of the radius.
  const double on_surface = 1e-9 * head.radius_mm * head.radius_mm;
  for (std::int32_t y = 0; y < along; ++y) {
    const double radius_mm = profile_radius_mm(tool, (2 * y + 1 - along) * half_pitch_mm);
    const double limit = (radius_mm * radius_mm + on_surface) / (half_pitch_mm * half_pitch_mm);
    for (std::int32_t z = 0; z < across; ++z) {
      for (std::int32_t x = 0; x < across; ++x) {
        const std::int32_t right = 2 * x + 1 - across, back = 2 * z + 1 - across;
        if (right * right + back * back <= limit) lattice.keep(x, y, z);
      }
    }
  }
  if (!tool.round) cover_surface(tool, lattice);
  tool.offsets = lattice.offsets();
  const std::int32_t taken = size.size_vox ? across : lattice.taken_across();
  tool.size_vox = {taken, along, taken};
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
        std::clamp(-half_mm * cosine(std::numbers::pi * i / steps), -half_mm, half_mm);
    const double radius_mm = profile_radius_mm(tool, y_mm);
    if (radius_mm > 0) line.push_back({y_mm, radius_mm});
  }
  line.push_back({half_mm, 0.0});
  return line;
}

namespace {

using Profile = std::vector<std::array<double, 2>>;

/// Begin of the shaft's wall, and inner radius of the face there.
struct Beginning {
  double y_mm, face_mm;
};

Beginning beginning_of(const SceneTool& tool) {
  const double wide_mm = tool.shaft.radius_mm;
  if (!tool.mesh.triangles.empty()) return {tool.length_mm / 2, 0};
  const Profile head = tool_profile(tool, 2048);
  for (std::size_t k = head.size() - 1; k > 0; --k) {
    const auto &low = head[k - 1], &high = head[k];
    if (low[1] < wide_mm) continue;
    const double share = (low[1] - wide_mm) / (low[1] - high[1]);
    return {std::lerp(low[0], high[0], share), wide_mm};
  }
  return {tool.length_mm / 2, profile_radius_mm(tool, tool.length_mm / 2)};
}

ToolPart part_of(const char* name, Profile profile) {
  const double middle_mm = (profile.front()[0] + profile.back()[0]) / 2;
  return {name, std::move(profile), middle_mm};
}

}  // namespace

ToolShaft tool_shaft(const ShaftSize& size, double head_length_mm) {
  ToolShaft shaft;
  if (!size.radius_mm) return shaft;
  shaft.radius_mm = *size.radius_mm;
  shaft.end_mm = *size.length_mm - head_length_mm / 2;
  if (!size.handpiece_radius_mm) return shaft;
  shaft.handpiece_radius_mm = *size.handpiece_radius_mm;
  shaft.handpiece_end_mm =
      shaft.end_mm + size.handpiece_length_mm.value_or(*size.handpiece_radius_mm);
  return shaft;
}

std::vector<ToolPart> shaft_parts(const SceneTool& tool) {
  const ToolShaft& shaft = tool.shaft;
  std::vector<ToolPart> parts;
  if (!(shaft.radius_mm > 0)) return parts;
  const auto [y_mm, face_mm] = beginning_of(tool);
  Profile profile;
  if (face_mm < shaft.radius_mm) profile.push_back({y_mm, face_mm});
  profile.push_back({y_mm, shaft.radius_mm});
  profile.push_back({shaft.end_mm, shaft.radius_mm});
  const bool handpiece = shaft.handpiece_radius_mm > 0;
  if (!handpiece) profile.push_back({shaft.end_mm, 0});
  parts.push_back(part_of("shaft", std::move(profile)));
  if (!handpiece) return parts;
  profile = {};
  if (shaft.radius_mm < shaft.handpiece_radius_mm) {
    profile.push_back({shaft.end_mm, shaft.radius_mm});
  }
  profile.push_back({shaft.end_mm, shaft.handpiece_radius_mm});
  profile.push_back({shaft.handpiece_end_mm, shaft.handpiece_radius_mm});
  profile.push_back({shaft.handpiece_end_mm, 0});
  parts.push_back(part_of("handpiece", std::move(profile)));
  return parts;
}

std::vector<std::array<double, 2>> shaft_profile(const SceneTool& tool) {
  Profile outline;
  for (const ToolPart& part : shaft_parts(tool)) {
    for (const auto& point : part.profile) {
      if (outline.empty() || outline.back() != point) outline.push_back(point);
    }
  }
  return outline;
}

}  // namespace kerf
