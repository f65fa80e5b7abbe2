// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "hil/front/fuse/fuse_node.hpp"
#include "hil/front/usb/wooden_hid.hpp"

namespace kerf {

/// An open of a hidraw node.
struct HidrawOpen : OpenFile {
  using Report = std::vector<std::uint8_t>;
  struct ParkedWrite {
    FuseRequest request;
    Report report;
  };
  std::deque<Report> waiting;
  std::deque<ParkedWrite> writes;  ///< that the device has not taken yet
  bool gone = false;               ///< the device was unplugged
};

/// The device node of an emulated WoodenHaptics arm (`/dev/hidraw*`, linux/hidraw.h): to hidapi it
/// is like the kernel's. Errors and queues are those of the kernel's hidraw.c (6.1).
///
/// Every open gets every report from its opening on, 1 kHz; if 64 wait, the newest are lost. Input
/// by ioctl is not modelled, nor the kernel's limit of 5 s for a device that takes nothing.
class HidrawNode final : public OpenFilesNode<HidrawOpen>, private HidHost {
 public:
  HidrawNode(const WoodenHid::Settings& settings, PacketDevice& device) : arm_(settings, device) {}

  [[nodiscard]] bool present(int /*file*/) const noexcept override { return arm_.present(); }
  void open(FileHandle open, int file) override;
  std::optional<FuseReply> read(FileHandle open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override;
  /// The number of the report, 0, and its bytes. Sleeps until the device has taken it.
  std::optional<FuseReply> write(FileHandle open, FuseRequest request,
                                 std::span<const std::uint8_t> bytes) override;
  std::optional<FuseReply> ioctl(FileHandle open, const FuseIoctl& call) override;
  std::uint32_t poll(FileHandle open, bool sleeps) override;
  void interrupted(FuseRequest request) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  [[nodiscard]] const WoodenHid& arm() const noexcept { return arm_; }
  /// Reports that came while an open had no room for them.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  static constexpr std::size_t kWaitingReports = 64;  // HIDRAW_BUFFER_SIZE
  using Open = HidrawOpen;

  [[nodiscard]] FuseReply take(Open& open, std::size_t size);
  void on_report(std::span<const std::uint8_t> report) override;
  void plugged(bool in) override;
  void deliver();
  void take_writes(Open& open);

  WoodenHid arm_;
  Open::Report taken_;
  std::vector<std::uint8_t> answer_;
  std::uint64_t lost_ = 0;
};

}  // namespace kerf
