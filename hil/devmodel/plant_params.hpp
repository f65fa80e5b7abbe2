// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace kerf {

/// What a device does with its motors when host packets stop.
enum class OnSilence : std::uint8_t { hold_torque, drop_torque };

inline constexpr int kMaxDelayCycles = 64;  // 8 ms

/// What every arm has, and the hand that holds it. Defaults are plausible ones for an Omni, to be
/// swept; none is a claim about a unit.
struct PlantParams {
  double tip_mass_kg = 0.045;         ///< apparent, of the Omni's data sheet
  double viscous_ns_per_mm = 0.0005;  ///< sweep 0..0.002
  double coulomb_n = 0.1;             ///< sweep 0..0.3; the sheet names 0.26 of back-drive friction

  /// Of each motor and what turns with it, at the joint, where the encoder sits: all three, or 0 =
  /// part of the tip mass.
  std::array<double, 3> joint_inertia_kg_m2{};
  /// Structural mode: each inertia above on a spring, with this frequency while the link is held;
  /// 0 = rigid.
  double mode_hz = 0;
  double mode_damping_ratio = 0.02;

  std::array<double, 3> torque_nmm_per_count{0.342, 0.342, 0.342};  ///< 0.70 N m at full scale
  double current_lag_s = 0;     ///< time constant of the current loop; 0 = none
  int output_delay_cycles = 0;  ///< 0..kMaxDelayCycles, from a command to its torque
  int input_delay_cycles = 0;   ///< the same from the joints to what is reported of them
  OnSilence on_silence = OnSilence::hold_torque;
  int silence_cycles = 800;  ///< 100 ms without a command count as silence

  double hand_stiffness_n_per_mm = 0.5;
  double hand_damping_ns_per_mm = 0.005;
  double hand_mass_kg = 0.1;  ///< moves with the tip

  /// The natural frequency of the hand's spring with the hand and the tip on it.
  [[nodiscard]] double hand_rad_per_s() const noexcept {
    constexpr double kMmPerM = 1000;
    return std::sqrt(kMmPerM * hand_stiffness_n_per_mm / (hand_mass_kg + tip_mass_kg));
  }

  /// Torque of one motor count at each joint, N mm, without its sign: what a host has to be told
  /// of a unit (`torque_scale` of a scene, `--torque-scale`).
  [[nodiscard]] std::array<double, 3> torque_scale() const noexcept {
    const auto& t = torque_nmm_per_count;
    return {std::abs(t[0]), std::abs(t[1]), std::abs(t[2])};
  }
};

}  // namespace kerf
