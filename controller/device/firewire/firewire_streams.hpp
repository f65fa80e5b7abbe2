// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/device/firewire/firewire_file.hpp"
#include "shared/wire/omni.hpp"

namespace kerf {

/// Cycle of an isochronous time stamp (3 bits second, 13 bits cycle), 0..63999.
[[nodiscard]] constexpr std::int32_t cycle_of_stamp(std::uint32_t stamp) noexcept {
  return static_cast<std::int32_t>((stamp >> 13 & 7) * 8000 + (stamp & 0x1FFF) % 8000);
}

/// Cycles from `from` to `to`, -32000..31999: time stamps repeat after eight seconds.
[[nodiscard]] constexpr std::int32_t cycles_between(std::int32_t from, std::int32_t to) noexcept {
  return ((to - from) % 64000 + 96000) % 64000 - 32000;
}

/// The device's packets, without a mapped buffer: a payload comes inside the events.
///
/// 64 packets deep (8 ms at 8 kHz). The kernel processes received packets on `flush`, and at marked
/// entries in case the servo does not flush. Servo thread only.
class FirewireReceiver {
 public:
  /// Creates the context on a freshly opened file. 0 or a negative errno. The stream begins with
  /// the first `turn`, so that a servo which starts later finds no old packets.
  [[nodiscard]] int prepare(FirewireFile& file, std::int32_t channel) noexcept;
  void stop(FirewireFile& file) noexcept;

  /// Gives back the room of packets that were taken, then asks for those that have come.
  void turn(FirewireFile& file) noexcept;
  /// The packets of an ISO_INTERRUPT event, which must stay where it is until `next` is empty.
  void take(std::span<const std::uint8_t> event) noexcept;

  struct Packet {
    std::size_t size = 0;                   ///< as on the bus; 0: there is none
    std::span<const std::uint8_t> bytes{};  ///< at most a report
  };
  [[nodiscard]] Packet next() noexcept;
  [[nodiscard]] bool has_packets() const noexcept { return !headers_.empty(); }

  /// The bus cycle of the newest packet, 0..63999; -1 before the first.
  [[nodiscard]] std::int32_t newest_cycle() const noexcept {
    return newest_cycle_.load(std::memory_order_relaxed);
  }

 private:
  static constexpr std::size_t kHeaderBytes = 8 + omni::kReportBytes;
  static constexpr int kPacketsPerEntry = 4;  // the length of an entry has 8 bits
  static constexpr int kEntries = 16;

  [[nodiscard]] int queue(FirewireFile& file, int entries) noexcept;

  std::span<const std::uint8_t> headers_;
  bool running_ = false;
  int free_packets_ = 0;  ///< taken, and their room not given back yet
  std::uint32_t entries_ = 0;
  std::atomic<std::int32_t> newest_cycle_{-1};
};

/// The host's packets: 16 bytes that travel in the queueing call itself.
///
/// By default one entry per packet and an empty queue in between: the packet goes out in the next
/// cycle. With `fill`, skipped cycles follow it up to the next packet, and the depth of the queue
/// follows from time stamps, never from the host's clock.
class FirewireTransmitter {
 public:
  /// `first` goes out at once: a stream cannot start empty. 0 or a negative errno.
  [[nodiscard]] int start(FirewireFile& file, std::int32_t channel,
                          std::span<const std::uint8_t> first) noexcept;
  void stop(FirewireFile& file) noexcept;

  /// Any thread, any signal handler: one system call. `skips` cycles after the packet stay empty.
  bool send(FirewireFile& file, std::span<const std::uint8_t> packet, int skips = 0) noexcept;

  /// Servo thread. Reads the kernel's events about sent packets, which would otherwise pile up.
  void take(std::span<const std::uint8_t> event) noexcept;
  [[nodiscard]] bool due() const noexcept {
    return entries_.load(std::memory_order_relaxed) - drained_at_ >= kInterruptEvery;
  }
  void drained() noexcept { drained_at_ = entries_.load(std::memory_order_relaxed); }

  /// How many skips keep the queue filled for `period` cycles, when the newest packet that came is
  /// of cycle `now`, or -1 when none has come yet.
  [[nodiscard]] int wanted_skips(std::int32_t now, int period) noexcept;

 private:
  static constexpr std::uint64_t kInterruptEvery = 64;
  static constexpr int kMargin = 2;  // cycles that the controller reads ahead

  void delay(std::int32_t lead) noexcept;

  std::atomic<std::uint64_t> entries_{0};  ///< queued so far
  std::uint64_t drained_at_ = 0;
  std::uint64_t sent_out_ = 0;  ///< entries that are known to have gone out
  /// Cycle of an entry less its number, 0..63999; it only grows, whenever the queue runs dry. -1:
  /// not known.
  std::atomic<std::int32_t> lead_{-1};
};

}  // namespace kerf
