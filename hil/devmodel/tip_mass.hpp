// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "shared/numeric/vec.hpp"

namespace kerf {

/// A point mass with viscous and Coulomb friction over one fixed time step.
///
/// Viscous friction is exact for a force that is constant over the step. Coulomb friction takes the
/// speed down by what it can take in one step and never turns it round, so a mass at rest stays
/// exactly at rest below the limit, and the terminal speed is (F - Fc) / b (the stick band of
/// Karnopp's model, with the width that follows from the step). Kick between two half drifts, and
/// the motion is of second order and keeps energy.
class TipMass {
 public:
  /// Mass in kg (> 0), viscous friction in N s/mm, Coulomb friction in N, step in s.
  TipMass(double mass_kg, double viscous_ns_per_mm, double coulomb_n, double step_s) noexcept {
    constexpr double kMmPerM = 1000.0;
    const double speed_per_n = kMmPerM * step_s / mass_kg;
    const double exponent = viscous_ns_per_mm * speed_per_n;
    decay_ = std::exp(-exponent);
    gain_ = exponent > 0 ? speed_per_n * -std::expm1(-exponent) / exponent : speed_per_n;
    coulomb_drop_ = coulomb_n * gain_;
  }

  /// Velocity in mm/s after one step under `force_n`.
  [[nodiscard]] DeviceVec<double> kick(DeviceVec<double> velocity,
                                       DeviceVec<double> force_n) const noexcept {
    const DeviceVec<double> pushed = velocity * decay_ + force_n * gain_;
    const double speed = norm(pushed);
    if (speed <= coulomb_drop_) return {};
    return pushed * (1.0 - coulomb_drop_ / speed);
  }

 private:
  double decay_ = 1;
  double gain_ = 0;          ///< mm/s per N
  double coulomb_drop_ = 0;  ///< mm/s
};

}  // namespace kerf
