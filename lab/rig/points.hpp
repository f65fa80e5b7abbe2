// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"
#include "shared/numeric/vec3.hpp"

/// Places, directions and turns in plain double, and random ones. Lengths in units of contact
/// space.

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

/// The same sequence on every machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}

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
  ToolTurn<N> turn(double angle_rad) {
    using Unit = typename N::Unit;
    const Point axis = std::sin(angle_rad / 2) * direction();
    return {Unit(axis[0]), Unit(axis[1]), Unit(axis[2]), Unit(std::cos(angle_rad / 2))};
  }

 private:
  std::mt19937_64 random_;
};

/// A place and three directions at right angles: a measurement turned at random.
struct Frame {
  Point place, up, along, across;

  Frame(Dice& dice, Point about)
      : place(about + Point{dice.uniform(0, 1), dice.uniform(0, 1), dice.uniform(0, 1)}),
        up(dice.direction()),
        along(dice.across(up)),
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

/// Share of full density by signed distance as a CT has it: edges blurred by a deviation of one
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

  Dice dice_{9};
};

}  // namespace kerf::extremes
