// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <poll.h>
#include <unistd.h>

#include "controller/device/port/packet_port.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/threads.hpp"

// Between the servo and the I/O thread of a port: core and priority of that thread, packets in both
// directions, and when the host may send on a half-duplex line.
//
// The packets pass without a lock, a system call or an allocation: the writer of a slot publishes
// it with release, the reader checks it with acquire, and the other way round for an empty slot.

namespace kerf {

/// Core and priority of the I/O threads of a port: the servo's core, above the servo, since the
/// device comes first.
struct IoThread {
  int core = -1;      ///< -1: the last one, the default of the servo
  int priority = 81;  ///< SCHED_FIFO
};

/// Gives the calling thread that core and priority. Without the right to either, packets are later;
/// the start of the servo reports that to the user.
inline void become(const IoThread& io) noexcept {
  static_cast<void>(pin_to_core(io.core >= 0 ? io.core : allowed_cores().back()));
  static_cast<void>(set_fifo(io.priority));
}

/// When the host may send on a half-duplex line, where a device answers each command once: after
/// all answers, or after kPatienceNs without one. A command that waits in the host can be replaced
/// by a newer one; in the buffer of the device it would only become outdated.
///
/// Times in ns of any clock that never goes back. One thread.
class Turns {
 public:
  /// An answer that takes longer counts as lost, and the host may send again.
  static constexpr std::int64_t kPatienceNs = 4'000'000;

  /// Whether the host may send.
  [[nodiscard]] bool ours(std::int64_t now_ns) const noexcept {
    return unanswered_ == 0 || now_ns >= answer_due_ns_;
  }
  /// A command was sent, whether the host was allowed to or not.
  void sent(std::int64_t now_ns) noexcept {
    unanswered_ = ours(now_ns) ? 1 : unanswered_ + 1;
    answer_due_ns_ = now_ns + kPatienceNs;
  }
  /// An answer has arrived, or a command is known not to have arrived.
  void answered() noexcept { unanswered_ = std::max(unanswered_ - 1, 0); }

 private:
  int unanswered_ = 0;
  std::int64_t answer_due_ns_ = 0;
};

/// A packet between the threads; one longer than kMaxBytes is truncated.
struct MailboxPacket {
  static constexpr std::size_t kMaxBytes = 64;

  void assign(std::span<const std::uint8_t> packet) noexcept {
    size = std::min(packet.size(), kMaxBytes);
    std::copy_n(packet.begin(), size, bytes.begin());
  }
  /// Returns the size of the packet; copies as much as `out` holds.
  std::size_t copy_to(std::span<std::uint8_t> out) const noexcept {
    std::copy_n(bytes.begin(), std::min(size, out.size()), out.begin());
    return size;
  }

  std::array<std::uint8_t, kMaxBytes> bytes{};
  std::size_t size = 0;
};

/// Reports: one writer, one reader, oldest first. Wait-free.
class SpscRing {
 public:
  /// The writer. False if the reader is kPlaces behind: the packet is lost then.
  bool put(std::span<const std::uint8_t> packet) noexcept {
    MailboxPacket copy;
    copy.assign(packet);
    return packets_.push(copy);
  }
  /// The reader. Size of the oldest packet; 0 when there is none.
  [[nodiscard]] std::size_t take(std::span<std::uint8_t> out) noexcept {
    const std::optional<MailboxPacket> packet = packets_.take();
    return packet ? packet->copy_to(out) : 0;
  }
  /// Any thread.
  [[nodiscard]] bool empty() const noexcept { return packets_.empty(); }
  /// The reader: sleeps until there is a packet; false after so many milliseconds, or once `closed`
  /// with nothing left.
  [[nodiscard]] bool wait(int milliseconds, const std::atomic<bool>& closed) const noexcept {
    const std::int64_t until_ns = monotonic_ns() + std::int64_t{milliseconds} * 1'000'000;
    while (empty() && !closed.load(std::memory_order_relaxed)) {
      const std::int64_t now_ns = monotonic_ns();
      if (now_ns >= until_ns) return false;
      sleep_until_ns(std::min(until_ns, now_ns + kPollNs));
    }
    return !empty();
  }

 private:
  static constexpr std::int64_t kPollNs = 50'000;
  static constexpr std::uint32_t kPlaces = 64;
  SpscQueue<MailboxPacket, kPlaces> packets_;
};

/// The next command: any thread and any signal handler writes, one reader takes the newest, and
/// older ones are dropped: a delayed reader sends no outdated command. Each packet has a slot of
/// its own, so a writer that a crash stopped in the middle of one does not block the others.
class LatestCommand {
 public:
  /// False if other threads hold all slots.
  bool put(std::span<const std::uint8_t> packet) noexcept {
    Place* const place = claim_oldest();
    if (!place) return false;
    place->packet.assign(packet);
    place->ticket.store(next_ticket_.fetch_add(1), std::memory_order_release);
    return true;
  }
  /// The reader. Size of the newest packet; 0 when there is none.
  [[nodiscard]] std::size_t take(std::span<std::uint8_t> out) noexcept {
    std::size_t size = 0;
    for (Place& place : places_) {
      const std::uint64_t ticket = place.ticket.load(std::memory_order_relaxed);
      if (ticket == kFree || !claim(place, ticket)) continue;
      if (ticket > newest_taken_) {
        newest_taken_ = ticket;
        on_its_way_.store(true);  // before the slot is free: `send_and_wait` checks both
        size = place.packet.copy_to(out);
      }
      place.ticket.store(kFree, std::memory_order_release);
    }
    return size;
  }
  /// The reader: whether the packet that it took is still in the process.
  void set_on_its_way(bool is) noexcept { on_its_way_.store(is); }

  /// Any thread but the reader's, any signal handler: calls `send`, again while it fails, and waits
  /// until all packets have left; false if that takes longer than so many milliseconds.
  template <class Send>
  bool send_and_wait(const Send& send, int milliseconds) const noexcept {
    bool is_put = send();
    for (int ms = 0; !is_put || !empty() || on_its_way_.load(); ++ms) {
      if (ms == milliseconds) return false;
      poll(nullptr, 0, 1);  // a sleep that signal handlers may call
      is_put = is_put || send();
    }
    return true;
  }
  /// Any thread, any signal handler: no whole packet waits.
  [[nodiscard]] bool empty() const noexcept {
    return std::ranges::all_of(places_, [](const Place& place) {
      const std::uint64_t ticket = place.ticket.load(std::memory_order_acquire);
      return ticket == kFree || ticket == kInHand;
    });
  }

 private:
  static constexpr std::size_t kPlaces = 8;
  // Tickets grow with time, between these two.
  static constexpr std::uint64_t kFree = 0;
  static constexpr std::uint64_t kInHand = ~std::uint64_t{0};
  struct Place {
    std::atomic<std::uint64_t> ticket{kFree};
    MailboxPacket packet;
  };
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

  /// Claims the slot for the caller alone. False if its ticket has changed.
  [[nodiscard]] static bool claim(Place& place, std::uint64_t ticket) noexcept {
    return ticket != kInHand &&
           place.ticket.compare_exchange_strong(ticket, kInHand, std::memory_order_acquire);
  }
  /// A free slot, or that of the oldest packet, which is outdated.
  [[nodiscard]] Place* claim_oldest() noexcept {
    for (std::size_t tries = 0; tries < kPlaces; ++tries) {
      Place* oldest = nullptr;
      std::uint64_t lowest = kInHand;
      for (Place& place : places_) {
        const std::uint64_t ticket = place.ticket.load(std::memory_order_relaxed);
        if (ticket >= lowest) continue;
        lowest = ticket;
        oldest = &place;
      }
      if (!oldest || claim(*oldest, lowest)) return oldest;
    }
    return nullptr;
  }

  std::array<Place, kPlaces> places_{};
  std::atomic<std::uint64_t> next_ticket_{kFree + 1};
  std::atomic<bool> on_its_way_{false};
  std::uint64_t newest_taken_ = kFree;  ///< of the reader: older packets came too late
};

/// A port whose packets pass through these mailboxes, to and from I/O threads of its own.
class MailboxPort : public PacketPort {
 public:
  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept final {
    return inbox_.take(out);
  }
  bool send_last(std::span<const std::uint8_t> packet) noexcept final {
    if (gettid() == sender_id_) return false;  // no thread is left to send it
    return outbox_.send_and_wait([&] { return send_now(packet); }, kLastPacketMs);
  }
  [[nodiscard]] bool closed() const noexcept final {
    return closed_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool wait(int milliseconds) noexcept final {
    return inbox_.wait(milliseconds, closed_);
  }

 protected:
  static constexpr int kLastPacketMs = 20;

  SpscRing inbox_;
  LatestCommand outbox_;
  std::atomic<bool> closed_{false};  ///< no report comes any more
  std::atomic<bool> stop_{false};
  std::atomic<int> sender_id_{0};  ///< of the thread that sends
};

}  // namespace kerf
