// SPDX-License-Identifier: Apache-2.0
// What a tool rests on it cuts, where its rim or its point lies between the places of its lattice.
#include <array>
#include <cstddef>
#include <string>

#include <doctest/doctest.h>

#include "controller/tool/tool_shapes.hpp"
#include "tests/case_count.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::rim_cut_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

struct Head {
  std::string shape;
  double radius, length;  ///< voxels
};

/// Parts of what the force should cut that are cut, in each fifth of a second: a hand holds an
/// upright tool 1 mm deep in a flat. Those at whose end the press is near the threshold count as 1.
std::array<double, 3> parts_cut(const SceneTool& tool, double half_mm, NumericKind numeric,
                                int rate_hz) {
  LoadedScene scene = half_space_scene(48);
  scene.tools = {tool};
  scene.tools[0].turns = false;
  scene.servo.numeric = numeric;
  scene.servo.rate_hz = rate_hz;
  scene.cut.model = CutModel::preston;
  scene.cut.machinability_mm3_per_s_n = 4;
  const double above_mm = half_mm + 0.3, pressed_mm = half_mm - 1;
  CuttingHand hand(scene, {0, above_mm, 0});
  const int down = rate_hz / 20;
  for (int i = 1; i <= down; ++i) {
    static_cast<void>(hand.step({0, above_mm + (pressed_mm - above_mm) * i / down, 0}));
  }
  std::array<double, 3> parts{};
  for (double& part : parts) {
    const double removed_mm3 = hand.removed_mm3(), fed_mm3 = hand.fed_mm3();
    const ServoOutput out = hand.hold({0, pressed_mm, 0}, 0.2);
    const bool bears = out.press_n > scene.cut.threshold_n + 0.02;
    part = bears ? (hand.removed_mm3() - removed_mm3) / (hand.fed_mm3() - fed_mm3) : 1;
  }
  return parts;
}

}  // namespace

TEST_CASE("what a tool rests on it cuts, wherever its rim lies on the lattice of its samples") {
  struct Run {
    NumericKind numeric;
    int rate_hz;
  };
  for (const auto& [numeric, rate_hz] :
       kinds({Run{NumericKind::fixed, 1000}, Run{NumericKind::fixed, 250},
              Run{NumericKind::fixed, 8000}, Run{NumericKind::float64, 1000}})) {
    for (const auto& [shape, radius, length] :
         {Head{"inverted_cone", 3.04, 3}, Head{"inverted_cone", 4.06, 9.3}, Head{"flame", 4, 4},
          Head{"flame", 1, 5}, Head{"cone", 1.97, 2}, Head{"cone", 4.23, 4.2},
          Head{"wheel", 3, 1.5}, Head{"cone", 0, 16}}) {
      CAPTURE(static_cast<int>(numeric));
      CAPTURE(rate_hz);
      CAPTURE(shape);
      CAPTURE(radius);
      ToolSize size{.pitch_mm = kVoxelMm};
      if (radius > 0) {
        size.radius_mm = radius * kVoxelMm;
        size.length_mm = length * kVoxelMm;
      } else {
        size.size_vox = static_cast<int>(length);  // no sample is on the axis
      }
      const auto parts =
          parts_cut(make_tool(shape, shape, size), length * kVoxelMm / 2, numeric, rate_hz);
      for (std::size_t i = 1; i < parts.size(); ++i) CHECK(parts[i] > 0.5);
    }
  }
}

}  // namespace kerf::rim_cut_test
