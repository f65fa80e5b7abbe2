// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hil/devmodel/bus_cycle.hpp"
#include "hil/devmodel/hand_script.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/hand_wish.hpp"

namespace kerf {

/// A hand that a user leads, from wish to wish.
///
/// What it wants follows the newest wish as a hand can: with the lag of its bandwidth, no faster
/// than its strokes, and it pulls at its grip no harder than `kMaxPullN`. Without a wish for
/// `kStaleS` (a window that hangs), or once it is forsaken (a window that is gone), it holds the
/// tip where that is and presses no more; `kPatienceS` later it withdraws to its start, straight up
/// first. A wish takes it from wherever it is. Asked to park, it goes the device's way back to the
/// rest pose, whatever it is told meanwhile, and stays there for `kParkedS`. In bus cycles, without
/// a clock. One thread; never allocates.
class GuidedHand {
 public:
  /// Voluntary motion reaches some 8 Hz: a first-order lag with that corner.
  static constexpr double kLagS = 1.0 / (2 * 3.14159265358979 * 8);
  /// Strokes of 10 mm to both sides, five a second: their peak, 2 pi 5 x 10, rounded down.
  static constexpr double kMaxSpeedMmPerS = 300;
  static constexpr double kMaxTurnRadPerS = 6;
  static constexpr double kMaxPullN = 6;  ///< near twice what the strongest motors here hold
  static constexpr double kStaleS = 0.25;
  static constexpr double kPatienceS = 1;
  static constexpr double kWithdrawMmPerS = 50;
  static constexpr double kParkMmPerS = 150;
  static constexpr double kParkedS = 0.5;  ///< ten times what the servo asks of a rest

  /// The stiffness of its grip, N/mm, and the way from rest to `start_mm`.
  GuidedHand(double stiffness_n_per_mm, const HandRoute& route,
             DeviceVec<double> start_mm) noexcept;

  void wish(const HandWish& wish) noexcept;
  void forsake() noexcept;

  /// The goal of the next bus cycle, while the tip is at `tip_mm`. `start` is where its way to the
  /// workpiece has ended.
  [[nodiscard]] HandGoal next(const HandGoal& start, DeviceVec<double> tip_mm) noexcept;
  /// As it was made: nobody leads it.
  void restart() noexcept;
  /// It has parked as long as it should: its way begins anew.
  [[nodiscard]] bool parked() const noexcept { return parked_for_ >= cycles_of(kParkedS); }

 private:
  [[nodiscard]] DeviceVec<double> aim(bool stale, bool withdraws,
                                      DeviceVec<double> start_mm) noexcept;
  [[nodiscard]] DeviceVec<double> retreat(DeviceVec<double> start_mm) const noexcept;

  double max_pull_mm_;
  std::optional<HandWish> wish_;
  std::optional<HandGoal> goal_;              ///< none: still at its start
  std::int64_t since_wish_ = 0;               ///< bus cycles
  std::optional<DeviceVec<double>> held_mm_;  ///< the tip, once no wish came any more
  std::array<DeviceVec<double>, 4> way_back_mm_;
  std::optional<std::size_t> parking_;  ///< at which of these points; their number: at rest
  std::int64_t parked_for_ = 0;         ///< bus cycles
};

}  // namespace kerf
