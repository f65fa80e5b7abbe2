// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/law/law_plan.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// What a stabiliser sees in a tick with a report while the motors are on. All of it at the device
/// port.
template <class N>
struct StabiliserInput {
  DeviceVec<typename N::Real> wanted_n;  ///< force to send, after all limits
  DeviceVec<typename N::Real> sent_n;    ///< what the last tick really sent
  DeviceVec<typename N::Real> moved_mm;  ///< by the tip since the last report
  std::uint32_t ticks = 1;               ///< since then
  DeviceVec<typename N::Real> velocity_mm_per_s;
  /// SUM -F_sent . dx up to this tip, in mJ (fixed: 32 fraction bits): what the loop took from the
  /// hand; below 0 it has given more than it took.
  typename N::Energy taken_mj{};
  bool contact = false;  ///< the tool presses on something
};

/// A stabiliser gives the force to send in place of `wanted_n`. All limits of the force hold for it
/// as for any other: what it adds is clamped and bounded in slope once more. Where it gives
/// `wanted_n` itself no bit changes. It begins anew after each tick with the motors off or on hold.
template <class N>
using StabiliserPlan = LawPlan<StabiliserInput<N>, typename N::Real>;

}  // namespace kerf
