// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/tool_volume.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

using Corners = std::array<glm::dvec3, 3>;  // in edges of the grid, from its first point

Corners corners_of(const Facets& facets, std::size_t triangle, const GridPoints& points) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& p = facets.points_mm[facets.triangles[triangle][k]];
    corners[k] = (glm::dvec3(p[0], p[1], p[2]) - points.first_mm) / points.edge_mm;
  }
  return corners;
}

double distance_to_edge(const glm::dvec3& at, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double square = glm::dot(along, along);
  const double fraction =
      square > 0.0 ? std::clamp(glm::dot(at - a, along) / square, 0.0, 1.0) : 0.0;
  return glm::length(at - a - fraction * along);
}

double distance_to(const Corners& t, const glm::dvec3& at) {
  const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  bool above = glm::dot(normal, normal) > 0.0;
  double nearest = distance_to_edge(at, t[2], t[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 &a = t[k], &b = t[(k + 1) % 3];
    above = above && glm::dot(glm::cross(b - a, at - a), normal) >= 0.0;
    nearest = std::min(nearest, distance_to_edge(at, a, b));
  }
  return above ? std::abs(glm::dot(normal, at - t[0])) / glm::length(normal) : nearest;
}

/// Grid points from `low` to `high`: the first and one after the last.
std::array<std::int32_t, 2> points_between(double low, double high, std::int32_t count) {
  const double first = std::clamp(std::ceil(low), 0.0, static_cast<double>(count));
  const double end = std::clamp(std::floor(high) + 1.0, first, static_cast<double>(count));
  return {static_cast<std::int32_t>(first), static_cast<std::int32_t>(end)};
}

/// Where `dot(normal, at) <= most`.
struct HalfSpace {
  glm::dvec3 normal;
  double most;
};

/// What holds all points within `reach` of a triangle and few others: its plane and its edges moved
/// out; all points if it is hardly more than a line, which hardly defines its plane.
std::array<HalfSpace, 5> around(const Corners& t, double reach) {
  constexpr double kSlack = 1e-6;  // edges of the grid: more than rounding
  constexpr double kLeastFraction = 1e-6;
  std::array<HalfSpace, 5> sides{};
  const glm::dvec3 across = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double size = glm::length(across);
  double longest_2 = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 edge = t[(k + 1) % 3] - t[k];
    longest_2 = std::max(longest_2, glm::dot(edge, edge));
  }
  if (!(size > kLeastFraction * longest_2)) return sides;
  const glm::dvec3 normal = across / size;
  const auto side = [&](const glm::dvec3& out, const glm::dvec3& through) {
    return HalfSpace{out, glm::dot(out, through) + reach + kSlack};
  };
  sides[0] = side(normal, t[0]);
  sides[1] = side(-normal, t[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    sides[2 + k] = side(glm::normalize(glm::cross(t[(k + 1) % 3] - t[k], normal)), t[k]);
  }
  return sides;
}

/// Calls `visit(x, y, z)` for the grid points within `reach` of a triangle and few others.
template <class Visit>
void for_points_near(const Corners& t, double reach, const VoxelGrid& grid, const Visit& visit) {
  const glm::dvec3 low = glm::min(glm::min(t[0], t[1]), t[2]) - reach;
  const glm::dvec3 high = glm::max(glm::max(t[0], t[1]), t[2]) + reach;
  const std::array<HalfSpace, 5> sides = around(t, reach);
  const auto [z0, z1] = points_between(low.z, high.z, grid.nz);
  const auto [y0, y1] = points_between(low.y, high.y, grid.ny);
  for (std::int32_t z = z0; z < z1; ++z) {
    for (std::int32_t y = y0; y < y1; ++y) {
      double from = low.x, to = high.x;
      for (const HalfSpace& side : sides) {
        const double left = side.most - side.normal.y * y - side.normal.z * z;
        if (side.normal.x > 0.0) to = std::min(to, left / side.normal.x);
        if (side.normal.x < 0.0) from = std::max(from, left / side.normal.x);
        if (side.normal.x == 0.0 && left < 0.0) to = from - 1.0;
      }
      if (to < from) continue;
      const auto [x0, x1] = points_between(from, to, grid.nx);
      for (std::int32_t x = x0; x < x1; ++x) visit(x, y, z);
    }
  }
}

/// On which side of the line from a to b a point lies, seen along y; the same bits, but for the
/// sign, from b to a.
double side_of(const glm::dvec3& a, const glm::dvec3& b, double x, double z) {
  const bool swapped = a.x != b.x ? a.x > b.x : a.z > b.z;
  const glm::dvec3 &p = swapped ? b : a, &q = swapped ? a : b;
  const double side = (q.x - p.x) * (z - p.z) - (q.z - p.z) * (x - p.x);
  return swapped ? -side : side;
}

/// Adds what a triangle does to the winding numbers of all points below it, at the highest of them.
void wind(const Corners& t, const VoxelGrid& grid, std::vector<std::int32_t>& steps) {
  // Aside of the grid's columns, so that none meets an edge.
  constexpr double kAsideX = 1.3e-6, kAsideZ = 2.1e-6;
  const auto [x_low, x_high] = std::minmax({t[0].x, t[1].x, t[2].x});
  const auto [z_low, z_high] = std::minmax({t[0].z, t[1].z, t[2].z});
  const auto columns_x = points_between(x_low - 1.0, x_high + 1.0, grid.nx);
  const auto columns_z = points_between(z_low - 1.0, z_high + 1.0, grid.nz);
  const auto pierce = [&](std::int32_t ix, std::int32_t iz) {
    const double x = ix + kAsideX, z = iz + kAsideZ;
    const double a = side_of(t[1], t[2], x, z), b = side_of(t[2], t[0], x, z);
    const double c = side_of(t[0], t[1], x, z);
    const bool faces_up = a < 0.0;
    if (a == 0.0 || b == 0.0 || c == 0.0 || (b < 0.0) != faces_up || (c < 0.0) != faces_up) return;
    const double y = (a * t[0].y + b * t[1].y + c * t[2].y) / (a + b + c);
    const auto below = points_between(0.0, std::ceil(y) - 1.0, grid.ny);
    if (below[1] > 0) steps[grid.index(ix, below[1] - 1, iz)] += faces_up ? 1 : -1;
  };
  for (std::int32_t iz = columns_z[0]; iz < columns_z[1]; ++iz) {
    for (std::int32_t ix = columns_x[0]; ix < columns_x[1]; ++ix) pierce(ix, iz);
  }
}

}  // namespace

std::vector<float> facet_distances(const Facets& facets, const GridPoints& points,
                                   double reach_mm) {
  const VoxelGrid& grid = points.grid;
  const double reach = reach_mm / points.edge_mm;
  std::vector<float> distance(grid.voxel_count(), static_cast<float>(reach_mm));
  std::vector<std::int32_t> winding(distance.size());  // steps of it, from above to below
  for (std::size_t i = 0; i < facets.triangles.size(); ++i) {
    const Corners t = corners_of(facets, i, points);
    for_points_near(t, reach, grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      float& nearest = distance[grid.index(x, y, z)];
      const double own = distance_to(t, glm::dvec3(x, y, z)) * points.edge_mm;
      nearest = std::min(nearest, static_cast<float>(own));
    });
    wind(t, grid, winding);
  }
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = grid.ny - 1; y >= 0; --y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        const std::size_t i = grid.index(x, y, z);
        if (y + 1 < grid.ny) winding[i] += winding[grid.index(x, y + 1, z)];
        if (winding[i] > 0) distance[i] = -distance[i];
      }
    }
  }
  return distance;
}

namespace {

constexpr double kMostAlong = 512.0;  // voxels
constexpr double kRampEdges = 2.0;    // over which the surface is antialiased
constexpr double kMarginEdges = 2.0;  // around a tool: half the ramp, and an edge of interpolation
constexpr glm::dvec3 kToolColour{0.60, 0.60, 0.61};

double distance_to_wall(const ProfilePoint& a, const ProfilePoint& b, const glm::dvec2& at) {
  const glm::dvec2 from(a[0], a[1]), along = glm::dvec2(b[0], b[1]) - from;
  const double square = glm::dot(along, along);
  const double fraction =
      square > 0.0 ? std::clamp(glm::dot(at - from, along) / square, 0.0, 1.0) : 0;
  return glm::length(at - from - fraction * along);
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

ChangedBricks ToolVolume::take(std::uint32_t tool) {
  if (held_ == tool) return {};
  held_ = tool;
  const std::vector<Density> before = density_;
  std::fill(density_.begin(), density_.end(), Density{0});
  if (tool < tools_.size()) fill(tools_[tool]);
  return changed_between(BrickGrid::of(grid_), before, density_);
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
        const double fraction = std::clamp(0.5 - 0.5 * distance_mm / ramp_mm, 0.0, 1.0);
        density_[voxel] = static_cast<Density>(std::lround(fraction * kDensityMax));
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

}  // namespace kerf
