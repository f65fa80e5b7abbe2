// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/rig/rest.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr double kRadius = 8;
constexpr VoxelGrid kGrid{36, 36, 36};
constexpr Point kMiddle{17, 17, 17};

/// A solid by the distance from it, in a frame in which the ball should rest at the origin.
using Solid = std::function<double(Point)>;

Solid convex(double radius) {
  return [=](Point p) { return length(p + Point{0, kRadius + radius, 0}) - radius; };
}
Solid concave(double radius) {
  return [=](Point p) { return radius - length(p + Point{0, kRadius - radius, 0}); };
}
double flat(Point p) {
  return p[1] + kRadius;
}
double crease(Point p) {
  return (p[1] - std::abs(p[2])) * std::sqrt(0.5) + kRadius;
}
double edge(Point p) {
  return (p[1] + kRadius + std::abs(p[2])) * std::sqrt(0.5);
}

/// Distance from `centre` to the iso-surface of the trilinear density, along the nearest of many
/// rays.
double iso_distance(const Body& body, Point centre) {
  const DensityField field{body.grid, body.density.data(), density_scale(kIso), {}};
  const auto inside = [&](Point p) {
    const double place[3] = {p[0], p[1], p[2]};
    return point_sample<DoubleNumbers>(field, place).density - 0.5;
  };
  constexpr int kRays = 8000;
  constexpr double kFrom = kRadius - 1.5, kTo = kRadius + 2, kStep = 0.05;
  double nearest = kTo;
  for (int i = 0; i < kRays; ++i) {
    const double z = 1 - (2 * i + 1.0) / kRays, r = std::sqrt(1 - z * z);
    const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Point direction{r * std::cos(turn), r * std::sin(turn), z};
    double before = inside(centre + kFrom * direction);
    for (double at = kFrom; at < nearest; at += kStep) {
      const double now = inside(centre + (at + kStep) * direction);
      if (now >= 0) {
        nearest = std::min(nearest, before >= 0 ? at : at + kStep * before / (before - now));
        break;
      }
      before = now;
    }
  }
  return nearest;
}

}  // namespace

void measure_rests(const Effort& effort, const RowSink& add_row) {
  const SampledTool ball(tool_of_units("ball", kRadius, 2 * kRadius));
  const auto placed = [&](const Solid& solid, const auto& measured) {
    Dice dice(6);
    for (int k = 0; k < effort.tilts; ++k) {
      const Frame frame(dice, kMiddle);
      const Body body = blurred(kGrid, [&](Point p) { return solid(frame.of(p)); });
      measured(frame, body, dice);
    }
  };
  struct Subject {
    const char* name;
    Solid solid;
  };
  for (const auto& [name, solid] :
       {Subject{"plane", flat}, Subject{"convex 40", convex(40)}, Subject{"convex 14", convex(14)},
        Subject{"convex 6", convex(6)}, Subject{"concave 40", concave(40)},
        Subject{"concave 14", concave(14)}, Subject{"crease of 90 degrees", crease}}) {
    double sum = 0, most = 0;
    placed(solid, [&](const Frame& frame, const Body& body, Dice&) {
      const Point rest = rest_of<N>(ball, body, frame.place, frame.up);
      const double off = solid(frame.of(rest)) - kRadius;
      sum += off;
      most = std::max(most, std::abs(off));
    });
    add_row({"rests", std::string(name) + ": mean offset", std::abs(sum / effort.tilts), "voxels",
             0.05, 0.02});
    add_row({"rests", std::string(name) + ": largest offset", most, "voxels", 0.05, 0.02});
  }
  double sum = 0, most = 0;
  placed(edge, [&](const Frame& frame, const Body& body, Dice& dice) {
    const double lean = dice.uniform(-0.7, 0.7);  // still on the edge, not on a face beside it
    const Point up = unit(std::cos(lean) * frame.up + std::sin(lean) * frame.across);
    const Point top = frame.at(0, -kRadius, 0);
    const Point rest = rest_of<N>(ball, body, top + kRadius * up, up);
    const double off = iso_distance(body, rest) - kRadius;
    sum += off;
    most = std::max(most, std::abs(off));
  });
  add_row({"rests", "sharp edge, to the iso-surface: mean offset", std::abs(sum / effort.tilts),
           "voxels", 0.12, 0.05});
  add_row({"rests", "sharp edge, to the iso-surface: largest offset", most, "voxels", 0.12, 0.05});
}

}  // namespace kerf::extremes
