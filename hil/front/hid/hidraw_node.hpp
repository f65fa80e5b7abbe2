// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hil/front/fuse/fuse_node.hpp"
#include "hil/front/packet_device.hpp"
#include "hil/front/usb/usb_fault.hpp"
#include "hil/front/usb/usb_time.hpp"
#include "shared/wire/wooden_constants.hpp"

namespace kerf {

/// The device node of an emulated WoodenHaptics arm (`/dev/hidraw*`, linux/hidraw.h): what hidapi
/// cannot tell from the kernel's. Errors and queues are those of the kernel's hidraw.c (6.1).
///
/// Every open gets every report from its opening on, 1 kHz; who does not read loses the newest when
/// 64 wait. Feature reports, numbered reports and input by ioctl are not there: the firmware has
/// none.
class HidrawNode final : public FuseNode {
 public:
  struct Settings {
    std::size_t packet_bytes = wooden::kPacketBytes;  ///< 14: mbed's numbers; 64: Teensy's
    std::string serial = "KERF0001";
    std::vector<ScriptedUsbFault> script{};
  };
  HidrawNode(const Settings& settings, PacketDevice& device)
      : settings_(settings), device_(device), script_(settings.script) {}

  void attach(FuseReplies& replies) noexcept override { replies_ = &replies; }
  [[nodiscard]] bool present() const noexcept override { return present_; }
  void open(FuseOpen open) override;
  void release(FuseOpen open) override { opens_.erase(open); }
  std::optional<FuseAnswer> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                 std::size_t size) override;
  /// The number of the report, 0, and its bytes.
  std::optional<FuseAnswer> write(FuseOpen open, FuseRequest request,
                                  std::span<const std::uint8_t> bytes) override;
  std::optional<FuseAnswer> ioctl(FuseOpen open, const FuseIoctl& call) override;
  std::uint32_t poll(FuseOpen open, bool sleeps) override;
  void interrupted(FuseRequest request) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  /// Somebody has written, and nobody has the node open any more.
  [[nodiscard]] bool left() const noexcept { return used_ && opens_.empty(); }
  [[nodiscard]] const UsbTime& time() const noexcept { return time_; }
  /// Reports of the device, and ones for which an open had no place.
  [[nodiscard]] std::uint64_t reports() const noexcept { return reports_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  [[nodiscard]] std::uint16_t vendor_id() const noexcept;
  [[nodiscard]] std::uint16_t product_id() const noexcept;

 private:
  static constexpr std::size_t kWaitingReports = 64;  // HIDRAW_BUFFER_SIZE
  using Report = std::vector<std::uint8_t>;
  struct ParkedRead {
    FuseRequest request;
    std::size_t size;
  };
  struct Open {
    std::deque<Report> waiting;
    std::deque<ParkedRead> parked;
    bool announced = false;  ///< pollers know of the reports that wait
    bool gone = false;
  };

  [[nodiscard]] FuseAnswer take(Open& open, std::size_t size);
  void catch_up();
  void strike(UsbFault fault);
  void deliver();

  Settings settings_;
  PacketDevice& device_;
  UsbFaultScript script_;
  FuseReplies* replies_ = nullptr;
  UsbTime time_;
  std::map<FuseOpen, Open> opens_;
  Report taken_;
  std::vector<std::uint8_t> answer_;
  bool present_ = true;
  bool used_ = false;
  std::uint64_t reports_ = 0, lost_ = 0;
};

}  // namespace kerf
