// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/wire/emulator_link.hpp"

/// Serves an emulated device to a host: in real time, in lock-step, or behind one descriptor of the
/// kernel; the link to the host, and its handshake.
namespace kerf {

/// A connection to one host: whole packets, none merged. One thread.
class PacketLink {
 public:
  enum class Sent : std::uint8_t { yes, full, closed };

  virtual ~PacketLink() = default;

  /// Oldest waiting packet into `buffer`; a longer one is cut. Empty if none waits; `closed` then
  /// reports whether the peer is gone. Never blocks.
  [[nodiscard]] virtual std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept = 0;
  /// Takes the oldest packet; waits up to `timeout_ms` for one.
  [[nodiscard]] std::span<const std::uint8_t> wait(std::span<std::uint8_t> buffer,
                                                   int timeout_ms) noexcept;
  /// Never blocks: `full` if the peer does not read.
  [[nodiscard]] virtual Sent send(std::span<const std::uint8_t> packet) noexcept = 0;
  /// Ends this side of the link; the peer's packets still arrive.
  virtual void hang_up() noexcept = 0;
  [[nodiscard]] bool closed() const noexcept { return closed_; }
  [[nodiscard]] int descriptor() const noexcept { return fd_; }

 protected:
  explicit PacketLink(int fd) noexcept : fd_(fd) {}

  int fd_;  ///< of the socket
  bool closed_ = false;
};

inline constexpr std::int64_t kNsPerCycle = 125'000;  ///< of the bus

inline constexpr std::int64_t kForeverNs = std::numeric_limits<std::int64_t>::max();

/// A stop request is seen within this time.
inline constexpr int kStopCheckMs = 100;
inline constexpr std::int64_t kStopCheckNs = kStopCheckMs * std::int64_t{1'000'000};

/// Returns true if `fd` can be read within the time.
[[nodiscard]] bool readable(int fd, int timeout_ms) noexcept;

/// Waits until `fd` can be read: false if `patience_ns` are over or `stop` became true, seen within
/// kStopCheckMs.
[[nodiscard]] bool readable_within(int fd, std::int64_t patience_ns,
                                   const std::atomic<bool>& stop) noexcept;

/// When to stop serving.
struct ServeLimits {
  std::int64_t cycles = 0;  ///< bus cycles to serve in all; 0 = until the client leaves
  const std::atomic<bool>& stop;

  /// The rest of that time after `served` bus cycles, by the clock: how long to wait for a client.
  [[nodiscard]] std::int64_t left_ns(std::int64_t served) const noexcept {
    return cycles == 0 ? kForeverNs : (cycles - served) * kNsPerCycle;
  }
  /// Returns true if the limit is reached after `served` bus cycles, or a stop was requested.
  [[nodiscard]] bool reached(std::int64_t served) const noexcept {
    return stop.load(std::memory_order_relaxed) || (cycles != 0 && served >= cycles);
  }
};

/// Counts of a front.
struct FrontStats {
  std::uint64_t sent = 0;
  std::uint64_t dropped = 0;  ///< the client did not read
  std::uint64_t resyncs = 0;  ///< the process slept so long that time was skipped
  std::int64_t cycles = 0;
  Histogram wake;
};

/// Serves one client in real time: every `packet_cycles` bus cycles, at absolute deadlines, the
/// packets of the host are applied and the device's packet is sent, if one is due. Never waits for
/// the client: packets that it does not read are dropped and counted. Returns when the client
/// leaves, at the limit or at a stop.
void serve_real_time(PacketLink& client, PacketDevice& device, int packet_cycles,
                     const ServeLimits& limits, FrontStats& stats);

/// The turns of a lock-step run.
struct LockStepTurns {
  int tick_cycles = 8;  ///< bus cycles of a tick
  /// All packets of a tick go as one turn (`Turn`), an empty one if nothing is due: for devices
  /// whose packets a fault may keep back or double. Only kerf's own controller reads turns.
  bool empty_turns = false;
  bool device_first = true;  ///< its packets go before any packet of the host
};

/// Serves one client in lock-step: one packet at once (of a device that goes first), then for
/// every packet of the host one tick and the packets that are due then. No clock: the same host
/// sees the same bytes.
void serve_lockstep(PacketLink& client, PacketDevice& device, const LockStepTurns& turns,
                    const ServeLimits& limits, FrontStats& stats);

/// A device that a kernel drives through one descriptor: requests arrive; answers and the device's
/// own packets leave. One thread.
class KernelDevice {
 public:
  virtual ~KernelDevice() = default;
  /// Readable if the kernel has a request; negative while the device is unplugged.
  [[nodiscard]] virtual int descriptor() const noexcept = 0;
  /// Handles the requests that wait there, without waiting for more.
  virtual void answer() = 0;
  /// The time at which `wake` is due without a request, CLOCK_MONOTONIC ns.
  [[nodiscard]] virtual std::int64_t next_wake_ns() const noexcept = 0;
  virtual void wake() = 0;
};

/// Serves while `goes_on`, which is called between two steps and at least every 100 ms. `lateness`
/// records the lateness of each `wake`.
void serve_kernel(KernelDevice& device, const std::function<bool()>& goes_on, Histogram& lateness);

/// Gives the calling thread SCHED_FIFO `priority` (0: leave it as it is) on core `cpu` (negative:
/// the last one, that of the servo: a wake-up across cores costs far more than one on the same).
/// Returns one line on the missing rights and the effect, or an empty string.
[[nodiscard]] std::string make_real_time(int priority, int cpu);

/// A link to a client that may send a hello before its first packet (`LinkHello`). Each hello is
/// answered, since UDP may lose an answer, and the device's last packet is sent again after it, so
/// that a lock-step session begins with its first report. A hello that does not fit is answered
/// too, and closes the link. A client without a hello is served all the same.
class HandshakeLink final : public PacketLink {
 public:
  /// `client` outlives it.
  HandshakeLink(PacketLink& client, const LinkHello& own);

  [[nodiscard]] std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept override;
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept override;
  void hang_up() noexcept override { client_.hang_up(); }

  /// The reason if the client was refused, else empty.
  [[nodiscard]] const std::string& refusal() const noexcept { return refusal_; }

 private:
  PacketLink& client_;
  LinkHello own_;
  bool greets_ = true;              ///< the client has sent nothing but hellos yet
  std::vector<std::uint8_t> last_;  ///< of the device, while it greets
  std::string refusal_;
};

}  // namespace kerf
