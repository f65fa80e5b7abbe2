// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/tool_volume.hpp"

#include <cmath>
#include <numeric>

#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/compose/facet_distance.hpp"
#include "visualizer/error.hpp"
#include "visualizer/view/transfer_function.hpp"

namespace kerf {

namespace {

constexpr double kMostAlong = 512.0;  // voxels
constexpr double kRampEdges = 2.0;    // over which the surface is antialiased
constexpr double kMarginEdges = 2.0;  // around a tool: half the ramp, and an edge of interpolation
constexpr glm::dvec3 kToolColour{0.60, 0.60, 0.61};

double distance_to_wall(const ProfilePoint& a, const ProfilePoint& b, const glm::dvec2& at) {
  const glm::dvec2 from(a[0], a[1]), along = glm::dvec2(b[0], b[1]) - from;
  const double square = glm::dot(along, along);
  const double share = square > 0.0 ? std::clamp(glm::dot(at - from, along) / square, 0.0, 1.0) : 0;
  return glm::length(at - from - share * along);
}

/// Whether the line from `at` away from the axis crosses this wall.
bool is_under(const ProfilePoint& a, const ProfilePoint& b, const glm::dvec2& at) {
  if ((a[0] <= at.x) == (b[0] <= at.x)) return false;
  return glm::mix(a[1], b[1], (at.x - a[0]) / (b[0] - a[0])) > at.y;
}

/// Of a point (y, radius) to the surface of the bodies that the outlines sweep about the axis;
/// negative inside. An outline begins and ends on the axis.
double distance_to(const Outlines& outlines, const glm::dvec2& at) {
  double nearest = std::numeric_limits<double>::max();
  for (const std::vector<ProfilePoint>& points : outlines) {
    double distance = std::numeric_limits<double>::max();
    bool inside = false;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      distance = std::min(distance, distance_to_wall(points[i], points[i + 1], at));
      inside = inside != is_under(points[i], points[i + 1], at);
    }
    nearest = std::min(nearest, inside ? -distance : distance);
  }
  return nearest;
}

/// Flat lids close an end that is not on the axis.
Outlines closed(Outlines outlines) {
  for (std::vector<ProfilePoint>& points : outlines) {
    points.insert(points.begin(), {points.front()[0], 0.0});
    points.push_back({points.back()[0], 0.0});
  }
  return outlines;
}

}  // namespace

ToolVolume::ToolVolume(const SceneView& scene)
    : label_(static_cast<Label>(std::max<std::size_t>(scene.materials.size(), 1))) {
  if (scene.materials.size() >= kPaletteWidth) {
    throw VisualizerError("--voxel-tool: the scene has " + std::to_string(kPaletteWidth - 1) +
                          " materials and the tool needs one more; leave the option out");
  }
  Extent all;
  for (const ToolView& tool : scene.tools) {
    tools_.push_back({closed(tool_outlines(tool)), tool.facets});
    Extent& own = extents_.emplace_back();
    for (const std::vector<ProfilePoint>& points : tools_.back().outlines) {
      for (const auto& [y, radius] : points) own.add(y, radius);
    }
    for (const auto& [x, y, z] : tool.facets.points_mm) own.add(y, std::hypot(x, z));
    if (own.low_mm > own.high_mm) continue;  // nothing to see
    all.add(own.low_mm, own.radius_mm);
    all.add(own.high_mm, own.radius_mm);
  }
  const double along_mm = all.high_mm - all.low_mm;
  if (!(along_mm > 0.0 && all.radius_mm > 0.0 && std::isfinite(along_mm))) {
    throw VisualizerError(
        "--voxel-tool: the scene has no tool with an extent; leave the option out");
  }
  edge_mm_ =
      std::max(shortest_edge_mm(scene.main_volume().world_from_voxel), along_mm / kMostAlong);
  const auto voxels = [&](double length_mm) {
    return static_cast<std::int32_t>(std::ceil(length_mm / edge_mm_ + 2.0 * kMarginEdges)) + 1;
  };
  const std::int32_t across = voxels(2.0 * all.radius_mm);
  grid_ = {across, voxels(along_mm), across};
  // The axis goes through the middle, whether that is a voxel or a corner of four.
  first_mm_ = {-0.5 * edge_mm_ * (across - 1), all.low_mm - kMarginEdges * edge_mm_,
               -0.5 * edge_mm_ * (across - 1)};
  density_.resize(grid_.voxel_count());
  labels_.resize(grid_.voxel_count(), label_);
}

SceneView ToolVolume::added_to(const SceneView& scene) const {
  SceneView with = scene;
  if (with.materials.empty()) with.materials.push_back({.name = "none", .colour = {0, 0, 0}});
  for (std::size_t m = 1; m < scene.materials.size(); ++m) {  // as if there were no other
    with.materials[m].opacity =
        scene.materials[m].opacity.value_or(default_opacity(scene.materials, m));
  }
  // No density reaches this iso: a material by label only.
  with.materials.push_back({.name = "tool", .iso = 2.0, .colour = kToolColour, .opacity = 1.0});
  VolumeView& volume = with.volumes.emplace_back();
  volume.name = "tool";
  volume.bricks = BrickGrid::of(grid_);
  volume.world_from_voxel = world_from_voxel({});
  volume.solid = false;
  return with;
}

bool ToolVolume::take(std::uint32_t tool) {
  if (held_ == tool) return false;
  held_ = tool;
  std::fill(density_.begin(), density_.end(), Density{0});
  if (tool < tools_.size()) fill(tools_[tool]);
  return true;
}

/// Distances to what is swept are worked out on half a plane through the axis, twice as fine as the
/// voxels, and interpolated.
void ToolVolume::fill(const Parts& parts) {
  constexpr double kFiner = 2.0;
  std::vector<double> to_surface(static_cast<std::size_t>(kFiner * grid_.nx) + 2);
  const double ramp_mm = 0.5 * kRampEdges * edge_mm_;
  const std::vector<float> to_facets =
      facet_distances(parts.facets, {grid_, first_mm_, edge_mm_}, ramp_mm);
  for (std::int32_t y = 0; y < grid_.ny; ++y) {
    for (std::size_t i = 0; i < to_surface.size(); ++i) {
      const double radius_mm = static_cast<double>(i) * edge_mm_ / kFiner;
      to_surface[i] = distance_to(parts.outlines, {first_mm_.y + y * edge_mm_, radius_mm});
    }
    for (std::int32_t z = 0; z < grid_.nz; ++z) {
      for (std::int32_t x = 0; x < grid_.nx; ++x) {
        const double at =
            kFiner * std::hypot(first_mm_.x / edge_mm_ + x, first_mm_.z / edge_mm_ + z);
        const auto low = static_cast<std::size_t>(at);
        const double swept_mm =
            std::lerp(to_surface[low], to_surface[low + 1], at - static_cast<double>(low));
        const std::size_t voxel = grid_.index(x, y, z);
        const double distance_mm = std::min(swept_mm, static_cast<double>(to_facets[voxel]));
        const double share = std::clamp(0.5 - 0.5 * distance_mm / ramp_mm, 0.0, 1.0);
        density_[voxel] = static_cast<Density>(std::lround(share * kDensityMax));
      }
    }
  }
}

glm::dmat4 ToolVolume::world_from_voxel(const Hand& hand) const {
  return glm::scale(glm::translate(rigid(hand.tip_mm, hand.orientation), first_mm_),
                    glm::dvec3(edge_mm_));
}

std::optional<BoxCorners> ToolVolume::corners(const Hand& hand) const {
  if (hand.tool >= tools_.size() || tools_[hand.tool].outlines.empty()) return std::nullopt;
  const Extent& extent = extents_[hand.tool];
  const double margin_mm = kMarginEdges * edge_mm_;
  const double radius_mm = extent.radius_mm + margin_mm;
  const glm::dvec3 low(-radius_mm, extent.low_mm - margin_mm, -radius_mm);
  const glm::dvec3 high(radius_mm, extent.high_mm + margin_mm, radius_mm);
  return box_corners(low, high, rigid(hand.tip_mm, hand.orientation));
}

std::vector<std::uint32_t> ToolVolume::bricks() const {
  std::vector<std::uint32_t> all(BrickGrid::of(grid_).count());
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

}  // namespace kerf
