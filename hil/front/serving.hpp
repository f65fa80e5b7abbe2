// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>

#include "hil/devmodel/packet_device.hpp"
#include "shared/numeric/histogram.hpp"

namespace kerf {

/// The way to one host: whole packets, none merged. One thread.
class PacketLink {
 public:
  enum class Sent : std::uint8_t { yes, full, closed };

  virtual ~PacketLink() = default;

  /// Oldest waiting packet into `buffer`; a longer one is cut. Empty when none waits, and then
  /// `closed` tells whether the other end is gone. Never blocks.
  [[nodiscard]] virtual std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept = 0;
  /// As `take`, but waits up to `timeout_ms` for a packet.
  [[nodiscard]] std::span<const std::uint8_t> wait(std::span<std::uint8_t> buffer,
                                                   int timeout_ms) noexcept;
  /// Never blocks: `full` when the other end does not read.
  [[nodiscard]] virtual Sent send(std::span<const std::uint8_t> packet) noexcept = 0;
  [[nodiscard]] bool closed() const noexcept { return closed_; }
  [[nodiscard]] int descriptor() const noexcept { return fd_; }

 protected:
  explicit PacketLink(int fd) noexcept : fd_(fd) {}

  int fd_;  ///< of the socket
  bool closed_ = false;
};

inline constexpr std::int64_t kNsPerCycle = 125'000;  ///< of the bus

inline constexpr std::int64_t kForeverNs = std::numeric_limits<std::int64_t>::max();

/// How long a stop request may wait.
inline constexpr int kStopCheckMs = 100;
inline constexpr std::int64_t kStopCheckNs = kStopCheckMs * std::int64_t{1'000'000};

/// Whether something can be read from `fd` within the time.
[[nodiscard]] bool readable(int fd, int timeout_ms) noexcept;

/// The same, for as long as that takes: false when `patience_ns` are over or `stop` became true,
/// seen within kStopCheckMs.
[[nodiscard]] bool readable_within(int fd, std::int64_t patience_ns,
                                   const std::atomic<bool>& stop) noexcept;

/// What both ways of serving share.
struct ServeLimits {
  std::int64_t cycles = 0;  ///< bus cycles to serve in all; 0 = until the client leaves
  const std::atomic<bool>& stop;

  /// How long that is from `served` bus cycles on, by the clock: how long to wait for a client.
  [[nodiscard]] std::int64_t left_ns(std::int64_t served) const noexcept {
    return cycles == 0 ? kForeverNs : (cycles - served) * kNsPerCycle;
  }
  /// Whether that is all, after `served` bus cycles.
  [[nodiscard]] bool reached(std::int64_t served) const noexcept {
    return stop.load(std::memory_order_relaxed) || (cycles != 0 && served >= cycles);
  }
};

/// What the front saw.
struct FrontStats {
  std::uint64_t sent = 0;
  std::uint64_t dropped = 0;  ///< the client did not read
  std::uint64_t resyncs = 0;  ///< the process slept so long that time was skipped
  std::int64_t cycles = 0;
  Histogram wake;
};

/// Serves one client in real time: every `packet_cycles` bus cycles, at absolute deadlines, the
/// packets of the host are applied and the device's packet is sent, where one is due. Never waits
/// for the client: what it does not read is dropped and counted. Returns when the client leaves, at
/// the limit or at a stop.
void serve_real_time(PacketLink& client, PacketDevice& device, int packet_cycles,
                     const ServeLimits& limits, FrontStats& stats);

/// How a lock-step run takes its turns.
struct LockStepTurns {
  int tick_cycles = 8;  ///< bus cycles of a tick
  /// All packets of a tick go as one turn (turn.hpp), an empty one where nothing is due: for
  /// devices whose packets a fault may keep back or double. Only kerf's own controller reads turns.
  bool says_nothing_came = false;
  bool speaks_first = true;  ///< the device, before any packet of the host
};

/// Serves one client in lock-step: one packet at once (of a device that speaks first), then for
/// every packet of the host one tick and the packets that are due then. No clock: the same host
/// sees the same bytes.
void serve_lockstep(PacketLink& client, PacketDevice& device, const LockStepTurns& turns,
                    const ServeLimits& limits, FrontStats& stats);

/// A device that a kernel drives through one descriptor: requests come, answers and what the device
/// says by itself go. One thread.
class KernelDevice {
 public:
  virtual ~KernelDevice() = default;
  /// Readable when the kernel asks; negative while the device is unplugged.
  [[nodiscard]] virtual int descriptor() const noexcept = 0;
  /// Takes what waits there, without waiting for more.
  virtual void answer() = 0;
  /// When `wake` is due although nobody asks, CLOCK_MONOTONIC ns.
  [[nodiscard]] virtual std::int64_t next_wake_ns() const noexcept = 0;
  virtual void wake() = 0;
};

/// Serves while `goes_on`, which is asked between two steps and at least every 100 ms. `lateness`
/// records how late `wake` was called.
void serve_kernel(KernelDevice& device, const std::function<bool()>& goes_on, Histogram& lateness);

/// Gives the calling thread SCHED_FIFO `priority` (0: leave it as it is) on core `cpu` (negative:
/// the last one, where the servo runs: a wake-up across cores costs far more than one on the same).
/// Returns what is missing and what it costs as one line, or nothing.
[[nodiscard]] std::string make_real_time(int priority, int cpu);

}  // namespace kerf
