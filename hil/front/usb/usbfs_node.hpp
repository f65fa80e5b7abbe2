// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "hil/front/fuse/fuse_node.hpp"
#include "hil/front/usb/falcon_usb.hpp"

namespace kerf {

/// An open of a usbfs node.
struct UsbfsOpen : OpenFile {
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
  std::deque<Urb> reads, writes, done;
  bool gone = false;  ///< the device was unplugged: nothing works any more
};

/// The device node of an emulated Falcon on USB (`/dev/bus/usb/BBB/DDD`, linux/usbdevice_fs.h): to
/// libusb it is like the kernel's usbfs. Errors are those of the kernel's devio.c (6.1).
///
/// A read completes when the device has a packet, at most once per 1 ms frame; a write and a
/// control request at once. Not modelled, ENOTTY: blocking REAPURB and BULK, isochronous transfers,
/// streams, mmap(), suspending. One transfer is one packet, which is enough for buffers of 64
/// bytes.
class UsbfsNode final : public OpenFilesNode<UsbfsOpen>, private UsbHost {
 public:
  UsbfsNode(const FtdiFalcon::Settings& settings, std::vector<ScriptedUsbFault> script,
            PacketDevice& device)
      : falcon_(settings, std::move(script), device) {}

  [[nodiscard]] bool present(int /*file*/) const noexcept override { return falcon_.present(); }
  [[nodiscard]] bool seekable() const noexcept override { return true; }
  void open(FileHandle open, int file) override;
  void release(FileHandle open) override;
  /// The descriptors.
  std::optional<FuseReply> read(FileHandle open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override;
  std::optional<FuseReply> ioctl(FileHandle open, const FuseIoctl& call) override;
  std::uint32_t poll(FileHandle open, bool sleeps) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  /// Times that an endpoint was freed while reads waited there, which the kernel does not allow
  /// (usb_clear_halt): their fate is up to its controller.
  [[nodiscard]] int rash_clears() const noexcept { return rash_clears_; }
  [[nodiscard]] const FtdiFalcon& chip() const noexcept { return falcon_.chip(); }

 private:
  using Open = UsbfsOpen;
  using Urb = Open::Urb;

  [[nodiscard]] static std::optional<Urb> read_urb(const FuseIoctl& call) noexcept;
  // Each returns the ioctl's result, or a negative errno.
  int submit(Open& open, FileHandle id, const FuseIoctl& call);
  int submit_control(Open& open, Urb urb, pid_t thread);
  int submit_bulk(Open& open, Urb urb, pid_t thread);
  int reap(Open& open, const FuseIoctl& call);
  int discard(Open& open, std::uint64_t address);
  int claim(FileHandle id, const FuseIoctl& call);
  int give_up_interface(FileHandle id);
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

  FalconUsb falcon_;
  std::optional<FileHandle> claimed_by_;
  int rash_clears_ = 0;
};

}  // namespace kerf
