// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

namespace kerf::test {

/// Servo ticks of 1 ms that a timing test runs: these, or KERF_TIMING_SECONDS.
inline constexpr int kTimingTicks = 2000;
[[nodiscard]] inline int timing_ticks() {
  const char* const wanted = std::getenv("KERF_TIMING_SECONDS");
  return wanted ? 1000 * std::clamp(std::atoi(wanted), 1, 3600) : kTimingTicks;
}

/// Percentiles of measured times; the unit is that of the values.
struct Spread {
  std::int64_t p50 = 0, p99 = 0, p999 = 0, max = 0;
};

/// Nearest rank below; all 0 without values.
[[nodiscard]] inline Spread spread_of(std::vector<std::int64_t> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {at(0.5), at(0.99), at(0.999), values.back()};
}

[[nodiscard]] inline std::string text(const Spread& s) {
  return std::to_string(s.p50) + " / " + std::to_string(s.p99) + " / " + std::to_string(s.p999) +
         " (" + std::to_string(s.max) + ")";
}

}  // namespace kerf::test
