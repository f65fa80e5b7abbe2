// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "lab/rig/guided_tool.hpp"
#include "lab/rig/posed_tool.hpp"

namespace kerf::extremes {

enum class EdgeWay { along, over };

/// Slides at a sharp convex edge of 90 degrees that lies along `frame.across`, anyhow in a volume.
/// Density is the solid's share of a cube of two units, turned with the edge, as a scan has it. The
/// ramp of the distance from the solid would not do: a voxel grid holds no ridge of it, and the
/// trilinear iso-surface is a row of bumps (docs/contact.md).
///
/// The hand is `depth` units below where the tool ideally rests and goes `step` units a tick, 12
/// units along the edge, or round it from 0.6 rad on one side to 0.6 on the other. There the ideal
/// force is constant or turns with the hand.
struct EdgeSlide {
  double step = 0.05, depth = 2;
  EdgeWay way = EdgeWay::along;
};

/// One slide's forces, over the stiffness, and their largest angle to the ideal ones.
struct EdgeFigures {
  Roughness roughness;
  double degrees = 0;
};

/// `axes`: of the tool's pose. A ball has the radius 8.
template <class N>
[[nodiscard]] EdgeFigures slide_at_edge(const EdgeSlide& slide, const SceneTool& shape,
                                        const SampledTool& tool, const Frame& frame,
                                        const Axes& axes, double lean) {
  const Reach reach(shape);
  const auto normal_at = [&](double angle) {
    return std::cos(angle) * frame.up + std::sin(angle) * frame.along;
  };
  struct Hand {
    Point centre, normal;
  };
  const auto at = [&](double angle, double along) {
    const Point normal = normal_at(angle);
    Point touching =
        tool.round ? -8.0 * normal : axes.to_world(reach.farthest(axes.to_tool(-1 * normal)));
    touching = touching - dot(touching, frame.across) * frame.across;  // the edge is long
    return Hand{frame.place + along * frame.across - touching, normal};
  };
  constexpr double kEnd = 0.6, kHalf = 6;  // rad, units
  std::vector<Hand> path;
  if (slide.way == EdgeWay::along) {
    for (double s = -kHalf; s < kHalf; s += slide.step) path.push_back(at(lean, s));
  } else {
    constexpr int kFine = 20000;
    for (int i = 0; i <= kFine; ++i) {
      const Hand next = at(kEnd * (2.0 * i / kFine - 1), 0);
      const auto place = [&](const Hand& hand) { return hand.centre - slide.depth * hand.normal; };
      if (path.empty() || length(place(next) - place(path.back())) >= slide.step) {
        path.push_back(next);
      }
    }
  }
  const Body body = body_of({52, 52, 52}, [&](Point p) {
    const Point from = p - frame.place;
    const double height = dot(from, frame.up), aside = dot(from, frame.along);
    const auto covered = [](double d) { return std::clamp(0.5 - d / 2, 0.0, 1.0); };
    return covered((height + aside) * std::sqrt(0.5)) * covered((height - aside) * std::sqrt(0.5));
  });
  const ToolTurn<N> turn = axes.turn<N>();
  const auto hand_of = [&](const Hand& hand, double depth) {
    return hand.centre - depth * hand.normal;
  };
  constexpr double kHigh = 12;  // the tool turns first
  GuidedTool<N> guided(tool, body, hand_of(path.front(), -kHigh));
  for (int i = 0; i < 100; ++i) guided.tick(hand_of(path.front(), -kHigh), turn);
  for (double depth = -kHigh; depth < slide.depth; depth += 0.1)
    guided.tick(hand_of(path.front(), depth), turn);
  EdgeFigures figures;
  for (const Hand& hand : path) {
    const Point force = guided.tick(hand_of(hand, slide.depth), turn);
    figures.roughness.add(force);
    figures.degrees = std::max(figures.degrees, degrees_between(force, hand.normal));
  }
  return figures;
}

}  // namespace kerf::extremes
