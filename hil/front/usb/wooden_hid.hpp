// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "shared/wire/woodenhaptics.hpp"

/// The HID side of an emulated WoodenHaptics arm, and the same device in the kernel's HID stack.
namespace kerf {

/// The host's side of `WoodenHid`.
class HidHost {
 public:
  virtual ~HidHost() = default;
  virtual void on_report(std::span<const std::uint8_t> report) = 0;
  virtual void plugged(bool in) = 0;
};

/// The HID side of an emulated WoodenHaptics arm: its identity, its report descriptor, one report
/// each 1 ms, and the faults of a script. Requests of a host differ between fronts. No feature
/// reports and no numbered reports: the firmware has none. One thread.
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

  /// To the present: `host` gets each report while the arm is plugged in, and each change of the
  /// plug.
  void catch_up(HidHost& host);
  /// An output report as a program writes it: its number, 0, then its bytes.
  void out(std::span<const std::uint8_t> report) noexcept;

  /// It takes nothing now.
  [[nodiscard]] bool naks() const noexcept { return time_.cycle() < nak_until_; }
  [[nodiscard]] bool present() const noexcept { return present_; }
  [[nodiscard]] const UsbTime& time() const noexcept { return time_; }
  /// Reports of the device, received or not.
  [[nodiscard]] std::uint64_t reports() const noexcept { return reports_; }

 private:
  std::size_t packet_bytes_;
  std::string serial_;
  PacketDevice& device_;
  UsbFaultScript script_;
  UsbTime time_;
  bool present_ = true;
  std::int64_t nak_until_ = 0;
  std::uint64_t reports_ = 0;
};

/// An emulated WoodenHaptics arm in the kernel's HID stack, by /dev/uhid (linux/uhid.h): the
/// kernel's own hidraw node stands above it. Reports go while the node is open.
class UhidArm final : public KernelDevice, private HidHost {
 public:
  /// `fd` is /dev/uhid, or a socket that keeps messages apart. Owned here.
  UhidArm(int fd, const WoodenHid::Settings& settings, PacketDevice& device);
  UhidArm(const UhidArm&) = delete;
  UhidArm& operator=(const UhidArm&) = delete;
  ~UhidArm() override;

  [[nodiscard]] int descriptor() const noexcept override { return fd_; }
  void answer() override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override {
    return arm_.time().next_frame_ns();
  }
  void wake() override { arm_.catch_up(*this); }

  /// A client has written, and the node is open no more.
  [[nodiscard]] bool left() const noexcept { return used_ && !open_; }
  [[nodiscard]] const WoodenHid& arm() const noexcept { return arm_; }
  /// Reports that the kernel did not take.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  void on_report(std::span<const std::uint8_t> report) override;
  void plugged(bool in) override;
  void create();

  WoodenHid arm_;
  int fd_;
  bool open_ = false;
  bool used_ = false;
  std::uint64_t lost_ = 0;
};

/// /dev/uhid, open; throws `HilError` if it is missing or may not be opened.
[[nodiscard]] int open_uhid();

}  // namespace kerf
