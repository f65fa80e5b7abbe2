// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "hil/lab/extremes/led.hpp"

namespace kerf::extremes {

/// A ball, or a cylinder that is turned at random.
struct ShakenTool {
  bool round = true;
  double radius = 8, half = 8;

  [[nodiscard]] SceneTool made() const {
    return tool_of_units(round ? "ball" : "cylinder", radius, 2 * half);
  }
  [[nodiscard]] double reach() const { return round ? radius : std::hypot(radius, half); }
  /// How far it reaches down along `up` from its centre.
  template <class N>
  [[nodiscard]] double reach_below(const ToolTurn<N>& turn, Point up) const {
    if (round) return radius;
    const auto rows = rows_of(turn);
    const double axis = std::abs(double(rows[0][1]) * up[0] + double(rows[1][1]) * up[1] +
                                 double(rows[2][1]) * up[2]);
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
  int most_probes = 0;
  double deepest = 0;       ///< of the proxy below the face
  double longest_jump = 0;  ///< of the proxy in a tick
};

/// F7: a hand at the face of a wall of `thickness` units, tilted anyhow, goes random steps of 0.1
/// to 10 m/s (at 0.1 mm a unit and 1 kHz), with small turns and large ones. No supervisor stops it.
template <class N>
void shake(double thickness, const ShakenTool& tool, int ticks, Dice& dice, Shaken& seen) {
  const Frame frame(dice, {32, 32, 32});
  const Body wall = blurred({66, 66, 66}, [&](Point p) {
    const double height = frame.of(p)[1];
    return thickness > 40 ? height : std::abs(height + thickness / 2) - thickness / 2;
  });
  Point hand = frame.at(0, tool.reach() + 3, 0);
  ToolTurn<N> turn;
  Led<N> led(tool.made(), wall, hand);
  for (int i = 0; i < ticks; ++i) {
    hand = hand + std::pow(10.0, dice.uniform(0, 2)) * dice.direction();
    const Point h = frame.of(hand);
    const double aside = std::max(1.0, std::hypot(h[0], h[2]) / 10);  // stay inside of the volume
    hand = frame.at(h[0] / aside, std::clamp(h[1], -14.0, 14.0), h[2] / aside);
    turn = compose(dice.turn<N>(i % 3 == 0 ? 3 : dice.uniform(0, 0.2)), turn);
    const Point before = led.proxy();
    const double spring = length(led.tick(hand, turn));

    const double below = tool.reach_below(led.pose().turn, frame.up);
    const double height = frame.of(led.proxy())[1];
    ++seen.ticks;
    seen.most_probes = std::max(seen.most_probes, led.swept().probes);
    seen.deepest = std::max(seen.deepest, below - height);
    seen.longest_jump = std::max(seen.longest_jump, length(led.proxy() - before));
    seen.crossed += height < 0 ? 1 : 0;
    seen.turned_late += led.swept().turned ? 0 : 1;
    if (frame.of(hand)[1] < below - 0.1) {
      ++seen.behind;
      seen.unfelt += spring < 0.05 ? 1 : 0;
    }
  }
}

}  // namespace kerf::extremes
