// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "kerf/scene.hpp"
#include "kerf/tick.hpp"

namespace kerf {

/// The scene's device, emulated down to its packets, and the hand that holds it, in lock-step with
/// a servo: the run of `./kerf demo --virtual` to the bit.
///
///     kerf::Hand hand(scene, "touch.toml");
///     servo.step(hand.next(servo.last()));
///
/// The hand rests until the device is calibrated, for 0.1 s (Falcon: 0.65 s), reaches for the start
/// of its script, goes through it and stays at its end (docs/scene-keys.md). No force comes before
/// the phase `ramping`: step for some seconds, or until `ended`. One thread.
class Hand {
 public:
  /// With the scene's own [[hand]]; if that names no script, the hand reaches for its start and is
  /// led from there. `arm`: whose device it is. Throws Error, also for a rate that does not divide
  /// 8000 Hz, and for a `device.torque_scale` that is not that of the emulated motors.
  explicit Hand(const Scene& scene, std::size_t arm = 0);
  /// With another script, TOML of a hand (empty: none), and with faults of the device, TOML as in
  /// hil/faults (empty: none).
  Hand(const Scene& scene, const std::filesystem::path& script,
       const std::filesystem::path& faults = {}, std::size_t arm = 0);
  /// With the scene's own script, and with such faults.
  [[nodiscard]] static Hand with_faults(const Scene& scene, const std::filesystem::path& faults,
                                        std::size_t arm = 0);
  ~Hand();
  Hand(Hand&&) noexcept;
  Hand& operator=(Hand&&) noexcept;

  /// Sends the motor counts of `last`, the last tick of its own arm, to the device, which moves on
  /// by one period; returns its newest report. Before the first tick nothing is sent.
  [[nodiscard]] DeviceReport next(const TickRecord& last) noexcept;

  /// Leads a hand whose script has ended: where its tip shall be, in scene mm, as far as a hand can
  /// follow. It lets go after a quarter of a second without a new target. Ignored before the end of
  /// the script, and if a number is not finite.
  void lead(const std::array<double, 3>& tip_mm, bool button = false) noexcept;

  /// True if it can be led: the script has ended. One that repeats never ends.
  [[nodiscard]] bool ended() const noexcept;
  /// The true tip in scene mm, which no encoder knows to the last digit.
  [[nodiscard]] std::array<double, 3> tip_mm() const noexcept;
  /// The true force of the motors at the tip, N along the axes of the device.
  [[nodiscard]] std::array<double, 3> motor_force_n() const noexcept;

 private:
  struct Parts;
  explicit Hand(std::unique_ptr<Parts> parts) noexcept;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kerf
