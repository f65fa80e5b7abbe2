// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/firewire_bus.hpp"

#include <algorithm>

#include "shared/numeric/fnv1a.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kRomCycles =
    kBusCyclesPerSecond / 2;  // a device's own reset: its ROM is read
constexpr std::int64_t kGoneCycles = 2 * kBusCyclesPerSecond;  // until a lost device is given up
constexpr std::uint32_t kOmniTag = 0;

}  // namespace

FirewireBus::FirewireBus(const FirewireSettings& settings, PacketDevice& device, Listener& listener)
    : settings_(settings),
      device_(device),
      listener_(listener),
      registers_(settings.packed_serial) {
  for (const ScriptedFault& entry : settings_.script) {
    script_.at(kFirstCycle + entry.cycle, [this, entry] { apply_fault(entry.fault); });
  }
}

void FirewireBus::pass(std::int64_t cycles) {
  settings_.clock.advance(cycles);
  catch_up();
}

/// A cycle that has begun has its command on the way; its report is there when it has ended.
void FirewireBus::run_to(std::int64_t cycle) {
  while (cycle_ < cycle) {
    finish_cycle();
    ++cycle_;
    begin_cycle();
  }
}

void FirewireBus::begin_cycle() {
  script_.run(cycle_);
  schedule_.run(cycle_);
  for (IsoContext* context : contexts_) {
    if (!context->settings().transmits) continue;
    const auto packet = context->transmit(cycle_);
    if (!packet) continue;
    stats_.command_hash = fnv1a_bytes(stats_.command_hash, static_cast<std::uint64_t>(cycle_));
    for (const std::uint8_t byte : packet->bytes) {
      stats_.command_hash = fnv1a_step(stats_.command_hash, byte);
    }
    const bool heard = present_ && registers_.streams() && packet->tag == kOmniTag &&
                       static_cast<int>(context->settings().channel) == registers_.listens_on();
    if (!heard) continue;
    ++stats_.commands;
    device_.receive(packet->bytes);
  }
  awake_ = awake_ || registers_.streams();
  if (awake_) device_.advance(1);
}

void FirewireBus::finish_cycle() {
  if (cycle_ % settings_.packet_cycles != 0) return;
  // Its counter runs if its packets are received or not.
  for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
    if (present_ && registers_.streams()) carry(packet);
  }
}

void FirewireBus::carry(std::span<const std::uint8_t> packet) {
  for (IsoContext* context : contexts_) {
    if (context->settings().transmits ||
        static_cast<int>(context->settings().channel) != registers_.transmits_on()) {
      continue;
    }
    const std::uint64_t missed = context->missed();
    context->receive(kOmniTag, packet, cycle_);
    ++(context->missed() == missed ? stats_.reports : stats_.undelivered);
  }
}

void FirewireBus::apply_fault(BusFault fault) {
  switch (fault) {
    case BusFault::reset:
    case BusFault::device_reset:
    case BusFault::steal:
      return reset(fault);
    case BusFault::vanish:
      return vanish();
    case BusFault::back:
      return come_back();
  }
}

void FirewireBus::reset(BusFault kind) {
  ++generation_;
  reset_cycle_ = cycle_;
  if (settings_.reset_stops_stream) registers_.reset();
  if (kind == BusFault::steal && listener_.channel_in_use() >= 0) {
    foreign_channels_ |= std::uint64_t{1} << listener_.channel_in_use();
  }
  resources_ = {};
  for (std::int32_t channel = 0; channel < 64; ++channel) {
    const std::uint64_t bit = foreign_channels_ & std::uint64_t{1} << channel;
    if (bit != 0) static_cast<void>(resources_.allocate(bit, 0));
  }
  listener_.generation_is_new();
  listener_.bus_was_reset(kind == BusFault::device_reset ? kRomCycles : 0);
}

void FirewireBus::vanish() {
  if (!present_) return;
  present_ = false;
  const std::uint32_t generation = ++generation_;
  listener_.generation_is_new();
  later(kGoneCycles, [this, generation] {
    if (present_ || generation_ != generation) return;
    listed_ = false;
    listener_.device_is_gone();
  });
}

void FirewireBus::come_back() {
  if (present_) return;
  present_ = listed_ = true;
  registers_.reset();
  reset(BusFault::reset);
}

std::int64_t FirewireBus::next_event() const noexcept {
  std::int64_t next = std::min(schedule_.next(), script_.next());
  for (const IsoContext* context : contexts_) {
    const std::int64_t packets = context->until_interrupt();
    if (packets == 0) continue;
    // A packet of the device is there when its cycle has ended.
    const std::int64_t cycles =
        context->settings().transmits ? packets : packets * settings_.packet_cycles;
    next = std::min(next, cycle_ + cycles);
  }
  return next;
}

}  // namespace kerf
