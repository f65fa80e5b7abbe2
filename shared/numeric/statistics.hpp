// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace kerf {

/// Durations in nanoseconds, counted in buckets of at most 3.2 % width: 32 per power of two.
///
/// Fixed memory, one increment per entry, so the servo thread may record. Percentiles are upper
/// bucket ends; the maximum is exact.
class Histogram {
 public:
  void record(std::int64_t ns) noexcept {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0));
    ++buckets_[bucket_of(value)];
    ++count_;
    max_ns_ = std::max(max_ns_, value);
  }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double max_us() const noexcept { return static_cast<double>(max_ns_) / 1e3; }

  /// Duration in microseconds that a share `quantile` (0..1) of the entries does not exceed.
  [[nodiscard]] double percentile_us(double quantile) const noexcept {
    if (count_ == 0) return 0;
    const double wanted = quantile * static_cast<double>(count_);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      seen += buckets_[i];
      if (static_cast<double>(seen) >= wanted) {
        return static_cast<double>(std::min(upper_end(i), max_ns_)) / 1e3;
      }
    }
    return max_us();
  }

 private:
  static constexpr int kSubBits = 5;
  static constexpr std::size_t kSub = std::size_t{1} << kSubBits;
  static constexpr std::size_t kBuckets = (64 - kSubBits + 1) * kSub;

  static constexpr std::size_t bucket_of(std::uint64_t value) noexcept {
    if (value < kSub) return static_cast<std::size_t>(value);
    const int shift = static_cast<int>(std::bit_width(value)) - 1 - kSubBits;
    return (static_cast<std::size_t>(shift) + 1) * kSub +
           static_cast<std::size_t>((value >> shift) - kSub);
  }
  static constexpr std::uint64_t upper_end(std::size_t bucket) noexcept {
    if (bucket < kSub) return bucket;
    const std::size_t shift = bucket / kSub - 1;
    return ((kSub + bucket % kSub + 1) << shift) - 1;
  }

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::uint64_t max_ns_ = 0;
};

/// The smallest of `values` that a share (0..1) of them does not exceed, by nearest rank; 0 for
/// nothing. Puts `values` into another order. No NaN.
[[nodiscard]] inline double percentile(std::span<double> values, double share) noexcept {
  if (values.empty()) return 0.0;
  constexpr double kRounding = 1e-9;  // 0.28 * 25 is a hair above 7
  const double rank = std::ceil(share * static_cast<double>(values.size()) - kRounding);
  const std::size_t at = std::min(static_cast<std::size_t>(std::max(rank, 1.0)), values.size()) - 1;
  const auto found = values.begin() + static_cast<std::ptrdiff_t>(at);
  std::nth_element(values.begin(), found, values.end());
  return *found;
}

}  // namespace kerf
