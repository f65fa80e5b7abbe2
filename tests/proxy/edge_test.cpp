// SPDX-License-Identifier: Apache-2.0
// A cylinder whose side lies on a sharp edge of the solid: the normal is the tool's own there.
#include <algorithm>

#include <doctest/doctest.h>

#include "lab/rig/contact_motions.hpp"
#include "tests/case_count.hpp"

using namespace kerf;
using namespace kerf::extremes;

TEST_CASE_TEMPLATE("along and over a sharp edge the force of a cylinder is steady", N, FixedNumbers,
                   DoubleNumbers) {
  const SceneTool cylinder = tool_of_units("cylinder", 5, 16);
  const SampledTool tool(cylinder);
  for (const EdgeWay way : {EdgeWay::along, EdgeWay::over}) {
    Dice dice(13);
    double worst = 0;
    for (int i = 0; i < test::cases(16); ++i) {
      Frame frame(dice, {25, 25, 25});
      frame.place = frame.at(0, -4, 0);
      const Axes lying = standing_on(frame.across, dice);
      const double lean = dice.uniform(-0.5, 0.5);
      const EdgeFigures figures =
          slide_at_edge<N>({.way = way}, cylinder, tool, frame, lying, lean);
      worst = std::max(worst, figures.roughness.ratio());
    }
    CHECK(worst < (way == EdgeWay::along ? 0.025 : 0.05));
  }
}
