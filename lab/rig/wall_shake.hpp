// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "lab/rig/guided_tool.hpp"

namespace kerf::extremes {

/// A ball; or a cylinder or a mesh, which are turned at random.
struct ShakenTool {
  bool round = true;
  double radius = 8, half = 8;
  const SceneTool* mesh = nullptr;  ///< instead of a cylinder; the caller's

  [[nodiscard]] SceneTool made() const {
    return mesh != nullptr ? *mesh : tool_of_units(round ? "ball" : "cylinder", radius, 2 * half);
  }
  [[nodiscard]] double reach() const {
    if (mesh == nullptr) return round ? radius : std::hypot(radius, half);
    double farthest = 0;
    for (const Point& point : mesh->mesh.points_mm) farthest = std::max(farthest, length(point));
    return farthest;
  }
  /// How far it reaches down along `up` from its centre.
  template <class N>
  [[nodiscard]] double reach_below(const ToolTurn<N>& turn, Point up) const {
    if (round) return radius;
    const auto rows = rows_of(turn);
    Point in_tool{};  // `up` along the tool's axes
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) in_tool[j] += double(rows[i][j]) * up[i];
    }
    if (mesh != nullptr) {
      double lowest = 0;
      for (const Point& point : mesh->mesh.points_mm) {
        lowest = std::min(lowest, dot(point, in_tool));
      }
      return -lowest;
    }
    const double axis = std::abs(in_tool[1]);
    return half * axis + radius * std::sqrt(std::max(0.0, 1 - axis * axis));
  }
};

/// What happened at the walls.
struct Shaken {
  long ticks = 0;
  long behind = 0;       ///< with the hand behind the face
  long unfelt = 0;       ///< of these: without force
  long crossed = 0;      ///< with the proxy's centre behind the face
  long turned_late = 0;  ///< with less turn than the hand's
  int most_queries = 0;
  double deepest = 0;       ///< of the proxy below the face
  double longest_jump = 0;  ///< of the proxy in a tick
};

/// F7 of docs/validation.md: a hand at the face of a wall of `thickness` units, tilted anyhow, goes
/// random steps of 0.1 to 10 m/s (at 0.1 mm a unit and 1 kHz), with small turns and large ones. No
/// supervisor stops it. `made` is the tool's. Depths count from where density is 1/2, crossings
/// too.
template <class N>
void shake(double thickness, const ShakenTool& tool, const SampledTool& made, int ticks, Dice& dice,
           Shaken& seen, Density iso = kIso) {
  const Frame frame(dice, {32, 32, 32});
  const Body wall = blurred({66, 66, 66}, [&](Point p) {
    const double height = frame.of(p)[1];
    return thickness > 40 ? height : std::abs(height + thickness / 2) - thickness / 2;
  });
  Point hand = frame.at(0, tool.reach() + 3, 0);
  ToolTurn<N> turn;
  GuidedTool<N> guided(made, wall, hand, 0, iso);
  for (int i = 0; i < ticks; ++i) {
    hand = hand + std::pow(10.0, dice.uniform(0, 2)) * dice.direction();
    const Point h = frame.of(hand);
    const double aside = std::max(1.0, std::hypot(h[0], h[2]) / 10);  // stay inside of the volume
    hand = frame.at(h[0] / aside, std::clamp(h[1], -14.0, 14.0), h[2] / aside);
    turn = compose(dice.turn<N>(i % 3 == 0 ? 3 : dice.uniform(0, 0.2)), turn);
    const Point before = guided.proxy();
    const double spring = length(guided.tick(hand, turn));

    const double below = tool.reach_below(guided.pose().turn, frame.up);
    const double height = frame.of(guided.proxy())[1];
    ++seen.ticks;
    seen.most_queries = std::max(seen.most_queries, guided.swept().queries);
    seen.deepest = std::max(seen.deepest, below - height);
    seen.longest_jump = std::max(seen.longest_jump, length(guided.proxy() - before));
    seen.crossed += height < 0 ? 1 : 0;
    seen.turned_late += guided.swept().turned ? 0 : 1;
    if (frame.of(hand)[1] < below - 0.1) {
      ++seen.behind;
      seen.unfelt += spring < 0.05 ? 1 : 0;
    }
  }
}

}  // namespace kerf::extremes
