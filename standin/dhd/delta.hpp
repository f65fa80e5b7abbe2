// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "shared/numeric/vec.hpp"
#include "standin/dhd/numbers.hpp"
#include "standin/dhd/slots.hpp"
#include "standin/emulated_arm.hpp"
#include "standin/ledger.hpp"
#include "standin/session.hpp"
#include "standin/settings.hpp"

namespace kerf::dhd {

/// A trajectory of the regulator, of one kind of motion: m/s, m/s2, m/s3.
struct Profile {
  double speed = 0.1, acceleration = 1, jerk = 10;
};

/// An omega.3 behind kerf-emulator: modes, forces, limits and the regulator of drd. Vectors are
/// kerf's, in mm and N. One thread at a time; nothing throws after the constructor.
///
/// In lock-step each force command is one tick of the device, and so are the ticks of the
/// regulator and of a sleep; nothing else moves time.
class Delta {
 public:
  enum class Mode : std::uint8_t { reset, idle, force, brake };
  enum class Cause : std::uint8_t { none, button, velocity, watchdog, software };

  /// Throws std::runtime_error with one line.
  Delta(const standin::Settings& settings, standin::Device& device);

  /// The newest pose. kFailed if the device is gone.
  [[nodiscard]] int read() noexcept;
  [[nodiscard]] const standin::Pose& pose() const noexcept { return arm_.pose(); }
  /// Empty with fewer than two poses in the window.
  [[nodiscard]] std::optional<DeviceVec<double>> velocity() const noexcept {
    return arm_.velocity(velocity_window_s);
  }
  [[nodiscard]] unsigned buttons() const noexcept;

  /// In real time: takes the next slot for a force command, and returns when that may leave, ns. In
  /// lock-step 0. Slots that passed while forces were on are counted.
  [[nodiscard]] std::int64_t take_slot_ns() noexcept;
  /// Sends a force. kOk, kSaturated, or kFailed if the device is gone or the force is not finite.
  [[nodiscard]] int set_force(DeviceVec<double> force_n) noexcept;
  [[nodiscard]] DeviceVec<double> force_n() const noexcept { return force_n_; }
  void set_mode(Mode mode, Cause cause) noexcept;
  /// Sends a mode that was set, without a force.
  [[nodiscard]] int apply() noexcept;
  [[nodiscard]] Mode mode() const noexcept { return mode_; }
  [[nodiscard]] Cause cause() const noexcept { return cause_; }
  /// The motors go off.
  void close() noexcept;

  /// One period of what happens without the program: the watchdog, the regulator. In lock-step it
  /// sends, and so moves time.
  void tick() noexcept;
  [[nodiscard]] bool needs_ticks() const noexcept { return regulates_ || watchdog_s > 0; }

  // The regulator: a spring and a damper towards a target that moves at the speed of its profile.
  [[nodiscard]] bool start() noexcept;
  void stop(bool force_on) noexcept;
  void go_to(DeviceVec<double> goal_mm, const Profile& profile) noexcept;
  void hold() noexcept {
    go_to(pose().tip_mm, tracking);
    target_mm_ = pose().tip_mm;
  }
  [[nodiscard]] bool regulates() const noexcept { return regulates_; }
  [[nodiscard]] bool moves() const noexcept;

  [[nodiscard]] standin::Device& device() const noexcept { return device_; }
  [[nodiscard]] bool lockstep() const noexcept { return arm_.lockstep(); }
  [[nodiscard]] double time_s() const noexcept { return arm_.time_s(); }
  [[nodiscard]] double command_khz() const noexcept;

  // Set by the program; the device only keeps them, unless a comment says otherwise.
  double velocity_window_s = 0.02;  ///< of `velocity`
  double velocity_limit_m_s = 0;    ///< 0 = off; above it the device brakes. Factory value unknown
  double watchdog_s = 0;            ///< 0 = off; without a force for so long the device brakes
  double most_n = -1;               ///< a longer force is shortened; negative = no limit
  int guard_us = 0;                 ///< a reading sooner than this is reused; 0 = off
  double most_torque = -1, most_gripper_n = -1;
  double effector_kg = 0, gravity = 9.81;
  std::array<double, 2> base_angle_rad{};
  double device_angle_rad = 0;
  bool compensates_gravity = true;
  int com_mode = 1;
  bool is_initialised;
  bool regulates_position = true, filters = true;
  DeviceVec<double> free_force_n;  ///< of the regulator while it does not regulate the position
  Profile moving, tracking;
  std::array<int, 2> priorities{};

 private:
  [[nodiscard]] bool gives_force() const noexcept { return mode_ == Mode::force; }
  [[nodiscard]] std::int64_t now_ns() const noexcept;
  void send(DeviceVec<double> force_n) noexcept;
  void note_command(DeviceVec<double> force_n) noexcept;
  void step_regulator(double dt_s) noexcept;

  const standin::Settings& settings_;
  standin::Device& device_;
  standin::Ledger& ledger_;
  standin::EmulatedArm arm_;
  Mode mode_ = Mode::idle;
  Cause cause_ = Cause::none;
  bool enabled_by_force_ = false;  ///< and not by the program's word
  DeviceVec<double> force_n_;
  std::int64_t commanded_ns_ = 0, read_ns_ = 0;
  double period_s_ = 0;  ///< between commands, smoothed
  Slots slots_;
  bool counts_misses_ = false;  ///< forces are on since the last slot

  bool regulates_ = false;
  DeviceVec<double> goal_mm_, target_mm_;
  double speed_mm_s_ = 100;
};

}  // namespace kerf::dhd
