// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/stability/sampled_loop.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// What a device is to the hand, at its tip, as far as sources say (docs/devices.md, "Gains"). No
/// unit was measured: a row is for checks and maps, never a claim about a unit.
struct DeviceFigures {
  double mass_kg;  ///< apparent
  /// No source has one: the lowest that identifications of such arms suggest. Less of it is the
  /// worse case.
  double viscous_ns_per_mm;
  double coulomb_n;   ///< back-drive friction
  double quantum_mm;  ///< of the encoders, at the tip
  /// From the reading of the encoders to the moment at which its force acts: bus and controller of
  /// the device. Assumed until measured: 2 ms, two frames of a bus of 1 kHz.
  double delay_s;
  /// Up to here a real port takes gains without being asked twice.
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

/// The loop of that device at a rate, held by nobody: a light grip is the worst case, since the
/// damping of a hand that holds on comes on top (docs/theory.md 5.7).
[[nodiscard]] constexpr SampledLoop light_loop(Personality personality, double rate_hz) noexcept {
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
