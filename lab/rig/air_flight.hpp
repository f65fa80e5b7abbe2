// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lab/rig/body.hpp"
#include "lab/rig/guided_tool.hpp"

namespace kerf::extremes {

/// A flat wall that is tilted anyhow; the air above it.
struct AirWall {
  static constexpr std::int32_t kEdge = 96;

  Frame frame;
  Body body;

  explicit AirWall(Dice& dice)
      : frame(dice, {kEdge / 2.0, kEdge / 2.0, kEdge / 2.0}),
        body(blurred({kEdge, kEdge, kEdge}, [&](Point p) { return frame.of(p)[1]; })) {}
};

/// A tool that is led to and fro along it.
struct AirFlight {
  double units_per_tick = 1;  ///< where a tick is long the way is too, beyond the volume
  double gap_units = 1;       ///< from the wall's iso-surface
  double turn_rad = 0;        ///< in each tick, about any axis; the gap is then the whole sphere's
};

/// What was felt there: nothing, if all is well.
struct Flown {
  int ticks = 0;
  double longest_spring = 0;  ///< units
  int most_queries = 0;
};

template <class N>
void fly(const SampledTool& tool, const AirWall& wall, const AirFlight& flight, int ticks,
         Dice& dice, Flown& flown) {
  ToolTurn<N> turn = dice.turn<N>(dice.uniform(0, 3));
  const auto rows = rows_of(turn);
  double below = 0, reach = 0;
  for (const Point& sample : tool.samples) {
    double height = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        height += wall.frame.up[i] * double(rows[i][j]) * sample[j];
      }
    }
    below = std::max(below, -height);
    reach = std::max(reach, length(sample));
  }
  const double height = (flight.turn_rad > 0 ? reach : below) + flight.gap_units;
  const double half = std::max(0.3 * AirWall::kEdge, 0.65 * flight.units_per_tick);
  double at = dice.uniform(-half, half), way = flight.units_per_tick;
  const Point far = wall.frame.at(at, 3 * reach, 0);
  GuidedTool<N> guided(tool, wall.body, far);
  for (int i = 0; i < 20; ++i) static_cast<void>(guided.tick(far, turn));  // it takes time to turn
  guided.start(wall.frame.at(at, height, 0));
  for (int i = 0; i <= ticks; ++i) {
    const Point hand = wall.frame.at(at, height, 0);
    // The hand, as the numbers of the sweep have it.
    const Point hand_felt = point_of<N>(place_of<N>(hand));
    static_cast<void>(guided.tick(hand, turn));
    if (i > 0) {
      ++flown.ticks;
      flown.longest_spring = std::max(flown.longest_spring, length(guided.proxy() - hand_felt));
      flown.most_queries = std::max(flown.most_queries, guided.swept().queries);
    }
    if (std::abs(at + way) > half) way = -way;
    at += way;
    if (flight.turn_rad > 0) turn = compose(dice.turn<N>(flight.turn_rad), turn);
  }
}

}  // namespace kerf::extremes
