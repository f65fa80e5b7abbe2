// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/volume/voxel_grid.hpp"

/// Geometry of measurements: positions, directions and rotations in plain double, and random ones;
/// solids of known shape as volumes; the reach of a posed tool. Lengths in units of contact space.
namespace kerf::extremes {

using Point = vec3::Vec;
using vec3::cross, vec3::dot, vec3::length, vec3::unit;
using vec3::operator+, vec3::operator-, vec3::operator*;

inline double degrees_between(Point a, Point b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

template <class N>
Point point_of(ContactVec<typename N::Real> v) {
  return {double(v.x), double(v.y), double(v.z)};
}
template <class N>
ContactVec<typename N::Real> place_of(Point p) {
  using Real = typename N::Real;
  return {Real(p[0]), Real(p[1]), Real(p[2])};
}
template <class N>
ContactVec<typename N::Unit> normal_of(Point p) {
  using Unit = typename N::Unit;
  return {Unit(p[0]), Unit(p[1]), Unit(p[2])};
}

template <class N>
Point normal_of(const ConstraintPlane<N>& plane) {
  return {double(plane.normal.x), double(plane.normal.y), double(plane.normal.z)};
}

/// Random numbers, the same sequence on every machine.
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint64_t seed) : random_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  Point direction() {
    for (;;) {
      const Point p{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      if (length(p) < 1 && length(p) > 0.05) return unit(p);
    }
  }
  /// At right angles to `n`.
  Point across(Point n) { return unit(cross(n, direction())); }
  /// About a random axis.
  template <class N>
  Orientation<N> rotation(double angle_rad) {
    using Unit = typename N::Unit;
    const Point axis = std::sin(angle_rad / 2) * direction();
    return {Unit(axis[0]), Unit(axis[1]), Unit(axis[2]), Unit(std::cos(angle_rad / 2))};
  }

 private:
  std::mt19937_64 random_;
};

/// A position and three directions at right angles: a measurement in a random pose.
struct Frame {
  Point place, up, along, across;

  Frame(RandomNumbers& random, Point about)
      : place(about + Point{random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)}),
        up(random.direction()),
        along(random.across(up)),
        across(cross(up, along)) {}
  /// Coordinates in the frame.
  [[nodiscard]] Point of(Point p) const {
    const Point offset = p - place;
    return {dot(along, offset), dot(up, offset), dot(across, offset)};
  }
  [[nodiscard]] Point at(double x, double y, double z) const {
    return place + x * along + y * up + z * across;
  }
};

/// Fraction of full density by signed distance as a CT has it: edges blurred by a deviation of one
/// voxel, and 2 % of noise.
class CtEdge {
 public:
  double operator()(double distance) {
    return 0.5 * std::erfc(distance / std::sqrt(2.0)) + 0.02 * normal();
  }

 private:
  /// From the normal distribution, mean 0 and deviation 1 (Box and Muller 1958).
  double normal() {
    const double r = std::sqrt(-2 * std::log(dice_.uniform(1e-12, 1)));
    return r * std::cos(2 * std::numbers::pi * dice_.uniform(0, 1));
  }

  RandomNumbers dice_{9};
};

/// A volume of densities, and its size. Its voxels are units, the first at the origin.
struct Body {
  VoxelGrid grid;
  std::vector<Density> density;
};

/// Density of every voxel from a function of its indices.
template <class DensityAt>
[[nodiscard]] Body made_of(VoxelGrid grid, DensityAt&& density_at) {
  Body body{grid, {}};
  body.density.reserve(grid.voxel_count());
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) body.density.push_back(density_at(x, y, z));
    }
  }
  return body;
}

/// Fraction 0..1 of full density by position, clipped; the iso-surface is at 1/2.
template <class Share>
[[nodiscard]] Body body_of(VoxelGrid grid, Share&& share_at) {
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    const double share = share_at(Point{double(x), double(y), double(z)});
    return static_cast<Density>(std::lround(kDensityMax * std::clamp(share, 0.0, 1.0)));
  });
}

/// From a signed distance, negative inside; density rises over `edge` voxels.
template <class Distance>
[[nodiscard]] Body blurred(VoxelGrid grid, Distance&& distance, double edge = 2) {
  return body_of(grid, [&](Point p) { return 0.5 - distance(p) / edge; });
}

/// The tool's axes in the world.
struct Axes {
  Point x, y, z;

  template <class N>
  [[nodiscard]] Orientation<N> orientation() const {
    using Unit = typename N::Unit;
    RotationRows<N> rows;
    for (std::size_t i = 0; i < 3; ++i) rows[i] = {Unit(x[i]), Unit(y[i]), Unit(z[i])};
    return orientation_of<N>(rows);
  }
  [[nodiscard]] Point to_tool(Point world) const {
    return {dot(x, world), dot(y, world), dot(z, world)};
  }
  [[nodiscard]] Point to_world(Point tool) const { return tool[0] * x + tool[1] * y + tool[2] * z; }
};

[[nodiscard]] inline Axes standing_on(Point axis, RandomNumbers& random) {
  const Point across = random.across(axis);
  return {across, axis, cross(across, axis)};
}

/// The reach of a tool along a direction of its own axes.
class Reach {
 public:
  explicit Reach(const SceneTool& tool) : points_(tool.mesh.points_mm) {
    if (points_.empty()) profile_ = tool_profile(tool, 512);
  }
  [[nodiscard]] double along(Point direction) const { return dot(farthest(direction), direction); }
  /// The point of its surface that is farthest along it.
  [[nodiscard]] Point farthest(Point direction) const {
    Point best{};
    double most = -1e9;
    const auto take = [&](const Point& point) {
      const double support = dot(point, direction);
      if (support > most) {
        most = support;
        best = point;
      }
    };
    for (const Point& point : points_) take(point);
    const double across = std::hypot(direction[0], direction[2]);
    const double x = across > 0 ? direction[0] / across : 1,
                 z = across > 0 ? direction[2] / across : 0;
    for (const auto& [y, radius] : profile_) take({radius * x, y, radius * z});
    return best;
  }

 private:
  std::vector<Point> points_;
  std::vector<std::array<double, 2>> profile_;
};

}  // namespace kerf::extremes
