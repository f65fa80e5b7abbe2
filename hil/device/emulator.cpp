// SPDX-License-Identifier: Apache-2.0
#include "hil/device/emulator.hpp"

#include <algorithm>

#include "shared/numeric/fnv1a.hpp"
#include "shared/numeric/quick_elementary.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kSettleCycles = kCyclesPerSecond / 20;  // 50 ms after calibration
constexpr std::int64_t kPatienceCycles =
    std::int64_t{2} * kCyclesPerSecond;  // hosts that never show it

}  // namespace

void Emulator::receive(std::span<const std::uint8_t> packet) noexcept {
  ++(model_->receive(packet) ? stats_.commands : stats_.refused);
}

void Emulator::guide_hand() noexcept {
  const Calibration calibration = model_->calibration();
  if (calibration == Calibration::needs_hand) hand_->calibrate();
  if (calibration == Calibration::done && !calibrated_at_) calibrated_at_ = stats_.cycles;
  const bool settled = calibrated_at_ && stats_.cycles - *calibrated_at_ >= kSettleCycles;
  if (!host_since_ && stats_.commands + stats_.reports > 0) host_since_ = stats_.cycles;
  const bool waited_enough = calibration != Calibration::needs_hand && host_since_ &&
                             stats_.cycles - *host_since_ >= kPatienceCycles;
  if (settled || waited_enough) hand_->leave();
}

void Emulator::set_target(const HandTarget& target) noexcept {
  if (led_) led_->set_target(target);
}

void Emulator::release() noexcept {
  if (led_) led_->release();
}

HandGoal Emulator::next_goal() noexcept {
  if (!hand_) return {};
  if (led_ && led_->parked()) {
    led_->restart();
    hand_->rest();
  }
  if (!hand_->left()) guide_hand();
  HandGoal goal = hand_->next();
  if (!accepts_target()) return goal;
  if (led_) goal = led_->next(goal, model_->tip_mm());
  if (!shake_) return goal;
  const double angle = shake_->rad_per_cycle * static_cast<double>(++shaken_);
  goal.target_mm = goal.target_mm + shake_->cosine_mm * quick::cosine(angle) +
                   shake_->sine_mm * quick::sine(angle);
  return goal;
}

void Emulator::advance(int cycles) noexcept {
  asked_ = false;
  for (int i = 0; i < cycles; ++i) {
    model_->step(next_goal());
    ++stats_.cycles;
    const DeviceVec<double> force_n = model_->motor_force_n();
    stats_.peak_motor_force_n = std::max(stats_.peak_motor_force_n, norm(force_n));
    stats_.square_sum_n2 += dot(force_n, force_n);
    stats_.motor_work_mj = model_->state().motor_work_mj;
    if (!model_->docked() && !stats_.undocked_at) stats_.undocked_at = stats_.cycles;
  }
}

std::span<const std::uint8_t> Emulator::next_packet() noexcept {
  if (asked_) return {};
  asked_ = true;
  const std::span<const std::uint8_t> packet = model_->next_packet();
  if (packet.empty()) return {};
  ++stats_.reports;
  for (const std::uint8_t byte : packet) {
    stats_.report_hash = fnv1a_step(stats_.report_hash, byte);
  }
  return packet;
}

}  // namespace kerf
