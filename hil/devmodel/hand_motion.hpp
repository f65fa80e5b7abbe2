// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hil/devmodel/hand_script.hpp"
#include "hil/devmodel/reach_curve.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Where a scripted hand wants to be, bus cycle by bus cycle.
///
/// It rests in the inkwell until `leave`; then it reaches for the script's start (`ReachCurve`) and
/// goes through the script. In between `calibrate` makes it do what the device's calibration needs.
/// Counts in whole bus cycles, so that repeats never drift. One thread; allocates only when
/// constructed.
class HandMotion {
 public:
  HandMotion(const HandScript& script, const HandRoute& route);

  /// Calibrates the device, again and again until it leaves.
  void calibrate() noexcept;
  void leave() noexcept;
  /// Rests again as at the begin, where it was brought: its way begins anew.
  void rest() noexcept;
  [[nodiscard]] bool left() const noexcept { return phase_ == Phase::left; }
  /// The way to the script's start is done.
  [[nodiscard]] bool arrived() const noexcept { return left() && leg_ > reach_; }
  /// The first point of the script.
  [[nodiscard]] DeviceVec<double> start_mm() const noexcept { return start_mm_; }
  /// It has done all, and stays where it is.
  [[nodiscard]] bool ended() const noexcept { return left() && leg_ == legs_.size(); }

  /// The wish for the next bus cycle.
  [[nodiscard]] HandGoal next() noexcept;

 private:
  enum class Phase : std::uint8_t { resting, calibrating, left };

  /// A step in device mm and bus cycles.
  struct Leg {
    HandStep step;
    std::int64_t cycles;
  };

  void add(const HandStep& step, double unit_mm);
  void begin_reach() noexcept;
  [[nodiscard]] DeviceVec<double> position(const Leg& leg, double progress) const noexcept;
  void begin_next_leg() noexcept;

  HandRoute route_;
  ReachCurve way_;
  std::vector<Leg> legs_;        ///< calibration, way to the start, script
  std::size_t reach_ = 0;        ///< the way to the start, the leg after the calibration
  std::size_t repeat_from_ = 0;  ///< legs_.size(): no repeat
  std::size_t leg_ = 0;
  std::int64_t cycle_ = 0;
  Phase phase_ = Phase::resting;
  DeviceVec<double> start_mm_;
  DeviceVec<double> from_mm_;
  std::array<double, 3> from_orientation_rad_{};
};

}  // namespace kerf
