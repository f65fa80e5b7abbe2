// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "lab/rig/posed_tool.hpp"
#include "lab/rig/rest.hpp"

namespace kerf::extremes {

/// How a tool in any pose rests on faces whose iso is not half of full density.
struct IsoRests {
  double degrees = 0;  ///< largest angle between force and normal
  double offset = 0;   ///< largest distance from the ideal place, units
};

/// `count` rests at a share `iso` of full density, on planes (`bump` = 0) or on balls of that
/// radius, at random tilts. Density rises to `full` over two units: where it is `iso` the face is
/// 1 - 2 iso / full units outside of where it is half of it, with the same normal.
template <class N>
[[nodiscard]] IsoRests rest_at_iso(const SceneTool& shape, const SampledTool& tool, double iso,
                                   double bump, int count, double full = 1) {
  const Reach reach(shape);
  Dice dice(8);
  IsoRests found;
  for (int k = 0; k < count; ++k) {
    const Frame frame(dice, {21, 21, 21});
    const Axes axes = standing_on(dice.direction(), dice);
    const Point touching =
        tool.round ? -8.0 * frame.up : axes.to_world(reach.farthest(axes.to_tool(-1 * frame.up)));
    const double outward = 1 - 2 * iso / full;
    const Point middle = frame.place + touching - (bump + outward) * frame.up;
    const Body body = body_of({44, 44, 44}, [&](Point p) {
      const Point from = p - middle;
      const double distance = bump > 0 ? length(from) - bump : dot(from, frame.up);
      return full * std::clamp(0.5 - distance / 2, 0.0, 1.0);
    });
    const auto level = static_cast<Density>(std::lround(iso * kDensityMax));
    const Point rest =
        rest_of<N>(tool, body, frame.place, frame.up, axes.turn<N>(), tool.round ? 4 : 20, level);
    const Point force = rest - frame.at(0, -1, 0);
    found.degrees = std::max(found.degrees, degrees_between(force, frame.up));
    found.offset = std::max(found.offset, std::abs(dot(rest - frame.place, frame.up)));
  }
  return found;
}

}  // namespace kerf::extremes
