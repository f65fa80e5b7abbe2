// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "hil/device/hand_script.hpp"
#include "hil/device/packet_device.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/emulator_link.hpp"

/// The emulated hands: one that plays a script, one that follows a user's target, and the smooth
/// reach of both.
namespace kerf {

/// Position along a rest-to-rest motion of minimum jerk (Flash and Hogan 1985); t and result 0..1.
[[nodiscard]] constexpr double minimum_jerk(double t) noexcept {
  return t * t * t * (10 + t * (-15 + 6 * t));
}

/// The path of a hand from its position to the start of its script: one cubic Bezier curve, device
/// mm, passed with minimum jerk. Its points are the hand's position, one above it, one beside the
/// workpiece, and the start; without a detour they lie on a line.
struct ReachCurve {
  /// A quick reach of the arm, at its fastest.
  static constexpr double kMaxMmPerS = 1000;
  static constexpr double kMaxMmPerS2 = 10'000;
  /// A soft or heavy hand is so slow that the tip swings past its start by this at most: half of
  /// the smallest distance that the project's scripts keep from the surface.
  static constexpr double kSwingMm = 2;

  std::array<DeviceVec<double>, 4> points_mm;

  [[nodiscard]] DeviceVec<double> at(double progress) const noexcept;
  /// The least duration within the three bounds above, s. A mass on a spring of natural frequency w
  /// swings about its lag, and a jerk j adds j / w^3 to the swing. The limits of a motion of
  /// duration T are those of T = 1 s over T, T^2 and T^3, so 1 s is sampled.
  [[nodiscard]] double least_seconds(double hand_rad_per_s) const noexcept;
};

[[nodiscard]] ReachCurve reach_curve(const HandRoute& route, DeviceVec<double> from_mm,
                                     DeviceVec<double> start_mm) noexcept;

/// The target of a scripted hand, bus cycle by bus cycle.
///
/// It rests in the inkwell until `leave`; then it reaches for the script's start (`ReachCurve`) and
/// goes through the script. In between `calibrate` makes it calibrate the device.
/// Counts in whole bus cycles, so that repeats never drift. One thread; allocates only when
/// constructed.
class HandMotion {
 public:
  HandMotion(const HandScript& script, const HandRoute& route);

  /// Calibrates the device, again and again until it leaves.
  void calibrate() noexcept;
  void leave() noexcept;
  /// Rests again as at the begin, at the rest pose; its path begins anew.
  void rest() noexcept;
  [[nodiscard]] bool left() const noexcept { return phase_ == Phase::left; }
  /// The way to the script's start is done.
  [[nodiscard]] bool arrived() const noexcept { return left() && leg_ > reach_; }
  /// The first point of the script.
  [[nodiscard]] DeviceVec<double> start_mm() const noexcept { return start_mm_; }
  /// The script has ended; the hand stays at its last point.
  [[nodiscard]] bool ended() const noexcept { return left() && leg_ == legs_.size(); }

  /// The goal of the next bus cycle.
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

/// A hand that follows a user's target.
///
/// Its goal follows the newest target as a hand can: with the lag of its bandwidth, no faster than
/// its strokes, and it pulls at its grip with at most `kMaxPullN`. Without a target for `kStaleS`
/// (a window that hangs), or after `release` (a window that is gone), it holds the tip at its
/// position, presses no more and lets go of the buttons; `kPatienceS` later it withdraws to its
/// start, straight up first. The next target moves it from its position. A target with `park` makes
/// it take the device's path back to the rest pose, whatever later targets are, its buttons up, and
/// stay there for `kParkedS`. In bus cycles, without a clock. One thread; never allocates.
class GuidedHand {
 public:
  /// Voluntary motion reaches some 8 Hz: a first-order lag with that corner.
  static constexpr double kLagS = 1.0 / (2 * 3.14159265358979 * 8);
  /// Strokes of 10 mm to both sides, five a second: their peak, 2 pi 5 x 10, rounded down.
  static constexpr double kMaxSpeedMmPerS = 300;
  static constexpr double kMaxTurnRadPerS = 6;
  static constexpr double kMaxPullN = 6;  ///< nearly twice the force of the strongest motors here
  static constexpr double kStaleS = 0.25;
  static constexpr double kPatienceS = 1;
  static constexpr double kWithdrawMmPerS = 50;
  static constexpr double kParkMmPerS = 150;
  static constexpr double kParkedS = 0.5;  ///< ten times the rest that the servo requires

  /// The stiffness of its grip, N/mm, and the path from rest to `start_mm`.
  GuidedHand(double stiffness_n_per_mm, const HandRoute& route,
             DeviceVec<double> start_mm) noexcept;

  void set_target(const HandTarget& target) noexcept;
  /// The user is gone: the target is stale from now on.
  void release() noexcept;

  /// The goal of the next bus cycle, while the tip is at `tip_mm`. `start` is the goal at which its
  /// path to the workpiece has ended.
  [[nodiscard]] HandGoal next(const HandGoal& start, DeviceVec<double> tip_mm) noexcept;
  /// Returns to the state after construction: no user leads it.
  void restart() noexcept;
  /// It has parked as long as it should; its path begins anew.
  [[nodiscard]] bool parked() const noexcept { return parked_for_ >= cycles_of(kParkedS); }

 private:
  [[nodiscard]] DeviceVec<double> aim(bool stale, bool withdraws,
                                      DeviceVec<double> start_mm) noexcept;
  [[nodiscard]] DeviceVec<double> retreat(DeviceVec<double> start_mm) const noexcept;

  double max_pull_mm_;
  bool first_button_parks_;
  std::optional<HandTarget> target_;
  std::optional<HandGoal> goal_;              ///< empty: still at its start
  std::int64_t since_target_ = 0;             ///< bus cycles
  std::optional<DeviceVec<double>> held_mm_;  ///< the tip, once no target came
  std::array<DeviceVec<double>, 4> way_back_mm_;
  std::optional<std::size_t> parking_;  ///< at which of these points; their number: at rest
  std::int64_t parked_for_ = 0;         ///< bus cycles
};

}  // namespace kerf
