// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "controller/law/velocity_estimator.hpp"

namespace kerf {

/// The velocity estimator `difference`: the backward difference of the tip, and where its time
/// constant tau is not 0 a first-order filter behind it, by the backward Euler rule:
///
///   v = y + (dx / T - y) T / (T + tau)
///
/// This is the estimator of the analytic limits of stability. Its quantum without a filter is one
/// encoder count over T. After a gap of k ticks dx / (k T) has stood for k of them.
template <class N>
class Difference {
 public:
  static constexpr const char* kName = "difference";
  static constexpr const char* kMeaning = "backward difference, and a first-order filter";
  static constexpr std::array<LawSetting, 1> kSettings{
      {{"tau_ms", "ms", 0, 1000, 0,
        "time constant of the filter; 0: none. Cut-off: 1 / (2 pi tau)"}}};
  using Real = typename N::Real;
  struct State {
    DeviceVec<Real> tip_mm;
    DeviceVec<Real> velocity_mm_per_s;
  };

  explicit Difference(const LawSetup& setup)
      : rate_hz_(static_cast<std::int32_t>(setup.rate_hz())),
        kept_(typename N::Unit(setup["tau_ms"] / (setup["tau_ms"] + 1000 * setup.period_s()))) {}

  [[nodiscard]] DeviceVec<Real> step(const VelocityInput<N>& in, State& state) const noexcept {
    if (in.first) state.tip_mm = in.tip_mm;
    // kept^ticks, by squaring: 10 rounds at most.
    typename N::Unit kept(1), power = kept_;
    for (std::uint32_t left = in.ticks; left > 0; left >>= 1) {
      if ((left & 1) != 0) kept = kept * power;
      power = power * power;
    }
    const auto axis = [&](Real last, Real tip, Real y) {
      const Real v = per_second(tip - last, in.ticks);
      return v + multiply<Real>(kept, y - v);
    };
    const DeviceVec<Real>&a = state.tip_mm, &b = in.tip_mm, &y = state.velocity_mm_per_s;
    state.velocity_mm_per_s = {axis(a.x, b.x, y.x), axis(a.y, b.y, y.y), axis(a.z, b.z, y.z)};
    state.tip_mm = in.tip_mm;
    return state.velocity_mm_per_s;
  }

 private:
  [[nodiscard]] Real per_second(Real moved_mm, std::uint32_t ticks) const noexcept {
    if constexpr (N::kIsFixed) {  // 32 + 13 bits
      return Real::from_raw(
          saturate_i32(std::int64_t{moved_mm.raw()} * rate_hz_ / std::int64_t{ticks}));
    } else {
      return moved_mm * Real(rate_hz_) / Real(ticks);
    }
  }

  std::int32_t rate_hz_;
  typename N::Unit kept_;  ///< of y in one tick: tau / (T + tau)
};

}  // namespace kerf
