// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "lab/rig/body.hpp"
#include "lab/rig/contact_rig.hpp"
#include "lab/rig/posed_tool.hpp"

namespace kerf::extremes {

/// Where a tool of a fixed pose touches the iso-surface of a body's own trilinear density, by
/// looking at all of its close samples: what a contact without any mean would feel, noise included.
class ExactTouch {
 public:
  ExactTouch(const SampledTool& tool, const Axes& axes, const Body& body)
      : field_{body.grid, body.density.data(), density_scale(1 << 15), {}} {
    for (const SurfaceSample& sample : tool.close) samples_.push_back(axes.to_world(sample.at));
  }

  /// How far beyond `centre` along `normal` the tool's centre is at rest; within kRange.
  [[nodiscard]] double height(Point centre, Point normal) const {
    double lowest = 0;
    for (const Point& sample : samples_) lowest = std::min(lowest, dot(sample, normal));
    std::vector<Point> near;
    for (const Point& sample : samples_) {
      if (dot(sample, normal) < lowest + 3 * kRange) near.push_back(centre + sample);
    }
    double inside = -kRange, outside = kRange;
    while (outside - inside > 1e-4) {
      const double middle = (inside + outside) / 2;
      const bool touches = std::ranges::any_of(
          near, [&](Point place) { return density(place + middle * normal) > 0.5; });
      (touches ? inside : outside) = middle;
    }
    return (inside + outside) / 2;
  }

  /// The normal of the places where the tool rests, from their heights half a voxel away.
  [[nodiscard]] Point normal(Point centre, Point up) const {
    constexpr double kAway = 0.5;
    const Point along = unit(cross(up, std::abs(up[0]) < 0.7 ? Point{1, 0, 0} : Point{0, 1, 0}));
    const Point across = cross(up, along);
    const auto slope = [&](Point direction) {
      return (height(centre + kAway * direction, up) - height(centre - kAway * direction, up)) /
             (2 * kAway);
    };
    return unit(up - slope(along) * along - slope(across) * across);
  }

 private:
  static constexpr double kRange = 0.5;  // units

  [[nodiscard]] double density(Point place) const {
    return point_sample<DoubleNumbers>(field_, {place[0], place[1], place[2]}).density;
  }

  DensityField field_;
  std::vector<Point> samples_;
};

}  // namespace kerf::extremes
