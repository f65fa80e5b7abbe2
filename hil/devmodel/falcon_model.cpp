// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/falcon_model.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

/// Counts of the three legs, before they are quantised.
std::array<double, 3> counts_of(JointVec<double> q) noexcept {
  const auto count = [](double angle_rad) {
    return (angle_rad - falcon::kZeroRad) / falcon::kRadPerCount;
  };
  return {count(q.x), count(q.y), count(q.z)};
}

}  // namespace

FalconModel::FalconModel(const FalconParams& params)
    : params_(params), plant_(FalconArm{}, params, FalconArm{}.joints_rad(params.rest_tip_mm)) {
  const auto counts = counts_of(plant_.encoder_rad());
  for (std::size_t i = 0; i < 3; ++i) {
    power_up_count_[i] = static_cast<int>(std::floor(counts[i]));
  }
}

bool FalconModel::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto decoded = falcon::decode_command(packet);
  if (decoded) command(*decoded);
  return decoded.has_value();
}

void FalconModel::command(const FalconCommand& command) noexcept {
  const auto torque = [&](std::size_t i) {
    const int count =
        std::clamp<int>(command.motor[i], -falcon::kMotorCountMax, falcon::kMotorCountMax);
    return count * params_.torque_nmm_per_count[i];
  };
  plant_.motors().command({torque(0), torque(1), torque(2)});
  driven_ = command.motor != std::array<std::int16_t, 3>{};
  homing_.packet(command.homing);
  owed_ = std::min(owed_ + 1, kMaxOwed);
}

void FalconModel::step(const HandGoal& hand) noexcept {
  buttons_ = static_cast<std::uint8_t>((hand.button1 ? falcon::kButtonCentre : 0) |
                                       (hand.button2 ? falcon::kButtonForward : 0));
  plant_.cycle(hand);
  homing_.watch(plant_.encoder_rad());
  if (frames_.step()) due_ = owed_ > 0;
}

Calibration FalconModel::calibration() const noexcept {
  if (homing_.complete()) return Calibration::done;
  return homing_.asked() ? Calibration::needs_hand : Calibration::not_begun;
}

HandRoute FalconModel::route() const {
  // Out and in above the workpiece; then the centre button, for hosts that wait for it.
  HandStep press;
  press.seconds = 0.15;
  press.button = 1;
  return {.rest_tip_mm = plant_.rest().tip_mm,
          .calibration = {hand_move({0, 20, 35}, 0.2), hand_move({0, 20, -35}, 0.3), press},
          .detour = HandRoute::Detour{.lift_mm = 0, .y_mm = 20, .z_mm = -20},
          .hand_rad_per_s = params().hand_rad_per_s()};
}

FalconReport FalconModel::report() const noexcept {
  const auto counts = counts_of(plant_.encoder_rad());
  FalconReport report;
  report.homed = homing_.homed();
  for (std::size_t i = 0; i < 3; ++i) {
    report.encoder[i] = encoder_count(report.homed[i] ? 0 : -power_up_count_[i], counts[i]);
  }
  report.buttons = buttons_;
  return report;
}

std::span<const std::uint8_t> FalconModel::next_packet() noexcept {
  if (!due_) return {};
  due_ = false;
  --owed_;
  packet_ = encode(report());
  return packet_;
}

}  // namespace kerf
