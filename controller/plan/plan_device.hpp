// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/input/load_error.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/servo/servo_plan.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

// The device of a scene, its limits and its laws in the loop's numbers. Load time.

namespace kerf {

namespace device_parts {

/// Links of a serial arm, mm, as SerialArm.
struct Links {
  double thigh_mm = 0, forearm_mm = 0, origin_height_mm = 0, origin_depth_mm = 0;
};

/// Encoders, motors and links of a joint-count device. Joints turret, thigh and forearm of a serial
/// arm; the legs of a delta.
struct CountedArm {
  Personality personality;
  std::array<double, 3> zero_rad;  ///< angle where the count is 0, if it does not count from a dock
  std::array<double, 3> rad_per_count;  ///< signed
  std::array<double, 3> motor_sign;     ///< of the count that gives a positive torque
  std::int32_t motor_count_end;
  /// Largest error of the tip from encoders that are rounded to whole counts: half a count of one
  /// joint with the whole arm.
  double tip_noise_mm;
  Links links = {};  ///< of a serial arm
};

inline constexpr std::array kCountedArms{
    CountedArm{.personality = Personality::omni,
               .zero_rad = {},
               .rad_per_count = {omni::kEncoderSign[0] * omni::kRadPerCount,
                                 omni::kEncoderSign[1] * omni::kRadPerCount,
                                 omni::kEncoderSign[2] * omni::kRadPerCount},
               .motor_sign = {1, 1, 1},
               .motor_count_end = -omni::kMotorCountMin,
               // 0.056; in its data sheet 0.055.
               .tip_noise_mm = omni::kRadPerCount * (omni::kUpperLinkMm + omni::kForearmMm) / 2,
               .links = {omni::kUpperLinkMm, omni::kForearmMm, omni::kOriginHeightMm,
                         omni::kOriginDepthMm}},
    CountedArm{.personality = Personality::falcon,
               .zero_rad = {falcon::kZeroRad, falcon::kZeroRad, falcon::kZeroRad},
               .rad_per_count = {falcon::kRadPerCount, falcon::kRadPerCount, falcon::kRadPerCount},
               .motor_sign = {falcon::kMotorSign, falcon::kMotorSign, falcon::kMotorSign},
               .motor_count_end = falcon::kMotorCountMax,
               .tip_noise_mm = falcon::kRadPerCount * falcon::kThighMm / 2},
    CountedArm{
        .personality = Personality::woodenhaptics,  // A = -q1, B = pi/2 - q2, C = q3
        .zero_rad = {0, wooden::kPi / 2, 0},
        .rad_per_count = {-wooden::kRadPerCount[0], -wooden::kRadPerCount[1],
                          wooden::kRadPerCount[2]},
        .motor_sign = {-1, -1, 1},
        .motor_count_end = wooden::kMaxMilliamps,
        .tip_noise_mm = wooden::kRadPerCount[1] * (wooden::kUpperLinkMm + wooden::kForearmMm) / 2,
        .links = {wooden::kUpperLinkMm, wooden::kForearmMm,
                  wooden::kShoulderHeightMm - wooden::kOriginHeightMm, wooden::kOriginDepthMm}}};

/// Null for a Cartesian device.
constexpr const CountedArm* counted_arm(Personality personality) {
  const auto* const found = std::ranges::find(kCountedArms, personality, &CountedArm::personality);
  return found == kCountedArms.end() ? nullptr : found;
}
static_assert(std::ranges::all_of(kDeviceKinds, [](const DeviceKind& kind) {
  return kind.axes.has_value() != (counted_arm(kind.personality) != nullptr);
}));

/// Map from the encoder to a joint of the servo's kinematics, and from the joint to its motor. Of a
/// Cartesian device the joints are its axes, in mm.
struct JointSense {
  double home_rad = 0;       ///< where the count is 0
  double rad_per_count = 0;  ///< signed
  double motor_sign = 1;     ///< of the count that gives a positive torque; Cartesian: counts per N
};

inline std::array<JointSense, 3> joints_of(const DeviceSettings& device) {
  std::array<JointSense, 3> joints;
  if (const auto figures = cartesian::figures(device.personality)) {
    joints.fill({0, figures->step_um / 1000.0, 1 / cartesian::kNewtonsPerCount});
    return joints;
  }
  const CountedArm& arm = *counted_arm(device.personality);
  const bool from_dock = kind_of(device.personality).counts_from_dock;
  for (std::size_t i = 0; i < 3; ++i) {
    joints[i] = {from_dock ? device.dock_rad[i] : arm.zero_rad[i], arm.rad_per_count[i],
                 arm.motor_sign[i]};
  }
  return joints;
}

template <class N>
SerialArm<N> serial_arm_of(Personality personality) {
  using Real = typename N::Real;
  const CountedArm* const arm = counted_arm(personality);
  const Links links = arm != nullptr ? arm->links : Links{};
  return {Real(links.thigh_mm), Real(links.forearm_mm), Real(links.origin_height_mm),
          Real(links.origin_depth_mm)};
}

template <class N>
DeltaArm<N> delta_arm() {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  DeltaArm<N> arm{.hub_mm = Real(falcon::kHipOutMm - falcon::kPlateOutMm),
                  .crank_mm = Real(falcon::kThighMm),
                  .parallelogram_mm = Real(falcon::kShinMm),
                  .hinges_mm = Real(falcon::kShinEndMm + falcon::kKneeEndMm),
                  .side_mm = Real(falcon::kPlateAcrossMm - falcon::kHipAcrossMm),
                  .origin_depth_mm = Real(falcon::kOriginDepthMm),
                  .azimuth = {}};
  for (std::size_t i = 0; i < 3; ++i) {
    arm.azimuth[i] = {Unit(sine(falcon::kLegAzimuthRad[i])),
                      Unit(cosine(falcon::kLegAzimuthRad[i]))};
  }
  return arm;
}

inline std::int32_t motor_count_end(Personality personality) {
  if (const CountedArm* const arm = counted_arm(personality)) return arm->motor_count_end;
  return static_cast<std::int32_t>(force_figures(personality).peak_n / cartesian::kNewtonsPerCount);
}

/// Largest error of the tip that the device reports. For a Cartesian one, half of its resolution.
inline double tip_noise_mm(Personality personality) {
  if (const CountedArm* const arm = counted_arm(personality)) return arm->tip_noise_mm;
  return cartesian::figures(personality)->quantum_um / 2000.0;
}

/// Largest distance from its first calibration at which a joint that is parked at rest is
/// calibrated: the play of a stylus in its inkwell, 3 mm at the wrist, and twice the 10 mrad within
/// which a hand holds WoodenHaptics in its home pose. A Falcon has no dock: its button may be held
/// at any pose.
inline constexpr double kDockPlayRad = 0.025;
/// Play in the inkwell of a Cartesian device, at the wrist.
inline constexpr double kDockPlayMm = 3;

/// How far the counter of an axis at rest may move: two counts of an encoder, or two steps of the
/// resolution of a Cartesian device.
inline std::int32_t rest_counts(Personality personality) {
  const auto figures = cartesian::figures(personality);
  return figures ? std::max(2, 2 * figures->quantum_um / figures->step_um) : 2;
}

/// The play of the dock in counts; `anywhere` for a device without a dock.
inline std::int32_t dock_counts(Personality personality, double per_count, std::int32_t anywhere) {
  if (!kind_of(personality).has_dock) return anywhere;
  return static_cast<std::int32_t>((is_cartesian(personality) ? kDockPlayMm : kDockPlayRad) /
                                   std::abs(per_count));
}

}  // namespace device_parts

/// The device, its position in the scene and its motors.
template <class N>
void plan_device(const DeviceSettings& device, ServoPlan<N>& plan) {
  using Real = typename N::Real;
  plan.workspace_scale = Real(device.workspace_scale);
  plan.offset_mm = rounded<WorldVec<Real>, Real>(device.offset_mm);

  DevicePlan<N>& arm = plan.device;
  const DeviceKind& kind = kind_of(device.personality);
  arm.kinematics = kind.kinematics;
  arm.has_gimbal = kind.has_pots;
  arm.absolute_encoders = !kind.counts_from_dock;
  arm.serial = device_parts::serial_arm_of<N>(device.personality);
  arm.delta = device_parts::delta_arm<N>();
  arm.motor_count_end = device_parts::motor_count_end(device.personality);
  arm.motors_configured = device.torque_scale.has_value();
  arm.rest_counts = device_parts::rest_counts(device.personality);
  const auto joints = device_parts::joints_of(device);
  for (std::size_t i = 0; i < 3; ++i) {
    arm.joints[i].home_rad = typename N::Angle(joints[i].home_rad);
    arm.dock_counts[i] = device_parts::dock_counts(device.personality, joints[i].rad_per_count,
                                                   DevicePlan<N>::kNoDock);
    if constexpr (N::kIsFixed) {
      constexpr auto kOne = static_cast<double>(std::int64_t{1} << kAnglePerCountBits);
      arm.joints[i].angle_per_count = static_cast<std::int64_t>(joints[i].rad_per_count * kOne);
    } else {
      arm.joints[i].angle_per_count = joints[i].rad_per_count;
    }
    if (!device.torque_scale) continue;
    arm.joints[i].counts_per_effort = Real(joints[i].motor_sign / (*device.torque_scale)[i]);
  }
}

/// Limits and times, in ticks of the scene's rate.
template <class N>
void plan_limits(const LoadedScene& scene, ServoPlan<N>& plan) {
  using Real = typename N::Real;
  // Of a small motor's winding: order of ten seconds (Maxon RE25: 12 s).
  constexpr double kThermalTimeS = 10.0;
  const double rate_hz = scene.servo.rate_hz;
  const auto ticks = [&](double ms) {
    return std::max(1U, static_cast<std::uint32_t>(ms * rate_hz / 1000.0));
  };
  plan.rate_hz = scene.servo.rate_hz;
  plan.device.gimbal_samples = std::clamp<std::size_t>(ticks(20), 1, kMaxGimbalSamples);
  constexpr double kStep = 1.0 / 65536;  // the limit is rounded down, not to nearest
  plan.limits.peak_n = Real(scene.limits.force_n - kStep);
  plan.limits.continuous_n = Real(std::min(scene.limits.continuous_force_n, scene.limits.force_n));
  plan.limits.slew_n_per_tick = Real(scene.limits.slew_n_per_ms * 1000.0 / rate_hz);
  plan.limits.thermal_per_tick = typename N::Ratio(1.0 / (rate_hz * kThermalTimeS));
  plan.speed_limit_mm_per_tick = Real(scene.limits.speed_mm_per_s / rate_hz);
  const auto at_least = [&](double ms) {
    return static_cast<std::uint32_t>(std::ceil(ms * rate_hz / 1000.0));
  };
  plan.timing = {.hold_ticks = ticks(5),
                 .zero_ticks = ticks(20),
                 // Below 500 Hz a tick is longer than the 2 ms: the first bad one trips.
                 .not_finite_ticks = static_cast<std::uint32_t>(2 * rate_hz / 1000),
                 .fade_in_ticks = at_least(100),
                 .rest_ticks = at_least(50)};
}

/// The force law of a scene: the one that it names, or the coupling with the scene's own keys.
[[nodiscard]] inline LawChoice force_law_of(const ForceSettings& force) {
  if (!force.law.name.empty()) return force.law;
  return {LawKind::force,
          "",
          {{"stiffness_n_per_mm", force.stiffness_n_per_mm},
           {"damping_ns_per_mm", force.damping_ns_per_mm}}};
}

/// The laws of a scene. Throws LoadError for one that this program does not know.
template <class N>
void plan_laws(const LoadedScene& scene, ServoPlan<N>& plan) {
  const LawLoop loop{.rate_hz = double(scene.servo.rate_hz),
                     .tip_noise_mm = device_parts::tip_noise_mm(scene.device.personality)};
  const auto law = [&]<template <class> class In>(const LawChoice& choice, const char* key,
                                                  LawPlan<In<N>>& into) {
    try {
      into = plan_law<In, N>(choice, loop);
    } catch (const LawError& error) {
      throw LoadError(scene.path + ": " + key + " \"" + choice.name + '"' + error.what());
    }
  };
  law.template operator()<ForceInput>(force_law_of(scene.force), "force.law", plan.force_law);
  law.template operator()<VelocityInput>(scene.servo.velocity, "servo.velocity", plan.velocity);
  law.template operator()<StabiliserInput>(scene.force.stabiliser, "force.stabiliser",
                                           plan.stabiliser);
}

}  // namespace kerf
