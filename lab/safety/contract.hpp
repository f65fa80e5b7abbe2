// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "lab/safety/device_wire.hpp"
#include "lab/safety/fault_run.hpp"
#include "lab/safety/outward_normal.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf::faults {

/// What the emulated device itself is doing in a bus cycle.
struct DeviceMoment {
  DeviceVec<double> motor_force_n;  ///< at the true tip
  bool docked = false;              ///< truly at rest
};

/// Watches a run from outside and reports where it breaks docs/safety.md. It sees the packets as
/// they go over the host's end of the wire, reads them by the emulator's geometry, and has the
/// emulator's clock; it knows nothing of the servo's own state. Times in ms of that clock;
/// they never go back. One thread.
class SafetyMonitor {
 public:
  /// `trusted`: neither sensors nor commands are broken on the way, so the motors' true force must
  /// follow the commands. `scene` and `outcome` outlive it.
  SafetyMonitor(const LoadedScene& scene, bool trusted, FaultOutcome& outcome);

  /// The host has asked for packets of the device.
  void listened(double time_ms) noexcept { listened_ms_ = time_ms; }
  /// A packet of the device that the host has taken.
  void reported(double time_ms, std::span<const std::uint8_t> packet);
  /// A signal has asked the controller to end: the motors go off, for good.
  void asked_to_end(double time_ms) noexcept { ended_ms_ = time_ms; }
  /// The host knows that the device has ended its side of the link.
  void link_ended() noexcept { link_ended_ = true; }
  /// A program gave a force for the next tick, which the servo took: of an external scene. Without
  /// one for force.stale_ms it falls to zero.
  void program_gave(double time_ms) noexcept { program_gave_ms_ = time_ms; }
  /// A packet that the host has sent.
  void commanded(double time_ms, std::span<const std::uint8_t> packet);
  /// A bus cycle of the device is over.
  void cycle(double time_ms, const DeviceMoment& device);
  /// Something goes wrong. The time to a latched fault counts from the newest one before it.
  void fault_begins(double time_ms) noexcept;
  /// A service or its link has shown that the connection ends: called again while it is so. The
  /// motors are off after kZeroMs, until the device was parked anew.
  void service_fails(double time_ms) noexcept;
  /// The host has ended a connection that could carry a message, and the last one had a force.
  void service_left_pushing(double time_ms) { broken(time_ms, "a connection ended with a force"); }
  /// The run is over; `latches` as in FaultScript, `faults_end_ms` when the last fault was over.
  void end(double time_ms, const std::string& latches, double faults_end_ms);

 private:
  /// The reason for motors to be off, by the packets until now; `no_reason`: they may be on.
  enum class Off : std::uint8_t { not_calibrated, parked, not_homed, fault, no_reason };
  struct TimedCommand {
    double time_ms = 0;
    double tick_ms = 0;  ///< since the last one, no longer than a tick
    ObservedCommand asked;
    DeviceVec<double> force_n;
  };

  void follow_report(double time_ms);
  void follow_rest(double time_ms);
  void follow_silence(double time_ms);
  void follow_stillness(double time_ms);
  void follow_sparse(double time_ms);
  void must_stay_off(const char* fault);
  void follow_stall(const TimedCommand& command);
  void check_state(const TimedCommand& command);
  void check_size(const TimedCommand& command);
  void check_change(const TimedCommand& command);
  void check_hold(const TimedCommand& command);
  void check_direction(const TimedCommand& command);
  void check_program(const TimedCommand& command);
  void heat_until(double time_ms);
  void check(bool kept, double time_ms, const char* rule, double value, double limit);
  void broken(double time_ms, const std::string& what);

  LimitSettings limits_;
  std::optional<double> program_stale_ms_;  ///< of an external scene
  double program_gave_ms_ = -1e9;           ///< the newest force
  double tick_ms_;
  bool trusted_;
  FaultOutcome& outcome_;
  DeviceWire wire_;
  OutwardNormal outward_;

  ObservedReport told_;                              ///< the newest report
  bool fresh_ = false;                               ///< it came since the last command
  double heard_ms_ = 0;                              ///< when
  double listened_ms_ = 0;                           ///< the host last asked for one
  std::optional<ArmPose> pose_;                      ///< that was told last
  double pose_ms_ = 0;                               ///< when
  DeviceVec<double> moved_mm_;                       ///< from the pose before to that
  std::optional<DeviceVec<double>> jumped_from_mm_;  ///< the tip; until it is there again
  bool had_no_pose_ = false;                         ///< in some report
  double no_pose_since_ms_ = -1;  ///< reports tell of none since; negative: they do
  EncoderCounts rest_count_{};
  double rest_since_ms_ = -1;  ///< parked and still; negative: it is not
  bool link_ended_ = false;
  double ended_ms_ = -1;       ///< a signal asked for the end then; negative: none has
  ObservedReport still_;       ///< without a number in its packets: what it has told ...
  double still_since_ms_ = 0;  ///< ... since then, under torque
  bool stands_still_ = false;  ///< for longer than reports that stand still are believed
  bool calibrated_ = false;
  double told_at_ms_ = 0;                 ///< the last command that a report was for
  double rest_without_gap_since_ms_ = 0;  ///< parked and still, in every report that was due
  std::optional<EncoderCounts> dock_;     ///< told in the first rest that was long enough
  bool zero_is_known_ = true;  ///< false: whether that rest was long enough is a matter of a tick
  bool zero_is_true_ = true;   ///< false: the host calibrated while the device was not at rest
  bool calibrated_again_ = false;  ///< in the run, after it had pushed
  Off off_ = Off::not_calibrated;
  double may_push_since_ms_ = 0;  ///< the fade begins
  bool after_stall_ = false;      ///< the last packet was one that ends a stall: motors off
  bool begins_anew_ = false;      ///< this packet is the first of a host that was silent: from zero

  TimedCommand last_;
  DeviceVec<double> held_n_;  ///< sent after the last report
  bool catches_up_ = false;   ///< the host was late since the last report
  double heat_n2_ = 0;
  bool way_in_is_known_ = true;  ///< false: a jump of the tip may have gone through the solid
  double inward_since_ms_ = -1;  ///< the force points into the solid; negative: it does not
  bool silence_told_ = false;
  double sparse_ms_ = 0;     ///< in which the force fell for want of reports, less its forgiveness
  double began_off_ms_ = 0;  ///< the last packet that asks for nothing, after one that did
  bool docked_ = true;
  double begun_ms_ = 0;
  double last_push_ms_ = -1;
  double service_failed_ms_ = -1;  ///< since then; negative: it has not, or was parked anew
};

}  // namespace kerf::faults
