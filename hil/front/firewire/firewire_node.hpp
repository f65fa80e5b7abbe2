// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/firewire/firewire_client.hpp"
#include "hil/front/fuse/fuse_node.hpp"

/// The device nodes of an emulated FireWire bus as files: that of the Omni, and that of the host's
/// card.
namespace kerf {

/// The device node of an emulated Omni on FireWire (`/dev/fw*`, linux/firewire-cdev.h): to a
/// driver that uses ioctl(), read() and poll() it is like the kernel's. Without mmap().
///
/// In real time the bus catches up with the clock at every call and at interrupts; in lock-step
/// time stands still unless a client flushes its received stream, which lets one servo period pass,
/// or sleeps for an answer, which takes it to that answer. Such a run repeats bit for bit.
class FirewireNode final : public FuseNode, private FirewireBus::Listener {
 public:
  FirewireNode(const FirewireSettings& settings, PacketDevice& device)
      : bus_(settings, device, *this) {}

  [[nodiscard]] bool present() const noexcept override { return bus_.listed(); }
  void open(FuseOpen open) override { add(open, kOmniNodeId); }
  /// An open of the host's own node on this bus (`FirewireHostNode`).
  void open_host(FuseOpen open) { add(open, kHostNodeId); }
  void release(FuseOpen open) override;
  std::optional<FuseReply> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override;
  std::optional<FuseReply> ioctl(FuseOpen open, const FuseIoctl& call) override;
  std::uint32_t poll(FuseOpen open, bool sleeps) override;
  void interrupted(FuseRequest request) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  /// A client had a stream, and the node is open no more.
  [[nodiscard]] bool left() const noexcept { return streamed_ && !in_use(); }
  /// The node is open.
  [[nodiscard]] bool in_use() const noexcept { return !opens_.empty(); }
  [[nodiscard]] const FirewireBus& bus() const noexcept { return bus_; }
  /// Largest number of events that one open has let wait.
  [[nodiscard]] std::size_t events_high_water() const noexcept { return high_water_; }
  /// START_ISO on a context that ran: a bug of the client that the kernel does not report.
  [[nodiscard]] std::uint64_t double_starts() const noexcept { return double_starts_; }

 private:
  struct ParkedRead {
    FuseRequest request;
    std::size_t size;
  };
  struct Open {
    std::shared_ptr<FirewireClient> client;
    std::deque<ParkedRead> parked;
    bool announced = false;  ///< pollers know of the events that wait
  };

  void generation_is_new() override { tell_bus_reset(kHostNodeId); }
  void bus_was_reset(std::int64_t event_delay) override;
  [[nodiscard]] std::int32_t channel_in_use() const override;
  void device_is_gone() override;

  void add(FuseOpen open, std::uint32_t node);
  void tell_bus_reset(std::uint32_t node);
  void sleep_on(Open& open);
  [[nodiscard]] FuseReply take(Open& open, std::size_t size);
  void deliver();

  FirewireBus bus_;
  std::map<FuseOpen, Open> opens_;
  EventQueue::Bytes taken_;
  bool streamed_ = false;
  std::size_t high_water_ = 0;
  std::uint64_t double_starts_ = 0;
};

/// The node of the host's own card (`/dev/fw0` if the card came up alone), beside that of the
/// device: programs that know every node of a bus, such as those above libraw1394, begin with it
/// and ask it for channels and bandwidth. Its opens are opens of the same bus, so the device node
/// serves them; it stays when the device is unplugged. In the same folder as
/// `device`, which outlives it.
class FirewireHostNode final : public FuseNode {
 public:
  explicit FirewireHostNode(FirewireNode& device) : device_(device) {}

  [[nodiscard]] bool present() const noexcept override { return true; }
  void open(FuseOpen open) override { device_.open_host(open); }
  void release(FuseOpen open) override { device_.release(open); }
  std::optional<FuseReply> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                std::size_t size) override {
    return device_.read(open, request, offset, size);
  }
  std::optional<FuseReply> ioctl(FuseOpen open, const FuseIoctl& call) override {
    return device_.ioctl(open, call);
  }
  std::uint32_t poll(FuseOpen open, bool sleeps) override { return device_.poll(open, sleeps); }
  void interrupted(FuseRequest request) override { device_.interrupted(request); }
  /// The device node wakes for both.
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override {
    return std::numeric_limits<std::int64_t>::max();
  }
  void wake() override {}

 private:
  FirewireNode& device_;
};

}  // namespace kerf
