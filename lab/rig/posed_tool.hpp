// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {

/// The tool's axes in the world.
struct Axes {
  Point x, y, z;

  template <class N>
  [[nodiscard]] ToolTurn<N> turn() const {
    using Unit = typename N::Unit;
    TurnRows<N> rows;
    for (std::size_t i = 0; i < 3; ++i) rows[i] = {Unit(x[i]), Unit(y[i]), Unit(z[i])};
    return turn_of<N>(rows);
  }
  [[nodiscard]] Point to_tool(Point world) const {
    return {dot(x, world), dot(y, world), dot(z, world)};
  }
  [[nodiscard]] Point to_world(Point tool) const { return tool[0] * x + tool[1] * y + tool[2] * z; }
};

[[nodiscard]] inline Axes standing_on(Point axis, Dice& dice) {
  const Point across = dice.across(axis);
  return {across, axis, cross(across, axis)};
}

/// How far a tool reaches along a direction of its own axes.
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
