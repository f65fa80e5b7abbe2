// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "lab/extremes/measures.hpp"
#include "lab/rig/edge_slide.hpp"

namespace kerf::extremes {

void measure_edge_slides(const Effort& effort, const RowSink& add_row) {
  struct Subject {
    std::string name;
    SceneTool tool;
  };
  for (const Subject& subject : {Subject{"ball", tool_of_units("ball", 8, 16)},
                                 Subject{"cylinder", tool_of_units("cylinder", 5, 16)}}) {
    const SampledTool tool(subject.tool);
    for (const EdgeWay way : {EdgeWay::along, EdgeWay::over}) {
      Dice dice(13);
      double step = 0;
      for (int k = 0; k < 2 * effort.slides; ++k) {
        Frame frame(dice, {25, 25, 25});
        frame.place = frame.at(0, -4, 0);
        const Axes lying = standing_on(frame.across, dice);  // its side on the edge
        const EdgeFigures figures = slide_at_edge<FixedNumbers>(
            {.way = way}, subject.tool, tool, frame, lying, dice.uniform(-0.5, 0.5));
        step = std::max(step, figures.roughness.ratio());
      }
      add_row({"edges",
               subject.name + (way == EdgeWay::along ? " along" : " over") +
                   " a sharp edge: force step over the mean",
               100 * step, "%", 5, 2});
    }
  }
}

}  // namespace kerf::extremes
