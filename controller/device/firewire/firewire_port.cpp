// SPDX-License-Identifier: Apache-2.0
#include "controller/device/firewire/firewire_port.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include <linux/firewire-cdev.h>

#include "controller/device/firewire/firewire_file.hpp"
#include "shared/wire/omni.hpp"

namespace kerf {
namespace {

// Registers of the device, one byte each but for the last.
constexpr std::uint64_t kHostTalksOn = 0x1000;
constexpr std::uint64_t kDeviceTalksOn = 0x1001;
constexpr std::uint64_t kControl = 0x1087;
constexpr std::uint64_t kMode20010 = 0x20010;
constexpr std::uint8_t kStreams = 0x08;  // of the control register
constexpr std::array<std::uint8_t, 4> kModeBytes{0x00, 0x00, 0x0F, 0xF8};  // as on the bus

// These four in ticks. A refused or unanswered request is repeated after kRetryTicks, and a stream
// that was silent for kSilentTurns is set up again, before the force has faded.
constexpr int kRetryTicks = 20;
constexpr int kSilentTurns = 8;
constexpr int kYieldTurns = 3;  // of neutral packets before a stream stops
constexpr std::uint32_t kHousekeepingTurns = 64;

constexpr int kConnectMs = 4000;  // after a bus reset the kernel delays allocations by a second
constexpr std::chrono::milliseconds kFewCycles{2};

const omni::CommandBytes kNeutral = encode(OmniCommand{});

}  // namespace

FirewirePort::FirewirePort(const FirewireOptions& options, int patience_ms,
                           const std::atomic<bool>& stop)
    : options_(options) {
  find(options, patience_ms, stop);
  connect(stop);
}

FirewirePort::~FirewirePort() {
  transmitter_.send(transmitted_, kNeutral);
  // The packet leaves before the device gets the command to stop.
  std::this_thread::sleep_for(kFewCycles);
  if (const auto control = requests_.read_byte(kControl)) {
    requests_.write(kControl, static_cast<std::uint8_t>(*control & ~kStreams), 0);
    static_cast<void>(requests_.ready(kFirewireAnswerMs));
  }
  receiver_.stop(received_);
  transmitter_.stop(transmitted_);
  // Closing frees channels and bandwidth.
}

void FirewirePort::find(const FirewireOptions& options, int patience_ms,
                        const std::atomic<bool>& stop) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  for (;;) {
    try {
      device_ = find_firewire(options);
      return;
    } catch (const std::runtime_error&) {
      if (stop || std::chrono::steady_clock::now() >= give_up) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

void FirewirePort::connect(const std::atomic<bool>& stop) {
  const std::string location = "--port fw: " + device_.path + ": ";
  if (const int error = requests_.open(device_.path); error != 0) {
    throw std::runtime_error(location + std::generic_category().message(error) +
                             "; give your user the right to it");
  }
  const auto control = requests_.read_byte(kControl);
  if (!control) {
    throw std::runtime_error(location +
                             "the device does not answer; unplug it and plug it in again");
  }
  control_ = *control;
  claim();
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(kConnectMs);
  while (state_ != State::streaming) {
    if (closed_ || stop || std::chrono::steady_clock::now() >= give_up) {
      throw std::runtime_error(location +
                               (state_ == State::claiming
                                    ? "no channel or bandwidth; end what uses the bus"
                                    : "no stream starts; unplug the device and try again"));
    }
    static_cast<void>(requests_.ready(10));
    tend();
  }
}

// ---- every tick ----

std::size_t FirewirePort::receive(std::span<std::uint8_t> out) noexcept {
  while (!closed_.load(std::memory_order_relaxed)) {
    if (const auto packet = receiver_.next(); packet.size > 0) {
      turns_ = state_ == State::streaming ? 0 : turns_;
      std::copy_n(packet.bytes.begin(), std::min(packet.bytes.size(), out.size()), out.begin());
      return packet.size;
    }
    if (!flushed_) turn();
    if (!received_.ready(0)) {
      flushed_ = false;
      close_if_gone();
      return 0;
    }
    hear(received_.read(event_));
  }
  return 0;
}

/// Once a tick: repairs the link, and lets the kernel flush received packets.
void FirewirePort::turn() noexcept {
  tend();
  if (transmitter_.due()) read_transmitted();
  receiver_.turn(received_);
  flushed_ = true;
}

bool FirewirePort::wait(int milliseconds) noexcept {
  if (closed_ || receiver_.has_packets()) return !closed_;
  if (!flushed_) turn();
  const bool ready = received_.ready(milliseconds);
  close_if_gone();
  return ready;
}

std::vector<LinkCounter> FirewirePort::counters() const {
  return {{"bus_resets", stats_.resets},
          {"armings", stats_.armings},
          {"reclaims", stats_.reclaims},
          {"misqueued", misqueued()}};
}

bool FirewirePort::send(std::span<const std::uint8_t> packet) noexcept {
  if (transmitted_.gone()) return false;
  if (muted_.load(std::memory_order_relaxed)) packet = kNeutral;
  int skips = 0;
  if (options_.fill) {
    const int period = omni::kBusCyclesPerSecond / options_.rate_hz;
    skips = transmitter_.wanted_skips(receiver_.newest_cycle(), period);
  }
  if (transmitter_.send(transmitted_, packet, skips)) return true;
  misqueued_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void FirewirePort::close_if_gone() noexcept {
  if (received_.gone() || requests_.gone()) closed_ = true;
}

// ---- the link ----

/// One step towards a stream; nothing to do while it streams.
void FirewirePort::tend() noexcept {
  ++turns_;
  if (state_ != State::streaming || ++quiet_turns_ % kHousekeepingTurns == 0) read_requests();
  close_if_gone();
  switch (state_) {
    case State::claiming:
      if (!refused_ && listen_.channel >= 0 && talk_.channel >= 0 && open_streams()) {
        arm();
      } else if (refused_ && turns_ >= kRetryTicks) {
        yield();
        claim();
      }
      break;
    case State::arming:
      if (answers_ == writes_) {
        state_ = State::streaming;
        muted_ = false;
        turns_ = 0;
      } else if (stale_ || turns_ >= kRetryTicks) {
        renew();
      }
      break;
    case State::streaming:
      if (turns_ >= kSilentTurns) renew();
      break;
    case State::yielding:
      if (turns_ >= kYieldTurns) {
        yield();
        claim();
      }
      break;
  }
}

/// Requests two channels and their bandwidth; the answers come as events.
void FirewirePort::claim() noexcept {
  state_ = State::claiming;
  turns_ = 0;
  const auto listen = requests_.claim(kListen, omni::kReportBytes);
  const auto talk = requests_.claim(kTalk, omni::kCommandBytes);
  refused_ = !listen || !talk;
  listen_ = listen.value_or(FirewireClaim{});
  talk_ = talk.value_or(FirewireClaim{});
}

/// Stops the streams and releases the remaining channels.
void FirewirePort::yield() noexcept {
  receiver_.stop(received_);
  transmitter_.stop(transmitted_);
  if (listen_.channel >= 0) requests_.give_back(listen_);
  if (talk_.channel >= 0) requests_.give_back(talk_);
  listen_ = talk_ = {};
}

/// An isochronous context is freed only when its file is closed, so both files are reopened.
bool FirewirePort::open_streams() noexcept {
  refused_ = true;  // until all steps succeed
  for (FirewireFile* file : {&received_, &transmitted_}) {
    if (file->open(device_.path) != 0 || !file->link()) return false;
  }
  if (receiver_.prepare(received_, listen_.channel) < 0) return false;
  if (transmitter_.start(transmitted_, talk_.channel, kNeutral) < 0) return false;
  refused_ = false;
  return true;
}

/// Sends the device its channels, and the command to stream.
void FirewirePort::arm() noexcept {
  state_ = State::arming;
  ++stats_.armings;
  ++batch_;
  turns_ = answers_ = writes_ = 0;
  stale_ = false;
  const auto tell = [this](std::uint64_t offset, std::span<const std::uint8_t> bytes) {
    requests_.write(offset, bytes, batch_);
    ++writes_;
  };
  const auto tell_byte = [&tell](std::uint64_t offset, int value) {
    const auto byte = static_cast<std::uint8_t>(value);
    tell(offset, {&byte, 1});
  };
  tell_byte(kHostTalksOn, talk_.channel);
  tell_byte(kDeviceTalksOn, listen_.channel);
  if (options_.write_20010) tell(kMode20010, kModeBytes);
  tell_byte(kControl, control_ | kStreams);
}

/// Arms in the current generation, whose event may come half a second later.
void FirewirePort::renew() noexcept {
  requests_.refresh();
  arm();
}

// ---- events of the kernel: received packets, bus resets, answers, resources ----

void FirewirePort::read_requests() noexcept {
  while (requests_.ready(0)) {
    const auto event = requests_.event();
    if (event.empty()) return;
    hear(event);
  }
}

void FirewirePort::read_transmitted() noexcept {
  transmitter_.drained();
  while (transmitted_.ready(0)) {
    const auto event = transmitted_.read(sent_event_);
    if (event.empty()) return;
    if (event_as<fw_cdev_event_common>(event).type == FW_CDEV_EVENT_ISO_INTERRUPT) {
      transmitter_.take(event);
    } else {
      hear(event);
    }
  }
}

void FirewirePort::hear(std::span<const std::uint8_t> event) noexcept {
  if (event.size() < sizeof(std::uint64_t) + sizeof(std::uint32_t)) return;
  switch (event_as<fw_cdev_event_common>(event).type) {
    case FW_CDEV_EVENT_ISO_INTERRUPT:
      return receiver_.take(event);
    case FW_CDEV_EVENT_BUS_RESET:
      return hear_reset(event_as<fw_cdev_event_bus_reset>(event).generation);
    case FW_CDEV_EVENT_RESPONSE:
      return hear_response(event);
    case FW_CDEV_EVENT_ISO_RESOURCE_ALLOCATED:
      return hear_resource(event, true);
    case FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED:
      return hear_resource(event, false);
    default:
      return;
  }
}

/// Each open reports the same reset; the first one counts.
void FirewirePort::hear_reset(std::uint32_t generation) noexcept {
  if (generation == requests_.generation()) return;
  ++stats_.resets;
  requests_.set_generation(generation);
  if (state_ == State::streaming || state_ == State::arming) arm();
}

void FirewirePort::hear_response(std::span<const std::uint8_t> event) noexcept {
  const auto response = event_as<fw_cdev_event_response>(event);
  if (state_ != State::arming || response.closure != batch_) return;
  if (response.rcode == RCODE_COMPLETE) ++answers_;
  // Any other answer is tried again later: a device may be busy, or away for a moment.
  if (response.rcode == RCODE_GENERATION && requests_.refresh()) stale_ = true;
}

void FirewirePort::hear_resource(std::span<const std::uint8_t> event, bool allocated) noexcept {
  const auto resource = event_as<fw_cdev_event_iso_resource>(event);
  FirewireClaim& claim = resource.closure == kListen ? listen_ : talk_;
  if (claim.handle != resource.handle) {  // of an earlier claim, which is void
    if (allocated && resource.channel >= 0) requests_.give_back({resource.handle, -1});
    return;
  }
  if (allocated) {
    claim.channel = resource.channel;
    refused_ = refused_ || resource.channel < 0;
    return;
  }
  if (resource.channel >= 0) return;  // released by this port
  claim.channel = -1;
  ++stats_.reclaims;
  muted_ = true;
  state_ = State::yielding;
  turns_ = 0;
}

}  // namespace kerf
