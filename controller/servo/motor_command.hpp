// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/servo/servo_plan.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// What the motors get: signed counts, and the share of the force that they can carry.
template <class N>
struct MotorCommand {
  std::array<std::int16_t, 3> counts{};
  typename N::Unit share{};  ///< 1, or less where a motor is at the end of its range
};

/// All three counts are scaled down together where one would leave the range, so that the direction
/// of the force stays. Products are not rounded before that.
template <class N>
[[nodiscard]] MotorCommand<N> motor_command(const ServoPlan<N>& plan,
                                            JointVec<typename N::Real> torque_n_mm) noexcept {
  const std::array<typename N::Real, 3> torque{torque_n_mm.x, torque_n_mm.y, torque_n_mm.z};
  MotorCommand<N> command;
  if constexpr (N::kIsFixed) {
    constexpr int kBits = 32;  // Q16 * Q16
    const std::int64_t end = plan.device.motor_count_end;
    std::array<std::int64_t, 3> wide{};
    std::int64_t largest = end << kBits;
    for (std::size_t i = 0; i < 3; ++i) {
      wide[i] = std::int64_t{torque[i].raw()} * plan.device.joints[i].counts_per_n_mm.raw();
      largest = std::max(largest, wide[i] < 0 ? -wide[i] : wide[i]);
    }
    // end / largest with 30 fraction bits. No product exceeds end, 13 bits, with 12 + 30 more.
    const std::int64_t share = (end << (30 + 20)) / (largest >> (kBits - 20));
    command.share = N::Unit::from_raw(static_cast<std::int32_t>(share));
    for (std::size_t i = 0; i < 3; ++i) {
      command.counts[i] = static_cast<std::int16_t>(round_shift((wide[i] >> 20) * share, 12 + 30));
    }
  } else {
    using Real = typename N::Real;
    const auto end = static_cast<Real>(plan.device.motor_count_end);
    std::array<Real, 3> wide{};
    Real largest = end;
    for (std::size_t i = 0; i < 3; ++i) {
      wide[i] = torque[i] * plan.device.joints[i].counts_per_n_mm;
      largest = std::max(largest, wide[i] < 0 ? -wide[i] : wide[i]);
    }
    command.share = end / largest;
    for (std::size_t i = 0; i < 3; ++i) {
      // Half up, as in fixed: the offset keeps the argument of the cast positive.
      constexpr int kOffset = 8192;
      command.counts[i] = static_cast<std::int16_t>(
          static_cast<int>(wide[i] * command.share + Real(kOffset) + Real(0.5)) - kOffset);
    }
  }
  return command;
}

}  // namespace kerf
