// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hil/devmodel/hand_script.hpp"
#include "hil/devmodel/omni_model.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Where a scripted hand wants to be, bus cycle by bus cycle.
///
/// It rests in the inkwell until `leave`; then it goes straight up out of the inkwell, over a point
/// clear of the workpiece to the script's start (1.2 s in all), and through the script. Counts in
/// whole bus cycles, so that repeats never drift. One thread; allocates only when constructed.
class HandMotion {
 public:
  HandMotion(const HandScript& script, DeviceVec<double> dock_tip_mm);

  void leave() noexcept { left_ = true; }
  [[nodiscard]] bool left() const noexcept { return left_; }

  /// The wish for the next bus cycle.
  [[nodiscard]] HandGoal next() noexcept;

 private:
  /// A step in device mm and bus cycles.
  struct Leg {
    HandStep step;
    std::int64_t cycles;
  };

  void add(const HandStep& step, double unit_mm);
  [[nodiscard]] DeviceVec<double> position(const Leg& leg, double progress) const noexcept;
  void begin_next_leg() noexcept;

  std::vector<Leg> legs_;
  std::size_t repeat_from_ = 0;  ///< legs_.size(): no repeat
  std::size_t leg_ = 0;
  std::int64_t cycle_ = 0;
  bool left_ = false;
  DeviceVec<double> from_mm_;
  std::array<double, 3> from_orientation_rad_{};
};

}  // namespace kerf
