// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace kerf::two_machines {

/// How a link treats packets, each direction alike and by itself.
struct LinkSettings {
  double loss = 0;         ///< share of packets, at random
  double delay_ms = 0;     ///< of each direction
  double mbit = 0;         ///< 10^6 bit/s; 0: no bound
  std::uint64_t seed = 1;  ///< the same losses for the same packets
};

/// One direction of a link, in whatever time its caller keeps: it loses, it sends packets one after
/// the other at its rate from a queue of 100 ms, which drops what does not fit, and then it delays.
class Link {
 public:
  using Packet = std::vector<std::byte>;
  static constexpr std::int64_t kQueueNs = 100'000'000;

  Link(const LinkSettings& settings, std::uint64_t direction)
      : settings_(settings), random_(settings.seed * 2 + direction) {}

  /// A packet comes in; false where it is lost.
  bool offer(std::int64_t now_ns, Packet packet) {
    const bool lucky = uniform_(random_) >= settings_.loss;
    const std::int64_t start_ns = std::max(now_ns, line_free_ns_);
    if (!lucky || start_ns - now_ns > kQueueNs) return false;
    const double bits = 8.0 * static_cast<double>(packet.size());
    line_free_ns_ =
        start_ns +
        (settings_.mbit > 0 ? static_cast<std::int64_t>(bits * 1e3 / settings_.mbit) : 0);
    const auto delay_ns = static_cast<std::int64_t>(settings_.delay_ms * 1e6);
    queue_.push_back({line_free_ns_ + delay_ns, std::move(packet)});
    return true;
  }

  /// When the next packet comes out; nothing: none is on its way.
  [[nodiscard]] std::optional<std::int64_t> next_ns() const {
    if (queue_.empty()) return std::nullopt;
    return queue_.front().due_ns;
  }

  /// The next packet that is out by `now_ns`.
  [[nodiscard]] std::optional<Packet> take(std::int64_t now_ns) {
    if (queue_.empty() || queue_.front().due_ns > now_ns) return std::nullopt;
    Packet out = std::move(queue_.front().packet);
    queue_.pop_front();
    return out;
  }

 private:
  struct Queued {
    std::int64_t due_ns;
    Packet packet;
  };
  LinkSettings settings_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_;
  std::deque<Queued> queue_;
  std::int64_t line_free_ns_ = 0;
};

}  // namespace kerf::two_machines
