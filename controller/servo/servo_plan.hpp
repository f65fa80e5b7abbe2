// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/cut_law.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/preston.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/proxy.hpp"
#include "controller/kernel/sampling.hpp"
#include "controller/kernel/spindle.hpp"
#include "controller/law/law.hpp"
#include "controller/servo/external_force.hpp"
#include "controller/servo/force_limits.hpp"
#include "controller/servo/kinematics.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "shared/wire/personality.hpp"

// Everything constant of a run: the compiled scene as the loop reads it.

namespace kerf {

/// Converts an exact sum of weighted gradients (voxel axes; docs/forces.md 7) to a force at the
/// device port (N): one matrix that holds pressure, sample volume, voxel size, rotation and
/// workspace scale.
///
/// Floating point: a plain matrix.
template <class N>
struct SumToForce {
  std::array<std::array<typename N::Real, 3>, 3> row{};
};

/// Fixed point: F = SUM_k mantissa[i][k] * (sum[k] >> pre_shift) >> post_shift, in Q15.16 N.
///
/// `pre_shift` is chosen at load so that the largest possible sum keeps 38 bits; with 22-bit
/// mantissas three products stay below 2^62. The exact sum is not limited before: it saturates only
/// here.
template <>
struct SumToForce<FixedNumbers> {
  std::array<std::array<std::int32_t, 3>, 3> mantissa{};
  int pre_shift = 0;
  int post_shift = 0;
};

template <class N>
[[nodiscard]] constexpr DeviceVec<typename N::Real> force_of_sum(
    const SumToForce<N>& map, Vec<typename N::Sum, VoxelSpace> sum) noexcept {
  using Real = typename N::Real;
  if constexpr (N::kIsFixed) {
    constexpr std::int64_t kLimit = std::int64_t{1} << 38;
    const auto reduced = [&](std::int64_t s) {
      return std::clamp(round_shift(s, map.pre_shift), -kLimit, kLimit);
    };
    const std::array<std::int64_t, 3> s{reduced(sum.x), reduced(sum.y), reduced(sum.z)};
    const auto component = [&](std::size_t i) {
      const auto& m = map.mantissa[i];
      const std::int64_t wide = m[0] * s[0] + m[1] * s[1] + m[2] * s[2];
      return Real::from_raw(saturate_i32(round_shift(wide, map.post_shift)));
    };
    return {component(0), component(1), component(2)};
  } else {
    const auto component = [&](std::size_t i) {
      const auto& m = map.row[i];
      return m[0] * sum.x + m[1] * sum.y + m[2] * sum.z;
    };
    return {component(0), component(1), component(2)};
  }
}

/// The methods: ways to compute contact and cut of one tool in one volume. A method has a line
/// here, a step (method_step.cpp) and a load-time part (such as
/// controller/plan/method/method_splat.cpp). The two parts are separate because the loop includes
/// nothing that allocates. Everything else is generated from this list.
///
/// A line has the name, the class of the step, and a condition on the number type `N`. The order is
/// by preference: the first method whose condition holds is taken; the last one's always holds.
#define KERF_METHODS(METHOD)                                                                \
  /* The swept proxy alone: no sums, and nothing is cut. */                                 \
  METHOD(surface, SurfaceStep, true)                                                        \
  /* A correlation of the density with one table (controller/kernel/kernel_set.hpp). */     \
  METHOD(aligned, AlignedStep, N::kIsFixed)                                                 \
  /* Weights added up in the volume (controller/kernel/kernel_set.hpp). */                  \
  METHOD(splat, SplatStep, N::kIsFixed)                                                     \
  /* Stored gradients, weighted at every sample (controller/kernel/overlap_methods.hpp). */ \
  METHOD(gather, GatherStep, true)

#define KERF_ENUMERATOR(name, Step, serves) name,
enum class Method : std::uint8_t { KERF_METHODS(KERF_ENUMERATOR) };
#undef KERF_ENUMERATOR

/// Radians per encoder count (mm of a Cartesian device), finer than Angle, so that a full rotation
/// is exact to the last bit of Angle: in fixed point an integer with 40 fraction bits.
template <class N>
using AnglePerCount = std::conditional_t<N::kIsFixed, std::int64_t, double>;
inline constexpr int kAnglePerCountBits = 40;

/// One motor and its encoder.
template <class N>
struct JointPlan {
  typename N::Angle home_rad;          ///< where the count is 0; not of a Cartesian device
  AnglePerCount<N> angle_per_count{};  ///< signed by the encoder's direction
  /// Motor counts per effort, signed: N mm of a joint's torque; N along an axis of a Cartesian
  /// device.
  typename N::Real counts_per_effort{};
};

/// Most readings of the gimbal that are summed: 20 ms at 8 kHz, the highest rate.
inline constexpr std::size_t kMaxGimbalSamples = 160;

/// Everything constant of the held device.
template <class N>
struct DevicePlan {
  Kinematics kinematics = Kinematics::serial;
  bool has_gimbal = false;  ///< of potentiometers, as the Omni's
  std::array<JointPlan<N>, 3> joints{};
  /// True: encoders are absolute once the device is `homed`. False: they count from the pose in
  /// which it was parked at rest.
  bool absolute_encoders = false;
  static constexpr std::int32_t kNoDock = 1 << 15;
  /// Jitter of an encoder at an edge: how far a counter moves during a rest (sense.hpp).
  std::int32_t rest_counts = 2;
  /// Largest distance from the first calibration at which parking at rest calibrates a joint,
  /// counts; `kNoDock`: any.
  std::array<std::int32_t, 3> dock_counts{kNoDock, kNoDock, kNoDock};
  SerialArm<N> serial{};  ///< of Kinematics::serial
  DeltaArm<N> delta{};    ///< of Kinematics::delta

  std::size_t gimbal_samples = 1;  ///< in 20 ms, of a device with a gimbal

  bool motors_configured = false;
  std::int32_t motor_count_end = 0;  ///< motor counts lie within +- this, at most 14 bits
};

/// Contact space in the world; constant during a run.
template <class N>
struct ContactPlan {
  bool swept = false;                      ///< else contact is the paper's sums
  WorldVec<typename N::Real> origin_mm;    ///< of contact space
  typename N::Ratio units_per_mm{};        ///< of the world
  typename N::Ratio device_mm_per_unit{};  ///< unit over workspace scale
  typename N::Ratio mm_per_unit{};         ///< of the world
};

/// The surface of a tool and the constants of its proxy.
template <class N>
struct SweptTool {
  PointShell<N> point_shell;  ///< of the head
  ShaftParts<N> shaft;
  bool follows_stylus = false;  ///< else it keeps the world's axes, or is a ball alone
  ProxyPlan<N> proxy;
};

/// The tool cuts kCutAdvance deeper than the surface that it rests on, so that its groove leaves it
/// play (docs/forces.md 6.3); units of contact space. While it covers less than its force would
/// cut, the advance grows, up to kDeepestAdvance; afterwards it slowly returns.
///
/// It may cover less because its inner samples end below its surface, by up to a pitch
/// (SampleLattice::cover): its rims then rest on voxels that they hardly cover. A ball that is
/// given by its radius has samples on its surface at its six poles only.
inline constexpr double kCutAdvance = 0.25, kDeepestAdvance = 1;

/// Cutting by force; constant during a run. Arrays: by index of the plan's volumes.
template <class N>
struct ForceCutPlan {
  bool on = false;
  typename N::Real deeper_step{};  ///< of the advance in a tick that covers too little, units
  typename N::Real back_step{};    ///< of the advance in any other
  SpindlePlan<N> spindle;
  FrictionPlan<N> friction;
  std::array<PrestonPlan<N>, kMaxVolumes> volume{};
  /// Size of a voxel over that of the largest, as a `fraction_of`.
  std::array<CutBudget<N>, kMaxVolumes> voxel_fraction{};
};

/// The covered voxels: groups for the kernels of fixed point, voxel by voxel otherwise.
template <class N>
using Covered = std::conditional_t<N::kIsFixed, CoveredGroups, CoveredVoxels<N>>;
template <class N>
using CoveredEntry = typename decltype(Covered<N>::list)::value_type;

/// A solid volume; constant during a run.
template <class N>
struct VolumePlan {
  std::size_t scene_index = 0;  ///< index in the scene and in the segment
  VoxelGrid grid;
  Density iso = 0;
  WorldVec<typename N::Real> position_mm;  ///< world position of voxel (0, 0, 0)
  Transform<typename N::Ratio, VoxelSpace, WorldSpace> voxel_from_world;  ///< voxels per mm
  /// Takes a unit normal of the world to mm per voxel along each voxel axis, over the largest
  /// spacing, so that its entries stay within 1.
  Transform<typename N::Unit, VoxelSpace, WorldSpace> normal_from_world;
  typename N::Real largest_spacing_mm{};
};

/// Constants of one tool in one volume.
template <class N>
struct ToolInVolume {
  /// Voxels per pitch along the world's axes; times the tool's rotation it is the sample step.
  Transform<typename N::Ratio, VoxelSpace, WorldSpace> voxel_from_pitch;
  /// The sample step of a tool that keeps its axes.
  std::array<std::array<typename N::Step, 3>, 3> unturned_step{};
  typename N::Step overlap_ratio{};  ///< a^3 / V_voxel
  /// Reach of a cut around the voxel of the tool's centre, by axis.
  std::array<std::int32_t, 3> reach_vox{};
  Method method = Method::gather;         ///< of contact and cut
  const AlignedTable* aligned = nullptr;  ///< of the method `aligned`
  // Of the method's own sums:
  SumToForce<N> contact;  ///< F_c = -p0 a^3 SUM grad (docs/forces.md 7.1), times workspace scale
  SumToForce<N> modification;  ///< F_m = -p1 V_voxel SUM c grad (docs/forces.md 7.4), scaled alike
  /// If force cuts: from voxel edges to rim radii along the world's axes, for a `SpindleFrame`.
  Transform<typename N::Ratio, WorldSpace, VoxelSpace> rims_from_voxel;
};

/// A tool of the scene; constant during a run.
template <class N>
struct ToolPlan {
  std::span<const ToolOffset> offsets;
  SampleTable samples;  ///< `offsets` for the methods `gather` and `splat` in fixed point
  /// A round tool has the same samples in every orientation: they keep the volume's axes.
  bool round = false;
  bool turns = true;              ///< rotates with the stylus; else keeps the world's axes
  typename N::Real rim_mm{};      ///< largest radius about the shaft
  typename N::Ratio steepness{};  ///< of its contacts' loads (covered_voxels.hpp)
  CutLaw<N> law;                  ///< if force cuts
  SweptTool<N> swept;             ///< for the swept proxy
  std::array<ToolInVolume<N>, kMaxVolumes> in_volume{};  ///< by index of the plan's volumes
};

/// Everything constant of the servo step: the compiled scene. Owns nothing.
template <class N>
struct ServoPlan {
  std::size_t volume_count = 0;
  std::array<VolumePlan<N>, kMaxVolumes> volumes{};
  std::size_t tool_count = 0;
  std::array<ToolPlan<N>, kMaxTools> tools{};

  GradientKernel gradient_kernel = GradientKernel::farid;
  const ExactTaps* taps = nullptr;     ///< of that kernel, for the method `splat`
  const KernelSet* kernels = nullptr;  ///< of this machine
  ContactPlan<N> contact;
  ExternalPlan<N> external;   ///< in place of contact
  bool overlap_cuts = false;  ///< by overlap, whatever the force
  RemovalRate<N> removal_rate;
  ForceCutPlan<N> force_cut;  ///< else, by force

  DevicePlan<N> device;
  typename N::Real workspace_scale{};  ///< x_scene = scale * x_device + offset
  WorldVec<typename N::Real> offset_mm;

  VelocityEstimatorPlan<N> velocity;  ///< always one
  ForceLawPlan<N> force_law;          ///< always one; of the swept contact
  StabiliserPlan<N> stabiliser;       ///< or none

  ForceLimits<N> limits;
  SafetyTiming timing;
  typename N::Real speed_limit_mm_per_tick{};
  std::int32_t rate_hz = 1000;
  bool pedalled = false;                   ///< nothing is cut without button 1
  std::uint32_t stroke_pause_ticks = 250;  ///< without contact, or pedal: ends the stroke
};

}  // namespace kerf
