// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <numbers>
#include <optional>

namespace kerf {

/// The spindle of a scene, as far as heat needs it.
struct HeatingSpindle {
  double stall_torque_n_mm = 0;
  double reference_krpm = 300;  ///< of a `spindle_ratio` of 1

  /// What the spindle puts into the cut, W: its torque times its speed.
  [[nodiscard]] constexpr double power_w(double load, double ratio) const noexcept {
    const double omega_per_s = ratio * reference_krpm * 1000 * 2 * std::numbers::pi / 60;
    return load * stall_torque_n_mm * omega_per_s * 1e-3;
  }
};

/// How much warmer the pulp of the tooth under the bur is than the body: a mark of a preparation,
/// which no force depends on. The tooth is one lump (docs/forces.md 6.7):
///
///   d(rise)/dt = kPerJ P - (rise - (T_water - T_body)) / kWaterS
///
/// the second term only while the spindle turns and its water runs. Dry, nothing cools: an upper
/// bound. Each tick is a step of the implicit Euler method, within tick / 80 s of the exact course.
/// All arms heat one tooth. Never waits, never allocates.
class PulpHeat {
 public:
  /// K per J of cutting: +6.8 K, the mean of 60 s of dry preparation, over the 324 J of a bur of
  /// radius 0.7 mm at 75 g, 200,000 rpm and a friction of 0.5 (chosen: not published). A tooth of 2
  /// g and 1.2 J/(g K) then keeps 5 % of the heat.
  static constexpr double kPerJ = 0.021;
  static constexpr double kWaterS = 40;  ///< fitted to means of water of 10, 23 and 35 C
  static constexpr double kBodyC = 37;
  static constexpr double kHarmC = 5.5;  ///< rise from which on a pulp is harmed

  /// `water_c`: temperature of the spray; empty: dry.
  constexpr PulpHeat(HeatingSpindle spindle, std::optional<double> water_c, double tick_s) noexcept
      : spindle_(spindle), water_c_(water_c), tick_s_(tick_s) {}

  /// One arm of a tick: the spindle's load and speed as in its record.
  constexpr void add(double spindle_load, double spindle_ratio) noexcept {
    power_w_ += spindle_.power_w(spindle_load, spindle_ratio);
    turns_ = turns_ || spindle_ratio > kTurns;
  }
  /// Ends the tick.
  constexpr void advance() noexcept {
    if (water_c_ && turns_) {
      const double rests_at = *water_c_ - kBodyC + kPerJ * power_w_ * kWaterS;
      rise_c_ += (rests_at - rise_c_) * (tick_s_ / (kWaterS + tick_s_));
    } else {
      rise_c_ += kPerJ * power_w_ * tick_s_;
    }
    highest_c_ = std::max(highest_c_, rise_c_);
    if (rise_c_ >= kHarmC) harm_s_ += tick_s_;
    power_w_ = 0;
    turns_ = false;
  }
  /// Another tooth, as after a reset of the volumes.
  constexpr void restart() noexcept { rise_c_ = highest_c_ = harm_s_ = power_w_ = 0; }

  [[nodiscard]] constexpr double rise_c() const noexcept { return rise_c_; }
  [[nodiscard]] constexpr double highest_c() const noexcept { return highest_c_; }
  [[nodiscard]] constexpr double harm_s() const noexcept { return harm_s_; }  ///< time above kHarmC

 private:
  static constexpr double kTurns = 0.01;  ///< slower it is at rest: 3,000 rpm

  HeatingSpindle spindle_;
  std::optional<double> water_c_;
  double tick_s_;
  double power_w_ = 0;
  bool turns_ = false;
  double rise_c_ = 0, highest_c_ = 0, harm_s_ = 0;
};

}  // namespace kerf
