// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/plan_choice.hpp"

#include <algorithm>

#include "controller/kernel/aligned_table.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/matrices.hpp"
#include "controller/scene/scene_words.hpp"

namespace kerf {
namespace {

/// Tool pitch and voxel are the same to the loop's last bit.
bool same_lattice(const SceneTool& tool, const SceneVolume& volume) {
  const auto& h = volume.image.spacing_mm;
  return std::all_of(h.begin(), h.end(), [&](double mm) {
    return step_of<FixedNumbers>(tool.pitch_mm / mm) == FixedNumbers::kStepOne;
  });
}

/// Why the plan `aligned` cannot serve; empty where it can.
std::string not_aligned(const Scene& scene, const SceneTool& tool, const SceneVolume& volume) {
  if (scene.servo.numeric != NumericKind::fixed) {
    return std::string(word_of(scene.servo.numeric)) + " numbers";
  }
  if (aligned_taps(scene.servo.kernel) == nullptr) {
    return "the gradient kernel " + std::string(word_of(scene.servo.kernel));
  }
  if (!tool.round) return "the tool turns and is not round";
  if (!same_lattice(tool, volume)) return "its pitch is not the voxel edge";
  if (scene.cut.model != CutModel::none && tool.offsets.size() > kMaxAlignedCutSamples) {
    return "more than " + std::to_string(kMaxAlignedCutSamples) + " samples that cut";
  }
  if (!can_align(tool.offsets)) return "its samples are not on one lattice";
  return {};
}

}  // namespace

PlanChoice choose_plan(const Scene& scene, const SceneTool& tool, const SceneVolume& volume) {
  const std::string reason = not_aligned(scene, tool, volume);
  if (!reason.empty()) return {Plan::gather, reason};
  return {Plan::aligned, "round, on the volume's lattice"};
}

}  // namespace kerf
