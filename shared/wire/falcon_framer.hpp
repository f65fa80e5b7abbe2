// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/wire/falcon_packet.hpp"

namespace kerf::falcon {

/// Finds packets, '<' to '>', in a serial stream that comes in pieces of any size. For both ends;
/// one thread; nothing allocates.
class Framer {
 public:
  /// True when this byte ends a packet, which `packet` then shows until the next call.
  [[nodiscard]] bool take(std::uint8_t byte) noexcept {
    if (byte == kBegin) {  // never inside a packet, whose bytes are 'A' and above
      strays_ += size_;
      size_ = 0;
    } else if (size_ == 0) {
      ++strays_;
      return false;
    }
    packet_[size_++] = byte;
    if (size_ < kPacketBytes) return false;
    size_ = 0;
    if (byte == kEnd) return true;
    strays_ += kPacketBytes;
    return false;
  }
  [[nodiscard]] const PacketBytes& packet() const noexcept { return packet_; }
  /// Bytes that belonged to no packet.
  [[nodiscard]] std::uint64_t strays() const noexcept { return strays_; }

 private:
  PacketBytes packet_{};
  std::size_t size_ = 0;
  std::uint64_t strays_ = 0;
};

}  // namespace kerf::falcon
