// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace kerf::bridge {

/// The other machine's CLOCK_MONOTONIC as the local one tells it; both count from their own start,
/// so they differ by hours. One thread.
///
/// A message that is sent at s (theirs) and comes at c (ours) took w = c - s - offset >= 0. The
/// least c - s so far is therefore the offset and the shortest way; half of the link's least round
/// trip is taken for that way, as NTP does: an error of half the difference of the two directions
/// stays. Two clocks drift apart, so the least one may grow by `kDriftPpm`; a link that queues from
/// the first message on cannot be told from another offset for longer than that.
class ClockOffset {
 public:
  static constexpr std::int64_t kDriftPpm = 100;  ///< of two quartz clocks, 50 each

  /// `round_trip_ns`: the link's least one so far; 0: not known.
  void sample(std::int64_t sent_ns, std::int64_t came_ns, std::int64_t round_trip_ns) noexcept {
    const std::int64_t seen = bounded(came_ns) - bounded(sent_ns);
    const std::int64_t passed =
        std::clamp<std::int64_t>(bounded(came_ns) - last_ns_, 0, kLongestNs);
    least_ns_ = known_ ? std::min(seen, least_ns_ + passed / 1'000'000 * kDriftPpm) : seen;
    // The part of the millisecond that gave no drift yet counts next time.
    last_ns_ = bounded(came_ns) - (known_ ? passed % 1'000'000 : 0);
    if (round_trip_ns > 0) way_ns_ = std::min(way_ns_, bounded(round_trip_ns) / 2);
    known_ = true;
  }

  /// Their time as ours; never below 0, where a time from before our start would wrap.
  [[nodiscard]] std::int64_t local(std::int64_t their_ns) const noexcept {
    const std::int64_t way = way_ns_ == std::numeric_limits<std::int64_t>::max() ? 0 : way_ns_;
    return std::max<std::int64_t>(bounded(their_ns) + least_ns_ - way, 0);
  }
  [[nodiscard]] std::uint64_t local(std::uint64_t their_ns) const noexcept {
    constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    return static_cast<std::uint64_t>(local(static_cast<std::int64_t>(std::min(their_ns, kMost))));
  }

 private:
  static constexpr std::int64_t kLongestNs = std::int64_t{86'400} * 1'000'000'000;  // a day

  /// A time of 73 years at most, so that sums of three stay in 64 bits.
  [[nodiscard]] static constexpr std::int64_t bounded(std::int64_t ns) noexcept {
    constexpr std::int64_t kMost = std::int64_t{1} << 61;
    return std::clamp(ns, -kMost, kMost);
  }

  bool known_ = false;
  std::int64_t least_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::int64_t way_ns_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace kerf::bridge
