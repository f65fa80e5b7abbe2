// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/omni.hpp"

/// Isochronous transfer on an emulated FireWire bus: its clock, and the DMA contexts of a
/// controller with the events that they give to a client.
namespace kerf {

inline constexpr std::int64_t kBusCyclesPerSecond = omni::kBusCyclesPerSecond;
inline constexpr int kTicksPerCycle = 3072;  ///< of the bus's 24.576 MHz clock
inline constexpr std::int64_t kNsPerBusCycle = kNsPerSecond / kBusCyclesPerSecond;

/// A bus begins late in its 128 s, so that every run sees its counters wrap.
inline constexpr std::int64_t kFirstCycle = 125 * kBusCyclesPerSecond;

/// 3 bits of the second and 13 bits of the cycle: the time stamp of an isochronous packet.
[[nodiscard]] constexpr std::uint16_t iso_stamp(std::int64_t cycle) noexcept {
  const auto second = static_cast<std::uint64_t>(cycle / kBusCyclesPerSecond) & 7;
  return static_cast<std::uint16_t>(second << 13 |
                                    static_cast<std::uint64_t>(cycle % kBusCyclesPerSecond));
}

/// 7 bits of the second, 13 of the cycle, 12 of the offset: the cycle timer of a controller.
[[nodiscard]] constexpr std::uint32_t cycle_timer(std::int64_t cycle, int ticks) noexcept {
  const auto second = static_cast<std::uint64_t>(cycle / kBusCyclesPerSecond) & 127;
  const auto within = static_cast<std::uint64_t>(cycle % kBusCyclesPerSecond);
  return static_cast<std::uint32_t>(second << 25 | within << 12 | static_cast<unsigned>(ticks));
}

/// The current bus cycle (125 us): by the machine's clock, or in lock-step by request.
class BusClock {
 public:
  /// The bus runs `drift_ppm` slower than the machine's clock.
  static BusClock real_time(double drift_ppm = 0) noexcept {
    BusClock clock;
    clock.began_ns_ = monotonic_ns();
    clock.ns_per_cycle_ = static_cast<double>(kNsPerBusCycle) * (1 + drift_ppm * 1e-6);
    return clock;
  }
  static BusClock lock_step() noexcept { return {}; }

  [[nodiscard]] bool is_lock_step() const noexcept { return ns_per_cycle_ == 0; }

  /// The cycle that runs at a time of CLOCK_MONOTONIC, and its age in bus ticks.
  struct Instant {
    std::int64_t cycle;
    int ticks;
  };
  [[nodiscard]] Instant at(std::int64_t ns) const noexcept {
    if (is_lock_step()) return {cycle_, 0};
    const double cycles = static_cast<double>(ns - began_ns_) / ns_per_cycle_;
    const double whole = std::floor(cycles);
    return {kFirstCycle + static_cast<std::int64_t>(whole),
            static_cast<int>((cycles - whole) * kTicksPerCycle)};
  }
  [[nodiscard]] std::int64_t cycle() const noexcept {
    return is_lock_step() ? cycle_ : at(monotonic_ns()).cycle;
  }
  /// When `cycle` begins, CLOCK_MONOTONIC; only in real time.
  [[nodiscard]] std::int64_t begin_ns(std::int64_t cycle) const noexcept {
    const double since = static_cast<double>(cycle - kFirstCycle) * ns_per_cycle_;
    return began_ns_ + static_cast<std::int64_t>(std::ceil(since));
  }
  /// Only in lock-step.
  void advance(std::int64_t cycles) noexcept { cycle_ += cycles; }

 private:
  std::int64_t began_ns_ = 0;
  double ns_per_cycle_ = 0;
  std::int64_t cycle_ = kFirstCycle;
};

/// Events of one open file, oldest first, each as the bytes that one read() returns.
///
/// As in the kernel there is no bound: a client that does not read grows it for ever. The
/// high-water mark shows that.
class EventQueue {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// `event` as it stands in memory, and then `data` from `data_offset` on; the event grows by the
  /// data's size, whatever padding it has.
  template <class Event>
  void push(const Event& event, std::span<const std::uint8_t> data = {},
            std::size_t data_offset = sizeof(Event)) {
    Bytes bytes(sizeof event + data.size());
    std::memcpy(bytes.data(), &event, sizeof event);
    if (!data.empty()) std::memcpy(&bytes[data_offset], data.data(), data.size());
    events_.push_back(std::move(bytes));
    high_water_ = std::max(high_water_, events_.size());
  }
  [[nodiscard]] Bytes pop() {
    Bytes bytes = std::move(events_.front());
    events_.pop_front();
    return bytes;
  }
  [[nodiscard]] bool empty() const noexcept { return events_.empty(); }
  [[nodiscard]] std::size_t high_water() const noexcept { return high_water_; }

 private:
  std::deque<Bytes> events_;
  std::size_t high_water_ = 0;
};

/// The part of its 16 MiB of descriptors that a context has in use, page by page as the kernel
/// takes them (ohci.c, context_get_descriptors): a block does not cross pages, and a page is free
/// again once its last block is completed.
class DescriptorMemory {
 public:
  static constexpr std::uint64_t kPages = 16 * 1024 * 1024 / 4096;
  static constexpr std::size_t kPageBytes = 4096 - 48 - 16;  ///< less its header and a guard

  /// Returns false if all pages are in use.
  [[nodiscard]] bool take(std::size_t bytes) noexcept {
    if (used_ + bytes > kPageBytes) {
      if (page_ + 1 - oldest_page_ >= kPages) return false;
      ++page_;
      used_ = 0;
    }
    used_ += bytes;
    return true;
  }
  /// The page of the block taken last.
  [[nodiscard]] std::uint64_t page() const noexcept { return page_; }
  /// All blocks on pages before `page` are completed.
  void complete_before(std::uint64_t page) noexcept { oldest_page_ = page; }

 private:
  std::uint64_t page_ = 0;
  std::uint64_t oldest_page_ = 0;
  std::size_t used_ = 0;
};

/// The settings with which a client made the context.
struct IsoSettings {
  bool transmits = false;
  std::uint32_t channel = 0;
  std::uint32_t header_size = 0;  ///< bytes that a received packet takes in an event
  std::uint64_t closure = 0;
  bool drops_overflow = false;  ///< clients below version 5: headers beyond a page are lost
};

/// One isochronous DMA context of an OHCI controller, as the kernel's driver runs it.
///
/// The engine works through descriptors cycle by cycle. The driver handles the completed ones only
/// at a descriptor with an interrupt, or on a flush: only then events appear and memory is free
/// again. An engine that ran out of descriptors halts until the next successful `queue`.
class IsoContext {
 public:
  IsoContext(const IsoSettings& settings, EventQueue& events)
      : settings_(settings), events_(events) {}

  /// QUEUE_ISO: entries as the client wrote them; `readable` is false if its memory holds fewer
  /// than announced.
  struct Queued {
    int error = 0;             ///< positive errno: entries before the bad one stay queued
    std::int32_t entries = 0;  ///< fewer than given: descriptor memory is full
    std::size_t bytes = 0;     ///< of these entries
  };
  [[nodiscard]] Queued queue(std::span<const std::uint8_t> entries, bool readable);

  /// 0 or an errno. `cycle` is the first one of the stream.
  [[nodiscard]] int start(std::int64_t cycle, std::uint32_t tags) noexcept;
  void stop() noexcept { running_ = false; }
  void flush() { complete(true); }

  /// The bus's side. Of a transmitter, the packet of `cycle`; empty if it sends none.
  struct Packet {
    std::uint32_t tag = 0;
    std::vector<std::uint8_t> bytes;
  };
  [[nodiscard]] std::optional<Packet> transmit(std::int64_t cycle);
  /// Of a receiver: a packet of this context's channel.
  void receive(std::uint32_t tag, std::span<const std::uint8_t> packet, std::int64_t cycle);

  [[nodiscard]] const IsoSettings& settings() const noexcept { return settings_; }
  /// Descriptors until the next one that interrupts, itself included; 0 for none.
  [[nodiscard]] std::int64_t until_interrupt() const noexcept;
  /// Packets that came while no descriptor was queued.
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }
  [[nodiscard]] std::uint64_t double_starts() const noexcept { return double_starts_; }

 private:
  struct Descriptor {
    std::uint64_t page = 0;
    bool interrupts = false;
    bool skips = false;
    std::uint32_t tag = 0;           ///< of a packet to send
    std::vector<std::uint8_t> data;  ///< the packet to send, or the one received
    std::uint16_t stamp = 0;
  };

  [[nodiscard]] bool append(std::uint32_t control, std::span<const std::uint8_t> data);
  [[nodiscard]] bool can_work() noexcept;
  void done(std::int64_t cycle);
  void complete(bool flush);
  void emit();

  IsoSettings settings_;
  EventQueue& events_;
  DescriptorMemory memory_;
  std::deque<Descriptor> descriptors_;       ///< done ones first
  std::size_t done_ = 0;                     ///< of them
  std::uint64_t completed_ = 0;              ///< descriptors that left in front
  std::deque<std::uint64_t> interrupts_at_;  ///< indices, counted from the first descriptor ever
  std::vector<std::uint8_t> headers_;        ///< of the event to come, at most a page
  std::uint16_t last_stamp_ = 0;
  bool running_ = false;
  bool halted_ = false;
  std::int64_t start_cycle_ = 0;
  std::uint32_t tags_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t double_starts_ = 0;
};

}  // namespace kerf
