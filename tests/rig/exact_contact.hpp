// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/geometry.hpp"

/// True contact of a head and of a shaft, by brute force on the trilinear density.
namespace kerf::extremes {

/// Contact of a tool of fixed orientation with the iso-surface of a body's own trilinear density,
/// from all of its close samples: the contact without any averaging, noise included.
class ExactTouch {
 public:
  ExactTouch(const SampledTool& tool, const Axes& axes, const Body& body)
      : field_{body.grid, body.density.data(), density_scale(1 << 15), {}} {
    for (const SurfaceSample& sample : tool.close) samples_.push_back(axes.to_world(sample.at));
  }

  /// Distance of the tool's centre at rest from `centre`, along `normal`; within kRange.
  [[nodiscard]] double height(Point centre, Point normal) const {
    double lowest = 0;
    for (const Point& sample : samples_) lowest = std::min(lowest, dot(sample, normal));
    std::vector<Point> near;
    for (const Point& sample : samples_) {
      if (dot(sample, normal) < lowest + 3 * kRange) near.push_back(centre + sample);
    }
    double inside = -kRange, outside = kRange;
    while (outside - inside > 1e-4) {
      const double middle = (inside + outside) / 2;
      const bool touches = std::ranges::any_of(
          near, [&](Point place) { return density(place + middle * normal) > 0.5; });
      (touches ? inside : outside) = middle;
    }
    return (inside + outside) / 2;
  }

  /// The normal of the surface of rest positions, from their heights half a voxel away.
  [[nodiscard]] Point normal(Point centre, Point up) const {
    constexpr double kAway = 0.5;
    const Point along = unit(cross(up, std::abs(up[0]) < 0.7 ? Point{1, 0, 0} : Point{0, 1, 0}));
    const Point across = cross(up, along);
    const auto slope = [&](Point direction) {
      return (height(centre + kAway * direction, up) - height(centre - kAway * direction, up)) /
             (2 * kAway);
    };
    return unit(up - slope(along) * along - slope(across) * across);
  }

 private:
  static constexpr double kRange = 0.5;  // units

  [[nodiscard]] double density(Point place) const {
    return point_sample<DoubleNumbers>(field_, {place[0], place[1], place[2]}).density;
  }

  DensityField field_;
  std::vector<Point> samples_;
};

/// Contact of shaft and handpiece with a volume, by the cylinders themselves and trilinear density:
/// the truth for the load that a shaft may bear.
class ShaftTouch {
 public:
  /// `density` is the volume's as it is now.
  ShaftTouch(const SceneVolume& volume, std::span<const Density> density)
      : volume_(volume),
        density_(density),
        to_volume_(matrix_of(volume.pose.orientation)),
        voxel_mm_(*std::ranges::min_element(volume.image.spacing_mm)) {}

  /// Smallest fraction of the press (0..1) that the head must carry if the hand presses the tool
  /// along `press`, because no frictionless contact of the shaft can. By Moreau's decomposition
  /// this is the largest component of the press along a direction in which the shaft is free,
  /// meaning that it can move one voxel without penetrating deeper. (Directions also describe the
  /// contact at an edge, where a normal does not.) A small extra depth, up to `kDeeperVox`, is
  /// tolerated and subtracted. 1 if the shaft touches nothing. `rotation` row-major, world from
  /// tool.
  [[nodiscard]] double least_head_share(const SceneTool& tool, Point centre_mm,
                                        const std::array<double, 9>& rotation, Point press) const {
    const std::vector<Place> places = places_of(tool, centre_mm, rotation);
    const Point down = unit(press);
    double share = 0;
    for (int i = 0; i < kWays; ++i) {  // over the half sphere about `down`
      const double along = 1 - static_cast<double>(i) / kWays;
      if (along <= share) break;
      const double deeper = deeper_along(places, way_about(down, along, i), along - share);
      share = std::max(share, along - deeper);
    }
    return share;
  }

 private:
  /// The shaft is enlarged by this, in the finest voxels: a contact rests within this distance of
  /// the iso-surface (docs/theory.md 3.6).
  static constexpr double kNearVox = 0.15;
  /// Depth that a wedged tool may have (docs/theory.md 4.2), in the finest voxels. A direction in
  /// which the shaft penetrates deeper by more than this is not free.
  static constexpr double kDeeperVox = 0.05;
  /// Rise of the density per voxel in the ramp of a face that is two voxels wide.
  static constexpr double kRamp = kDensityMax / 2.0;
  static constexpr int kWays = 10000;  ///< 1.5 degrees apart over a half sphere

  /// A point of the shaft's surface near the solid, and the density that it may have after a move
  /// without being deeper.
  struct Place {
    Point at;
    double most;
  };

  /// The i-th direction to test; its component along `down` is `along`.
  [[nodiscard]] static Point way_about(Point down, double along, int i) {
    const Point x = unit(cross(down, std::abs(down[0]) < 0.7 ? Point{1, 0, 0} : Point{0, 1, 0}));
    const Point y = cross(down, x);
    const double across = std::sqrt(1 - along * along);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    return along * down + across * std::cos(angle) * x + across * std::sin(angle) * y;
  }

  /// How much deeper the shaft gets by moving one voxel along `way`, in voxels; 1 if this exceeds
  /// `most` or `kDeeperVox`.
  [[nodiscard]] double deeper_along(const std::vector<Place>& places, Point way,
                                    double most) const {
    const double end = std::min(most, kDeeperVox);
    double deeper = 0;
    for (const Place& place : places) {
      deeper = std::max(deeper, (density_at(place.at + voxel_mm_ * way) - place.most) / kRamp);
      if (deeper > end) return 1;
    }
    return deeper;
  }

  [[nodiscard]] std::vector<Place> places_of(const SceneTool& tool, Point centre_mm,
                                             const std::array<double, 9>& rotation) const {
    std::vector<Place> places;
    const double near_mm = kNearVox * voxel_mm_;
    const auto look = [&](double y, double radius) {
      const int around = std::max(8, static_cast<int>(4 * radius * std::numbers::pi / voxel_mm_));
      for (int i = 0; i < around; ++i) {
        const double angle = 2 * std::numbers::pi * i / around;
        const Point at{radius * std::cos(angle), y, radius * std::sin(angle)};
        const Point place = centre_mm + turned(rotation, at);
        if (!is_near(place)) continue;
        places.push_back({place, std::max<double>(volume_.iso, density_at(place))});
      }
    };
    for (const ToolPart& part : shaft_parts(tool)) {
      for (std::size_t i = 1; i < part.profile.size(); ++i) {
        const auto [y0, r0] = part.profile[i - 1];
        const auto [y1, r1] = part.profile[i];
        const int steps = 1 + static_cast<int>(2 * std::hypot(y1 - y0, r1 - r0) / voxel_mm_);
        for (int s = 0; s <= steps; ++s) {
          const double t = static_cast<double>(s) / steps;
          const double y = y0 + t * (y1 - y0) + (y1 == y0 ? (i == 1 ? -near_mm : near_mm) : 0);
          look(y, r0 + t * (r1 - r0) + near_mm);
        }
      }
    }
    return places;
  }

  /// Returns true if a path of one voxel may lead to a voxel that reaches the iso.
  [[nodiscard]] bool is_near(Point world_mm) const {
    const VoxelGrid& grid = volume_.image.grid;
    const Point at = in_voxels(world_mm);
    const auto from = [&](double x) { return std::max(0, static_cast<int>(std::floor(x)) - 1); };
    const auto to = [&](double x, int n) {
      return std::min(n - 1, static_cast<int>(std::floor(x)) + 2);
    };
    for (int z = from(at[2]); z <= to(at[2], grid.nz); ++z) {
      for (int y = from(at[1]); y <= to(at[1], grid.ny); ++y) {
        for (int x = from(at[0]); x <= to(at[0], grid.nx); ++x) {
          if (density_[grid.index(x, y, z)] >= volume_.iso) return true;
        }
      }
    }
    return false;
  }

  [[nodiscard]] Point in_voxels(Point world_mm) const {
    const Point off = world_mm - volume_.pose.position_mm;
    Point at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Point column{to_volume_[0][axis], to_volume_[1][axis], to_volume_[2][axis]};
      at[axis] = dot(column, off) / volume_.image.spacing_mm[axis];
    }
    return at;
  }

  [[nodiscard]] static Point turned(const std::array<double, 9>& m, Point p) {
    return {m[0] * p[0] + m[1] * p[1] + m[2] * p[2], m[3] * p[0] + m[4] * p[1] + m[5] * p[2],
            m[6] * p[0] + m[7] * p[1] + m[8] * p[2]};
  }

  /// Trilinear; 0 outside of the volume.
  [[nodiscard]] double density_at(Point world_mm) const {
    const VoxelGrid& grid = volume_.image.grid;
    const Point at = in_voxels(world_mm);
    std::array<std::int32_t, 3> low{};
    std::array<double, 3> part{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = static_cast<std::int32_t>(std::floor(at[axis]));
      part[axis] = at[axis] - low[axis];
    }
    double sum = 0;
    for (std::int32_t corner = 0; corner < 8; ++corner) {
      const std::int32_t x = low[0] + (corner & 1), y = low[1] + (corner >> 1 & 1),
                         z = low[2] + (corner >> 2);
      if (x < 0 || y < 0 || z < 0 || x >= grid.nx || y >= grid.ny || z >= grid.nz) continue;
      sum += density_[grid.index(x, y, z)] * ((corner & 1) != 0 ? part[0] : 1 - part[0]) *
             ((corner >> 1 & 1) != 0 ? part[1] : 1 - part[1]) *
             (corner >> 2 != 0 ? part[2] : 1 - part[2]);
    }
    return sum;
  }

  const SceneVolume& volume_;
  std::span<const Density> density_;
  Matrix to_volume_;
  double voxel_mm_;  ///< the finest
};

}  // namespace kerf::extremes
