// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/scene/matrices.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// The device's place in the scene and its motors, as the loop's numbers hold them.
template <class N>
void plan_device(const Scene::Device& device, ServoPlan<N>& plan) {
  using Real = typename N::Real;
  using Angle = typename N::Angle;
  plan.dock = {Angle(device.dock_rad[0]), Angle(device.dock_rad[1]), Angle(device.dock_rad[2])};
  plan.workspace_scale = Real(device.workspace_scale);
  plan.offset_mm = rounded<WorldVec<Real>, Real>(device.offset_mm);
  plan.motors_configured = device.torque_scale.has_value();
  if (!device.torque_scale) return;
  for (std::size_t i = 0; i < 3; ++i) {
    plan.counts_per_n_mm[i] = Real(1.0 / (*device.torque_scale)[i]);
  }
}

/// Limits and times, in ticks of the scene's rate.
template <class N>
void plan_limits(const Scene& scene, ServoPlan<N>& plan) {
  using Real = typename N::Real;
  // Of a small motor's winding: order of ten seconds (Maxon RE25: 12 s).
  constexpr double kThermalTimeS = 10.0;
  const double rate_hz = scene.servo.rate_hz;
  const auto ticks = [&](double ms) {
    return std::max(1U, static_cast<std::uint32_t>(ms * rate_hz / 1000.0));
  };
  plan.rate_hz = scene.servo.rate_hz;
  constexpr double kStep = 1.0 / 65536;  // the limit is rounded down, not to nearest
  plan.limits.peak_n = Real(scene.limits.force_n - kStep);
  plan.limits.continuous_n = Real(std::min(scene.limits.continuous_force_n, scene.limits.force_n));
  plan.limits.slew_n_per_tick = Real(scene.limits.slew_n_per_ms * 1000.0 / rate_hz);
  plan.limits.thermal_per_tick = typename N::Ratio(1.0 / (rate_hz * kThermalTimeS));
  plan.speed_limit_mm_per_tick = Real(scene.limits.speed_mm_per_s / rate_hz);
  plan.timing = {.hold_ticks = ticks(5),
                 .zero_ticks = ticks(20),
                 // Below 500 Hz a tick is longer than the 2 ms: the first bad one trips.
                 .not_finite_ticks = static_cast<std::uint32_t>(2 * rate_hz / 1000),
                 .fade_in_ticks = ticks(100),
                 .dock_ticks = ticks(50)};
}

}  // namespace kerf
