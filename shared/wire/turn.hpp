// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace kerf {

/// All packets of a device in one tick of a lock-step run, in one datagram of kerf's own links:
/// magic, then each packet behind a byte with its length. Without packets it says that nothing
/// came, so that a fault that keeps packets back does not stop both sides.
///
/// Its first bytes are no packet's of any device that is known here.
class Turn {
 public:
  static constexpr std::array<std::uint8_t, 8> kMagic{'k', 'e', 'r', 'f', 0, 't', 'n', 1};
  /// The longest turn; more packets of one tick than 15 of the longest are no device's.
  static constexpr std::size_t kMostBytes = 1024;

  Turn() noexcept { std::copy(kMagic.begin(), kMagic.end(), bytes_.begin()); }

  /// False: there is no room, or the packet is empty or longer than 255 bytes.
  bool add(std::span<const std::uint8_t> packet) noexcept {
    if (packet.empty() || packet.size() > 255 || size_ + 1 + packet.size() > kMostBytes)
      return false;
    bytes_[size_] = static_cast<std::uint8_t>(packet.size());
    std::copy(packet.begin(), packet.end(),
              bytes_.begin() + static_cast<std::ptrdiff_t>(size_ + 1));
    size_ += 1 + packet.size();
    return true;
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return std::span(bytes_).first(size_);
  }

  [[nodiscard]] static bool is_turn(std::span<const std::uint8_t> bytes) noexcept {
    return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
  }
  /// The packet at the head of what follows the magic, which is taken off; empty at the end, or
  /// where a length leads beyond it.
  [[nodiscard]] static std::span<const std::uint8_t> next(
      std::span<const std::uint8_t>& rest) noexcept {
    if (rest.empty() || rest.size() - 1 < rest[0]) return {};
    const auto packet = rest.subspan(1, rest[0]);
    rest = rest.subspan(1 + packet.size());
    return packet;
  }

 private:
  std::array<std::uint8_t, kMostBytes> bytes_{};
  std::size_t size_ = kMagic.size();
};

}  // namespace kerf
