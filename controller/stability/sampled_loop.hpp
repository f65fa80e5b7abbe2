// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "include/kerf/stability.hpp"
#include "shared/wire/personality.hpp"

// The figures of each device, and its loop on a virtual wall (include/kerf/stability.hpp).

namespace kerf {

/// Figures of a device at its tip, from published sources (docs/gains.md). No unit was
/// measured: a row is for checks and maps, never a claim about a unit.
struct DeviceFigures {
  Personality personality;
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

/// By Personality. Mass and friction: Omni and Touch, the Omni's data sheet; Falcon and
/// WoodenHaptics, the emulator's; others assumed. Quantum: a count of the encoders, or the vendor's
/// resolution. Gains: CHAI3D's CPhantomDevices ("PHANTOM Omni", "Touch") and CDeltaDevices
/// ("Falcon", "omega.3"); CWoodenDevice, default_woody(), of WoodenHaptics/woody-experimental,
/// 23f74fda.
inline constexpr std::array kDeviceFigures{
    DeviceFigures{Personality::omni, 0.045, 0.0002, 0.26, 0.055, 0.002, 0.7, 0.005, "CHAI3D 3.3.0"},
    DeviceFigures{Personality::falcon, 0.12, 0.0002, 0.3, 0.038, 0.002, 3.0, 0.02, "CHAI3D 3.3.0"},
    DeviceFigures{Personality::woodenhaptics, 0.2, 0.0002, 0.2, 0.118, 0.002, 1.0, 0.008,
                  "its open driver"},
    DeviceFigures{Personality::inverse3, 0.2, 0.0002, 0.1, 0.01, 0.002, 1.0, 0.01, {}},
    DeviceFigures{Personality::touch, 0.045, 0.0002, 0.26, 0.055, 0.002, 0.4, 0.004,
                  "CHAI3D 3.3.0"},
    DeviceFigures{Personality::omega, 0.2, 0.0002, 0.1, 0.01, 0.002, 5.0, 0.03, "CHAI3D 3.3.0"}};
static_assert(covers_devices(kDeviceFigures));

[[nodiscard]] constexpr const DeviceFigures& device_figures(Personality personality) noexcept {
  return row_of(kDeviceFigures, personality);
}

/// The loop of that device at a rate, without a hand: a light grip is the worst case, since the
/// damping of a firm hand comes on top (docs/forces.md 5.7).
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
