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

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/matrices.hpp"
#include "controller/tool/tool_shaft.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {

/// Where what is behind a tool's head touches a volume, by the cylinders themselves and trilinear
/// density: truth for what a shaft may bear.
class ShaftTouch {
 public:
  /// `density` is the volume's as it is now.
  ShaftTouch(const SceneVolume& volume, std::span<const Density> density)
      : volume_(volume), density_(density), to_volume_(matrix_of(volume.pose.orientation)) {}

  /// The least part of a press along `press` that is the head's, 0..1: what no sum of forces along
  /// the normals of the shaft's contacts can bear (the rest of Moreau's decomposition into a cone
  /// and its polar one). 1 where the shaft touches nothing. `rotation` row-major, world from tool.
  [[nodiscard]] double least_head_share(const SceneTool& tool, Point centre_mm,
                                        const std::array<double, 9>& rotation, Point press) const {
    const std::vector<Point> normals = normals_of(tool, centre_mm, rotation);
    std::vector<double> load(normals.size());
    Point left = press;
    constexpr int kSweeps = 200;  // of coordinate descent; few normals
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (std::size_t i = 0; i < normals.size(); ++i) {
        const double next = std::max(0.0, load[i] - dot(left, normals[i]));
        left = left + (next - load[i]) * normals[i];
        load[i] = next;
      }
    }
    return length(left);
  }

 private:
  /// A contact rests within so much of the iso-surface (docs/theory.md 3.6), in the finest voxels.
  static constexpr double kNearVox = 0.15;

  /// Normals out of the solid where the shaft touches, none within 2 degrees of another.
  [[nodiscard]] std::vector<Point> normals_of(const SceneTool& tool, Point centre_mm,
                                              const std::array<double, 9>& rotation) const {
    const auto& spacing = volume_.image.spacing_mm;
    const double voxel_mm = *std::ranges::min_element(spacing), near_mm = kNearVox * voxel_mm;
    std::vector<Point> normals;
    const auto look = [&](double y, double radius) {
      const int around = std::max(8, static_cast<int>(4 * radius * std::numbers::pi / voxel_mm));
      for (int i = 0; i < around; ++i) {
        const double angle = 2 * std::numbers::pi * i / around;
        const Point at{radius * std::cos(angle), y, radius * std::sin(angle)};
        const Point place = centre_mm + turned(rotation, at);
        if (!(density_at(place) >= volume_.iso)) continue;
        const Point normal = normal_at(place, voxel_mm);
        const auto alike = [&](Point n) {
          return dot(n, normal) > std::cos(2 * std::numbers::pi / 180);
        };
        if (length(normal) > 0.5 && std::ranges::none_of(normals, alike)) normals.push_back(normal);
      }
    };
    for (const ToolPart& part : parts_behind(tool)) {
      for (std::size_t i = 1; i < part.profile.size(); ++i) {
        const auto [y0, r0] = part.profile[i - 1];
        const auto [y1, r1] = part.profile[i];
        const int steps = 1 + static_cast<int>(2 * std::hypot(y1 - y0, r1 - r0) / voxel_mm);
        for (int s = 0; s <= steps; ++s) {
          const double t = static_cast<double>(s) / steps;
          const double y = y0 + t * (y1 - y0) + (y1 == y0 ? (i == 1 ? -near_mm : near_mm) : 0);
          look(y, r0 + t * (r1 - r0) + near_mm);
        }
      }
    }
    return normals;
  }

  [[nodiscard]] static Point turned(const std::array<double, 9>& m, Point p) {
    return {m[0] * p[0] + m[1] * p[1] + m[2] * p[2], m[3] * p[0] + m[4] * p[1] + m[5] * p[2],
            m[6] * p[0] + m[7] * p[1] + m[8] * p[2]};
  }

  /// Trilinear; 0 outside of the volume.
  [[nodiscard]] double density_at(Point world_mm) const {
    const VoxelGrid& grid = volume_.image.grid;
    const Point off = world_mm - volume_.pose.position_mm;
    std::array<std::int32_t, 3> low{};
    std::array<double, 3> part{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Point column{to_volume_[0][axis], to_volume_[1][axis], to_volume_[2][axis]};
      const double at = dot(column, off) / volume_.image.spacing_mm[axis];
      low[axis] = static_cast<std::int32_t>(std::floor(at));
      part[axis] = at - low[axis];
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

  [[nodiscard]] Point normal_at(Point place, double step_mm) const {
    Point gradient{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Point off{};
      off[axis] = step_mm;
      gradient[axis] = density_at(place + off) - density_at(place - off);
    }
    return length(gradient) > 1 ? -1 * unit(gradient) : Point{};
  }

  const SceneVolume& volume_;
  std::span<const Density> density_;
  Matrix to_volume_;
};

}  // namespace kerf::extremes
