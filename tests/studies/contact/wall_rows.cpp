// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/rig/contact_motions.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/studies/contact/rows.hpp"

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

void measure_walls(const Effort& effort, const RowSink& add_row) {
  constexpr int kTicksPerWall = 500;
  struct Subject {
    const char* name;
    double thickness;
    ShakenTool tool;
    double deepest;
  };
  const SceneTool fluted = shipped_bur();
  const ShakenTool ball, cylinder{.round = false, .radius = 5, .half = 8},
      bur{.round = false, .mesh = &fluted};
  for (const Subject& subject : {Subject{"ball, wall of 5 mm", 50, ball, 0.05},
                                 Subject{"ball, wall of 2 voxels", 2, ball, 0.05},
                                 Subject{"turning cylinder, wall of 5 mm", 50, cylinder, 0.05},
                                 Subject{"turning cylinder, wall of 2 voxels", 2, cylinder, 0.05},
                                 Subject{"turning bur (STL), wall of 5 mm", 50, bur, 0.05},
                                 Subject{"turning bur (STL), wall of 2 voxels", 2, bur, 0.05}}) {
    const SampledTool made(subject.tool.made());
    Shaken seen;
    RandomNumbers random(11);
    for (int k = 0; k < effort.walls; ++k) {
      shake<FixedNumbers>(subject.thickness, subject.tool, made, kTicksPerWall, random, seen);
    }
    const std::string name = subject.name;
    const auto row = [&](const char* what, double value, const char* unit,
                         std::optional<double> must, std::optional<double> aim = std::nullopt) {
      add_row({"walls", name + what, value, unit, must, aim});
    };
    row(": ticks", double(seen.ticks), "ticks", std::nullopt);
    row(": ticks with the hand behind", double(seen.behind), "ticks", std::nullopt);
    row(": crossings", double(seen.crossed), "ticks", 0);
    row(": without force behind the face", double(seen.unfelt), "ticks", 0);
    row(": sunk", seen.deepest, "voxels", subject.deepest);
    row(": queries in a tick", seen.most_queries, "1", SweepRules::kMaxQueries);
  }
}

void measure_air(const Effort& effort, const RowSink& add_row) {
  struct Flight {
    double rate_hz, voxel_mm, m_per_s, gap_mm;
  };
  struct Subject {
    const char *name, *shape;
    double radius_mm, length_mm, turn_rad_per_s;
  };
  RandomNumbers random(23);
  std::vector<AirWall> walls;
  for (int k = 0; k < effort.air_walls; ++k) walls.emplace_back(random);
  for (const Flight& at : {Flight{250, 0.05, 0.5, 0.5},
                           {250, 0.05, 1, 0.5},
                           {1000, 0.02, 1, 0.25},
                           {1000, 0.1, 1, 0.14},
                           {8000, 0.02, 1, 0.03},
                           {1000, 0.25, 0.6, 0.25}}) {
    for (const Subject& tool :
         {Subject{"ball", "ball", 0.4, 0.8, 0}, Subject{"cylinder", "cylinder", 0.4, 0.8, 0},
          Subject{"turning cylinder", "cylinder", 0.4, 0.8, 30},
          Subject{"cone", "cone", 0.4, 0.8, 0}}) {
      const double length = tool.length_mm / at.voxel_mm;
      const SampledTool made(make_tool(tool.name, tool.shape,
                                       {.pitch_mm = std::max(1.0, length / 40),
                                        .radius_mm = tool.radius_mm / at.voxel_mm,
                                        .length_mm = length}));
      const AirFlight flight{1000 * at.m_per_s / at.rate_hz / at.voxel_mm, at.gap_mm / at.voxel_mm,
                             tool.turn_rad_per_s / at.rate_hz, at.voxel_mm, 1 / at.rate_hz};
      Flown flown;
      for (const AirWall& wall : walls) fly<FixedNumbers>(made, wall, flight, 100, random, flown);
      char name[128];
      std::snprintf(name, sizeof name, "%s, %g Hz, voxels of %g mm, %g m/s, %g mm beside a wall",
                    tool.name, at.rate_hz, at.voxel_mm, at.m_per_s, at.gap_mm);
      add_row({"air", std::string(name) + ": force", flown.force_n, "N", 0, {}});
    }
  }
}

void measure_rests(const Effort& effort, const RowSink& add_row) {
  const SampledTool ball(tool_of_units("ball", kRadius, 2 * kRadius));
  const auto placed = [&](const Solid& solid, const auto& measured) {
    RandomNumbers random(6);
    for (int k = 0; k < effort.tilts; ++k) {
      const Frame frame(random, kMiddle);
      const Body body = blurred(kGrid, [&](Point p) { return solid(frame.of(p)); });
      measured(frame, body, random);
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
    placed(solid, [&](const Frame& frame, const Body& body, RandomNumbers&) {
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
  placed(edge, [&](const Frame& frame, const Body& body, RandomNumbers& random) {
    const double lean = random.uniform(-0.7, 0.7);  // still on the edge, not on a face beside it
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

void measure_isos(const Effort& effort, const RowSink& add_row) {
  constexpr double kMiddle = 0.45, kBump = 14;
  for (const EdgedTool& subject :
       {EdgedTool{"ball", tool_of_units("ball", 8, 16)}, edged_tools()[0], edged_tools()[1]}) {
    const SampledTool tool(subject.tool);
    const auto degrees_at = [&](double iso, int tilts) {
      double most = 0;
      for (const double bump : {0.0, kBump}) {
        const IsoRests rests = rest_at_iso<FixedNumbers>(subject.tool, tool, iso, bump, tilts);
        most = std::max(most, rests.degrees);
      }
      return most;
    };
    // The limit of all rows: a largest angle of few tilts would be no limit of others.
    const double middle = degrees_at(kMiddle, Effort{}.tilts);
    for (const double iso : {0.02, 0.05, 0.1, 0.2, 0.3, kMiddle, 0.6, 0.7, 0.8, 0.95}) {
      char name[80];
      std::snprintf(name, sizeof name, "%s, iso %g: angle", subject.name, iso);
      add_row({"isos", name, iso == kMiddle ? middle : degrees_at(iso, effort.tilts), "deg",
               1.5 * middle, middle});
    }
  }
}

}  // namespace kerf::extremes
