// SPDX-License-Identifier: Apache-2.0
#include "lab/extremes/measured_tools.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/rig/wall_shake.hpp"

namespace kerf::extremes {

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
    Dice dice(11);
    for (int k = 0; k < effort.walls; ++k) {
      shake<FixedNumbers>(subject.thickness, subject.tool, made, kTicksPerWall, dice, seen);
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

}  // namespace kerf::extremes
