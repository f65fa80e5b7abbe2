// SPDX-License-Identifier: Apache-2.0
#include "hil/front/serving.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <system_error>

#include <poll.h>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/threads.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kMaxBehindNs = 100'000'000;  // beyond this the past is not made up for
constexpr int kMaxTakenPerPeriod = 64;              // a flooding host cannot hold the device
// One byte more than any command, so that a longer packet is seen to be wrong.
using Buffer = std::array<std::uint8_t, 65>;

void send(PacketLink& client, PacketDevice& device, FrontStats& stats) noexcept {
  if (device.hung_up()) return client.hang_up();
  for (auto packet = device.next_packet(); !packet.empty(); packet = device.next_packet()) {
    const PacketLink::Sent sent = client.send(packet);
    if (sent == PacketLink::Sent::yes) ++stats.sent;
    if (sent == PacketLink::Sent::full) ++stats.dropped;
  }
}

/// Sends all that is due as one turn, which may be empty.
void send_turn(PacketLink& client, PacketDevice& device, FrontStats& stats) noexcept {
  if (device.hung_up()) return client.hang_up();
  Turn turn;
  std::uint64_t packets = 0;
  for (auto packet = device.next_packet(); !packet.empty(); packet = device.next_packet()) {
    ++(turn.add(packet) ? packets : stats.dropped);
  }
  const PacketLink::Sent sent = client.send(turn.bytes());
  if (sent == PacketLink::Sent::yes) stats.sent += packets;
  if (sent == PacketLink::Sent::full) stats.dropped += packets;
}

}  // namespace

bool readable(int fd, int timeout_ms) noexcept {
  pollfd waiting{fd, POLLIN, 0};
  return poll(&waiting, 1, timeout_ms) > 0;
}

bool readable_within(int fd, std::int64_t patience_ns, const std::atomic<bool>& stop) noexcept {
  const std::int64_t began_ns = monotonic_ns();
  std::int64_t left_ns = patience_ns;
  while (!stop.load(std::memory_order_relaxed) && left_ns > 0) {
    constexpr std::int64_t kNsPerMs = 1'000'000;
    const auto ms = std::min<std::int64_t>(kStopCheckMs, (left_ns - 1) / kNsPerMs + 1);
    if (readable(fd, static_cast<int>(ms))) return true;
    left_ns = patience_ns - (monotonic_ns() - began_ns);
  }
  return false;
}

std::span<const std::uint8_t> PacketLink::wait(std::span<std::uint8_t> buffer,
                                               int timeout_ms) noexcept {
  static_cast<void>(readable(fd_, timeout_ms));
  return take(buffer);
}

void serve_real_time(PacketLink& client, PacketDevice& device, int packet_cycles,
                     const ServeLimits& limits, FrontStats& stats) {
  Buffer buffer;
  std::int64_t deadline_ns = monotonic_ns();
  while (!client.closed() && !limits.reached(stats.cycles)) {
    deadline_ns += packet_cycles * kNsPerCycle;
    sleep_until_ns(deadline_ns);
    const std::int64_t late_ns = monotonic_ns() - deadline_ns;
    stats.wake.record(late_ns);
    if (late_ns > kMaxBehindNs) {
      ++stats.resyncs;
      deadline_ns += late_ns;
    }
    for (int taken = 0; taken < kMaxTakenPerPeriod; ++taken) {
      const auto packet = client.take(buffer);
      if (packet.empty()) break;
      device.receive(packet);
    }
    device.advance(packet_cycles);
    stats.cycles += packet_cycles;
    send(client, device, stats);
  }
}

void serve_lockstep(PacketLink& client, PacketDevice& device, const LockStepTurns& turns,
                    const ServeLimits& limits, FrontStats& stats) {
  Buffer buffer;
  const auto send_tick = [&] {
    if (turns.empty_turns) return send_turn(client, device, stats);
    send(client, device, stats);
  };
  if (turns.device_first || !turns.empty_turns) send_tick();
  while (!client.closed() && !limits.reached(stats.cycles)) {
    const auto packet = client.wait(buffer, kStopCheckMs);
    if (packet.empty()) continue;
    device.receive(packet);
    device.advance(turns.tick_cycles);
    stats.cycles += turns.tick_cycles;
    send_tick();
  }
}

void serve_kernel(KernelDevice& device, const std::function<bool()>& goes_on, Histogram& lateness) {
  while (goes_on()) {
    const std::int64_t late_ns = monotonic_ns() - device.next_wake_ns();
    if (late_ns >= 0) {
      lateness.record(late_ns);
      device.wake();
    }
    const std::int64_t patience_ns =
        std::clamp<std::int64_t>(device.next_wake_ns() - monotonic_ns(), 0, kStopCheckNs);
    const timespec patience{0, patience_ns};
    pollfd asked{device.descriptor(), POLLIN, 0};
    if (ppoll(&asked, 1, &patience, nullptr) > 0) device.answer();
  }
}

std::string make_real_time(int priority, int cpu) {
  if (priority <= 0) return {};
  std::string missing;
  const int core = cpu >= 0 ? cpu : allowed_cores().back();
  if (pin_to_core(core) != 0) missing = "core " + std::to_string(core);
  if (const int error = set_fifo(priority); error != 0) {
    missing += (missing.empty() ? "" : " and ") + ("SCHED_FIFO " + std::to_string(priority)) +
               " (" + std::generic_category().message(error) + ")";
  }
  if (missing.empty()) return {};
  return "no right to " + missing + ": packets may be milliseconds late; run as root, set an " +
         "rtprio limit, or say --priority 0";
}

HandshakeLink::HandshakeLink(PacketLink& client, const LinkHello& own)
    : PacketLink(client.descriptor()), client_(client), own_(own) {}

std::span<const std::uint8_t> HandshakeLink::take(std::span<std::uint8_t> buffer) noexcept {
  const auto packet = client_.take(buffer);
  closed_ = client_.closed();
  if (packet.empty() || !greets_) return packet;
  const auto hello = decode_hello(packet);
  greets_ = hello.has_value();
  if (!greets_) return packet;
  static_cast<void>(client_.send(encode(own_)));
  refusal_ = discord(*hello, own_);
  if (!refusal_.empty()) {
    closed_ = true;
  } else if (!last_.empty()) {
    static_cast<void>(client_.send(last_));
  }
  return {};
}

PacketLink::Sent HandshakeLink::send(std::span<const std::uint8_t> packet) noexcept {
  if (greets_) last_.assign(packet.begin(), packet.end());
  const Sent sent = client_.send(packet);
  closed_ = closed_ || client_.closed();
  return sent;
}

}  // namespace kerf
