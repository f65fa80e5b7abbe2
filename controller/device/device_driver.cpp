// SPDX-License-Identifier: Apache-2.0
#include "controller/device/device_driver.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf {

namespace {

bool pushes(const ServoOutput& sent) noexcept {
  return sent.motors_on &&
         std::ranges::any_of(sent.dac_counts, [](std::int16_t count) { return count != 0; });
}

}  // namespace

DeviceReport DeviceDriver::read() noexcept {
  const DeviceReport before = last_;
  last_.fresh = false;
  std::array<std::uint8_t, kMaxPacketBytes + 1> packet;  // one byte more, to detect a longer packet
  for (int taken = 0; taken < kMaxDrain; ++taken) {
    const std::size_t size = port_.receive(packet);
    if (size == 0) break;
    if (size <= kMaxPacketBytes && take(std::span(packet).first(size), last_)) {
      last_.fresh = true;
    } else {
      ++refused_;
    }
  }
  if (port_.closed()) released_.store(true);
  if (!are_numbered()) follow_change(before);
  silent_reads_ = last_.fresh ? 0 : silent_reads_ + (silent_reads_ < UINT32_MAX ? 1U : 0U);
  return last_;
}

/// Only the position counts: gimbal and buttons have sensors of their own, which may go on without
/// it. Once it counts as standing still, that lasts while the force fades too.
void DeviceDriver::follow_change(const DeviceReport& before) noexcept {
  const bool changed = last_.fresh && last_.counts != before.counts;
  const bool is_still = still_reads_ >= most_still_reads_;
  if (changed || !(pushing_ || (forcing_ && is_still))) {
    still_reads_ = 0;
  } else if (!is_still) {
    ++still_reads_;
  } else if (last_.fresh) {
    last_.fresh = false;
    ++refused_;
  }
}

void DeviceDriver::command(const ServoOutput& output) noexcept {
  ServoOutput allowed = output;
  if (released_.load(std::memory_order_relaxed)) allowed.motors_on = false;
  if (!allowed.motors_on) allowed.dac_counts = {};
  Packet packet;
  const std::size_t size = compose(allowed, packet);
  const bool lets_go = forcing_ && !allowed.motors_on;
  if (lets_go) {
    port_.send_now(std::span(packet).first(size));
  } else {
    port_.send(std::span(packet).first(size));
  }
  forcing_ = allowed.motors_on;
  pushing_ = pushes(allowed);
  if (forcing_ && released_.load()) release();  // set meanwhile by another thread
}

bool DeviceDriver::release() const noexcept {
  Packet packet;
  const std::size_t size = compose_release(packet);
  return port_.send_now(std::span(packet).first(size));
}

bool DeviceDriver::stay_released() noexcept {
  released_.store(true);
  return release();
}

bool DeviceDriver::release_for_good() noexcept {
  released_.store(true);
  Packet packet;
  const std::size_t size = compose_release(packet);
  return port_.send_last(std::span(packet).first(size));
}

// Falcon.

bool FalconDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = falcon::decode_report(packet);
  if (!said) return false;
  homed_ = std::ranges::all_of(said->homed, [](bool homed) { return homed; });
  report.counts = said->encoder;
  report.button1 = (said->buttons & falcon::kButtonForward) != 0;
  report.button2 = (said->buttons & falcon::kButtonPlus) != 0;
  report.parked = (said->buttons & falcon::kButtonCentre) != 0;
  report.homed = homed_;
  ++report.counter;
  return true;
}

std::size_t FalconDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  const bool asks = output.phase == Phase::off || output.phase == Phase::calibrating;
  const bool fault = output.phase == Phase::fault;
  const auto bytes = encode(FalconCommand{.motor = output.dac_counts,
                                          .homing = !homed_,
                                          .green = !asks && !fault,
                                          .blue = asks,
                                          .red = fault});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

std::size_t FalconDriver::compose_release(Packet& packet) const noexcept {
  const auto bytes = encode(FalconCommand{});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

// Omni.

namespace {

OmniCommand::Light light_of(Phase phase) noexcept {
  switch (phase) {
    case Phase::off:
    case Phase::calibrating:
      return OmniCommand::Light::slow_flash;
    case Phase::fault:
      return OmniCommand::Light::fast_flash;
    case Phase::armed:
    case Phase::ramping:
    case Phase::active:
      return OmniCommand::Light::steady;
  }
  return OmniCommand::Light::off;
}

// Packets in 20 ms of an 8 kHz stream, after which the force is off in any case: one more packet
// costs nothing then. And ticks in 20 ms of the fastest servo.
constexpr std::uint32_t kNear = 160;
// Packets in 2 s of it, after which the controller gives the device up: more cannot be missing.
constexpr std::uint32_t kMostMissing = 16'000;

}  // namespace

bool PacketNumbers::is_newest(std::uint32_t counter, std::uint32_t silent_reads) noexcept {
  const std::uint32_t step = counter - newest_;
  if (seen_) {
    const bool is_ahead = step - 1 < kMostMissing;
    if (step - 1 < kNear) {
      missing_ += step - 1;
    } else {
      const bool goes_on = refused_counter_ && counter - *refused_counter_ - 1 < kNear;
      refused_counter_ = counter;
      if (!goes_on || !(is_ahead || silent_reads >= kNear)) return false;
      if (is_ahead) missing_ += step - 2;  // the refused one came
    }
  }
  refused_counter_.reset();
  seen_ = true;
  newest_ = counter;
  return true;
}

bool OmniDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = decode_report(packet);
  if (!said) return false;
  if (!numbers_.is_newest(said->counter, silent_reads_)) return false;
  lost_ = numbers_.missing();
  report.counts = said->encoder;
  report.wiper_a = said->pot_a;
  report.wiper_b = said->pot_b;
  report.button1 = said->button1;
  report.button2 = said->button2;
  report.parked = said->docked;
  report.counter = said->counter;
  return true;
}

std::size_t OmniDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  const auto bytes = encode(OmniCommand{
      .motor = output.dac_counts, .motors_on = output.motors_on, .light = light_of(output.phase)});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

std::size_t OmniDriver::compose_release(Packet& packet) const noexcept {
  const auto bytes = encode(OmniCommand{});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

// Cartesian devices.

bool CartesianDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = decode_cartesian_report(packet);
  if (!said) return false;
  std::array<std::int16_t, 3> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    // To nearest, half away from zero.
    const int half = said->position_um[i] < 0 ? -step_um_ / 2 : step_um_ / 2;
    const int count = (said->position_um[i] + half) / step_um_;
    if (count < INT16_MIN || count > INT16_MAX) return false;
    counts[i] = static_cast<std::int16_t>(count);
  }
  if (!numbers_.is_newest(said->number, silent_reads_)) return false;
  lost_ = numbers_.missing();
  newest_ = said->number;
  report.kind = DeviceReport::Kind::pose;
  report.counts = counts;
  report.orientation = said->orientation;
  report.button1 = said->button1;
  report.button2 = said->button2;
  report.parked = said->parked;
  report.homed = said->homed && said->powered;
  report.counter = said->number;
  return true;
}

std::size_t CartesianDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  using Light = CartesianCommand::Light;
  const bool asks = output.phase == Phase::off || output.phase == Phase::calibrating;
  const Light light = output.phase == Phase::fault ? Light::fault
                      : asks                       ? Light::asks
                                                   : Light::ready;
  const auto bytes = encode(CartesianCommand{.force_mn = output.dac_counts,
                                             .force_on = output.motors_on,
                                             .light = light,
                                             .answers = newest_});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

std::size_t CartesianDriver::compose_release(Packet& packet) const noexcept {
  const auto bytes = encode(CartesianCommand{});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

// WoodenHaptics.

namespace {

constexpr int kHomeCounts = 40;        // 10 mrad: a hand holds the pose as still as that
constexpr int kFarFromHome = 20 * 40;  // 0.2 rad: not held by mistake

bool near_home(const std::array<std::int16_t, 3>& counts, int within) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(counts[i] - wooden::kHomeCounts[i]) > within) return false;
  }
  return true;
}

}  // namespace

WoodenDriver::Counts WoodenDriver::turned(const Counts& counts) const noexcept {
  Counts out;
  // Wraps at 16 bits, like counts.
  for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<std::int16_t>(sign_[i] * counts[i]);
  return out;
}

bool WoodenDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = wooden::decode_report(packet);
  if (!said) return false;
  if (seen_ && packet.size() != packet_bytes_.load(std::memory_order_relaxed)) return false;
  seen_ = true;
  packet_bytes_.store(packet.size(), std::memory_order_relaxed);
  button_ = said->calibrate;
  button_reports_ = button_ ? button_reports_ + 1 : 0;
  constexpr std::uint32_t kReportsPerSet = 64;
  set_due_ = button_ && (set_due_ || button_reports_ % kReportsPerSet == 1);
  counts_ = said->encoder;
  joints_ = turned({counts_[0], counts_[1], counts_[2]});
  const bool in_pose = near_home(joints_, kHomeCounts);
  if (button_) {
    homed_ = homed_ && !near_home(joints_, kFarFromHome);
  } else if (set_sent_ && in_pose) {
    homed_ = at_home_ = true;
    set_sent_ = false;
  }
  at_home_ = at_home_ && in_pose;
  report.counts = joints_;
  report.button1 = wooden::wireless_button(said->encoder[3]);
  report.parked = button_ || set_sent_ || at_home_;
  report.homed = homed_;
  ++report.counter;
  return true;
}

std::size_t WoodenDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  WoodenCommand command{.milliamps = turned(output.dac_counts), .set_encoders = {}};
  if (button_ && (!homed_ || set_due_)) {
    set_due_ = false;
    // The device also releases the button when its encoders are set.
    auto& counts = command.set_encoders.emplace(counts_);
    if (!homed_) {
      counts = {};
      std::ranges::copy(turned(wooden::kHomeCounts), counts.begin());
      set_sent_ = true;
    }
  }
  std::ranges::copy(encode(command), packet.begin());
  return packet_bytes_.load(std::memory_order_relaxed);
}

std::size_t WoodenDriver::compose_release(Packet& packet) const noexcept {
  std::ranges::copy(encode(WoodenCommand{}), packet.begin());
  return packet_bytes_.load(std::memory_order_relaxed);
}

namespace {

using EncoderSign = std::optional<std::array<double, 3>>;

template <class Driver>
std::unique_ptr<DeviceDriver> plain_driver(Personality, PacketPort& port, const EncoderSign&) {
  return std::make_unique<Driver>(port);
}

std::unique_ptr<DeviceDriver> wooden_driver(Personality, PacketPort& port,
                                            const EncoderSign& encoder_sign) {
  const auto sign = encoder_sign.value_or(std::array{1.0, 1.0, 1.0});
  return std::make_unique<WoodenDriver>(
      port, std::array{sign[0] < 0 ? -1 : 1, sign[1] < 0 ? -1 : 1, sign[2] < 0 ? -1 : 1});
}

std::unique_ptr<DeviceDriver> cartesian_driver(Personality personality, PacketPort& port,
                                               const EncoderSign&) {
  return std::make_unique<CartesianDriver>(port, cartesian::figures(personality)->step_um);
}

struct DriverKind {
  Personality personality;
  std::unique_ptr<DeviceDriver> (*make)(Personality, PacketPort&, const EncoderSign&);
};
constexpr std::array kDrivers{DriverKind{Personality::omni, plain_driver<OmniDriver>},
                              DriverKind{Personality::falcon, plain_driver<FalconDriver>},
                              DriverKind{Personality::woodenhaptics, wooden_driver},
                              DriverKind{Personality::inverse3, cartesian_driver},
                              DriverKind{Personality::touch, cartesian_driver},
                              DriverKind{Personality::omega, cartesian_driver}};
static_assert(covers_devices(kDrivers));

}  // namespace

std::unique_ptr<DeviceDriver> make_driver(Personality personality, PacketPort& port,
                                          const std::optional<std::array<double, 3>>& encoder_sign,
                                          int rate_hz) {
  auto driver = row_of(kDrivers, personality).make(personality, port, encoder_sign);
  driver->set_rate(rate_hz);
  return driver;
}

}  // namespace kerf
