// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Limits at the device port (docs/forces.md 5.4); the plan holds them in the loop's numbers.
template <class N>
struct ForceLimits {
  typename N::Real peak_n;             ///< |F| never above it
  typename N::Real continuous_n;       ///< RMS that the motors can give continuously
  typename N::Real slew_n_per_tick;    ///< |dF| per tick, but see `limited_force`
  typename N::Ratio thermal_per_tick;  ///< T / thermal time constant
};

/// RMS budget: a first-order model of the winding's heat (docs/forces.md 5.4), in N^2.
template <class N>
struct ThermalState {
  typename N::Energy heat_n2{};
};

/// Largest force that the motors may give now: the peak while cool, falling to the continuous force
/// as the budget is used up, so that a held peak settles at the continuous RMS.
template <class N>
[[nodiscard]] constexpr typename N::Real thermal_limit(const ForceLimits<N>& limits,
                                                       const ThermalState<N>& state) noexcept {
  using Real = typename N::Real;
  const Real budget = limits.continuous_n * limits.continuous_n;
  Real heat;
  if constexpr (N::kIsFixed) {
    heat = Real::from_wide(state.heat_n2, 32);
  } else {
    heat = state.heat_n2;
  }
  // The last quarter of the budget is the band in which the limit falls.
  const Real band = budget / Real(4);
  const Real left = std::clamp((budget - heat) / band, Real(0), Real(1));
  return limits.continuous_n + (limits.peak_n - limits.continuous_n) * left;
}

/// One tick of the winding's heat under this force.
template <class N>
constexpr void heat_up(const ForceLimits<N>& limits, ThermalState<N>& state,
                       DeviceVec<typename N::Real> force_n) noexcept {
  if constexpr (N::kIsFixed) {
    const std::int64_t length = norm(force_n).raw();
    const std::int64_t rise = length * length - state.heat_n2;  // |F| < 2^15 N: below 2^62
    state.heat_n2 += (rise >> 16) * limits.thermal_per_tick.raw() >> 8;
  } else {
    state.heat_n2 += (dot(force_n, force_n) - state.heat_n2) * limits.thermal_per_tick;
  }
}

/// `v`, shortened to the component of `wanted` along it: between 0 and `v`.
template <class Real>
[[nodiscard]] constexpr DeviceVec<Real> fallen(DeviceVec<Real> v, DeviceVec<Real> wanted) noexcept {
  const Real length = norm(v);
  if (!(length > Real(0))) return v;
  const auto along = [&](Real part, Real by) { return by * (part / length); };
  const Real left = std::clamp(along(v.x, wanted.x) + along(v.y, wanted.y) + along(v.z, wanted.z),
                               Real(0), length);
  return clamped(v, left);
}

/// `to` if it is within `most` of `from`, else the point at distance `most` from `from` towards it.
template <class Real>
[[nodiscard]] constexpr DeviceVec<Real> within_step(DeviceVec<Real> to, DeviceVec<Real> from,
                                                    Real most) noexcept {
  return norm(to - from) > most ? from + clamped(to - from, most) : to;
}

/// Returns the force to send: `wanted_n` clamped to the peak and the thermal limit, then limited in
/// its change from `last_n`, the force of the last tick. Adds its heat to the winding.
///
/// If the hand `leaves`, that is, moves with the force of the last tick, that force gives it
/// energy. Then it may fall along its own direction at once, and the slew limit counts from the
/// fallen force. Both together change the force F' of the last tick by no more than the slew or F'
/// itself, whichever is larger: |F - F'| <= max(slew, |F'|), the bound of every tick. A force that
/// is later scaled to the motors' range or switched off keeps this bound, because it lies between F
/// and 0.
template <class N>
[[nodiscard]] constexpr DeviceVec<typename N::Real> limited_force(
    const ForceLimits<N>& limits, ThermalState<N>& thermal, DeviceVec<typename N::Real> wanted_n,
    DeviceVec<typename N::Real> last_n, bool leaves) noexcept {
  const auto bounded = clamped(wanted_n, std::min(limits.peak_n, thermal_limit(limits, thermal)));
  const auto whole_n = last_n;
  if (leaves) last_n = fallen(last_n, bounded);
  // The second clamp takes off what rounding of the slew steps may have added up.
  auto sent = clamped(last_n + clamped(bounded - last_n, limits.slew_n_per_tick), limits.peak_n);
  if (leaves) sent = within_step(sent, whole_n, std::max(limits.slew_n_per_tick, norm(whole_n)));
  heat_up(limits, thermal, sent);
  return sent;
}

}  // namespace kerf
