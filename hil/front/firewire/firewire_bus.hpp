// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "hil/front/firewire/bus_registers.hpp"
#include "hil/front/firewire/iso_context.hpp"
#include "shared/numeric/fnv1a.hpp"

namespace kerf {

/// Actions of later bus cycles: answers on their way, time-outs, scripted faults. Actions of one
/// cycle run in the order in which they were entered.
class EventSchedule {
 public:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  void at(std::int64_t cycle, std::function<void()> action) {
    entries_.emplace(cycle, std::move(action));
  }
  [[nodiscard]] std::int64_t next() const noexcept {
    return entries_.empty() ? kNever : entries_.begin()->first;
  }
  /// Runs all that is due up to and in `cycle`, including actions added meanwhile.
  void run(std::int64_t cycle) {
    while (next() <= cycle) entries_.extract(entries_.begin()).mapped()();
  }

 private:
  std::multimap<std::int64_t, std::function<void()>> entries_;
};

/// A fault of a bus.
enum class BusFault : std::uint8_t {
  reset,         ///< another node resets the bus
  device_reset,  ///< the device itself does: clients get the event half a second later
  steal,         ///< a reset in which another node takes the lowest channel that is in use
  vanish,        ///< the device is gone; clients get the event after two seconds
  back,          ///< the device is there again
};

/// A fault and its time.
struct ScriptedFault {
  std::int64_t cycle = 0;  ///< counted from the start of the bus
  BusFault fault = BusFault::reset;
};

/// The behaviour of bus and device in one run.
struct FirewireSettings {
  BusClock clock = BusClock::lock_step();
  int packet_cycles = 1;    ///< cycles per packet of the device: 1 = 8 kHz, 8 = 1 kHz
  int lockstep_cycles = 8;  ///< that a FLUSH_ISO of the received stream lets pass in lock-step
  /// The real device's behaviour in a bus reset is not known: stream on, or forget channels and
  /// enable bit.
  bool reset_stops_stream = false;
  std::uint32_t packed_serial = 0x82B6'980C;
  int abi_version = 5;  ///< of the kernel's interface: Linux 6.1; newer ones have more
  std::vector<ScriptedFault> script;
};

/// Counts of a run.
struct FirewireStats {
  std::uint64_t commands = 0;     ///< packets of the host that reached the device
  std::uint64_t reports = 0;      ///< packets of the device that reached an open
  std::uint64_t undelivered = 0;  ///< packets of the device that no descriptor waited for
  /// FNV-1a over every packet of the host and the cycle in which it went out.
  std::uint64_t command_hash = kFnv1aBasis;
};

/// The bus and the device on it, cycle by cycle: the senders of its channels, generations,
/// resources, faults. Advances only in `catch_up`. One thread.
class FirewireBus {
 public:
  /// Called for events that concern every client.
  class Listener {
   public:
    virtual ~Listener() = default;
    /// The generation is new; the host's own node reports this at once.
    virtual void generation_is_new() = 0;
    /// After that: claims resources again now, and reports the reset to the device's clients
    /// `event_delay` cycles later.
    virtual void bus_was_reset(std::int64_t event_delay) = 0;
    /// The channel that a foreign node should take in a reset; -1 if none.
    [[nodiscard]] virtual std::int32_t channel_in_use() const = 0;
    virtual void device_is_gone() = 0;
  };

  FirewireBus(const FirewireSettings& settings, PacketDevice& device, Listener& listener);
  FirewireBus(const FirewireBus&) = delete;
  FirewireBus& operator=(const FirewireBus&) = delete;

  void catch_up() { run_to(settings_.clock.cycle()); }
  /// Lock-step only: lets so many cycles pass.
  void pass(std::int64_t cycles);
  /// In `cycles` cycles from now.
  void later(std::int64_t cycles, std::function<void()> action) {
    schedule_.at(cycle_ + cycles, std::move(action));
  }
  void reset(BusFault kind);

  void attach(IsoContext& context) { contexts_.push_back(&context); }
  void detach(const IsoContext& context) { std::erase(contexts_, &context); }
  [[nodiscard]] const std::vector<IsoContext*>& contexts() const noexcept { return contexts_; }

  [[nodiscard]] const BusClock& clock() const noexcept { return settings_.clock; }
  [[nodiscard]] const FirewireSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::int64_t cycle() const noexcept { return cycle_; }
  [[nodiscard]] std::int64_t reset_cycle() const noexcept { return reset_cycle_; }
  [[nodiscard]] std::uint32_t generation() const noexcept { return generation_; }
  /// Returns true if the device is on the bus.
  [[nodiscard]] bool present() const noexcept { return present_; }
  /// Returns true if clients take it to be there: they learn of a loss two seconds later.
  [[nodiscard]] bool listed() const noexcept { return listed_; }
  [[nodiscard]] OmniRegisters& registers() noexcept { return registers_; }
  [[nodiscard]] const OmniRegisters& registers() const noexcept { return registers_; }
  [[nodiscard]] IsoResources& resources() noexcept { return resources_; }
  [[nodiscard]] const FirewireStats& stats() const noexcept { return stats_; }
  /// The next cycle in which something is due that a client may wait for.
  [[nodiscard]] std::int64_t next_due() const noexcept { return schedule_.next(); }
  /// The next cycle in which anything is due, with interrupts and the script; else
  /// `EventSchedule::kNever`.
  [[nodiscard]] std::int64_t next_event() const noexcept;

 private:
  void run_to(std::int64_t cycle);
  void begin_cycle();
  void finish_cycle();
  void carry(std::span<const std::uint8_t> packet);
  void apply_fault(BusFault fault);
  void vanish();
  void come_back();

  FirewireSettings settings_;
  PacketDevice& device_;
  Listener& listener_;
  OmniRegisters registers_;
  IsoResources resources_;
  std::uint64_t foreign_channels_ = 0;
  EventSchedule schedule_;
  EventSchedule script_;
  std::vector<IsoContext*> contexts_;
  std::int64_t cycle_ = kFirstCycle;
  std::int64_t reset_cycle_ = 0;
  std::uint32_t generation_ = 1;
  bool present_ = true;
  bool listed_ = true;
  bool awake_ = false;  ///< the device has streamed
  FirewireStats stats_;
};

}  // namespace kerf
