// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kerf {

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

  /// Quadlets in the order of this machine, as GET_INFO hands them out.
  [[nodiscard]] std::vector<std::uint32_t> config_rom() const;

  /// An RCODE of the bus: complete (0), type error (6: wrong width), address error (7). A read
  /// fills `data`.
  [[nodiscard]] std::uint32_t read(std::uint64_t offset, std::span<std::uint8_t> data) const;
  [[nodiscard]] std::uint32_t write(std::uint64_t offset, std::span<const std::uint8_t> data);

  [[nodiscard]] bool streams() const noexcept { return (control_ & kStreams) != 0; }
  [[nodiscard]] int listens_on() const noexcept { return listen_channel_; }
  [[nodiscard]] int transmits_on() const noexcept { return transmit_channel_; }
  [[nodiscard]] std::uint32_t mode_20010() const noexcept { return mode_20010_; }
  /// As after power-up.
  void reset() noexcept { *this = OmniRegisters(packed_serial_); }

 private:
  std::uint32_t packed_serial_;
  std::uint8_t listen_channel_ = 0;
  std::uint8_t transmit_channel_ = 0;
  std::uint8_t control_ = 0;
  std::uint32_t mode_20010_ = 0;
};

}  // namespace kerf
