// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "shared/wire/personality.hpp"

// The model of one axis of a device on a virtual wall, the figures of each device, and the limits
// of the gains.

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
/// Linear except for `coulomb_n` and `quantum_mm`: the exact limits below ignore both,
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

// Limits of the gains of a sampled wall (docs/theory.md 5.7).
//
// Passivity: bounds for every hand, or short formulas. Passive is more than stable: a passive wall
// never gives energy, whatever the hand does. The hand of the loop is not used.

/// The device damping (N s/mm) above which the wall is passive, by a scan of the circle: Colgate
/// and Schenkel's (T/2) max_w Re[(1 - e^-jwT) H(e^jwT)] / (1 - cos wT), and, if the delay has a
/// part of a period, the energy that a hand gains between two samples (docs/theory.md 5.7). Never
/// below 0.
[[nodiscard]] double passive_viscosity(const SampledLoop& loop, double stiffness_n_per_mm,
                                       double damping_ns_per_mm);

/// The largest K (N/mm) that is passive on this device at this damping; 0: none.
[[nodiscard]] double passive_stiffness(const SampledLoop& loop, double damping_ns_per_mm);

/// min(2 b/T, 2 fc/D): up to here quantisation and sampling never give energy, for any hand (Abbott
/// and Okamura; B = 0, no delay). Without a quantum the first of the two.
[[nodiscard]] double quantum_stiffness(const SampledLoop& loop);

// Exact stability: zero-order hold by the matrix exponential, delay of any part of a period,
// Schur-Cohn test of the characteristic polynomial, in double. A boundary is found by a scan in
// steps of 2 % and a bisection to the last bits, so a band narrower than 2 % can be missed; none is
// known. For load time and for the lab: each call takes about 0.1 ms and allocates.

/// Whether every motion of the loop decays. On the boundary: false.
[[nodiscard]] bool is_stable(const SampledLoop& loop, double stiffness_n_per_mm,
                             double damping_ns_per_mm);

/// The first boundary at this damping B >= 0: the largest K (N/mm) below which all K > 0 are
/// stable; 0: none is.
[[nodiscard]] double highest_stiffness(const SampledLoop& loop, double damping_ns_per_mm);

/// The largest B (N s/mm) that is stable without any stiffness (K -> 0): no wall may have more.
[[nodiscard]] double highest_damping(const SampledLoop& loop);

}  // namespace kerf
