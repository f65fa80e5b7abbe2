// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/device/firewire/firewire_file.hpp"
#include "controller/device/firewire/firewire_streams.hpp"
#include "controller/device/port/packet_port.hpp"

namespace kerf {

/// Counters of a link over FireWire.
struct FirewireLinkStats {
  std::uint64_t resets = 0;    ///< of the bus, by events
  std::uint64_t armings = 0;   ///< batches of register writes, the first one included
  std::uint64_t reclaims = 0;  ///< channels that were lost and requested again
};

/// The Omni on FireWire, by system calls on `/dev/fw*` alone.
///
/// Three opens: requests and resources, the received stream, the transmitted one. Every tick
/// flushes the received stream, so a packet is never older than a tick and a bus cycle. An
/// undisturbed tick takes six calls: return of buffers, flush, poll, read, poll, and send.
///
/// The link repairs itself between ticks, without sleeping: after a bus reset the registers are
/// written again; for a silent device too; channels that another node has taken are released
/// (neutral packets first) and claimed anew, which opens the node again. Meanwhile the servo gets
/// no reports. Only a device that is gone closes the port.
class FirewirePort final : public PacketPort {
 public:
  /// Finds the device, claims channels, starts both streams with a neutral packet. Retries
  /// for `patience_ms` while no device is connected, or until `stop`. Throws std::runtime_error
  /// with one line.
  FirewirePort(const FirewireOptions& options, int patience_ms, const std::atomic<bool>& stop);
  /// Motors off, the device's enable bit cleared, both streams stopped.
  ~FirewirePort() override;
  FirewirePort(const FirewirePort&) = delete;
  FirewirePort& operator=(const FirewirePort&) = delete;

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override;
  bool send(std::span<const std::uint8_t> packet) noexcept override;
  [[nodiscard]] bool closed() const noexcept override {
    return closed_.load(std::memory_order_relaxed);
  }
  /// Flushes once, then waits for an event.
  [[nodiscard]] bool wait(int milliseconds) noexcept override;

  [[nodiscard]] std::vector<LinkCounter> counters() const override;

  /// Bus cycle of the newest packet taken, 0..63999, or -1: the device's clock, free of the host's
  /// jitter.
  [[nodiscard]] std::int32_t newest_cycle() const noexcept { return receiver_.newest_cycle(); }
  [[nodiscard]] const FirewireLinkStats& stats() const noexcept { return stats_; }
  /// Packets that the kernel did not accept.
  [[nodiscard]] std::uint64_t misqueued() const noexcept {
    return misqueued_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] const FirewireDevice& device() const noexcept { return device_; }

 private:
  enum class State : std::uint8_t {
    claiming,   ///< waits for channels
    arming,     ///< waits for answers to register writes
    streaming,  ///
    yielding,   ///< a channel was taken away: neutral packets, then claiming
  };

  void find(const FirewireOptions& options, int patience_ms, const std::atomic<bool>& stop);
  void connect(const std::atomic<bool>& stop);

  void turn() noexcept;
  void tend() noexcept;
  void claim() noexcept;
  void arm() noexcept;
  void renew() noexcept;
  void yield() noexcept;
  [[nodiscard]] bool open_streams() noexcept;

  void read_requests() noexcept;
  void read_transmitted() noexcept;
  void hear(std::span<const std::uint8_t> event) noexcept;
  void hear_reset(std::uint32_t generation) noexcept;
  void hear_response(std::span<const std::uint8_t> event) noexcept;
  void hear_resource(std::span<const std::uint8_t> event, bool allocated) noexcept;
  void close_if_gone() noexcept;

  /// Closures of the two resources.
  static constexpr std::uint64_t kListen = 1, kTalk = 2;
  static constexpr std::size_t kEventBytes = 4096 + 64;  // a page of headers and their event

  FirewireOptions options_;
  FirewireDevice device_;
  FirewireRequests requests_;
  FirewireFile received_, transmitted_;
  FirewireReceiver receiver_;
  FirewireTransmitter transmitter_;

  State state_ = State::claiming;
  FirewireClaim listen_, talk_;  ///< host receives; device receives
  bool refused_ = false;         ///< no channel, or no stream on it
  bool stale_ = false;           ///< a register write came too late for its generation
  std::uint32_t batch_ = 0;      ///< of register writes: answers to older ones do not count
  int answers_ = 0, writes_ = 0;
  int turns_ = 0;  ///< in this state, or without a packet
  std::uint32_t quiet_turns_ = 0;
  std::uint8_t control_ = 0;  ///< the control register at the start
  bool flushed_ = false;

  std::atomic<bool> muted_{false};  ///< every packet is a neutral one
  std::atomic<bool> closed_{false};
  std::atomic<std::uint64_t> misqueued_{0};
  FirewireLinkStats stats_;
  alignas(8) std::array<std::uint8_t, kEventBytes> event_{};       ///< of the received stream
  alignas(8) std::array<std::uint8_t, kEventBytes> sent_event_{};  ///< of the transmitted one
};

}  // namespace kerf
