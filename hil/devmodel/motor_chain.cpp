// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/motor_chain.hpp"

#include <algorithm>
#include <cmath>

#include "hil/devmodel/bus_cycle.hpp"

namespace kerf {

MotorChain::MotorChain(const PlantParams& params) noexcept
    : on_silence_(params.on_silence),
      silence_cycles_(params.silence_cycles),
      delay_(static_cast<std::size_t>(
          std::clamp(params.output_delay_cycles, 0, kMaxOutputDelayCycles))),
      lag_decay_(params.current_lag_s > 0 ? std::exp(-kStepS / params.current_lag_s) : 0.0) {}

void MotorChain::command(JointVec<double> torque_nmm) noexcept {
  wanted_nmm_ = torque_nmm;
  cycles_since_command_ = 0;
}

void MotorChain::begin_cycle() noexcept {
  const bool dropped = silent() && on_silence_ == OnSilence::drop_torque;
  delay_head_ = (delay_head_ + 1) % delayed_nmm_.size();
  delayed_nmm_[delay_head_] = dropped ? JointVec<double>{} : wanted_nmm_;
  applied_nmm_ = delayed_nmm_[(delay_head_ + delayed_nmm_.size() - delay_) % delayed_nmm_.size()];
  cycles_since_command_ = std::min(cycles_since_command_ + 1, silence_cycles_ + 1);
}

}  // namespace kerf
