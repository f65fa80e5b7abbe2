// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/firewire/firewire_client.hpp"
#include "hil/front/fuse/fuse_node.hpp"

namespace kerf {

/// An open of a node on FireWire.
struct FirewireOpen : OpenFile {
  std::shared_ptr<FirewireClient> client;
};

/// The nodes of an emulated FireWire bus as files (`/dev/fw*`, linux/firewire-cdev.h): that of the
/// Omni, and that of the host's own card. To a driver that uses ioctl(), read() and poll() they are
/// like the kernel's. Without mmap().
///
/// Programs that know every node of a bus, such as those above libraw1394, begin with the card and
/// ask it for channels and bandwidth; it stays when the device is unplugged.
///
/// In real time the bus catches up with the clock at every call and at interrupts; in lock-step
/// time stands still unless a client flushes its received stream, which lets one servo period pass,
/// or sleeps for an answer, which takes it to that answer. Such a run repeats bit for bit.
class FirewireNode final : public OpenFilesNode<FirewireOpen>, private FirewireBus::Listener {
 public:
  /// The files of `FuseMount::add`. The card is `/dev/fw0` if it came up alone.
  static constexpr int kOmniFile = 0, kHostFile = 1;

  FirewireNode(const FirewireSettings& settings, PacketDevice& device)
      : bus_(settings, device, *this) {}
  /// The clients of what is still open leave the bus before it goes.
  ~FirewireNode() override { opens_.clear(); }

  [[nodiscard]] bool present(int file) const noexcept override {
    return file == kHostFile || bus_.listed();
  }
  void open(FileHandle open, int file) override;
  void release(FileHandle open) override;
  std::optional<FuseReply> read(FileHandle open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override;
  std::optional<FuseReply> ioctl(FileHandle open, const FuseIoctl& call) override;
  std::uint32_t poll(FileHandle open, bool sleeps) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  [[nodiscard]] const FirewireBus& bus() const noexcept { return bus_; }
  /// Largest number of events that one open has let wait.
  [[nodiscard]] std::size_t events_high_water() const noexcept { return high_water_; }
  /// START_ISO on a context that ran: a bug of the client that the kernel does not report.
  [[nodiscard]] std::uint64_t double_starts() const noexcept { return double_starts_; }

 private:
  using Open = FirewireOpen;

  void generation_is_new() override { queue_bus_reset(kHostNodeId); }
  void bus_was_reset(std::int64_t event_delay) override;
  [[nodiscard]] std::int32_t channel_in_use() const override;
  void device_is_gone() override;

  void queue_bus_reset(std::uint32_t node);
  void sleep_on(Open& open);
  [[nodiscard]] FuseReply take(Open& open, std::size_t size);
  void deliver();

  FirewireBus bus_;
  EventQueue::Bytes taken_;
  std::size_t high_water_ = 0;
  std::uint64_t double_starts_ = 0;
};

}  // namespace kerf
