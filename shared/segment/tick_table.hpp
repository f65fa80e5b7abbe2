// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "include/kerf/tick.hpp"
#include "shared/segment/layout_field.hpp"

// The table of a tick: each field of `TickRecord` once, with type, unit, stage of the step, meaning
// and validity; bits and codes. From it come the layout's hash, the columns of logs and of what
// they are exported to, messages of ROS 2, the stages of a replay, docs/log.md and the types of
// python/kerf_reader. A new field stands in include/kerf/tick.hpp and here; then run
// `./kerf record columns > docs/log.md` and `tests/docs/reference/make.py . build/release/bin
// write`.

namespace kerf {

/// The part of the servo step that makes a field, causes before what follows from them. A replay
/// names the first that differs.
enum class TickStage : std::uint8_t {
  given,  ///< to a replay, or by the machine of the run: not compared
  pose,
  safety,
  contact,
  force,
  cut,
  energy,
  output
};
inline constexpr std::array<std::string_view, 8> kTickStageWords{
    "given", "pose", "safety", "contact", "force", "cut", "energy", "output"};

/// One field of a tick.
struct TickField {
  struct Made {
    TickStage stage = TickStage::given;
    int order = 0;  ///< within the stage, from 1: causes before what follows from them
  };
  LayoutField layout;
  std::string_view unit;  ///< empty: a plain number
  Made made;
  std::string_view meaning;
  std::string_view valid = {};  ///< in which rows; empty: in all
};

/// One bit of the field `flags`, or one value of a field that is a code.
struct TickCode {
  std::uint32_t value;
  std::string_view name;
  std::string_view meaning;
};

inline constexpr TickCode kTickFlags[] = {
    {kFlagButton1, "button 1", "pressed"},
    {kFlagButton2, "button 2", "pressed"},
    {kFlagContact, "contact", "the commanded force is above 0.01 N"},
    {kFlagClamped, "clamped", "a limit of force, slew, heat or motors acted"},
    {kFlagStaleInput, "stale input", "no fresh report came for this tick"},
    {kFlagDeviceFault, "fault", "a fault is latched; the column fault has its code"},
    {kFlagMotorsOn, "motors on", ""},
    {kFlagParked, "parked", "the device reports that the hand is not working"},
    {kFlagStarted, "started", "the device was picked up at least once; reports count from here"},
    {kFlagForbidden, "forbidden", "the tool presses on material that may not be cut"},
    {kFlagRefused, "refused", "the tool finds no free position, and has no contact"},
    {kFlagShaft, "shaft", "the shaft or the handpiece presses on the solid"},
    {kFlagReset, "reset",
     "the volumes go back to their first content: no force, and nothing is cut"},
    {kFlagUndo, "undo",
     "the last stroke is undone: no force, and nothing is cut; `removed` is given back"},
    {kFlagUndoable, "undoable", "the last stroke can be undone"},
    {kFlagRedo, "redo",
     "a stroke that was undone is cut again: no force; `removed` is its density"},
    {kFlagRedoable, "redoable", "a stroke that was undone can be cut again"},
    {kFlagPedal, "pedal", "the tool cuts only while button 1 is pressed"},
};
inline constexpr TickCode kTickCommands[] = {
    {1, "select_tool", "selects a tool; the argument is its index"},
    {2, "hold", "argument 1: no force, and nothing is cut; 0: the run continues"},
    {4, "reset", "the volumes go back to their first content"},
    {5, "undo", "undoes the last stroke"},
    {6, "redo", "cuts the stroke again that was undone last"},
    {kCommandMark, "mark", "changes nothing; marks this tick in the log"},
    {kCommandFadeIn, "restart",
     "added to the others: the force fades in after a stall of the servo"},
    {1U << kCommandMissedShift, "missed",
     "added to the others, times the number of ticks that the servo missed before this one, at "
     "most 65535; a silence of the device counts as longer by these ticks"},
};
inline constexpr TickCode kTickPhases[] = {
    {0, "off", "no report has come yet"},
    {1, "calibrating", "never docked yet, or homing lost: positions are unknown"},
    {2, "armed", "docked, waits for the hand"},
    {3, "ramping", "picked up: the force fades in"},
    {4, "active", "the motors follow"},
    {5, "fault", "no force until parked at rest"},
};
inline constexpr TickCode kTickFaults[] = {
    {0, "none", ""},
    {1, "stale_input", "no report for 20 ms"},
    {2, "not_finite", "no finite pose, or one that a Falcon cannot have, for more than 2 ms"},
    {3, "overspeed", "tip faster than the limit"},
    {4, "force_law", "the scene's force law returned no number"},
    {5, "velocity_estimator", "the scene's velocity estimator returned no number"},
    {6, "stabiliser", "the scene's stabiliser returned no number"},
    {7, "wrong_dock", "parked at rest, but not where it was calibrated first"},
    {8, "sparse_input", "reports came too seldom for too long"},
};

inline constexpr std::string_view kValidDocked = "from docking on; NaN before";
inline constexpr std::string_view kValidContact = "in a tick with contact; else 0";
inline constexpr std::string_view kValidPreston = "with cut.model = \"preston\"; else 0";
inline constexpr std::string_view kValidChange = "if dirty_volumes is not 0";
inline constexpr TickField::Made kGivenField{};

// Each row: name, offset, type, count; unit; stage; meaning; when it is valid.
// clang-format off
inline constexpr TickField kTickFields[] = {
    {KERF_FIELD(TickRecord, seq, 0, "u64", 1), "", kGivenField,
     "twice the number of records published before this one, + 2: a step of more than 2 is a "
     "gap. It is twice `tick`, except in a watched replay"},
    {KERF_FIELD(TickRecord, tick, 8, "u64", 1), "tick", kGivenField,
     "count of servo steps since the start of the controller, from 1"},
    {KERF_FIELD(TickRecord, start_ns, 16, "u64", 1), "ns", kGivenField,
     "start of the tick, CLOCK_MONOTONIC; in lock-step `tick` times the manifest's `tick_ns`"},
    {KERF_FIELD(TickRecord, period_error_ns, 24, "i32", 1), "ns", kGivenField,
     "delay of the start after the deadline",
     "0 in lock-step"},
    {KERF_FIELD(TickRecord, execution_ns, 28, "u32", 1), "ns", kGivenField,
     "time that the servo step took",
     "0 in lock-step"},
    {KERF_FIELD(TickRecord, flags, 32, "u32", 1), "", {TickStage::safety, 3},
     "bits"},
    {KERF_FIELD(TickRecord, missed_deadlines, 36, "u32", 1), "tick", kGivenField,
     "deadlines missed since the start",
     "0 in lock-step"},
    {KERF_FIELD(TickRecord, encoder_counts, 40, "i32", 6), "count, mrad", {TickStage::pose, 1},
     "0 to 2: joints, unwrapped; 3 to 5: yaw, pitch and roll of the gimbal",
     "joints from docking on; before, they count from an unknown position"},
    {KERF_FIELD(TickRecord, position_mm, 64, "f64", 3), "mm", {TickStage::pose, 2},
     "tip in the scene",
     kValidDocked},
    {KERF_FIELD(TickRecord, orientation, 88, "f32", 4), "", {TickStage::pose, 3},
     "quaternion x, y, z, w: rotation from the tool, as contact has it, to the world",
     kValidDocked},
    {KERF_FIELD(TickRecord, velocity_mm_per_s, 104, "f32", 3), "mm/s", {TickStage::pose, 4},
     "velocity of the device port, by the estimator that report.json names (velocity_estimator)",
     "from the tick at which the user picks up the device; NaN before, and while homing is lost"},
    {KERF_FIELD(TickRecord, commanded_force_n, 116, "f32", 3), "N", {TickStage::force, 2},
     "force sent to the device, after all limits; at the device port",
     "0 while the motors are off"},
    {KERF_FIELD(TickRecord, contact_force_n, 128, "f32", 3), "N", {TickStage::contact, 7},
     "part of the wanted force that the contact makes, before limits; in an external scene "
     "the program's force after fading, before limits",
     kValidContact},
    {KERF_FIELD(TickRecord, modification_force_n, 140, "f32", 3), "N", {TickStage::force, 1},
     "part of the wanted force that cutting makes: reaction or friction",
     kValidContact},
    {KERF_FIELD(TickRecord, proxy_offset_mm, 152, "f32", 3), "mm", {TickStage::contact, 2},
     "from the tip to the proxy's tip, in the scene",
     "with force.model = \"proxy\", in contact; else 0"},
    {KERF_FIELD(TickRecord, dac_counts, 164, "i16", 3), "count", {TickStage::force, 4},
     "signed motor commands, 0 is no torque",
     "0 while the motors are off"},
    {KERF_FIELD(TickRecord, phase, 170, "u16", 1), "", {TickStage::safety, 1},
     "code: state of the safety logic"},
    {KERF_FIELD(TickRecord, removed, 172, "u32", 1), "1/65535 voxel", {TickStage::cut, 4},
     "density removed in this tick by this arm, in all volumes"},
    {KERF_FIELD(TickRecord, port_energy_j, 176, "f64", 1), "J", {TickStage::energy, 1},
     "energy taken from the hand since the start: SUM -F.dx at the device, F the mean force "
     "sent since the last report"},
    {KERF_FIELD(TickRecord, port_minimum_j, 184, "f64", 1), "J", {TickStage::energy, 2},
     "lowest value of port_energy_j so far; below 0 the loop gave more than it took"},
    {KERF_FIELD(TickRecord, joint_torque_n_mm, 192, "f32", 3), "N mm", {TickStage::force, 3},
     "motor torques about the joints, of commanded_force_n",
     "0 while the motors are off"},
    {KERF_FIELD(TickRecord, refused_packets, 204, "u32", 1), "packet", kGivenField,
     "packets refused since the start: no report, an old one, or a repeated one under force"},
    {KERF_FIELD(TickRecord, volume_hash, 208, "u64", 1), "", {TickStage::cut, 8},
     "hash chained over all changed boxes since the start"},
    {KERF_FIELD(TickRecord, output_hash, 216, "u64", 1), "", {TickStage::output, 1},
     "hash chained over all output of the servo since the start"},
    {KERF_FIELD(TickRecord, dirty_lo, 224, "u16", 3), "voxel", {TickStage::cut, 6},
     "first voxel of the box that changed, in the first changed volume",
     kValidChange},
    {KERF_FIELD(TickRecord, dirty_hi, 230, "u16", 3), "voxel", {TickStage::cut, 7},
     "end of that box (exclusive)",
     kValidChange},
    {KERF_FIELD(TickRecord, lost_packets, 236, "u32", 1), "packet", kGivenField,
     "packets lost since the start, by the counter of the device",
     "Omni and Cartesian devices; 0 for devices that do not number their packets"},
    {KERF_FIELD(TickRecord, dirty_volumes, 240, "u32", 1), "", {TickStage::cut, 5},
     "bit v: volume v changed"},
    {KERF_FIELD(TickRecord, last_command, 244, "u32", 1), "", kGivenField,
     "number of the newest command of a reader, applied or refused",
     "0: none yet"},
    {KERF_FIELD(TickRecord, tip_torque_n_mm, 248, "f32", 3), "N mm", {TickStage::contact, 8},
     "torque of contact and cutting about the tip; no supported device renders it",
     kValidContact},
    {KERF_FIELD(TickRecord, spindle_ratio, 260, "f32", 1), "", {TickStage::cut, 2},
     "speed of the spindle over its reference speed",
     kValidPreston},
    {KERF_FIELD(TickRecord, raw, 264, "i32", 11), "count", kGivenField,
     "as the device sent it: 0 to 2 encoders, 3 to 5 and 6 to 8 both wipers of the gimbal's "
     "pots (a Cartesian device: position in the servo's steps, then its quaternion x, y, z, w "
     "as 16 bits), 9 bits (1 button, 2 second button, 4 parked, 8 not homed), 10 packet counter",
     "the last report that came; pots: Omni; quaternion: Inverse3, Touch"},
    {KERF_FIELD(TickRecord, press_n, 308, "f32", 1), "N", {TickStage::cut, 1},
     "normal force that cuts, in the scene",
     kValidPreston},
    {KERF_FIELD(TickRecord, energy_spring, 312, "i64", 1), "2^-32 mJ", {TickStage::energy, 3},
     "part of port_energy_j: the coupling or another force law, without the effect of sampling"},
    {KERF_FIELD(TickRecord, energy_damping, 320, "i64", 1), "2^-32 mJ", {TickStage::energy, 4},
     "part of port_energy_j: the damping that is added to the spring"},
    {KERF_FIELD(TickRecord, energy_friction, 328, "i64", 1), "2^-32 mJ", {TickStage::energy, 5},
     "part of port_energy_j: friction of the tool on the solid"},
    {KERF_FIELD(TickRecord, energy_cutting, 336, "i64", 1), "2^-32 mJ", {TickStage::energy, 6},
     "part of port_energy_j: reaction of the removal, and friction of the cutter"},
    {KERF_FIELD(TickRecord, energy_limits, 344, "i64", 1), "2^-32 mJ", {TickStage::energy, 7},
     "part of port_energy_j: changes by the limits of peak, heat, slew and motors"},
    {KERF_FIELD(TickRecord, energy_hold, 352, "i64", 1), "2^-32 mJ", {TickStage::energy, 8},
     "part of port_energy_j: fading in, and a force that was held or faded over a gap"},
    {KERF_FIELD(TickRecord, energy_leak, 360, "i64", 1), "2^-32 mJ", {TickStage::energy, 9},
     "part of port_energy_j: sample and hold of spring and friction"},
    {KERF_FIELD(TickRecord, energy_stabiliser, 368, "i64", 1), "2^-32 mJ", {TickStage::energy, 10},
     "part of port_energy_j: force that the scene's stabiliser added"},
    {KERF_FIELD(TickRecord, spindle_load, 376, "f32", 1), "", {TickStage::cut, 3},
     "torque on the spindle over its stall torque",
     kValidPreston},
    {KERF_FIELD(TickRecord, active_tool, 380, "u32", 1), "", {TickStage::contact, 1},
     "index of the tool in the scene, from 0"},
    {KERF_FIELD(TickRecord, fault, 384, "u32", 1), "", {TickStage::safety, 2},
     "code: why there is no force"},
    {KERF_FIELD(TickRecord, stale, 388, "u32", 1), "", kGivenField,
     "1: no fresh report came for this tick, and it has no contact"},
    {KERF_FIELD(TickRecord, penetration_mm, 392, "f32", 1), "mm", {TickStage::contact, 9},
     "how deep the hand is in the solid: length of proxy_offset_mm, or of the overlap along "
     "the force",
     kValidContact},
    {KERF_FIELD(TickRecord, plane_count, 396, "u32", 1), "", {TickStage::contact, 3},
     "planes that hold the tool, at most 3",
     "with force.model = \"proxy\""},
    {KERF_FIELD(TickRecord, plane_load_n, 400, "f32", 3), "N", {TickStage::contact, 6},
     "load along each plane's normal, before limits",
     "the first plane_count"},
    {KERF_FIELD(TickRecord, plane_normal, 412, "f32", 9), "", {TickStage::contact, 4},
     "x, y, z of each plane's normal, out of the solid",
     "the first plane_count"},
    {KERF_FIELD(TickRecord, plane_arm_mm, 448, "f32", 9), "mm", {TickStage::contact, 5},
     "x, y, z from the tool's centre to each contact",
     "the first plane_count"},
    {KERF_FIELD(TickRecord, command, 484, "u32", 1), "", kGivenField,
     "code: command given before the step of this tick, applied or refused; 0: none"},
    {KERF_FIELD(TickRecord, command_argument, 488, "u32", 1), "", kGivenField,
     "argument of that command: index of the tool; hold: 1 on, 0 off"},
    {KERF_FIELD(TickRecord, crc32c, 492, "u32", 1), "", kGivenField,
     "checksum of the row from tick on"},
};
// clang-format on

/// The bits or codes of a field; empty if it has none.
[[nodiscard]] constexpr std::span<const TickCode> tick_codes(std::string_view field) noexcept {
  if (field == "flags") return kTickFlags;
  if (field == "command") return kTickCommands;
  if (field == "phase") return kTickPhases;
  if (field == "fault") return kTickFaults;
  return {};
}

}  // namespace kerf
