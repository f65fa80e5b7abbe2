// SPDX-License-Identifier: Apache-2.0
#include "hil/emulator.hpp"

#include <algorithm>

namespace kerf {
namespace {

constexpr std::int64_t kSettleCycles = omni::kBusCyclesPerSecond / 5;    // 0.2 s after calibration
constexpr std::int64_t kPatienceCycles = 2 * omni::kBusCyclesPerSecond;  // hosts that never show it

}  // namespace

Emulator::Emulator(const OmniParams& params, const std::optional<HandScript>& script,
                   const EmulatorFaults& faults)
    : model_(params), faults_(faults) {
  if (script) hand_.emplace(*script, model_.dock_tip_mm());
}

void Emulator::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto command = decode_command(packet);
  if (!command) {
    ++stats_.refused;
    return;
  }
  ++stats_.commands;
  model_.command(*command);
}

void Emulator::let_hand_leave() noexcept {
  const bool calibrated = model_.motors_on() || model_.light() == OmniCommand::Light::steady;
  if (calibrated && !calibrated_at_) calibrated_at_ = stats_.cycles;
  const bool settled = calibrated_at_ && stats_.cycles - *calibrated_at_ >= kSettleCycles;
  if (settled || stats_.cycles >= kPatienceCycles) hand_->leave();
}

void Emulator::advance(int cycles) noexcept {
  for (int i = 0; i < cycles; ++i) {
    if (hand_ && !hand_->left()) let_hand_leave();
    model_.step(hand_ ? hand_->next() : HandGoal{});
    ++stats_.cycles;
    stats_.peak_motor_force_n = std::max(stats_.peak_motor_force_n, norm(model_.motor_force_n()));
    if (!model_.docked() && !stats_.undocked_at) stats_.undocked_at = stats_.cycles;
  }
}

std::span<const std::uint8_t> Emulator::next_packet() noexcept {
  const OmniReport report = model_.next_report();
  const bool lost = faults_.drop_every > 0 && report.counter % faults_.drop_every == 0;
  const bool silent = faults_.silent_after > 0 && stats_.cycles > faults_.silent_after;
  if (lost || silent) {
    ++stats_.withheld;
    return {};
  }
  ++stats_.reports;
  packet_ = encode(report);
  for (const std::uint8_t byte : packet_) {
    stats_.report_hash = (stats_.report_hash ^ byte) * 0x0000'0100'0000'01B3;
  }
  return packet_;
}

}  // namespace kerf
