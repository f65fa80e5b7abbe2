// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "hil/front/firewire/event_queue.hpp"

namespace kerf {

/// How much of its 16 MiB of descriptors a context has in use, page by page as the kernel takes
/// them (ohci.c, context_get_descriptors): a block does not cross pages, and a page is free again
/// once its last block is completed.
class DescriptorMemory {
 public:
  static constexpr std::uint64_t kPages = 16 * 1024 * 1024 / 4096;
  static constexpr std::size_t kPageBytes = 4096 - 48 - 16;  ///< less its header and a guard

  /// False when all pages are in use.
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

/// What a client asked for when it made the context.
struct IsoSettings {
  bool transmits = false;
  std::uint32_t channel = 0;
  std::uint32_t header_size = 0;  ///< bytes that a received packet takes in an event
  std::uint64_t closure = 0;
  bool drops_overflow = false;  ///< clients below version 5: what a page cannot hold is lost
};

/// One isochronous DMA context of an OHCI controller, as the kernel's driver runs it.
///
/// The engine works through descriptors cycle by cycle. The driver looks at what is done only at a
/// descriptor with an interrupt, or on a flush: only then events appear and memory is free again.
/// An engine that ran out of descriptors halts until the next successful `queue`.
class IsoContext {
 public:
  IsoContext(const IsoSettings& settings, EventQueue& events)
      : settings_(settings), events_(events) {}

  /// QUEUE_ISO: entries as the client wrote them; `readable` false when more were announced than
  /// its memory holds.
  struct Queued {
    int error = 0;             ///< positive errno: what stood before the bad entry stays queued
    std::int32_t entries = 0;  ///< fewer than given: descriptor memory is full
    std::size_t bytes = 0;     ///< of these entries
  };
  [[nodiscard]] Queued queue(std::span<const std::uint8_t> entries, bool readable);

  /// 0 or an errno. `cycle` is the first one of the stream.
  [[nodiscard]] int start(std::int64_t cycle, std::uint32_t tags) noexcept;
  void stop() noexcept { running_ = false; }
  void flush() { complete(true); }

  /// The bus's side. Of a transmitter, the packet of `cycle`: nothing when it sends none.
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
    std::uint32_t tag = 0;           ///< of what is sent
    std::vector<std::uint8_t> data;  ///< what is sent, or what has come
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
