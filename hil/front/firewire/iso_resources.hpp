// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdint>

namespace kerf {

/// What the isochronous resource manager of a bus gives away: 64 channels and the bandwidth of a
/// cycle.
class IsoResources {
 public:
  static constexpr std::int32_t kBandwidth = 4915;  ///< units of 20.3 ns: 100 us of the 125

  /// Takes the lowest free channel of `channels` (bit 0 = channel 0) and `bandwidth` units. Returns
  /// the channel, or -EBUSY where either is not left. `channels` of 0 asks for bandwidth alone, and
  /// gets channel 0.
  [[nodiscard]] std::int32_t allocate(std::uint64_t channels, std::int32_t bandwidth) noexcept {
    std::int32_t channel = 0;
    while (channels != 0 && channel < 64 && (channels & free_ & bit(channel)) == 0) ++channel;
    if (channel == 64 || bandwidth > bandwidth_) return -EBUSY;
    if (channels != 0) free_ &= ~bit(channel);
    bandwidth_ -= bandwidth;
    return channel;
  }
  /// Gives back what `allocate` gave for the same `channels` and `bandwidth`.
  void free(std::uint64_t channels, std::int32_t channel, std::int32_t bandwidth) noexcept {
    if (channels != 0) free_ |= bit(channel);
    bandwidth_ += bandwidth;
  }

 private:
  static constexpr std::uint64_t bit(std::int32_t channel) noexcept {
    return std::uint64_t{1} << channel;
  }
  std::uint64_t free_ = ~std::uint64_t{0};
  std::int32_t bandwidth_ = kBandwidth;
};

}  // namespace kerf
