// SPDX-License-Identifier: Apache-2.0
#include "bridge/stream/link_rate.hpp"

#include <algorithm>

namespace kerf::bridge {

void LinkRate::sent_frame(std::uint64_t frame, std::size_t bytes, std::int64_t now_ns) {
  bytes_sent_ += bytes;
  flight_.push_back({frame, bytes_acked_, bytes_sent_, acked_ns_ != 0 ? acked_ns_ : now_ns});
}

void LinkRate::acked(std::uint64_t frame, std::int64_t now_ns) {
  for (; !flight_.empty() && flight_.front().frame <= frame; flight_.pop_front()) {
    const Flight& flight = flight_.front();
    bytes_acked_ = flight.bytes_with;
    const auto span_ns = static_cast<double>(now_ns - flight.since_ns + 1);
    bytes_per_ns_[next_sample_] = static_cast<double>(bytes_acked_ - flight.bytes_before) / span_ns;
    next_sample_ = (next_sample_ + 1) % kSamples;
    acked_ns_ = now_ns;
  }
}

std::size_t LinkRate::window() const noexcept {
  const double highest = *std::max_element(bytes_per_ns_.begin(), bytes_per_ns_.end());
  const double bytes = kMaxRawBytes + 2 * highest * static_cast<double>(round_trip_ns_ + kTurnNs);
  return static_cast<std::size_t>(std::min<double>(bytes, kMostBytes));
}

double LinkRate::bytes_per_s() const noexcept {
  return *std::max_element(bytes_per_ns_.begin(), bytes_per_ns_.end()) * 1e9;
}

}  // namespace kerf::bridge
