// SPDX-License-Identifier: Apache-2.0
#include "controller/device/driver/wooden_driver.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "shared/wire/wooden_packet.hpp"

namespace kerf {
namespace {

constexpr int kHomeCounts = 40;        // 10 mrad: a hand holds the pose that still
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
  // Wraps at 16 bits, as counts do.
  for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<std::int16_t>(sign_[i] * counts[i]);
  return out;
}

bool WoodenDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = wooden::decode_report(packet);
  if (!said) return false;
  packet_bytes_.store(packet.size(), std::memory_order_relaxed);
  button_ = said->calibrate;
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
  report.encoder = joints_;
  report.button1 = wooden::wireless_button(said->encoder[3]);
  report.parked = button_ || set_sent_ || at_home_;
  report.homed = homed_;
  ++report.counter;
  return true;
}

std::size_t WoodenDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  WoodenCommand command{.milliamps = turned(output.motor_counts), .set_encoders = {}};
  if (button_) {
    // Setting them is also what makes the device let go of the button.
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

}  // namespace kerf
