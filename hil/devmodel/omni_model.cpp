// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/omni_model.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

/// Wiper A of a gimbal angle; wiper B is the rest to 2^16. Angles beyond the pot stay at its end.
constexpr int kPotTurn = 1 << 16;
int wiper_count(std::size_t axis, double angle_rad) noexcept {
  const double ratio = (angle_rad - omni::kGimbalOffsetRad[axis]) / omni::kGimbalSlopeRad[axis];
  return std::clamp(static_cast<int>(std::floor(ratio * kPotTurn + 0.5)), 1, kPotTurn - 1);
}

}  // namespace

OmniModel::OmniModel(const OmniParams& params)
    : params_(params),
      plant_(OmniArm(params.links), params,
             {params.dock_rad[0], params.dock_rad[1], params.dock_rad[2]}),
      noise_(params.seed) {}

bool OmniModel::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto decoded = decode_command(packet);
  if (decoded) command(*decoded);
  return decoded.has_value();
}

void OmniModel::command(const OmniCommand& command) noexcept {
  command_ = command;
  const auto torque = [&](std::size_t i) {
    return command.motors_on ? command.motor[i] * params_.torque_nmm_per_count[i] : 0.0;
  };
  plant_.motors().command({torque(0), torque(1), torque(2)});
}

void OmniModel::step(const HandGoal& hand) noexcept {
  orientation_rad_ = hand.orientation_rad;
  button1_ = hand.button1;
  button2_ = hand.button2;
  plant_.cycle(hand);
}

Calibration OmniModel::calibration() const noexcept {
  const bool done = command_.motors_on || command_.light == OmniCommand::Light::steady;
  return done ? Calibration::done : Calibration::not_begun;
}

HandRoute OmniModel::route() const {
  // All of it is inside the elbow's limits, and behind the workpiece.
  return {.rest_tip_mm = dock_tip_mm(),
          .calibration = {},
          .detour = HandRoute::Detour{.lift_mm = 25, .y_mm = 15, .z_mm = -60},
          .hand_rad_per_s = params().hand_rad_per_s()};
}

std::uint16_t OmniModel::noisy(std::uint16_t pot) noexcept {
  if (!params_.pot_noise) return pot;
  constexpr std::uint32_t kNoiseMask = (1u << omni::kPotNoiseBits) - 1;
  return static_cast<std::uint16_t>((pot & ~kNoiseMask) | (noise_() & kNoiseMask));
}

OmniReport OmniModel::next_report() noexcept {
  const JointVec<double> seen = plant_.encoder_rad();
  const JointVec<double>& dock = plant_.rest().q;
  const std::array<double, 3> turned{seen.x - dock.x, seen.y - dock.y, seen.z - dock.z};
  const std::array<double, 3> gimbal{orientation_rad_[0], plant_.link_rad().z + orientation_rad_[1],
                                     orientation_rad_[2]};
  OmniReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    report.encoder[i] = encoder_count(params_.encoder_offset[i],
                                      omni::kEncoderSign[i] * turned[i] / omni::kRadPerCount);
    const int wiper = wiper_count(i, gimbal[i]);
    report.pot_a[i] = noisy(static_cast<std::uint16_t>(wiper));
    report.pot_b[i] = noisy(static_cast<std::uint16_t>(kPotTurn - wiper));
  }
  report.button1 = button1_;
  report.button2 = button2_;
  report.docked = docked();
  report.counter = ++packets_;
  return report;
}

std::span<const std::uint8_t> OmniModel::next_packet() noexcept {
  packet_ = encode(next_report());
  return packet_;
}

}  // namespace kerf
