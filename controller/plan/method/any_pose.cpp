// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/any_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "controller/kernel/overlap.hpp"
#include "controller/kernel/splat_table.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/tables/aligned_tool.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/scene/scene_text.hpp"

namespace kerf {
namespace {

void check(const ToolCase& in, double is, double most, const char* what, const char* way_out) {
  if (is <= most) return;
  throw SceneError(in.scene.path + ": tool " + in.tool.name + " in volume " + in.volume.name +
                   ": up to " + number_text(std::floor(is)) + what + ", and " + number_text(most) +
                   " are the end; " + way_out + ", or set servo.numeric = \"double\"");
}

}  // namespace

std::string why_not_aligned(const ToolCase& in) {
  if (in.scene.servo.numeric != NumericKind::fixed) {
    return std::string(word_of(in.scene.servo.numeric)) + " numbers";
  }
  if (!in.tool.round && in.tool.turns) return "it turns and is not round";
  if (!lattice_turn(in.tool, in.volume)) return "its samples do not lie on the volume's lattice";
  if (!can_align(in.tool.offsets)) return "its samples are no lattice of at most 64 a side";
  return {};
}

void check_reach(const ToolCase& in) {
  double farthest_pitches = 0;
  for (const ToolOffset& offset : in.tool.offsets) {  // half pitches
    const double x = offset[0], y = offset[1], z = offset[2];
    farthest_pitches = std::max(farthest_pitches, std::sqrt(x * x + y * y + z * z) / 2);
  }
  double reach = 0;
  for (const double mm : in.volume.image.spacing_mm) {
    reach = std::max(reach, farthest_pitches * in.tool.pitch_mm / mm);
  }
  check(in, reach, kSampleReachVox, " voxels from the tool's centre",
        "use a smaller tool or one whose centre lies in its middle");
}

void check_splat(const ToolCase& in) {
  const auto& h = in.volume.image.spacing_mm;
  double per_voxel = 1;
  std::array<double, 3> width{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The cubes around the samples that a voxel feels lie within its hat, widened by half their
    // diagonal to each side: in any pose its weights add up to no more than that hat's volume.
    per_voxel *= h[axis] / in.tool.pitch_mm + std::numbers::sqrt3;
    width[axis] = static_cast<double>(overlap_width(in.tool.size_vox, in.tool.pitch_mm, h[axis]));
  }
  const bool fine = in.tool.pitch_mm < 0.99 * std::min({h[0], h[1], h[2]});
  check(in, per_voxel, kMaxSplatDensity, " samples in one voxel",
        fine ? "give the tool a larger pitch_mm" : "resample the volume to finer voxels");
  check(in, width[0] * width[1], kMaxPlaneVoxels, " voxels of a plane under the tool",
        "use a smaller tool");
}

}  // namespace kerf
