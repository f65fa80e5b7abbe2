// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "shared/numeric/vec.hpp"
#include "shared/wire/falcon_constants.hpp"

namespace kerf {

/// Homing of the Falcon's three legs: the user pulls the grip out, then pushes it in, while the
/// host asks for homing in every packet. One without that bit begins all over for the legs that are
/// not homed yet; a homed leg stays so.
///
/// At which angles a real device recognises both ends is not known; these are passed by a pull of
/// 35 mm and a push of 35 mm, 20 mm above the middle of the workspace.
class FalconHoming {
 public:
  static constexpr double kPulledOutRad = 40.0 * falcon::kRadPerDegree;
  static constexpr double kPushedInRad = 18.0 * falcon::kRadPerDegree;

  /// A packet of the host came.
  void packet(bool asks_for_homing) noexcept {
    asked_ = asks_for_homing;
    if (!asked_) pulled_out_ = {};
  }
  /// The legs stand at these angles now.
  void watch(JointVec<double> q) noexcept {
    if (!asked_) return;
    const std::array<double, 3> angle{q.x, q.y, q.z};
    for (std::size_t i = 0; i < 3; ++i) {
      if (angle[i] > kPulledOutRad) pulled_out_[i] = true;
      if (pulled_out_[i] && angle[i] < kPushedInRad) homed_[i] = true;
    }
  }

  [[nodiscard]] bool asked() const noexcept { return asked_; }
  [[nodiscard]] const std::array<bool, 3>& homed() const noexcept { return homed_; }
  [[nodiscard]] bool complete() const noexcept { return homed_[0] && homed_[1] && homed_[2]; }

 private:
  bool asked_ = false;
  std::array<bool, 3> pulled_out_{};
  std::array<bool, 3> homed_{};
};

}  // namespace kerf
