// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdint>
#include <span>
#include <vector>

/// The registers of a FireWire bus: the resources that its manager gives away, and the
/// configuration ROM and registers of both nodes.
namespace kerf {

// The nodes of the bus: the Omni, and the host's card, which is root, cycle master, bus manager and
// isochronous resource manager.
inline constexpr std::uint32_t kOmniNodeId = 0xFFC0;
inline constexpr std::uint32_t kHostNodeId = 0xFFC1;

/// The resources of the bus's isochronous resource manager: 64 channels and the bandwidth of a
/// cycle. A bus reset frees all of them: make a new object.
class IsoResources {
 public:
  static constexpr std::int32_t kBandwidth = 4915;  ///< units of 20.3 ns: 100 us of the 125

  /// Takes the lowest free channel of `channels` (bit 0 = channel 0) and `bandwidth` units. Returns
  /// the channel, or -EBUSY if either is used up. `channels` of 0 requests bandwidth alone, and
  /// gets channel 0.
  [[nodiscard]] std::int32_t allocate(std::uint64_t channels, std::int32_t bandwidth) noexcept {
    std::int32_t channel = 0;
    while (channels != 0 && channel < 64 && (channels & free_ & bit(channel)) == 0) ++channel;
    if (channel == 64 || bandwidth > bandwidth_) return -EBUSY;
    if (channels != 0) free_ &= ~bit(channel);
    bandwidth_ -= bandwidth;
    return channel;
  }
  /// Frees the result of `allocate` for the same `channels` and `bandwidth`.
  void free(std::uint64_t channels, std::int32_t channel, std::int32_t bandwidth) noexcept {
    if (channels != 0) free_ |= bit(channel);
    bandwidth_ += bandwidth;
  }

  /// The resources as every node of the bus sees them: four registers (IEEE 1394-1995, 8.3.2.3).
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
  /// If the register holds `expected`, it gets `value`. Returns its value before.
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

/// The asynchronous side of an Omni: its configuration ROM and its registers, as far as open
/// drivers know them. Bytes are in the order of the bus.
///
///     0x1000      1 byte   W   channel on which the host transmits
///     0x1001      1 byte   RW  channel on which the device transmits
///     0x1082      1 byte   R   0x00, meaning unknown
///     0x1083      1 byte   R   0xC0, meaning unknown
///     0x1087      1 byte   RW  control; bit 3 = the device streams
///     0x20010     4 bytes  W   meaning unknown
///     0x1006000C  4 bytes  R   GUID, high word;  0x10060010: low word, the packed serial
class OmniRegisters {
 public:
  static constexpr std::uint8_t kStreams = 0x08;

  /// `packed_serial`: bit 0 is 0.
  explicit OmniRegisters(std::uint32_t packed_serial = 0x82B6'980C) noexcept
      : packed_serial_(packed_serial) {}

  /// Quadlets in the order of this machine, as GET_INFO returns them.
  [[nodiscard]] std::vector<std::uint32_t> config_rom() const;

  /// An RCODE of the bus: complete (0), type error (6: wrong width), address error (7). A read
  /// fills `data`.
  [[nodiscard]] std::uint32_t read(std::uint64_t offset, std::span<std::uint8_t> data) const;
  [[nodiscard]] std::uint32_t write(std::uint64_t offset, std::span<const std::uint8_t> data);

  [[nodiscard]] bool streams() const noexcept { return (control_ & kStreams) != 0; }
  [[nodiscard]] int listens_on() const noexcept { return listen_channel_; }
  [[nodiscard]] int transmits_on() const noexcept { return transmit_channel_; }
  [[nodiscard]] std::uint32_t mode_20010() const noexcept { return mode_20010_; }
  /// Resets to the state after power-up.
  void reset() noexcept { *this = OmniRegisters(packed_serial_); }

 private:
  std::uint32_t packed_serial_;
  std::uint8_t listen_channel_ = 0;
  std::uint8_t transmit_channel_ = 0;
  std::uint8_t control_ = 0;
  std::uint32_t mode_20010_ = 0;
};

/// The asynchronous side of the host's own card: the answers of the kernel's ohci.c if a program
/// asks the local node. Bytes are in the order of the bus; addresses count from kCsrBegin.
///
///     0x008   R   node id           0x21C   RL  bus manager
///     0x200   R   cycle timer       0x220   RL  bandwidth that is left
///     0x234   R   broadcast channel 0x224   RL  channels 0 to 31 that are free, channel 0 highest
///     0x400   R   configuration ROM 0x228   RL  channels 32 to 63
///
/// R: by a quadlet. L: by compare and swap of 32 bits, which returns the value before. Not
/// modelled: writes, and reads of more than a quadlet.
[[nodiscard]] std::vector<std::uint32_t> host_config_rom();

/// An RCODE of the bus; `answer` is empty, or the bytes that the request returns. `timer`: the
/// cycle timer.
[[nodiscard]] std::uint32_t ask_host(std::uint32_t tcode, std::uint64_t offset,
                                     std::span<const std::uint8_t> data, std::uint32_t timer,
                                     IsoResources& resources, std::vector<std::uint8_t>& answer);

}  // namespace kerf
