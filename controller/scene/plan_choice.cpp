// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/plan_choice.hpp"

#include <optional>
#include <utility>

#include "controller/kernel/aligned_table.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/scene_words.hpp"

namespace kerf {
namespace {

/// Why the plan `aligned` cannot serve; empty where it can.
std::string not_aligned(const Scene& scene, const SceneTool& tool,
                        const std::optional<LatticeTurn>& turn) {
  if (scene.servo.numeric != NumericKind::fixed) {
    return std::string(word_of(scene.servo.numeric)) + " numbers";
  }
  if (aligned_taps(scene.servo.kernel) == nullptr) {
    return "gradient kernel " + std::string(word_of(scene.servo.kernel));
  }
  if (!tool.round && tool.turns) return "it turns and is not round";
  if (!turn) return "its samples do not lie on the volume's lattice";
  if (scene.cut.model != CutModel::none && tool.offsets.size() > kMaxAlignedCutSamples) {
    return "it cuts with more than " + std::to_string(kMaxAlignedCutSamples) + " samples";
  }
  if (!can_align(tool.offsets)) return "its samples are no lattice of at most 64 a side";
  return {};
}

}  // namespace

PlanChoice choose_plan(const Scene& scene, const SceneTool& tool, const SceneVolume& volume) {
  const std::optional<LatticeTurn> turn = lattice_turn(tool, volume);
  std::string reason = not_aligned(scene, tool, turn);
  if (!reason.empty()) return {Plan::gather, std::move(reason), {}};
  return {Plan::aligned, tool.round ? "round, on the volume's lattice" : "unturned, on the lattice",
          *turn};
}

}  // namespace kerf
