// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/servo/kinematics/rotation.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// A plane that the tool presses on, at the device port.
template <class N>
struct PressedPlane {
  DeviceVec<typename N::Unit> normal{};  ///< out of the solid
  DeviceVec<typename N::Real> arm_mm{};  ///< from the tool's centre to the contact
  typename N::Real load_n{};             ///< along the normal, before any limit
  bool behind = false;                   ///< on shaft or handpiece
};

/// The tool as it rests on the solid: at its proxy, not where the hand would have it.
template <class N>
struct ToolContact {
  WorldVec<typename N::Real> centre_mm;
  Rotation<N> rotation = identity_rotation<N>();  ///< of its samples
  WorldVec<typename N::Unit> normal{};            ///< out of the solid, of the head; 0 in air
  WorldVec<typename N::Unit> press{};             ///< the same of the whole tool
  typename N::Unit head_share{1};                 ///< of the force along `press`
  DeviceVec<typename N::Real> head_arm_mm{};      ///< from its centre to where the head presses
  std::array<PressedPlane<N>, kMaxPlanes> planes{};
  std::size_t plane_count = 0;
};

/// A place of the world in a volume.
template <class N>
[[nodiscard]] VoxelVec<typename N::Real> place_in(const VolumePlan<N>& volume,
                                                  WorldVec<typename N::Real> at_mm) noexcept {
  return volume.voxel_from_world * (at_mm - volume.position_mm);
}

/// Samples of the active tool in one volume. A tool that is round, or that does not turn, has the
/// same samples whatever the stylus does.
template <class N>
[[nodiscard]] ToolPose<N> tool_pose(const VolumePlan<N>& volume, const ToolPlan<N>& tool,
                                    const ToolInVolume<N>& in_volume,
                                    WorldVec<typename N::Real> tip_mm,
                                    const Rotation<N>& rotation) noexcept {
  ToolPose<N> pose;
  pose.centre_vox = place_in(volume, tip_mm);
  pose.step = in_volume.unturned_step;
  if (tool.round || !tool.turns) return pose;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const auto& a = in_volume.voxel_from_pitch.row[i];
      if constexpr (N::kIsFixed) {
        std::int64_t sum = 0;  // Q24 * Q30 = Q54, three terms below 2^61.6
        for (std::size_t k = 0; k < 3; ++k) {
          sum += std::int64_t{a[k].raw()} * rotation.row[k][j].raw();
        }
        pose.step[i][j] = saturate_i32(round_shift(sum, 54 - 20));
      } else {
        pose.step[i][j] =
            a[0] * rotation.row[0][j] + a[1] * rotation.row[1][j] + a[2] * rotation.row[2][j];
      }
    }
  }
  return pose;
}

}  // namespace kerf
