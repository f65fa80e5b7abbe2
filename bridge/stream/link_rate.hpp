// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace kerf::bridge {

/// What a link has shown to deliver, and how many frames may be under way on it.
///
/// The rate of an ack is what was acknowledged since its frame was sent, over that time; the
/// highest of the last `kSamples` counts, since a sender with little to say delivers less than the
/// link could. Twice rate times round trip is under way when the link is full and acks come in
/// clumps; one frame more starts it. The round trip is the kernel's least one, because that of an
/// ack contains the sending time of its frame, and would let a queue grow that it then measures.
///
/// `now_ns` never falls. One thread.
class LinkRate {
 public:
  static constexpr std::size_t kSamples = 32;
  static constexpr unsigned kLeastWindow = 2, kMostWindow = 32;

  void set_round_trip(std::int64_t least_ns) noexcept { round_trip_ns_ = least_ns; }

  /// What is sent beside frames.
  void sent(std::size_t bytes) noexcept { bytes_sent_ += bytes; }
  void sent_frame(std::uint64_t frame, std::size_t bytes, std::int64_t now_ns);
  /// All frames up to `frame` have been applied.
  void acked(std::uint64_t frame, std::int64_t now_ns);

  [[nodiscard]] bool has_credit() const noexcept { return flight_.size() < window(); }
  [[nodiscard]] bool waits_for_ack() const noexcept { return !flight_.empty(); }
  [[nodiscard]] unsigned window() const noexcept;
  /// 0: nothing was acknowledged yet.
  [[nodiscard]] double bytes_per_s() const noexcept;

 private:
  struct Flight {
    std::uint64_t frame;
    std::uint64_t frames_before, bytes_before;  // acknowledged when it was sent
    std::uint64_t bytes_with;                   // sent up to its end
    std::int64_t since_ns;
  };
  struct Sample {
    double frames_per_ns = 0, bytes_per_ns = 0;
  };

  std::deque<Flight> flight_;
  std::array<Sample, kSamples> samples_{};
  std::size_t next_sample_ = 0;
  std::uint64_t frames_acked_ = 0, bytes_acked_ = 0, bytes_sent_ = 0;
  std::int64_t acked_ns_ = 0, round_trip_ns_ = 0;
};

}  // namespace kerf::bridge
