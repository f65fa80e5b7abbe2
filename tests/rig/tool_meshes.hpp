// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "controller/tool/inner_samples.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "tests/rig/geometry.hpp"

namespace kerf::extremes {

/// The closed body between outlines at heights of y: `point(y, angle)` is the outline's corner, its
/// angle from x to z. Flat ends.
template <class Outline>
[[nodiscard]] std::vector<LooseTriangle> loft(const std::vector<double>& heights, int sides,
                                              const Outline& point) {
  std::vector<LooseTriangle> triangles;
  const auto add = [&](const Point& a, const Point& b, const Point& c) {
    LooseTriangle& t = triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      t[0][i] = static_cast<float>(a[i]);
      t[1][i] = static_cast<float>(b[i]);
      t[2][i] = static_cast<float>(c[i]);
    }
  };
  const auto corner = [&](double y, int side) {
    return point(y, 2 * std::numbers::pi * (side % sides) / sides);
  };
  const auto middle = [&](double y) {
    Point sum{};
    for (int side = 0; side < sides; ++side) sum = sum + 1.0 / sides * corner(y, side);
    return sum;
  };
  const double low = heights.front(), high = heights.back();
  const Point low_middle = middle(low), high_middle = middle(high);
  for (int side = 0; side < sides; ++side) {
    add(low_middle, corner(low, side), corner(low, side + 1));
    for (std::size_t k = 1; k < heights.size(); ++k) {
      const double y = heights[k - 1], above = heights[k];
      add(corner(y, side), corner(above, side), corner(y, side + 1));
      add(corner(y, side + 1), corner(above, side), corner(above, side + 1));
    }
    add(high_middle, corner(high, side + 1), corner(high, side));
  }
  return triangles;
}

/// A cylinder of flat sides; 4 make a square bar, its half diagonal the radius.
[[nodiscard]] inline std::vector<LooseTriangle> prism(double radius, double length, int sides) {
  return loft({-length / 2, length / 2}, sides, [&](double y, double angle) {
    return Point{radius * std::cos(angle), y, radius * std::sin(angle)};
  });
}

/// A tapered bur with a round end and twisted flutes, its largest radius 1/5 of the length.
[[nodiscard]] inline std::vector<LooseTriangle> fluted_bur(double length) {
  constexpr int kFlutes = 6, kSides = 60, kRings = 16;
  const double top = 0.2 * length, tip = 0.12 * length;  // radii at the shaft and of the round end
  std::vector<double> heights;
  for (int ring = 0; ring <= 6; ++ring) {
    heights.push_back(-length / 2 + tip * (1 - std::cos(std::numbers::pi / 2 * ring / 6)));
  }
  for (int ring = 1; ring <= kRings; ++ring) {
    heights.push_back(-length / 2 + tip + (length - tip) * ring / kRings);
  }
  return loft(heights, kSides, [&](double y, double angle) {
    const double rise = y + length / 2;
    const double radius = rise < tip ? std::sqrt(std::max(0.0, rise * (2 * tip - rise)))
                                     : std::lerp(tip, top, (rise - tip) / (length - tip));
    const double twist = 1.5 * rise / length;
    const double flute = std::abs(std::sin(kFlutes * (angle + twist) / 2));  // 0 in the groove
    const double cut = radius * (1 - 0.18 * (1 - std::pow(flute, 0.5)) * std::min(1.0, rise / tip));
    return Point{cut * std::cos(angle), y, cut * std::sin(angle)};
  });
}

/// A tool of voxels of 1 mm, so that mm are units.
[[nodiscard]] inline SceneTool mesh_of_units(const char* name,
                                             const std::vector<LooseTriangle>& triangles) {
  return make_mesh_tool(name, join_triangles(triangles, 1, name), 1);
}

}  // namespace kerf::extremes
