// SPDX-License-Identifier: Apache-2.0
#include "hil/device/wooden.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

/// The pose of the home counts: A = B = 0, forearm level.
constexpr JointVec<double> kHomeRad{0, 0, std::numbers::pi / 2};

}  // namespace

WoodenModel::WoodenModel(const WoodenParams& params)
    : params_(params), plant_(WoodenArm{}, params, kHomeRad) {
  const auto turned = turned_counts();
  for (std::size_t i = 0; i < 6; ++i) {
    zero_count_[i] = params.power_up_count[i] - static_cast<int>(std::floor(turned[i]));
  }
}

std::array<double, 6> WoodenModel::turned_counts() const noexcept {
  const JointVec<double> q = plant_.encoder_rad();
  const auto& sign = params_.encoder_sign;
  return {sign[0] * q.x / wooden::kRadPerCount[0],
          sign[1] * q.y / wooden::kRadPerCount[1],
          sign[2] * q.z / wooden::kRadPerCount[2],
          0,
          0,
          0};
}

bool WoodenModel::receive(std::span<const std::uint8_t> packet) noexcept {
  if (packet.size() != params_.packet_bytes) return false;
  const auto decoded = wooden::decode_command(packet);
  if (decoded) command(*decoded);
  return decoded.has_value();
}

void WoodenModel::command(const WoodenCommand& command) noexcept {
  streaming_ = true;
  const auto torque = [&](std::size_t i) {
    constexpr int kMax = wooden::kAmplifierMilliamps;
    return std::clamp<int>(command.milliamps[i], -kMax, kMax) * params_.encoder_sign[i] *
           params_.torque_nmm_per_count[i];
  };
  if (!command.set_encoders) {
    plant_.motors().command({torque(0), torque(1), torque(2)});
    return;
  }
  plant_.motors().command({});
  const auto turned = turned_counts();
  for (std::size_t i = 0; i < 6; ++i) {
    zero_count_[i] = (*command.set_encoders)[i] - static_cast<int>(std::floor(turned[i]));
  }
  button_flag_ = false;
  calibrated_ = true;
}

void WoodenModel::step(const HandGoal& hand) noexcept {
  button1_ = hand.button1;
  if (hand.calibrate && !button_held_) button_flag_ = true;
  button_held_ = hand.calibrate;
  plant_.cycle(hand);
  if (frames_.step()) due_ = streaming_;
}

bool WoodenModel::motors_on() const noexcept {
  return streaming_ && !plant_.motors().silent();
}

Calibration WoodenModel::calibration() const noexcept {
  if (calibrated_) return Calibration::done;
  return streaming_ ? Calibration::needs_hand : Calibration::not_begun;
}

HandRoute WoodenModel::route() const {
  // The rest pose is 0.2 m above the workpiece: straight down.
  return {.rest_tip_mm = plant_.rest().tip_mm,
          .calibration = {},
          .detour = {},
          .hand_rad_per_s = params().hand_rad_per_s()};
}

WoodenReport WoodenModel::report() const noexcept {
  const auto turned = turned_counts();
  WoodenReport report;
  for (std::size_t i = 0; i < 6; ++i) {
    report.encoder[i] = encoder_count(zero_count_[i], turned[i]);
  }
  if (params_.wireless_button && button1_) {
    report.encoder[3] = static_cast<std::int16_t>(report.encoder[3] + wooden::kButtonCounts);
  }
  report.calibrate = button_flag_;
  return report;
}

std::span<const std::uint8_t> WoodenModel::next_packet() noexcept {
  if (!due_) return {};
  due_ = false;
  packet_ = encode(report());
  return std::span<const std::uint8_t>(packet_).first(params_.packet_bytes);
}

}  // namespace kerf
