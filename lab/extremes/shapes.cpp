// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>

#include "lab/extremes/measures.hpp"
#include "lab/rig/loft.hpp"
#include "lab/rig/posed_tool.hpp"
#include "lab/rig/rest.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr VoxelGrid kGrid{44, 44, 44};
constexpr Point kMiddle{21, 21, 21};

enum class Pose { any, upright, lying };

}  // namespace

void measure_shapes(const Effort& effort, const RowSink& add_row) {
  struct Subject {
    const char* name;
    SceneTool tool;
    Pose pose;
  };
  // 1.5 times what a ball may.
  constexpr double kOffset = 0.075, kOffsetAim = 0.03, kDegrees = 0.75, kDegreesAim = 0.45;
  for (const Subject& subject :
       {Subject{"cylinder, any pose", tool_of_units("cylinder", 5, 16), Pose::any},
        Subject{"cylinder on its end", tool_of_units("cylinder", 5, 16), Pose::upright},
        Subject{"cylinder on its side", tool_of_units("cylinder", 5, 16), Pose::lying},
        Subject{"cone, any pose", tool_of_units("cone", 5, 16), Pose::any},
        Subject{"inverted cone, any pose", tool_of_units("inverted_cone", 5, 10), Pose::any},
        Subject{"flame, any pose", tool_of_units("flame", 4, 16), Pose::any},
        Subject{"wheel, any pose", tool_of_units("wheel", 8, 4), Pose::any},
        Subject{"needle 2 voxels thick, any pose", tool_of_units("cylinder", 1, 16), Pose::any},
        Subject{"STL, square bar, any pose", mesh_of_units("bar", prism(6, 16, 4)), Pose::any},
        Subject{"STL, fluted bur, any pose", mesh_of_units("bur", fluted_bur(24)), Pose::any}}) {
    const Reach reach(subject.tool);
    const SampledTool tool(subject.tool);
    Dice dice(8);
    double sum = 0, most = 0, degrees = 0;
    for (int k = 0; k < effort.tilts; ++k) {
      const Frame frame(dice, kMiddle);
      const Point axis = subject.pose == Pose::upright ? frame.up
                         : subject.pose == Pose::lying ? frame.along
                                                       : dice.direction();
      const Axes axes = standing_on(axis, dice);
      const double support = reach.along(axes.to_tool(-1 * frame.up));
      const Body body = blurred(kGrid, [&](Point p) { return frame.of(p)[1] + support; });
      // From so high that the tool can turn first.
      const Point rest = rest_of<N>(tool, body, frame.place, frame.up, axes.turn<N>(), 20);
      const double off = frame.of(rest)[1];
      sum += off;
      most = std::max(most, std::abs(off));
      degrees = std::max(degrees, degrees_between(rest - frame.at(0, -1, 0), frame.up));
    }
    const auto row = [&](const char* what, double value, const char* unit, double must,
                         double aim) {
      add_row({"shapes", std::string(subject.name) + what, value, unit, must, aim});
    };
    row(": mean offset", std::abs(sum / effort.tilts), "voxels", kOffset, kOffsetAim);
    row(": largest offset", most, "voxels", kOffset, kOffsetAim);
    row(": angle", degrees, "deg", kDegrees, kDegreesAim);
  }
  measure_shape_edges(effort, add_row);
  measure_shape_slides(effort, add_row);
}

}  // namespace kerf::extremes
