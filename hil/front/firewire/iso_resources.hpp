// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdint>

namespace kerf {

// Who is who on the bus: the Omni, and the host's card, which is root, cycle master, bus manager
// and isochronous resource manager.
inline constexpr std::uint32_t kOmniNodeId = 0xFFC0;
inline constexpr std::uint32_t kHostNodeId = 0xFFC1;

/// What the isochronous resource manager of a bus gives away: 64 channels and the bandwidth of a
/// cycle. A bus reset gives all of it back: make a new one.
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

  /// The same as any node of the bus sees it: four registers (IEEE 1394-1995, 8.3.2.3).
  enum class Register : std::uint8_t { bus_manager, bandwidth, channels_low, channels_high };

  [[nodiscard]] std::uint32_t get(Register which) const noexcept {
    switch (which) {
      case Register::bus_manager:
        return bus_manager_;
      case Register::bandwidth:
        return static_cast<std::uint32_t>(bandwidth_) & kBandwidthMask;
      case Register::channels_low:
        return mirrored(static_cast<std::uint32_t>(free_));
      case Register::channels_high:
        break;
    }
    return mirrored(static_cast<std::uint32_t>(free_ >> 32));
  }
  /// Where the register holds `expected` it gets `value`. Returns what it held before.
  std::uint32_t compare_swap(Register which, std::uint32_t expected, std::uint32_t value) noexcept {
    const std::uint32_t old = get(which);
    if (old == expected) set(which, value);
    return old;
  }

 private:
  static constexpr std::uint32_t kBandwidthMask = 0x1FFF;
  static constexpr std::uint32_t kNodeMask = 0x3F;

  static constexpr std::uint64_t bit(std::int32_t channel) noexcept {
    return std::uint64_t{1} << channel;
  }
  /// In the registers the first channel is the highest bit.
  static constexpr std::uint32_t mirrored(std::uint32_t bits) noexcept {
    std::uint32_t out = 0;
    for (int i = 0; i < 32; ++i) out |= (bits >> i & 1U) << (31 - i);
    return out;
  }
  void set(Register which, std::uint32_t value) noexcept {
    constexpr std::uint64_t kLow = 0xFFFF'FFFF;
    switch (which) {
      case Register::bus_manager:
        bus_manager_ = value & kNodeMask;
        return;
      case Register::bandwidth:
        bandwidth_ = static_cast<std::int32_t>(value & kBandwidthMask);
        return;
      case Register::channels_low:
        free_ = (free_ & ~kLow) | mirrored(value);
        return;
      case Register::channels_high:
        free_ = (free_ & kLow) | std::uint64_t{mirrored(value)} << 32;
        return;
    }
  }

  std::uint64_t free_ = ~std::uint64_t{0};
  std::int32_t bandwidth_ = kBandwidth;
  std::uint32_t bus_manager_ = kHostNodeId & kNodeMask;
};

}  // namespace kerf
