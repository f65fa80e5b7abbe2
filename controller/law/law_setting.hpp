// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace kerf {

/// One named number of a law, which a scene may set: reading, the answer to every mistake,
/// docs/scene-keys.md and the JSON in the segment come from it. Both ends are allowed values.
struct LawSetting {
  std::string_view name;  ///< with its unit, as `stiffness_n_per_mm`
  std::string_view unit;  ///< as text; empty: a plain number
  double lo = 0, hi = 0;
  double by_default = 0;
  std::string_view meaning;
};
inline constexpr std::size_t kMostLawSettings = 8;

/// What a law is made from, at load: its settings, and what is constant of the loop.
class LawSetup {
 public:
  constexpr LawSetup(double rate_hz, double tip_noise_mm, std::span<const LawSetting> settings,
                     std::span<const double> values) noexcept
      : rate_hz_(rate_hz), tip_noise_mm_(tip_noise_mm), settings_(settings), values_(values) {}

  [[nodiscard]] constexpr double rate_hz() const noexcept { return rate_hz_; }
  [[nodiscard]] constexpr double period_s() const noexcept { return 1 / rate_hz_; }
  /// No encoder reading is farther from the true tip, at the device port.
  [[nodiscard]] constexpr double tip_noise_mm() const noexcept { return tip_noise_mm_; }
  /// The value of one of the law's settings. A name that the law does not list gives 0, and the law
  /// is refused with it at load.
  [[nodiscard]] constexpr double operator[](std::string_view name) const noexcept {
    for (std::size_t i = 0; i < settings_.size(); ++i) {
      if (settings_[i].name == name) return values_[i];
    }
    unknown_ = name;
    return 0;
  }
  /// The last name that was asked for and is not listed; empty: none.
  [[nodiscard]] constexpr std::string_view unknown() const noexcept { return unknown_; }

 private:
  double rate_hz_, tip_noise_mm_;
  std::span<const LawSetting> settings_;
  std::span<const double> values_;
  mutable std::string_view unknown_{};
};

}  // namespace kerf
