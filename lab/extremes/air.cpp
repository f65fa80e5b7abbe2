// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/rig/air_flight.hpp"

namespace kerf::extremes {

namespace {

constexpr double kNPerMm = 0.4;

struct Flight {
  double rate_hz, voxel_mm, m_per_s, gap_mm;
};
struct Subject {
  const char *name, *shape;
  double radius_mm, length_mm, turn_rad_per_s;
};

std::vector<AirWall> walls_of(const Effort& effort, double density, Dice& dice) {
  std::vector<AirWall> walls;
  for (int k = 0; k < effort.air_walls; ++k) walls.emplace_back(dice, density);
  return walls;
}

/// The longest spring of a tool that nothing holds, as a force.
void fly_along(const std::vector<AirWall>& walls, const std::string& where, const Flight& at,
               const Subject& tool, Dice& dice, const RowSink& add_row) {
  const double length = tool.length_mm / at.voxel_mm;
  const SampledTool made(make_tool(tool.name, tool.shape,
                                   {.pitch_mm = std::max(1.0, length / 40),
                                    .radius_mm = tool.radius_mm / at.voxel_mm,
                                    .length_mm = length}));
  const AirFlight flight{1000 * at.m_per_s / at.rate_hz / at.voxel_mm, at.gap_mm / at.voxel_mm,
                         tool.turn_rad_per_s / at.rate_hz};
  Flown flown;
  for (const AirWall& wall : walls) fly<FixedNumbers>(made, wall, flight, 100, dice, flown);
  char name[128];
  std::snprintf(name, sizeof name, "%s, %g Hz, voxels of %g mm, %g m/s, %s", tool.name, at.rate_hz,
                at.voxel_mm, at.m_per_s, where.c_str());
  add_row({"air",
           std::string(name) + ": force",
           flown.longest_spring * at.voxel_mm * kNPerMm,
           "N",
           0,
           {}});
}

std::string with_number(const char* format, double number) {
  char text[64];
  std::snprintf(text, sizeof text, format, number);
  return text;
}

}  // namespace

void measure_air(const Effort& effort, const RowSink& add_row) {
  constexpr Subject kBall{"ball", "ball", 0.4, 0.8, 0},
      kCylinder{"cylinder", "cylinder", 0.4, 0.8, 0},
      kTurning{"turning cylinder", "cylinder", 0.4, 0.8, 30}, kCone{"cone", "cone", 0.4, 0.8, 0};
  Dice dice(23);
  const std::vector<AirWall> hard = walls_of(effort, 1, dice);
  for (const Flight& at : {Flight{250, 0.05, 0.5, 0.5},
                           {250, 0.05, 1, 0.5},
                           {1000, 0.02, 1, 0.25},
                           {1000, 0.1, 1, 0.14},
                           {8000, 0.02, 1, 0.03}}) {
    for (const Subject& tool : {kBall, kCylinder, kTurning, kCone}) {
      fly_along(hard, with_number("%g mm beside a wall", at.gap_mm), at, tool, dice, add_row);
    }
  }
  // Half in what is softer than the iso.
  for (const double of_iso : {0.6, 0.95}) {
    const std::vector<AirWall> soft = walls_of(effort, of_iso / 2, dice);
    for (const Flight& at :
         {Flight{250, 0.05, 0.5, -0.4}, {1000, 0.02, 1, -0.4}, {8000, 0.02, 1, -0.4}}) {
      for (const Subject& tool : {kBall, kCylinder, kCone}) {
        fly_along(soft, with_number("half in %g of iso", of_iso), at, tool, dice, add_row);
      }
    }
  }
}

}  // namespace kerf::extremes
