// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/law/law_plan.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// What a velocity estimator sees with each report that has a finite pose.
template <class N>
struct VelocityInput {
  DeviceVec<typename N::Real> tip_mm;  ///< at the device port
  std::uint32_t ticks = 1;  ///< since the last one, 1 to 1000: more where reports were missing
  /// There was none, or the device was calibrated with it: the tip is at rest here since ever.
  bool first = false;
};

/// A velocity estimator gives the velocity of the tip in mm/s. It stands for the tick and for those
/// without a report that follow.
template <class N>
using VelocityEstimatorPlan = LawPlan<VelocityInput<N>, typename N::Real>;

}  // namespace kerf
