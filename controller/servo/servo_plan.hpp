// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/law/force_law.hpp"
#include "controller/law/stabiliser.hpp"
#include "controller/law/velocity_estimator.hpp"
#include "controller/servo/contact_plan.hpp"
#include "controller/servo/device_plan.hpp"
#include "controller/servo/force_cut_plan.hpp"
#include "controller/servo/force_limits.hpp"
#include "controller/servo/method_list.hpp"
#include "controller/servo/sum_to_force.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/volume/scene_limits.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// A solid volume as the loop sees it; constant during a run.
template <class N>
struct VolumePlan {
  std::size_t scene_index = 0;  ///< place in the scene and in the segment
  VoxelGrid grid;
  Density iso = 0;
  WorldVec<typename N::Real> position_mm;  ///< world place of voxel (0, 0, 0)
  Transform<typename N::Ratio, VoxelSpace, WorldSpace> voxel_from_world;  ///< voxels per mm
  /// Takes a unit normal of the world to mm per voxel along each voxel axis, over the largest
  /// spacing, so that its entries stay within 1.
  Transform<typename N::Unit, VoxelSpace, WorldSpace> normal_from_world;
  typename N::Real largest_spacing_mm{};
};

/// What one tool needs in one volume.
template <class N>
struct ToolInVolume {
  /// Voxels per pitch along the world's axes; times the tool's rotation it is the sample step.
  Transform<typename N::Ratio, VoxelSpace, WorldSpace> voxel_from_pitch;
  /// The sample step of a tool that keeps its axes.
  std::array<std::array<typename N::Step, 3>, 3> unturned_step{};
  typename N::Step overlap_ratio{};  ///< a^3 / V_voxel
  /// No voxel farther than this from that of the tool's centre is cut, by axis.
  std::array<std::int32_t, 3> reach_vox{};
  Method method = Method::gather;         ///< how contact and cut are computed here
  const AlignedTable* aligned = nullptr;  ///< of the method `aligned`
  // Of the method's own sums:
  SumToForce<N> contact;  ///< F_c = -p0 a^3 SUM grad (docs/theory.md 7.1), times workspace scale
  SumToForce<N> modification;  ///< F_m = -p1 V_voxel SUM c grad (docs/theory.md 7.4), scaled alike
  /// Where force cuts: from voxel edges to rim radii along the world's axes, for a `SpindleFrame`.
  Transform<typename N::Ratio, WorldSpace, VoxelSpace> rims_from_voxel;
};

/// A tool of the scene; constant during a run.
template <class N>
struct ToolPlan {
  std::span<const ToolOffset> offsets;
  SampleTable samples;  ///< the same for the methods `gather` and `splat` in fixed point
  /// A round tool has the same samples in every orientation: they keep the volume's axes.
  bool round = false;
  bool turns = true;              ///< with the stylus; else the tool keeps the world's axes
  typename N::Real rim_mm{};      ///< largest radius about the shaft
  typename N::Ratio steepness{};  ///< of its contacts' bearing (covered_loads.hpp)
  SweptTool<N> swept;             ///< where the swept proxy is felt
  std::array<ToolInVolume<N>, kMaxVolumes> in_volume{};  ///< by index of the plan's volumes
};

/// Everything constant of the servo step: the compiled scene. Owns nothing.
template <class N>
struct ServoPlan {
  std::size_t volume_count = 0;
  std::array<VolumePlan<N>, kMaxVolumes> volumes{};
  std::size_t tool_count = 0;
  std::array<ToolPlan<N>, kMaxTools> tools{};

  GradientKernel kernel = GradientKernel::farid;
  const ExactTaps* taps = nullptr;     ///< of the kernel, for the method `splat`
  const KernelSet* kernels = nullptr;  ///< what this machine runs
  ContactPlan<N> contact;
  bool cutting = false;  ///< by overlap, whatever the force
  RemovalRate<N> removal_rate;
  ForceCutPlan<N> force_cut;  ///< else, by force

  DevicePlan<N> device;
  typename N::Real workspace_scale{};  ///< x_scene = scale * x_device + offset
  WorldVec<typename N::Real> offset_mm;

  VelocityEstimatorPlan<N> velocity;  ///< always one
  ForceLawPlan<N> force_law;          ///< in place of `contact.coupling`; or none
  StabiliserPlan<N> stabiliser;       ///< or none

  ForceLimits<N> limits;
  SafetyTiming timing;
  typename N::Real speed_limit_mm_per_tick{};
  std::int32_t rate_hz = 1000;
  std::uint32_t stroke_pause_ticks = 250;  ///< without contact, and the stroke is over
};

}  // namespace kerf
