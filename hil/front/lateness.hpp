// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace kerf {

/// How late the wake-ups of a loop were: one bucket per microsecond up to 10 ms, and the maximum.
/// Later ones count in the last bucket. Preallocated; one thread.
class Lateness {
 public:
  void record(std::int64_t late_ns) noexcept {
    const std::int64_t late_us = std::max<std::int64_t>(late_ns, 0) / 1000;
    max_us_ = std::max(max_us_, late_us);
    ++bucket_[std::min(static_cast<std::size_t>(late_us), bucket_.size() - 1)];
    ++count_;
  }

  /// Smallest bound that `share` (0..1) of the wake-ups keep, in whole microseconds.
  [[nodiscard]] std::int64_t percentile_us(double share) const noexcept {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t us = 0; us < bucket_.size(); ++us) {
      seen += bucket_[us];
      if (seen >= wanted) return std::min(static_cast<std::int64_t>(us), max_us_);
    }
    return max_us_;
  }
  [[nodiscard]] std::int64_t max_us() const noexcept { return max_us_; }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

 private:
  static constexpr std::size_t kBuckets = 10'001;
  std::array<std::uint64_t, kBuckets> bucket_{};
  std::uint64_t count_ = 0;
  std::int64_t max_us_ = 0;
};

}  // namespace kerf
