// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// A hand that holds the device for good: its mass moves with the tip, its spring and damper go to
/// the ground. All zero: nobody holds the device, which is the worst case for stability.
struct SampledHand {
  double mass_kg = 0;
  double damping_ns_per_mm = 0;
  double stiffness_n_per_mm = 0;
};

/// One axis of a haptic device in contact with a virtual wall: a mass that feels, once per period,
/// the force F = -K x - B v of the tick before, held until the next one.
///
/// Linear but for `coulomb_n` and `quantum_mm`: stable_gains.hpp leaves both out,
/// passive_limits.hpp and one_axis.hpp count them. No structural mode: a bound of this model says
/// nothing above the device's first resonance. Mass and period are positive, the rest is not
/// negative; whoever reads a file has checked that.
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

/// Longer delays are taken as this one.
inline constexpr double kMaxDelayPeriods = 64;

}  // namespace kerf
