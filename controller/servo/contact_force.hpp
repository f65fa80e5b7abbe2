// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/milling.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/sampling.hpp"
#include "controller/servo/kinematics.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

// The contact force of a tick, by the proxy or by overlap, and the pose of the tool on the solid.

namespace kerf {

/// The contact of the active tool in one tick, and its removal by overlap. `contact_and_cut` fills
/// it; limits, energy, cut by force and output read it. Forces are at the device port, before any
/// limit. The default is a tool in air.
template <class N>
struct ContactResult {
  using Real = typename N::Real;
  using Unit = typename N::Unit;

  DeviceVec<Real> contact_n;
  /// Force of the cutting: the modification force if overlap cuts, else the friction of the last
  /// cut.
  DeviceVec<Real> modification_n;
  DeviceVec<Real> spring_n, friction_n;        ///< parts of `contact_n`; the rest is damping
  bool law_failed = false;                     ///< by itself; a force may also be not finite
  std::array<Removed, kMaxVolumes> removed{};  ///< by overlap; by volume of the scene

  // Of the proxy:
  WorldVec<Real> proxy_offset_mm;   ///< from the hand's tip to the proxy's
  DeviceVec<Real> tip_torque_n_mm;  ///< of both forces about the tool's centre
  Real shaft_force_n{};             ///< load of shaft and handpiece
  std::int64_t samples_read = 0;    ///< as sample_reader.hpp counts

  // The tool at its proxy, not at the position of the hand:
  WorldVec<Real> centre_mm;
  Rotation<N> rotation = identity_rotation<N>();  ///< of its samples
  WorldVec<Unit> normal{};                        ///< out of the solid, of the head; 0 in air
  WorldVec<Unit> press{};                         ///< out of the solid, of the whole tool; 0 in air
  Unit head_fraction{1};                          ///< of the force along `press`
  DeviceVec<Real> head_lever_mm{};                ///< from its centre to the load of the head
  std::array<PlaneLoad<N>, kMaxPlanes> planes{};
  std::size_t plane_count = 0;
};

/// The world position `at_mm` in voxels of a volume.
template <class N>
[[nodiscard]] VoxelVec<typename N::Real> voxel_position(const VolumePlan<N>& volume,
                                                        WorldVec<typename N::Real> at_mm) noexcept {
  return volume.voxel_from_world * (at_mm - volume.position_mm);
}

/// Samples of the active tool in one volume. A tool that is round, or that does not rotate with the
/// stylus, has the same samples in every orientation.
template <class N>
[[nodiscard]] ToolPose<N> tool_pose(const VolumePlan<N>& volume, const ToolPlan<N>& tool,
                                    const ToolInVolume<N>& in_volume,
                                    WorldVec<typename N::Real> tip_mm,
                                    const Rotation<N>& rotation) noexcept {
  ToolPose<N> pose;
  pose.centre_vox = voxel_position(volume, tip_mm);
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

/// One tick: the proxy of the active tool follows the hand, and the force law pulls the hand to the
/// proxy (docs/theory.md 4, docs/forces.md 5.1). `rotation` orients the tool, unless it is a ball
/// without a shaft or keeps the world's axes. Servo thread; at most 32 queries; writes
/// `state.contact` and `state.force_law`. A force law can return a force that is not finite.
template <class N>
[[nodiscard]] ContactResult<N> proxy_force(const ServoPlan<N>& plan, ServoState<N>& state,
                                           WorldVec<typename N::Real> tip_mm,
                                           const Rotation<N>& rotation,
                                           DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

/// Contact force of the active tool in all solid volumes; then, if the plan cuts by overlap, the
/// modification force from the same densities, and only then the removal.
template <class N>
[[nodiscard]] ContactResult<N> contact_and_cut(
    const ServoPlan<N>& plan, ServoState<N>& state, WorldVec<typename N::Real> tip_mm,
    const Rotation<N>& rotation, DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

}  // namespace kerf
