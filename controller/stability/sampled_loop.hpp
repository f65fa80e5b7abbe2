// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "include/kerf/stability.hpp"
#include "shared/wire/personality.hpp"

// The figures of each device, and its loop on a virtual wall (include/kerf/stability.hpp).

namespace kerf {

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
  /// Up to here a real port accepts gains without a confirmation: what `gains_from` publishes.
  double highest_stiffness_n_per_mm;
  double highest_damping_ns_per_mm;
  std::string_view gains_from;  ///< empty: no source has gains of this device, both are assumed
};

[[nodiscard]] constexpr DeviceFigures device_figures(Personality personality) noexcept {
  constexpr std::string_view kChai3d = "CHAI3D 3.3.0";
  switch (personality) {
    case Personality::omni:  // data sheet; gains: CPhantomDevices, "PHANTOM Omni"
      return {0.045, 0.0002, 0.26, 0.055, 0.002, 0.7, 0.005, kChai3d};
    case Personality::falcon:  // mass, friction: the emulator's; quantum: a count of a leg; gains:
      return {0.12, 0.0002, 0.3, 0.038, 0.002, 3.0, 0.02, kChai3d};  // CDeltaDevices, "Falcon"
    case Personality::inverse3:  // step: the vendor's claim; all else: assumed
      return {0.2, 0.0002, 0.1, 0.01, 0.002, 1.0, 0.01, {}};
    case Personality::touch:  // as the Omni, whose mechanics it has; gains: the row "Touch" there
      return {0.045, 0.0002, 0.26, 0.055, 0.002, 0.4, 0.004, kChai3d};
    case Personality::omega:  // gains: CDeltaDevices, "omega.3"; mass, friction: assumed
      return {0.2, 0.0002, 0.1, 0.01, 0.002, 5.0, 0.03, kChai3d};
    case Personality::woodenhaptics:  // mass, friction: the emulator's
      break;
  }
  // Gains: CWoodenDevice, default_woody(), of WoodenHaptics/woody-experimental, 23f74fda.
  return {0.2, 0.0002, 0.2, 0.118, 0.002, 1.0, 0.008, "its open driver"};
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
