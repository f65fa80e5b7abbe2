// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/law/law.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// The velocity estimators that scenes can name: `foaw` and `difference`.

namespace kerf {

/// Constants of `VelocityWindow` in a run.
template <class N>
struct VelocityPlan {
  std::int32_t rate_hz = 1000;
  /// Ticks between the samples that are used, 1 to `kMaxStride`: from 1 to 8 kHz a window still
  /// spans up to 16 ms, above (in maps alone) 128 ticks.
  std::int32_t stride = 1;
  typename N::Real noise_mm{};  ///< largest error of an encoder reading
};

/// Velocity of the tip by first-order adaptive windowing (docs/forces.md 5.2): on each axis the
/// longest window of at most 16 intervals whose line misses no sample by more than twice
/// `noise_mm`, because the sample and the newest position can each be off by `noise_mm`. A resting
/// hand therefore keeps the full window. Servo thread; 135 comparisons an axis at most; no heap.
template <class N>
class VelocityWindow {
 public:
  using Real = typename N::Real;
  static constexpr std::int32_t kIntervals = 16;
  static constexpr std::int32_t kMaxStride = 8;

  /// Begins with a tip that has been at rest at `tip_mm`.
  constexpr void start(DeviceVec<Real> tip_mm) noexcept { ring_.fill(tip_mm); }

  /// Adds the tip `gap` ticks after the last one. Missing positions between are interpolated, as if
  /// the hand had kept its speed. Writes at most kRing + 1 positions.
  constexpr void take(DeviceVec<Real> tip_mm, std::uint32_t gap) noexcept {
    const std::int64_t ticks = std::max<std::uint32_t>(gap, 1U);
    const DeviceVec<Real> from = ring_[static_cast<std::size_t>(newest_)];
    const auto between = [&](Real a, Real b, std::int64_t i) {
      const Wide part = (wide(b) - wide(a)) * Wide(i) / Wide(ticks);
      if constexpr (N::kIsFixed) {
        return Real::from_raw(static_cast<std::int32_t>(a.raw() + part));
      } else {
        return a + part;
      }
    };
    for (std::int64_t i = std::max<std::int64_t>(1, ticks - kRing); i <= ticks; ++i) {
      newest_ = (newest_ + 1) % kRing;
      ring_[static_cast<std::size_t>(newest_)] =
          i == ticks ? tip_mm
                     : DeviceVec<Real>{between(from.x, tip_mm.x, i), between(from.y, tip_mm.y, i),
                                       between(from.z, tip_mm.z, i)};
    }
  }

  /// At the newest tip, in mm/s, saturated.
  [[nodiscard]] constexpr DeviceVec<Real> velocity(const VelocityPlan<N>& plan) const noexcept {
    return {axis(plan, &DeviceVec<Real>::x), axis(plan, &DeviceVec<Real>::y),
            axis(plan, &DeviceVec<Real>::z)};
  }

 private:
  static constexpr std::int32_t kRing = kIntervals * kMaxStride + 1;
  /// Fixed: exact integers. A difference has 33 bits, 6 SUM 44, times j 48, times the denominator
  /// of the check, at most 16 * 17 * 18, 46.
  using Wide = std::conditional_t<N::kIsFixed, std::int64_t, Real>;

  static constexpr Wide wide(Real value) noexcept {
    if constexpr (N::kIsFixed) {
      return value.raw();
    } else {
      return value;
    }
  }

  constexpr Real axis(const VelocityPlan<N>& plan, Real DeviceVec<Real>::*of) const noexcept {
    const auto at = [&](std::int32_t l) {
      const std::int32_t age = l * plan.stride;
      return wide(ring_[static_cast<std::size_t>((newest_ + kRing - age) % kRing)].*of);
    };
    const Wide most = Wide(2) * wide(plan.noise_mm);
    std::array<Wide, kIntervals + 1> back{};  // newest - sample
    const Wide newest = at(0);
    std::int32_t same = 1;
    while (same <= kIntervals && at(same) == newest) ++same;
    if (same > kIntervals) return Real(0);  // as below, without its 135 comparisons

    Wide slope{}, slope_of{1};  // per interval: slope / slope_of
    Wide sum{};                 // SUM_j back_j
    Wide moment{};              // SUM_j j back_j
    for (std::int32_t i = 1; i <= kIntervals; ++i) {
      const auto n = static_cast<std::size_t>(i);
      back[n] = newest - at(i);
      sum += back[n];
      moment += Wide(i) * back[n];
      // SUM_j (i - 2 j) x_j = SUM_j (2 j - i) back_j, as the weights add up to 0.
      const Wide top = Wide(6) * (Wide(2) * moment - Wide(i) * sum);
      const Wide bottom = Wide(i) * Wide(i + 1) * Wide(i + 2);
      for (std::int32_t j = 1; j <= i; ++j) {
        const Wide miss = back[static_cast<std::size_t>(j)] * bottom - Wide(j) * top;
        if (i > 1 && (miss > most * bottom || -miss > most * bottom)) {
          return per_second(plan, slope, slope_of);
        }
      }
      slope = top;
      slope_of = bottom;
    }
    return per_second(plan, slope, slope_of);
  }

  static constexpr Real per_second(const VelocityPlan<N>& plan, Wide top, Wide bottom) noexcept {
    if constexpr (N::kIsFixed) {
      const Wide scaled = top * plan.rate_hz;  // 44 + 13 bits
      const Wide half = scaled < 0 ? -bottom * plan.stride / 2 : bottom * plan.stride / 2;
      return Real::from_raw(saturate_i32((scaled + half) / (bottom * plan.stride)));
    } else {
      return top * Real(plan.rate_hz) / (bottom * Real(plan.stride));
    }
  }

  std::array<DeviceVec<Real>, static_cast<std::size_t>(kRing)> ring_{};
  std::int32_t newest_ = 0;
};

/// The velocity estimator `difference`: the backward difference of the tip and, if its time
/// constant tau is not 0, a first-order filter after it, by the backward Euler rule:
///
///   v = y + (dx / T - y) T / (T + tau)
///
/// Without the filter its resolution is one encoder count / T. After a gap of k ticks the mean
/// velocity dx / (k T) passes the filter k times. The analytic limits of stability assume this
/// estimator.
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

/// The velocity estimator `foaw`: a `VelocityWindow` whose bound is the device's encoder.
template <class N>
class Foaw {
 public:
  static constexpr const char* kName = "foaw";
  static constexpr const char* kMeaning =
      "first-order adaptive windowing, best fit over at most 16 intervals (docs/forces.md 5.2)";
  static constexpr std::array<LawSetting, 0> kSettings{};
  using State = VelocityWindow<N>;

  explicit Foaw(const LawSetup& setup)
      : plan_{.rate_hz = static_cast<std::int32_t>(setup.rate_hz()),
              .stride = std::clamp<std::int32_t>(static_cast<std::int32_t>(setup.rate_hz()) / 1000,
                                                 1, State::kMaxStride),
              .noise_mm = typename N::Real(setup.tip_noise_mm())} {}

  [[nodiscard]] DeviceVec<typename N::Real> step(const VelocityInput<N>& in,
                                                 State& window) const noexcept {
    if (in.first) window.start(in.tip_mm);
    window.take(in.tip_mm, in.ticks);
    return window.velocity(plan_);
  }

 private:
  VelocityPlan<N> plan_;
};

}  // namespace kerf
