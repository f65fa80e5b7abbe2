// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hil/devmodel/packet_device.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "shared/wire/wooden_constants.hpp"

namespace kerf {

/// The host's side of `WoodenHid`.
class HidHost {
 public:
  virtual ~HidHost() = default;
  virtual void hear(std::span<const std::uint8_t> report) = 0;
  virtual void plugged(bool in) = 0;
};

/// What the HID side of an emulated WoodenHaptics arm is made of: who it is, its report descriptor,
/// one report each 1 ms, and what a script does to it. How a host asks differs between fronts.
/// Feature reports and numbered reports are not there: the firmware has none. One thread.
class WoodenHid {
 public:
  struct Settings {
    std::size_t packet_bytes = wooden::kPacketBytes;  ///< 14: mbed's numbers; 64: Teensy's
    std::string serial = "KERF0001";
    std::vector<ScriptedUsbFault> script{};
    const UsbClock* clock = &kMachineClock;  ///< outlives this
  };
  WoodenHid(const Settings& settings, PacketDevice& device)
      : packet_bytes_(settings.packet_bytes),
        serial_(settings.serial),
        device_(device),
        script_(settings.script),
        time_(*settings.clock) {}

  [[nodiscard]] std::uint16_t vendor_id() const noexcept;
  [[nodiscard]] std::uint16_t product_id() const noexcept;
  [[nodiscard]] static std::string_view name() noexcept { return "kerf emulated WoodenHaptics"; }
  [[nodiscard]] static std::string_view place() noexcept { return "usb-kerf-1/input0"; }
  [[nodiscard]] const std::string& serial() const noexcept { return serial_; }
  /// A vendor page with one report each way (HID 1.11, 6.2.2).
  [[nodiscard]] std::vector<std::uint8_t> report_descriptor() const;

  /// To the present: `host` hears each report while the arm is plugged in, and of the plug.
  void catch_up(HidHost& host);
  /// An output report as a program writes it: its number, 0, then its bytes.
  void out(std::span<const std::uint8_t> report) noexcept;

  /// It takes nothing now.
  [[nodiscard]] bool deaf() const noexcept { return time_.cycle() < deaf_until_; }
  [[nodiscard]] bool present() const noexcept { return present_; }
  [[nodiscard]] const UsbTime& time() const noexcept { return time_; }
  /// Reports of the device, heard or not.
  [[nodiscard]] std::uint64_t reports() const noexcept { return reports_; }

 private:
  std::size_t packet_bytes_;
  std::string serial_;
  PacketDevice& device_;
  UsbFaultScript script_;
  UsbTime time_;
  bool present_ = true;
  std::int64_t deaf_until_ = 0;
  std::uint64_t reports_ = 0;
};

}  // namespace kerf
