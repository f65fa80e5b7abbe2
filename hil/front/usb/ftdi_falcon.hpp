// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hil/devmodel/packet_device.hpp"
#include "hil/front/usb/falcon_boot_loader.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "shared/wire/falcon_framer.hpp"

namespace kerf {

/// What the USB side of an emulated Falcon is made of: the FTDI chip FT232R (vendor requests, two
/// status bytes, latency timer), and behind its serial line the boot loader and then `device`.
///
/// One packet of at most 64 bytes per 1 ms frame: as soon as 62 bytes wait, otherwise with what
/// waits (or nothing but status) when the latency timer has run out. The line itself takes no time.
/// One thread.
class FtdiFalcon {
 public:
  struct Settings {
    bool firmware_runs = false;       ///< it was started before, else the boot loader waits
    std::int64_t wrong_echo_at = -1;  ///< fault: that byte of the firmware is echoed wrongly
    std::string serial = "KERF0001";
    const UsbClock* clock = &kMachineClock;  ///< outlives this
  };
  FtdiFalcon(const Settings& settings, PacketDevice& device)
      : serial_(settings.serial),
        device_(device),
        loader_(settings.firmware_runs, settings.wrong_echo_at),
        time_(*settings.clock) {}

  /// Device and configuration descriptors, one after the other.
  [[nodiscard]] static std::span<const std::uint8_t> descriptors() noexcept;
  /// Answer to a control request; nothing where the device stalls it.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> control(const UsbSetup& setup);
  /// Bytes of the host for the serial line.
  void out(std::span<const std::uint8_t> bytes);

  /// To the present. `in(packet)` once per frame, where a packet is due and `wants()`.
  template <class Wants, class In>
  void catch_up(Wants wants, In in) {
    time_.catch_up(
        device_, [this](std::span<const std::uint8_t> packet) { hear(packet); },
        [&] {
          ++quiet_frames_;
          if (due() && wants()) in(next_in());
        });
  }
  [[nodiscard]] const UsbTime& time() const noexcept { return time_; }
  [[nodiscard]] bool firmware_runs() const noexcept { return loader_.running(); }
  [[nodiscard]] std::int64_t firmware_bytes() const noexcept { return loader_.stored(); }
  /// Packets of the device that went into the line, and ones that had no room there.
  [[nodiscard]] std::uint64_t reports() const noexcept { return reports_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Fault: for so many frames a packet carries at most `kSplitBytes` of the line.
  void slow_down(int frames) noexcept { slow_frames_ = frames; }

 private:
  static constexpr std::size_t kFifoBytes = 256;  ///< towards the host, FT232R data sheet
  static constexpr std::size_t kSplitBytes = 9;

  void hear(std::span<const std::uint8_t> packet);
  [[nodiscard]] bool due() const noexcept;
  [[nodiscard]] std::span<const std::uint8_t> next_in();
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> standard(const UsbSetup& setup) const;
  bool set(const UsbSetup& setup);

  std::string serial_;
  PacketDevice& device_;
  FalconBootLoader loader_;
  UsbTime time_;
  falcon::Framer framer_;  ///< of what the host says
  std::deque<std::uint8_t> line_;
  std::vector<std::uint8_t> packet_;
  int latency_frames_ = 16;  // the chip's own at power-up
  int quiet_frames_ = 0;
  int slow_frames_ = 0;
  std::uint64_t reports_ = 0, lost_ = 0;
};

}  // namespace kerf
