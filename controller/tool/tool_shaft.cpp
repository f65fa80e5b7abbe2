// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_shaft.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "controller/tool/tool_shapes.hpp"

namespace kerf {
namespace {

using Profile = std::vector<std::array<double, 2>>;

/// Where the shaft's wall begins, and from which radius a face leads there.
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

std::vector<ToolPart> parts_behind(const SceneTool& tool) {
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
  for (const ToolPart& part : parts_behind(tool)) {
    for (const auto& point : part.profile) {
      if (outline.empty() || outline.back() != point) outline.push_back(point);
    }
  }
  return outline;
}

}  // namespace kerf
