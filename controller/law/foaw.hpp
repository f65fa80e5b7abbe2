// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "controller/law/velocity_estimator.hpp"
#include "controller/law/velocity_window.hpp"

namespace kerf {

/// The velocity estimator `foaw`: a `VelocityWindow` whose bound is the device's encoder.
template <class N>
class Foaw {
 public:
  static constexpr const char* kName = "foaw";
  static constexpr const char* kMeaning =
      "first-order adaptive windowing, best fit over at most 16 intervals (docs/theory.md 5.2)";
  static constexpr std::array<LawSetting, 0> kSettings{};
  using State = VelocityWindow<N>;

  explicit Foaw(const LawSetup& setup)
      : plan_{.rate_hz = static_cast<std::int32_t>(setup.rate_hz()),
              .stride = std::max(1, static_cast<std::int32_t>(setup.rate_hz()) / 1000),
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
