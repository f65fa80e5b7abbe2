// SPDX-License-Identifier: Apache-2.0
#include "controller/device/wooden_driver.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "shared/wire/wooden_packet.hpp"

namespace kerf {
namespace {

constexpr int kHomeCounts = 40;  // 10 mrad: a hand holds the pose that still

bool in_home_pose(const WoodenReport& report) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(report.encoder[i] - wooden::kHomeCounts[i]) > kHomeCounts) return false;
  }
  return true;
}

}  // namespace

bool WoodenDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = wooden::decode_report(packet);
  if (!said) return false;
  packet_bytes_ = packet.size();
  button_ = said->calibrate;
  const bool near_home = in_home_pose(*said);
  if (button_) {
    homed_ = false;
  } else if (set_sent_ && near_home) {
    homed_ = at_home_ = true;
    set_sent_ = false;
  }
  at_home_ = at_home_ && near_home;
  std::copy_n(said->encoder.begin(), 3, report.encoder.begin());
  report.button1 = wooden::wireless_button(said->encoder[3]);
  report.parked = button_ || set_sent_ || at_home_;
  report.homed = homed_;
  ++report.counter;
  return true;
}

std::size_t WoodenDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  WoodenCommand command{.milliamps = output.motor_counts, .set_encoders = {}};
  if (button_) {
    const auto& home = wooden::kHomeCounts;
    command.set_encoders = {home[0], home[1], home[2], 0, 0, 0};
    set_sent_ = true;
  }
  std::ranges::copy(encode(command), packet.begin());
  return packet_bytes_;
}

std::size_t WoodenDriver::compose_release(Packet& packet) const noexcept {
  std::ranges::copy(encode(WoodenCommand{}), packet.begin());
  return packet_bytes_;
}

}  // namespace kerf
