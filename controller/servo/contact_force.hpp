// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/milling.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/sampling.hpp"
#include "controller/servo/kinematics.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

// The contact force of a tick, by the proxy or by overlap, and the pose of the tool on the solid.

namespace kerf {

/// A plane that the tool presses on, at the device port.
template <class N>
struct PressedPlane {
  DeviceVec<typename N::Unit> normal{};  ///< out of the solid
  DeviceVec<typename N::Real> arm_mm{};  ///< from the tool's centre to the contact
  typename N::Real load_n{};             ///< along the normal, before any limit
  bool behind = false;                   ///< on shaft or handpiece
};

/// The tool as it rests on the solid: at its proxy, not at the position of the hand.
template <class N>
struct ToolContact {
  WorldVec<typename N::Real> centre_mm;
  Rotation<N> rotation = identity_rotation<N>();  ///< of its samples
  WorldVec<typename N::Unit> normal{};            ///< out of the solid, of the head; 0 in air
  WorldVec<typename N::Unit> press{};             ///< the same of the whole tool
  typename N::Unit head_fraction{1};              ///< of the force along `press`
  DeviceVec<typename N::Real> head_arm_mm{};      ///< from its centre to the load of the head
  std::array<PressedPlane<N>, kMaxPlanes> planes{};
  std::size_t plane_count = 0;
};

/// A position of the world in a volume.
template <class N>
[[nodiscard]] VoxelVec<typename N::Real> voxel_position(const VolumePlan<N>& volume,
                                                        WorldVec<typename N::Real> at_mm) noexcept {
  return volume.voxel_from_world * (at_mm - volume.position_mm);
}

/// Samples of the active tool in one volume. A tool that is round, or that does not turn, has the
/// same samples in every orientation of the stylus.
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

/// The force of the swept proxy.
template <class N>
struct SweptForce {
  DeviceVec<typename N::Real> force_n;      ///< of the coupling, before any limit
  DeviceVec<typename N::Real> spring_n;     ///< part of it: of the spring, out of the faces
  DeviceVec<typename N::Real> friction_n;   ///< and along them
  WorldVec<typename N::Real> offset_mm;     ///< from the hand's tip to the proxy's
  DeviceVec<typename N::Real> torque_n_mm;  ///< of the contact about the tool's centre
  ToolContact<N> tool;
  typename N::Real shaft_force_n{};  ///< load of shaft and handpiece, at the device port
  std::int64_t queried = 0;          ///< samples read, as sample_reader.hpp counts
};

/// One tick: the proxy of the active tool follows the hand, and the coupling or a law pulls the
/// hand to the proxy (docs/theory.md 4, 5.1). `rotation` turns the tool, unless it is a ball
/// without a shaft or keeps the world's axes. Servo thread; at most 32 queries; writes
/// `state.contact`, and `state.force_law` if the scene names a force law, whose force may not be
/// finite.
template <class N>
[[nodiscard]] SweptForce<N> proxy_force(const ServoPlan<N>& plan, ServoState<N>& state,
                                        WorldVec<typename N::Real> tip_mm,
                                        const Rotation<N>& rotation,
                                        DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

/// Contact and modification force at the device port, before any limit, and the removal by overlap
/// at this pose. If force cuts, the modification force is its friction, and the cut comes later.
template <class N>
struct ToolForces {
  DeviceVec<typename N::Real> contact_n;
  DeviceVec<typename N::Real> modification_n;
  DeviceVec<typename N::Real> spring_n{}, friction_n{};  ///< of the contact: the rest is damping
  WorldVec<typename N::Real> proxy_offset_mm;            ///< from the tip; 0 without a proxy
  /// Likewise; of both forces about the tool's centre.
  DeviceVec<typename N::Real> tip_torque_n_mm;
  ToolContact<N> tool;                         ///< likewise
  typename N::Real shaft_force_n{};            ///< likewise: of shaft and handpiece
  std::int64_t queried = 0;                    ///< likewise: samples, as sample_reader.hpp counts
  std::array<Removed, kMaxVolumes> removed{};  ///< by volume of the scene
};

/// Contact force of the active tool in all solid volumes; then, if the plan cuts by overlap, the
/// modification force from the same densities, and only then the removal.
template <class N>
[[nodiscard]] ToolForces<N> contact_and_cut(const ServoPlan<N>& plan, ServoState<N>& state,
                                            WorldVec<typename N::Real> tip_mm,
                                            const Rotation<N>& rotation,
                                            DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

}  // namespace kerf
