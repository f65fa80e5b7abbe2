// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hil/front/fuse/fuse_node.hpp"
#include "hil/front/usb/falcon_usb.hpp"

namespace kerf {

/// The device node of an emulated Falcon on USB (`/dev/bus/usb/BBB/DDD`, linux/usbdevice_fs.h):
/// what libusb cannot tell from the kernel's usbfs. Errors are those of the kernel's devio.c (6.1).
///
/// A read completes when the device has a packet, at most once per 1 ms frame; a write and a
/// control request at once. Not modelled, ENOTTY: blocking REAPURB and BULK, isochronous transfers,
/// streams, mmap(), suspending. One transfer is one packet, which is enough for buffers of 64
/// bytes.
class UsbfsNode final : public FuseNode, private UsbHost {
 public:
  UsbfsNode(const FtdiFalcon::Settings& settings, std::vector<ScriptedUsbFault> script,
            PacketDevice& device)
      : plug_(settings, std::move(script), device) {}

  [[nodiscard]] bool present() const noexcept override { return plug_.present(); }
  [[nodiscard]] bool seekable() const noexcept override { return true; }
  void open(FuseOpen open) override;
  void release(FuseOpen open) override;
  /// The descriptors.
  std::optional<FuseReply> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override;
  std::optional<FuseReply> ioctl(FuseOpen open, const FuseIoctl& call) override;
  std::uint32_t poll(FuseOpen open, bool sleeps) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  /// A client had transfers, and the node is open no more.
  [[nodiscard]] bool left() const noexcept { return used_ && !in_use(); }
  /// Somebody has it open.
  [[nodiscard]] bool in_use() const noexcept { return !opens_.empty(); }
  /// Times that an endpoint was freed while reads waited there, which the kernel does not allow
  /// (usb_clear_halt): their fate is up to its controller.
  [[nodiscard]] int rash_clears() const noexcept { return rash_clears_; }
  [[nodiscard]] const FtdiFalcon& chip() const noexcept { return plug_.chip(); }

 private:
  /// A transfer of a client: its structure, the address of that in the client's memory, and the
  /// data that are copied there when the client reaps it.
  struct Urb {
    std::uint64_t address = 0;
    std::uint8_t type = 0;
    std::uint8_t endpoint = 0;
    std::uint64_t buffer = 0;
    std::int32_t buffer_bytes = 0;
    std::int32_t status = 0;
    std::int32_t actual_bytes = 0;
    std::vector<std::uint8_t> data;
    std::size_t data_offset = 0;
  };
  struct Open {
    std::deque<Urb> reads, writes, done;
    bool announced = false;  ///< pollers know of the finished transfers
    bool gone = false;       ///< the device was unplugged: nothing works any more
  };

  [[nodiscard]] static std::optional<Urb> read_urb(const FuseIoctl& call) noexcept;
  // Each returns the ioctl's result, or a negative errno.
  int submit(Open& open, FuseOpen id, const FuseIoctl& call);
  int submit_control(Open& open, Urb urb, pid_t thread);
  int submit_bulk(Open& open, Urb urb, pid_t thread);
  int reap(Open& open, const FuseIoctl& call);
  int discard(Open& open, std::uint64_t address);
  int claim(FuseOpen id, const FuseIoctl& call);
  int give_up_interface(FuseOpen id);
  int clear_halt(const FuseIoctl& call);
  FuseReply control(const FuseIoctl& call);
  int connect_info(const FuseIoctl& call);

  static void finish(Open& open, Urb urb, int status);
  /// All that are under way.
  static void end_transfers(Open& open, int status);
  [[nodiscard]] std::optional<std::size_t> room() override;
  void complete_read(int status, std::span<const std::uint8_t> bytes) override;
  void plugged(bool in) override;
  [[nodiscard]] Open* reader();
  void catch_up();
  void take_writes(Open& open);
  void deliver();

  FalconUsb plug_;
  std::map<FuseOpen, Open> opens_;
  std::optional<FuseOpen> claimed_by_;
  bool used_ = false;
  int rash_clears_ = 0;
};

}  // namespace kerf
