// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/plan_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include "controller/kernel/overlap.hpp"
#include "controller/kernel/splat_table.hpp"
#include "controller/plan/aligned_tool.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/scene/scene_text.hpp"
#include "controller/scene/scene_words.hpp"

namespace kerf {
namespace {

/// Why the plan `aligned` cannot serve; empty where it can.
std::string not_aligned(const LoadedScene& scene, const SceneTool& tool,
                        const std::optional<LatticeTurn>& turn) {
  if (scene.servo.numeric != NumericKind::fixed) {
    return std::string(word_of(scene.servo.numeric)) + " numbers";
  }
  if (!tool.round && tool.turns) return "it turns and is not round";
  if (!turn) return "its samples do not lie on the volume's lattice";
  if (!can_align(tool.offsets)) return "its samples are no lattice of at most 64 a side";
  return {};
}

/// The bounds that keep sums of the plans `gather` and `splat` within their integers.
void check_any_pose(const LoadedScene& scene, const SceneTool& tool, const SceneVolume& volume) {
  const auto check = [&](double is, double most, const char* what, const char* way_out) {
    if (is <= most) return;
    throw SceneError(scene.path + ": tool " + tool.name + " in volume " + volume.name + ": up to " +
                     number_text(std::floor(is)) + what + ", and " + number_text(most) +
                     " are the end; " + way_out + ", or set servo.numeric = \"double\"");
  };
  double farthest_pitches = 0;
  for (const ToolOffset& offset : tool.offsets) {  // half pitches
    const double x = offset[0], y = offset[1], z = offset[2];
    farthest_pitches = std::max(farthest_pitches, std::sqrt(x * x + y * y + z * z) / 2);
  }
  double per_voxel = 1, reach = 0;
  std::array<double, 3> width{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double mm = volume.image.spacing_mm[axis];
    // The cubes around the samples that a voxel feels lie within its hat, widened by half their
    // diagonal to each side: in any pose its weights add up to no more than that hat's volume.
    per_voxel *= mm / tool.pitch_mm + std::numbers::sqrt3;
    width[axis] = static_cast<double>(overlap_width(tool.size_vox, tool.pitch_mm, mm));
    reach = std::max(reach, farthest_pitches * tool.pitch_mm / mm);
  }
  check(reach, kSampleReachVox, " voxels from the tool's centre",
        "use a smaller tool or one whose centre lies in its middle");
  if (scene.cut.model == CutModel::none) return;
  const auto& h = volume.image.spacing_mm;
  const bool fine = tool.pitch_mm < 0.99 * std::min({h[0], h[1], h[2]});
  check(per_voxel, kMaxSplatDensity, " samples in one voxel",
        fine ? "give the tool a larger pitch_mm" : "resample the volume to finer voxels");
  check(width[0] * width[1], kMaxPlaneVoxels, " voxels of a plane under the tool",
        "use a smaller tool");
}

}  // namespace

PlanChoice choose_plan(const LoadedScene& scene, const SceneTool& tool, const SceneVolume& volume) {
  if (scene.force.model == ForceModel::proxy && scene.cut.model == CutModel::none) {
    return {Plan::surface, "its surface alone is felt, and nothing is cut", {}};
  }
  const std::optional<LatticeTurn> turn = lattice_turn(tool, volume);
  std::string reason = not_aligned(scene, tool, turn);
  if (!reason.empty()) {
    if (scene.servo.numeric != NumericKind::fixed) return {Plan::gather, std::move(reason), {}};
    check_any_pose(scene, tool, volume);
    const Plan plan = scene.cut.model == CutModel::none ? Plan::gather : Plan::splat;
    return {plan, std::move(reason), {}};
  }
  return {Plan::aligned, tool.round ? "round, on the volume's lattice" : "unturned, on the lattice",
          *turn};
}

}  // namespace kerf
