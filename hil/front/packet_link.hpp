// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace kerf {

/// The way to one host: whole packets, none merged. One thread.
class PacketLink {
 public:
  enum class Sent : std::uint8_t { yes, full, closed };

  virtual ~PacketLink() = default;

  /// Oldest waiting packet into `buffer`; a longer one is cut. Empty when none waits, and then
  /// `closed` tells whether the other end is gone. Never blocks.
  [[nodiscard]] virtual std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept = 0;
  /// As `take`, but waits up to `timeout_ms` for a packet.
  [[nodiscard]] virtual std::span<const std::uint8_t> wait(std::span<std::uint8_t> buffer,
                                                           int timeout_ms) noexcept = 0;
  /// Never blocks: `full` when the other end does not read.
  [[nodiscard]] virtual Sent send(std::span<const std::uint8_t> packet) noexcept = 0;
  [[nodiscard]] virtual bool closed() const noexcept = 0;
};

}  // namespace kerf
