// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "hil/devmodel/bus_cycle.hpp"
#include "hil/devmodel/plant_params.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// From a command to the torque at the motors: silence of the host, output delay in whole cycles,
/// first-order lag of the current loop. One thread; never allocates.
class MotorChain {
 public:
  explicit MotorChain(const PlantParams& params) noexcept;

  /// Torques that a packet of the host asks for, N mm; they act from the next cycle on.
  void command(JointVec<double> torque_nmm) noexcept;
  /// One bus cycle begins.
  void begin_cycle() noexcept;
  /// Torque during the next step of it.
  [[nodiscard]] JointVec<double> step() noexcept {
    torque_nmm_ = applied_nmm_ + (torque_nmm_ - applied_nmm_) * lag_decay_;
    return torque_nmm_;
  }
  /// Whether no packet came for so long that the device counts the host as gone.
  [[nodiscard]] bool silent() const noexcept { return cycles_since_command_ > silence_cycles_; }

 private:
  OnSilence on_silence_;
  int silence_cycles_;
  std::size_t delay_;
  double lag_decay_;
  JointVec<double> wanted_nmm_;
  JointVec<double> applied_nmm_;
  JointVec<double> torque_nmm_;
  int cycles_since_command_ = 0;
  std::array<JointVec<double>, kMaxDelayCycles + 1> delayed_nmm_{};
  std::size_t delay_head_ = 0;
};

inline MotorChain::MotorChain(const PlantParams& params) noexcept
    : on_silence_(params.on_silence),
      silence_cycles_(params.silence_cycles),
      delay_(static_cast<std::size_t>(std::clamp(params.output_delay_cycles, 0, kMaxDelayCycles))),
      lag_decay_(params.current_lag_s > 0 ? std::exp(-kStepS / params.current_lag_s) : 0.0) {}

inline void MotorChain::command(JointVec<double> torque_nmm) noexcept {
  wanted_nmm_ = torque_nmm;
  cycles_since_command_ = 0;
}

inline void MotorChain::begin_cycle() noexcept {
  const bool dropped = silent() && on_silence_ == OnSilence::drop_torque;
  delay_head_ = (delay_head_ + 1) % delayed_nmm_.size();
  delayed_nmm_[delay_head_] = dropped ? JointVec<double>{} : wanted_nmm_;
  applied_nmm_ = delayed_nmm_[(delay_head_ + delayed_nmm_.size() - delay_) % delayed_nmm_.size()];
  cycles_since_command_ = std::min(cycles_since_command_ + 1, silence_cycles_ + 1);
}

}  // namespace kerf
