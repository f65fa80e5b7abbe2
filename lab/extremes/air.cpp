// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/rig/air_flight.hpp"

namespace kerf::extremes {

void measure_air(const Effort& effort, const RowSink& add_row) {
  constexpr double kNPerMm = 0.4;
  struct Flight {
    double rate_hz, voxel_mm, m_per_s, gap_mm;
  };
  struct Subject {
    const char *name, *shape;
    double radius_mm, length_mm, turn_rad_per_s;
  };
  Dice dice(23);
  std::vector<AirWall> walls;
  for (int k = 0; k < effort.air_walls; ++k) walls.emplace_back(dice);
  for (const Flight& at : {Flight{250, 0.05, 0.5, 0.5},
                           {250, 0.05, 1, 0.5},
                           {1000, 0.02, 1, 0.25},
                           {1000, 0.1, 1, 0.14},
                           {8000, 0.02, 1, 0.03}}) {
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
                             tool.turn_rad_per_s / at.rate_hz};
      Flown flown;
      for (const AirWall& wall : walls) fly<FixedNumbers>(made, wall, flight, 100, dice, flown);
      char name[128];
      std::snprintf(name, sizeof name, "%s, %g Hz, voxels of %g mm, %g m/s, %g mm beside a wall",
                    tool.name, at.rate_hz, at.voxel_mm, at.m_per_s, at.gap_mm);
      add_row({"air",
               std::string(name) + ": force",
               flown.longest_spring * at.voxel_mm * kNPerMm,
               "N",
               0,
               {}});
    }
  }
}

}  // namespace kerf::extremes
