// SPDX-License-Identifier: Apache-2.0
#include "bridge/stream/link_rate.hpp"

#include <algorithm>
#include <cmath>

namespace kerf::bridge {

void LinkRate::sent_frame(std::uint64_t frame, std::size_t bytes, std::int64_t now_ns) {
  bytes_sent_ += bytes;
  flight_.push_back(
      {frame, frames_acked_, bytes_acked_, bytes_sent_, acked_ns_ != 0 ? acked_ns_ : now_ns});
}

void LinkRate::acked(std::uint64_t frame, std::int64_t now_ns) {
  for (; !flight_.empty() && flight_.front().frame <= frame; flight_.pop_front()) {
    const Flight& flight = flight_.front();
    ++frames_acked_;
    bytes_acked_ = flight.bytes_with;
    const auto span_ns = static_cast<double>(now_ns - flight.since_ns + 1);
    samples_[next_sample_] = {static_cast<double>(frames_acked_ - flight.frames_before) / span_ns,
                              static_cast<double>(bytes_acked_ - flight.bytes_before) / span_ns};
    next_sample_ = (next_sample_ + 1) % kSamples;
    acked_ns_ = now_ns;
  }
}

unsigned LinkRate::window() const noexcept {
  double highest = 0;
  for (const Sample& sample : samples_) highest = std::max(highest, sample.frames_per_ns);
  const double frames = 1 + std::ceil(2 * highest * static_cast<double>(round_trip_ns_));
  return static_cast<unsigned>(std::clamp<double>(frames, kLeastWindow, kMostWindow));
}

double LinkRate::bytes_per_s() const noexcept {
  double highest = 0;
  for (const Sample& sample : samples_) highest = std::max(highest, sample.bytes_per_ns);
  return highest * 1e9;
}

}  // namespace kerf::bridge
