// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/wire/personality.hpp"

// The model of one axis of a device on a virtual wall, and the figures of each device.

namespace kerf {

/// A hand that never lets the device go: its mass moves with the tip, its spring and damper go to
/// ground. All zero: no hand, which is the worst case for stability.
struct SampledHand {
  double mass_kg = 0;
  double damping_ns_per_mm = 0;
  double stiffness_n_per_mm = 0;
};

/// One axis of a haptic device in contact with a virtual wall: a mass that gets, once per period,
/// the force F = -K x - B v of the tick before, held until the next one.
///
/// Linear except for `coulomb_n` and `quantum_mm`: the exact limits of gain_limits.hpp ignore both,
/// `quantum_stiffness` and axis_simulation.hpp use them. No structural mode: a bound of this model
/// does not hold above the device's first resonance. Mass and period are positive, the rest is not
/// negative; the readers of files check that.
struct SampledLoop {
  double mass_kg = 0.045;      ///< apparent, at the tip
  double viscous_ns_per_mm{};  ///< damping of the device itself, b
  double period_s = 0.001;     ///< T
  /// From the reading of the encoder to the moment at which its force acts; any part of a period,
  /// up to `kMaxDelayPeriods`.
  double delay_s = 0;
  /// Time constant of a first-order low-pass (backward Euler) after the backward difference of the
  /// position; 0: none. A window of n ticks is about as late as a constant of n/2 periods.
  double velocity_filter_s = 0;
  SampledHand hand;
  double coulomb_n = 0;   ///< Coulomb friction at the tip
  double quantum_mm = 0;  ///< of the encoders, at the tip
};

/// Longer delays are clamped to this one.
inline constexpr double kMaxDelayPeriods = 64;

/// Figures of a device at its tip, from published sources (docs/devices.md, "Gains"). No unit was
/// measured: a row is for checks and maps, never a claim about a unit.
struct DeviceFigures {
  double mass_kg;  ///< apparent
  /// No source has a value: the lowest that identifications of such arms suggest. Less damping is
  /// the worse case.
  double viscous_ns_per_mm;
  double coulomb_n;   ///< back-drive friction
  double quantum_mm;  ///< of the encoders, at the tip
  /// From the reading of the encoders to the moment at which its force acts: bus and controller of
  /// the device. Assumed until measured: 2 ms, two frames of a bus of 1 kHz.
  double delay_s;
  /// Up to here a real port accepts gains without a confirmation.
  double highest_stiffness_n_per_mm;
  double highest_damping_ns_per_mm;
};

[[nodiscard]] constexpr DeviceFigures device_figures(Personality personality) noexcept {
  switch (personality) {
    case Personality::omni:  // data sheet; gains: CHAI3D's caps of this device
      return {0.045, 0.0002, 0.26, 0.055, 0.002, 0.7, 0.005};
    case Personality::falcon:  // mass, friction: the emulator's; quantum: a count of a leg; CHAI3D
      return {0.12, 0.0002, 0.3, 0.038, 0.002, 3.0, 0.02};
    case Personality::woodenhaptics:  // likewise; no cap is published: CHAI3D's of any other device
      break;
  }
  return {0.2, 0.0002, 0.2, 0.118, 0.002, 1.0, 0.02};
}

/// The loop of that device at a rate, without a hand: a light grip is the worst case, since the
/// damping of a firm hand comes on top (docs/theory.md 5.7).
[[nodiscard]] constexpr SampledLoop unheld_loop(Personality personality, double rate_hz) noexcept {
  const DeviceFigures device = device_figures(personality);
  SampledLoop loop;
  loop.mass_kg = device.mass_kg;
  loop.viscous_ns_per_mm = device.viscous_ns_per_mm;
  loop.period_s = 1 / rate_hz;
  loop.delay_s = device.delay_s;
  loop.coulomb_n = device.coulomb_n;
  loop.quantum_mm = device.quantum_mm;
  return loop;
}

}  // namespace kerf
