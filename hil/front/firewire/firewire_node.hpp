// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/firewire/firewire_client.hpp"
#include "hil/front/fuse/fuse_node.hpp"

namespace kerf {

/// The device node of an emulated Omni on FireWire (`/dev/fw*`, linux/firewire-cdev.h): what a
/// driver that uses ioctl(), read() and poll() cannot tell from the kernel's. Without mmap().
///
/// In real time the bus catches up with the clock at every call and at interrupts; in lock-step
/// time stands still except where a client flushes its received stream, which lets one servo period
/// pass, or sleeps for an answer, which takes it to that answer. Then a run is repeated bit for
/// bit.
class FirewireNode final : public FuseNode, private FirewireBus::Listener {
 public:
  FirewireNode(const FirewireSettings& settings, PacketDevice& device)
      : bus_(settings, device, *this) {}

  [[nodiscard]] bool present() const noexcept override { return bus_.listed(); }
  void open(FuseOpen open) override { add(open, kOmniNodeId); }
  /// An open of the host's own node on this bus (firewire_host_node.hpp).
  void open_host(FuseOpen open) { add(open, kHostNodeId); }
  void release(FuseOpen open) override;
  std::optional<FuseAnswer> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                 std::size_t size) override;
  std::optional<FuseAnswer> ioctl(FuseOpen open, const FuseIoctl& call) override;
  std::uint32_t poll(FuseOpen open, bool sleeps) override;
  void interrupted(FuseRequest request) override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override;
  void wake() override;

  /// Somebody had a stream, and nobody has the node open any more.
  [[nodiscard]] bool left() const noexcept { return streamed_ && !in_use(); }
  /// Somebody has it open.
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
  [[nodiscard]] FuseAnswer take(Open& open, std::size_t size);
  void deliver();

  FirewireBus bus_;
  std::map<FuseOpen, Open> opens_;
  EventQueue::Bytes taken_;
  bool streamed_ = false;
  std::size_t high_water_ = 0;
  std::uint64_t double_starts_ = 0;
};

}  // namespace kerf
