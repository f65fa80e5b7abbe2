// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "shared/numeric/vec.hpp"
#include "standin/emulated_arm.hpp"
#include "standin/hd/error_stack.hpp"
#include "standin/hd/motor_heat.hpp"
#include "standin/hd/numbers.hpp"
#include "standin/hd/touch_kinematics.hpp"
#include "standin/hd/wrist.hpp"
#include "standin/ledger.hpp"
#include "standin/session.hpp"
#include "standin/settings.hpp"

/// The open device of the HD stand-in: frames, force, limits, parameters.
namespace kerf::hd {

/// The types in which a parameter may be read or written.
enum Types : unsigned { kBool = 1, kInt = 2, kFloat = 4, kDouble = 8, kLong = 16 };

/// The values of a parameter.
struct Values {
  std::size_t count = 0;
  std::array<double, 16> value{};
};

/// The readings of one frame.
struct Readings {
  standin::Pose pose;
  DeviceVec<double> velocity, angular_velocity;
  std::uint32_t buttons = 0;
  Angles joints{}, gimbal{};
  Transform16 transform{};
};

/// A Touch behind kerf-emulator. Every error goes to the stack, with the handle; nothing throws
/// after the constructor. One thread at a time; only in lock-step does `end_tick` wait.
///
/// A frame: `begin_frame` samples, sets act on the frame, `end_frame` fixes its force; the packet
/// leaves at the end of the tick, or at once without a scheduler. The force of a frame begins at 0.
class Touch {
 public:
  /// `is_locked_out`: another process has the device, and this one sees the pose with all joints at
  /// 0. Throws std::runtime_error with one line.
  Touch(const standin::Settings& settings, standin::Device& device, ErrorStack& errors,
        Handle handle, bool is_locked_out);

  void begin_tick() noexcept;
  /// A frame that is still open is thrown away and counted.
  void end_tick() noexcept;
  void begin_frame() noexcept;
  void end_frame() noexcept;
  /// The scheduler starts or stops. At a stop the force is held or dropped, by the switch.
  void run(bool runs, int rate_hz) noexcept;
  /// The motors go off.
  void close() noexcept;
  [[nodiscard]] standin::Device& device() const noexcept { return device_; }

  void enable(Enum capability, bool on) noexcept;
  [[nodiscard]] bool is_enabled(Enum capability) noexcept;
  [[nodiscard]] Enum calibration() noexcept;
  void calibrate() noexcept;

  /// Nothing, and an error, if there is no such parameter or none in these types.
  [[nodiscard]] std::optional<Values> read(Enum name, unsigned type) noexcept;
  /// Number of values that a write takes; 0, and an error, if there is no such parameter.
  [[nodiscard]] std::size_t writes(Enum name, unsigned type) noexcept;
  void write(Enum name, const std::array<double, 16>& value) noexcept;
  /// Null, and an error, for another parameter.
  [[nodiscard]] const char* text(Enum name) noexcept;

  /// The transform of the newest frame with its gimbal angles scaled.
  [[nodiscard]] Transform16 with_scaled_gimbal(const Angles& scale) const noexcept;

 private:
  static constexpr std::size_t kMotors = 3;

  void follow(standin::Pose& now, double dt_s) noexcept;
  [[nodiscard]] Readings sampled() const noexcept;
  struct Parameter;
  struct Parameters;
  [[nodiscard]] static const Parameter* parameter(Enum name) noexcept;
  [[nodiscard]] bool* capability(Enum name) noexcept;
  [[nodiscard]] DeviceVec<double> wanted_force() noexcept;
  [[nodiscard]] DeviceVec<double> limited(DeviceVec<double> force_n) noexcept;
  void send() noexcept;
  void count_not_cleared() noexcept;
  void push(Enum code) noexcept { errors_.push(code, handle_); }

  const standin::Settings& settings_;
  standin::Device& device_;
  standin::Ledger& ledger_;
  ErrorStack& errors_;
  Handle handle_;
  std::string serial_;
  // What each report moves and heats; the arm receives the first one when it is made.
  Wrist wrist_;
  MotorHeat heat_;
  bool is_warm_ = false, was_warm_ = false;  ///< now; in the frame before
  standin::EmulatedArm arm_;

  Readings now_, before_;
  DeviceVec<double> last_force_n_;  ///< of the last frame
  DeviceVec<double> output_n_;      ///< what is sent
  bool in_frame_ = false, had_frame_ = false, has_two_ = false;
  bool runs_ = false;
  bool is_forced_ = false;   ///< by the newest packet
  bool has_ticked_ = false;  ///< since the start of the scheduler
  bool is_counted_ = false;  ///< its force, as not cleared
  int rate_hz_ = 1000;
  std::int64_t ticks_ = 0;  ///< since the start
  bool calibrated_;

  /// What the program has set in this frame.
  struct Wanted {
    DeviceVec<double> force_n;
    std::optional<Angles> joint_torque_mnm;
    bool has_force = false, has_dac = false;
  };
  Wanted wanted_;

  bool force_output_ = false, clamps_ = true, ramps_ = true, checks_force_ = true,
       one_frame_ = true;
  double velocity_limit_ = 1200;  ///< mm/s, by one comment of a client
  double impulse_limit_n_ = 4;    ///< N a tick, by one comment of a client
  double ramping_rate_ = 0;
};

}  // namespace kerf::hd
