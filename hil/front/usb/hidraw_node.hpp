// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "hil/front/fuse/fuse_node.hpp"
#include "hil/front/usb/wooden_hid.hpp"

namespace kerf {

/// The device node of an emulated WoodenHaptics arm (`/dev/hidraw*`, linux/hidraw.h): what hidapi
/// cannot tell from the kernel's. Errors and queues are those of the kernel's hidraw.c (6.1).
///
/// Every open gets every report from its opening on, 1 kHz; who does not read loses the newest when
/// 64 wait. Input by ioctl is not there, nor the kernel's own patience of 5 s with a deaf device.
class HidrawNode final : public FuseNode, private HidHost {
 public:
  HidrawNode(const WoodenHid::Settings& settings, PacketDevice& device) : arm_(settings, device) {}

  [[nodiscard]] bool present() const noexcept override { return arm_.present(); }
  void open(FuseOpen open) override;
  void release(FuseOpen open) override { opens_.erase(open); }
  std::optional<FuseReply> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override;
  /// The number of the report, 0, and its bytes. Sleeps until the device has taken it.
  std::optional<FuseReply> write(FuseOpen open, FuseRequest request,
                                 std::span<const std::uint8_t> bytes) override;
  std::optional<FuseReply> ioctl(FuseOpen open, const FuseIoctl& call) override;
  std::uint32_t poll(FuseOpen open, bool sleeps) override;
  void interrupted(FuseRequest request) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  /// A client has written, and the node is open no more.
  [[nodiscard]] bool left() const noexcept { return used_ && !in_use(); }
  /// Somebody has it open.
  [[nodiscard]] bool in_use() const noexcept { return !opens_.empty(); }
  [[nodiscard]] const WoodenHid& arm() const noexcept { return arm_; }
  /// Reports for which an open had no place.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  static constexpr std::size_t kWaitingReports = 64;  // HIDRAW_BUFFER_SIZE
  using Report = std::vector<std::uint8_t>;
  struct ParkedRead {
    FuseRequest request;
    std::size_t size;
  };
  struct ParkedWrite {
    FuseRequest request;
    Report report;
  };
  struct Open {
    std::deque<Report> waiting;
    std::deque<ParkedRead> parked;
    std::deque<ParkedWrite> writes;  ///< of which the device takes none now
    bool announced = false;          ///< pollers know of the reports that wait
    bool gone = false;
  };

  [[nodiscard]] FuseReply take(Open& open, std::size_t size);
  void hear(std::span<const std::uint8_t> report) override;
  void plugged(bool in) override;
  void deliver();
  void take_writes(Open& open);

  WoodenHid arm_;
  std::map<FuseOpen, Open> opens_;
  Report taken_;
  std::vector<std::uint8_t> answer_;
  bool used_ = false;
  std::uint64_t lost_ = 0;
};

}  // namespace kerf
