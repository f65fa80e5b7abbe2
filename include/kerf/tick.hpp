// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

// What goes into a tick of the servo, and what comes out: the report of a device and commands; the
// record of an arm, which is the row of a log, the record of the shared memory and what
// `Servo::step` returns, byte for byte. Plain data, for programs without an operating system too.
//
//     if ((tick.flags & kerf::kFlagContact) != 0) std::printf("%g N\n", tick.commanded_force_n[1]);

namespace kerf {

using Tick = std::uint64_t;  ///< count of servo steps; 0 is the state before the first one

/// Report of the device in this tick: raw counts, not angles. With commands, and `ProgramForce` in
/// an external scene, it is all that the servo step gets, and so all that a replay needs.
///
/// It is of one kind: counts of joints and gimbal, or a pose, as a Cartesian device reports it
/// (docs/devices.md).
///
/// `parked` means that the device is not in use: the stylus is in the inkwell (Omni, Touch), the
/// centre button of the grip is held (Falcon), the arm has not left the home pose since its
/// calibration button was pressed (WoodenHaptics), or a button is held (Inverse3, omega). Parking
/// at rest calibrates the device; motors stay off while it is parked.
struct DeviceReport {
  enum class Kind : std::uint8_t { joints, pose };

  bool fresh = false;  ///< false: nothing arrived since the last tick
  Kind kind = Kind::joints;
  /// Of the joints' encoders, which wrap at 16 bits; of a pose: its position, in steps of the
  /// device (`step_um`).
  std::array<std::int16_t, 3> counts{};
  std::array<std::uint16_t, 3> wiper_a{};  ///< joints: gimbal pots, both wipers; zero without one
  std::array<std::uint16_t, 3> wiper_b{};
  std::array<std::int16_t, 4> orientation{};  ///< pose: quaternion x, y, z, w; 32767 is 1
  bool button1 = false, button2 = false;      ///< pressed
  bool parked = false;
  bool homed = true;          ///< false: absolute encoders have no meaning yet
  std::uint32_t counter = 0;  ///< packet counter of the device, else of the driver
};

/// A command of a person or a program; applied at a tick boundary. Values of kinds go into logs:
/// append only.
struct ServoCommand {
  enum class Kind : std::uint32_t {
    none,
    select_tool,
    hold,
    fade_in,  ///< force starts again from 0: after a stall of the servo
    reset,    ///< restores the volumes' first content, over several ticks; no-op without cutting
    undo,     ///< restores the content before the last stroke, if there is one; as a reset
    redo,     ///< repeats the stroke that was undone last, if there is one; as a reset
    mark,     ///< changes nothing: marks a tick in the log
    missed    ///< ticks that the host skipped before this one: without a report, for all arms
  };
  Kind kind = Kind::none;
  std::uint32_t argument = 0;  ///< index of the tool; hold: 1 on, 0 off; missed: ticks
  std::uint32_t arm = 0;       ///< that gets the tool; other kinds are for all arms
};

/// What a program asks of the hand in a scene with `force.model = "external"`: force plus
/// stiffness (goal - tip) / workspace_scale - damping v, at the device port, along the axes of the
/// scene. All limits of the scene apply to it. It counts for `force.stale_ms`; without a new one it
/// fades to zero, and fades in again with the next (docs/own-law.md). One that is not finite or
/// beyond the bounds below is refused.
struct ProgramForce {
  std::array<double, 3> force_n{};  ///< each component at most 255 N
  std::array<double, 3> goal_mm{};  ///< in the scene, at most 10 m; counts with a stiffness alone
  double stiffness_n_per_mm = 0;    ///< at the device; up to the scene's `force.stiffness_n_per_mm`
  double damping_ns_per_mm = 0;     ///< at the device; up to the scene's `force.damping_ns_per_mm`
};

/// Phase of the safety state machine. Motors are on in `ramping` and `active` only. Values go
/// into logs: append only.
enum class Phase : std::uint8_t {
  off,          ///< no report has come yet
  calibrating,  ///< never parked at rest yet, or homing lost: the joint angles are unknown
  armed,        ///< calibrated and parked: waits for the hand
  ramping,      ///< picked up: force fades in
  active,
  fault  ///< latched; parking at rest clears it
};

/// Why the force went to zero. Values go into logs: append only.
enum class Fault : std::uint32_t {
  none = 0,
  stale_input = 1,  ///< no report for 20 ms
  not_finite = 2,   ///< no finite pose from the counts for more than 2 ms, or no finite force
  overspeed = 3,    ///< tip faster than the limit
  // A law of the scene gave a value that is not finite:
  force_law = 4,
  velocity_estimator = 5,
  stabiliser = 6,
  wrong_dock = 7,   ///< parked at rest, but not where it was calibrated first
  sparse_input = 8  ///< reports came too seldom for too long
};

[[nodiscard]] constexpr const char* fault_name(Fault fault) noexcept {
  switch (fault) {
    case Fault::none:
      return "none";
    case Fault::stale_input:
      return "stale_input";
    case Fault::not_finite:
      return "not_finite";
    case Fault::overspeed:
      return "overspeed";
    case Fault::force_law:
      return "force_law";
    case Fault::velocity_estimator:
      return "velocity_estimator";
    case Fault::stabiliser:
      return "stabiliser";
    case Fault::wrong_dock:
      return "wrong_dock";
    case Fault::sparse_input:
      return "sparse_input";
  }
  return "unknown";
}

/// Input, contact and output of one arm in one servo tick. The tip is in the scene (mm); velocity
/// and forces are at the device port. Unit, meaning and validity of each field: docs/log.md.
struct TickRecord {
  std::uint64_t seq;  ///< of record i: 2 i + 1 while it is written, then 2 i + 2; set by the writer
  std::uint64_t tick;
  std::uint64_t start_ns;  ///< of the tick, CLOCK_MONOTONIC; in lock-step tick * tick_ns
  std::int32_t period_error_ns;
  std::uint32_t execution_ns;
  std::uint32_t flags;  ///< kFlag...
  std::uint32_t missed_deadlines;
  std::int32_t encoder_counts[6];  ///< 0..2: joints, unwrapped since docking; 3..5: gimbal, mrad
  double position_mm[3];           ///< NaN in the phases off and calibrating
  float orientation[4];            ///< quaternion x, y, z, w: tool to world; NaN as the position
  float velocity_mm_per_s[3];      ///< at the device; NaN as the position, and until first in hand
  float commanded_force_n[3];      ///< sent, after all limits
  float contact_force_n[3];        ///< wanted by the contact or the program, before limits
  float modification_force_n[3];   ///< wanted by the cutting, before limits
  float proxy_offset_mm[3];        ///< from the tip to the proxy's tip, in the scene
  std::int16_t dac_counts[3];
  std::uint16_t phase;    ///< `Phase` of the servo
  std::uint32_t removed;  ///< in this tick, in 1/65535 of a voxel; in an undo, restored
  double port_energy_j;   ///< energy that the loop took from the hand since the start of the run
  double port_minimum_j;  ///< its lowest value so far; below 0 the loop gave more than it took
  float joint_torque_n_mm[3];
  std::uint32_t refused_packets;  ///< since the start: no report, an old one, a repeat under force
  std::uint64_t volume_hash;      ///< chain over all changes so far; not `Servo::volume_hash`
  std::uint64_t output_hash;      ///< chained over all outputs since the start
  std::uint16_t dirty_lo[3];      ///< first voxel of the changed box of the first changed volume
  std::uint16_t dirty_hi[3];      ///< its end, exclusive
  std::uint32_t lost_packets;     ///< since the start
  std::uint32_t dirty_volumes;    ///< bit v: volume v changed in this tick
  std::uint32_t last_command;     ///< number of the newest one of a reader, applied or not; 0: none
  float tip_torque_n_mm[3];
  float spindle_ratio;
  std::int32_t raw[11];  ///< as received, the last report if this tick has none; kRaw...
  float press_n;         ///< normal force that cuts, in the scene
  // `port_energy_j` by source, in steps of 2^-32 mJ.
  std::int64_t energy_spring;
  std::int64_t energy_damping;
  std::int64_t energy_friction;
  std::int64_t energy_cutting;
  std::int64_t energy_limits;
  std::int64_t energy_hold;
  std::int64_t energy_leak;
  std::int64_t energy_stabiliser;
  float spindle_load;
  std::uint32_t active_tool;
  std::uint32_t fault;
  std::uint32_t stale;  ///< 1: no fresh report
  float penetration_mm;
  std::uint32_t plane_count;       ///< contact planes that hold the tool, at most 3
  float plane_load_n[3];           ///< along each normal, before any limit, at the device port
  float plane_normal[9];           ///< x, y, z of each, out of the solid
  float plane_arm_mm[9];           ///< x, y, z of each: from the tool's centre to the contact
  std::uint32_t command;           ///< given before the step, applied or refused; kCommand...
  std::uint32_t command_argument;  ///< of that command: index of the tool; hold: 1 on, 0 off
  std::uint32_t crc32c;            ///< of all bytes from `tick` up to here; set by the writer
};

inline constexpr std::uint32_t kFlagButton1 = 1U << 0;
inline constexpr std::uint32_t kFlagButton2 = 1U << 1;
inline constexpr std::uint32_t kFlagContact = 1U << 2;      ///< commanded force above 0.01 N
inline constexpr std::uint32_t kFlagClamped = 1U << 4;      ///< a limit of the force acted
inline constexpr std::uint32_t kFlagStaleInput = 1U << 5;   ///< no fresh report in this tick
inline constexpr std::uint32_t kFlagDeviceFault = 1U << 6;  ///< a fault of any kind is latched
inline constexpr std::uint32_t kFlagMotorsOn = 1U << 7;
inline constexpr std::uint32_t kFlagParked = 1U << 8;      ///< as the device reports
inline constexpr std::uint32_t kFlagStarted = 1U << 9;     ///< picked up at least once
inline constexpr std::uint32_t kFlagForbidden = 1U << 10;  ///< presses on a forbidden material
inline constexpr std::uint32_t kFlagRefused = 1U << 11;    ///< no free position near the hand
inline constexpr std::uint32_t kFlagShaft = 1U << 12;  ///< shaft or handpiece presses on the solid
inline constexpr std::uint32_t kFlagReset = 1U << 13;  ///< a reset of the volumes is in progress
inline constexpr std::uint32_t kFlagUndo = 1U << 14;   ///< an undo is in progress
inline constexpr std::uint32_t kFlagUndoable = 1U << 15;  ///< an undo is possible
inline constexpr std::uint32_t kFlagRedo = 1U << 16;      ///< a redo is in progress
inline constexpr std::uint32_t kFlagRedoable = 1U << 17;  ///< a redo is possible
inline constexpr std::uint32_t kFlagPedal = 1U << 18;     ///< cuts only while button 1 is pressed

/// Bits of `TickRecord::command`: a `ServoCommand::Kind`, one bit that is
/// set if the force fades in again after a stall of the servo, and above kCommandMissedShift how
/// many ticks the servo missed before this one.
inline constexpr std::uint32_t kCommandKind = 0xff;
inline constexpr std::uint32_t kCommandFadeIn = 1U << 8;
inline constexpr unsigned kCommandMissedShift = 16;
inline constexpr std::uint32_t kMostMissed = 0xffff;  ///< more count as these: 8 s at 8 kHz
inline constexpr std::uint32_t kCommandMark = 7;      ///< a kind; only marks the tick in the log

inline constexpr std::size_t kRawEncoder = 0;  ///< first of 3
inline constexpr std::size_t kRawPot = 3;      ///< first of 6; of a pose: 4, the quaternion
inline constexpr std::size_t kRawStatus = 9;   ///< bits: button 1, button 2, parked, not homed
inline constexpr std::size_t kRawDeviceCounter = 10;

}  // namespace kerf
