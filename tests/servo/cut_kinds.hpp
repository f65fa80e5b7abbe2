// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "tests/servo/support.hpp"

namespace kerf::test {

/// A way of cutting, in one type of numbers.
struct CutKind {
  const char* name;
  NumericKind numeric;
  CutModel cut;
  bool round = true;
};
inline constexpr std::array kCutKinds{
    CutKind{"preston, fixed", NumericKind::fixed, CutModel::preston},
    CutKind{"preston, double", NumericKind::float64, CutModel::preston},
    CutKind{"paper, fixed, aligned", NumericKind::fixed, CutModel::overlap},
    CutKind{"paper, fixed, splat", NumericKind::fixed, CutModel::overlap, false},
    CutKind{"paper, double, gradients", NumericKind::float64, CutModel::overlap}};

/// Solid below y = 0, in 40^3 voxels: the far bricks of a block are missing.
inline LoadedScene cut_scene(const CutKind& kind) {
  const bool force = kind.cut == CutModel::preston;
  LoadedScene scene = force ? half_space_scene(44) : paper_scene(44);
  scene.servo.numeric = kind.numeric;
  scene.cut.model = kind.cut;
  scene.tools[0].round = kind.round;
  if (force) scene.cut.machinability_mm3_per_s_n = 8;
  return scene;
}

}  // namespace kerf::test
