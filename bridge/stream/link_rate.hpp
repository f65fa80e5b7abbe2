// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "bridge/wire/messages.hpp"

namespace kerf::bridge {

/// What a link has shown to deliver, and how many bytes may be under way on it.
///
/// The rate of an ack is what was acknowledged since its frame was sent, over that time; the
/// highest of the last `kSamples` counts, since a sender with little to say delivers less than the
/// link could. Twice rate times round trip is under way when the link is full and acks come in
/// clumps; one frame more starts it. The round trip is the kernel's least one, because that of an
/// ack contains the sending time of its frame, and would let a queue grow that it then measures.
///
/// Bytes, not frames: a packed frame is a quarter of a plain one, and a window of so many frames
/// would be as much smaller, just where the link is what holds a pass up.
///
/// `now_ns` never falls. One thread.
class LinkRate {
 public:
  static constexpr std::size_t kSamples = 32;
  /// One frame is applied while the next is on its way, however large they are.
  static constexpr std::size_t kLeastFrames = 2;
  /// Until a program has its turn on a processor, applies a frame and answers. It counts on a quick
  /// link only, whose join is a sixth shorter for it; at 4 Mbit/s it is 1 KiB of the window.
  static constexpr std::int64_t kTurnNs = 1'000'000;
  /// Of which a link of more than 13 MB/s at a round trip of 40 ms waits for acks.
  static constexpr std::size_t kMostBytes = 32 * kMaxRawBytes;

  void set_round_trip(std::int64_t least_ns) noexcept { round_trip_ns_ = least_ns; }

  /// What is sent beside frames.
  void sent(std::size_t bytes) noexcept { bytes_sent_ += bytes; }
  void sent_frame(std::uint64_t frame, std::size_t bytes, std::int64_t now_ns);
  /// All frames up to `frame` have been applied.
  void acked(std::uint64_t frame, std::int64_t now_ns);

  [[nodiscard]] bool has_credit() const noexcept {
    return flight_.size() < kLeastFrames || flight_.back().bytes_with - bytes_acked_ < window();
  }
  [[nodiscard]] bool waits_for_ack() const noexcept { return !flight_.empty(); }
  /// Bytes.
  [[nodiscard]] std::size_t window() const noexcept;
  /// 0: nothing was acknowledged yet.
  [[nodiscard]] double bytes_per_s() const noexcept;

 private:
  struct Flight {
    std::uint64_t frame;
    std::uint64_t bytes_before;  // acknowledged when it was sent
    std::uint64_t bytes_with;    // sent up to its end
    std::int64_t since_ns;
  };

  std::deque<Flight> flight_;
  std::array<double, kSamples> bytes_per_ns_{};
  std::size_t next_sample_ = 0;
  std::uint64_t bytes_acked_ = 0, bytes_sent_ = 0;
  std::int64_t acked_ns_ = 0, round_trip_ns_ = 0;
};

}  // namespace kerf::bridge
