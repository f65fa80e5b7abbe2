// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "hil/devmodel/plant_params.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// The joints of one moment.
struct JointReadings {
  JointVec<double> encoder_rad;  ///< as the encoders see them
  JointVec<double> link_rad;
};

/// Input delay of a device: what it reports of its joints is some bus cycles old. One thread; never
/// allocates.
class ReportedJoints {
 public:
  ReportedJoints(int delay_cycles, JointVec<double> rest_rad) noexcept
      : delay_(static_cast<std::size_t>(std::clamp(delay_cycles, 0, kMaxDelayCycles))) {
    ring_.fill({rest_rad, rest_rad});
  }

  /// At the end of each cycle.
  void take(const JointReadings& now) noexcept {
    head_ = (head_ + 1) % ring_.size();
    ring_[head_] = now;
  }

  /// What a report tells; `now` where there is no delay.
  [[nodiscard]] JointVec<double> old_or(JointVec<double> JointReadings::*which,
                                        JointVec<double> now) const noexcept {
    return delay_ == 0 ? now : ring_[(head_ + ring_.size() - delay_) % ring_.size()].*which;
  }

 private:
  std::size_t delay_;
  std::array<JointReadings, kMaxDelayCycles + 1> ring_;
  std::size_t head_ = 0;
};

}  // namespace kerf
