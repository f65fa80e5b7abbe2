// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hil/front/usb/ftdi_falcon.hpp"
#include "hil/front/usb/usb_device.hpp"

namespace kerf {

/// The host's side of a plug, as `FalconPlug` needs it.
class UsbHost {
 public:
  virtual ~UsbHost() = default;
  /// Bytes that the oldest waiting read takes; nothing while nobody reads.
  [[nodiscard]] virtual std::optional<std::size_t> room() = 0;
  /// Ends the oldest read: with 0 or a negative errno, as in the kernel's URBs.
  virtual void complete_read(int status, std::span<const std::uint8_t> bytes) = 0;
  virtual void plugged(bool in) = 0;
};

/// An emulated Falcon at the end of a USB cable: its chip, its halted endpoint, and what a script
/// does to it. How a host asks differs between fronts; what the device does then stands here.
/// One thread.
class FalconPlug {
 public:
  FalconPlug(const FtdiFalcon::Settings& settings, std::vector<ScriptedUsbFault> script,
             PacketDevice& device)
      : chip_(settings, device), script_(std::move(script)) {}

  /// To the present: reads are completed, faults strike.
  void catch_up(UsbHost& host);
  /// As `FtdiFalcon::control`, and a halted endpoint is freed where the request says so.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> control(const UsbSetup& setup);
  /// Frees an endpoint; false where there is none of that address.
  bool clear_halt(unsigned endpoint) noexcept;
  void out(std::span<const std::uint8_t> bytes) { chip_.out(bytes); }
  /// It takes nothing now.
  [[nodiscard]] bool deaf() const noexcept { return chip_.time().cycle() < deaf_until_; }

  [[nodiscard]] bool present() const noexcept { return present_; }
  [[nodiscard]] const FtdiFalcon& chip() const noexcept { return chip_; }

 private:
  /// Of the endpoint that is read: the first read that meets it ends with -EPIPE, later ones wait.
  enum class Halt { none, unreported, reported };
  void strike(UsbFault fault, UsbHost& host);

  FtdiFalcon chip_;
  UsbFaultScript script_;
  bool present_ = true;
  Halt halt_ = Halt::none;
  std::int64_t deaf_until_ = 0;
};

}  // namespace kerf
