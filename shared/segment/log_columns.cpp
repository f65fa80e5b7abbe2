// SPDX-License-Identifier: Apache-2.0
// The table of a log's columns. A new field of a tick record needs one row here; then run
// `./kerf record columns > docs/log.md`.
#include "shared/segment/log_columns.hpp"

#include <array>
#include <cstddef>

#include "shared/segment/layout_table.hpp"

namespace kerf {
namespace {

constexpr std::string_view kDocked = "from docking on; NaN before";
constexpr std::string_view kContact = "in a tick with contact; else 0";
constexpr std::string_view kPreston = "with cut.model = \"preston\"; else 0";
constexpr std::string_view kChange = "where dirty_volumes is not 0";

// clang-format off
constexpr LogCode kFlags[] = {
    {kFlagButton1, "button 1", "pressed"},
    {kFlagButton2, "button 2", "pressed"},
    {kFlagContact, "contact", "the commanded force is above 0.01 N"},
    {kFlagClamped, "clamped", "a limit of force, slew, heat or motors acted"},
    {kFlagStaleInput, "stale input", "no fresh report came for this tick"},
    {kFlagDeviceFault, "fault", "a fault is latched: the column fault says which"},
    {kFlagMotorsOn, "motors on", ""},
    {kFlagParked, "parked", "the device says that the hand is not at work"},
    {kFlagStarted, "started", "taken in hand at least once: reports count from here"},
    {kFlagForbidden, "forbidden", "pressed on what may not be cut"},
    {kFlagRefused, "refused", "the tool finds no free place, and feels nothing"},
    {kFlagShaft, "shaft", "pressed with shaft or handpiece"},
    {kFlagReset, "reset",
     "the volumes go back to their first content: no force, and nothing is cut"},
    {kFlagUndo, "undo",
     "the last stroke is undone: no force, and nothing is cut; `removed` is given back"},
    {kFlagUndoable, "undoable", "the last stroke can be undone"},
    {kFlagRedo, "redo", "a stroke that was undone is cut again: no force; `removed` is it"},
    {kFlagRedoable, "redoable", "it can be"},
    {kFlagPedal, "pedal", "the tool cuts only while button 1 is pressed"},
};
constexpr LogCode kCommands[] = {
    {1, "select_tool", "its index is the argument"},
    {2, "hold", "argument 1: no force, nothing is cut; 0: goes on"},
    {4, "reset", "the volumes go back to their first content"},
    {5, "undo", "the last stroke"},
    {6, "redo", "the stroke that was undone last"},
    {kCommandMark, "mark", "changes nothing: a place in the log"},
    {kCommandFadeIn, "restart",
     "added to the others: the force fades in after a stall of the servo"},
    {1U << kCommandMissedShift, "missed",
     "added to the others, times the ticks that the servo missed before this one, at most 65535: a "
     "silence of the device lasts so much longer"},
};
constexpr LogCode kPhases[] = {
    {0, "off", "no report has come yet"},
    {1, "calibrating", "never docked yet, or homing lost: positions are unknown"},
    {2, "armed", "docked, waits for the hand"},
    {3, "ramping", "taken in hand: the force fades in"},
    {4, "active", "the motors follow"},
    {5, "fault", "no force until parked at rest"},
};
constexpr LogCode kFaults[] = {
    {0, "none", ""},
    {1, "stale_input", "no report for 20 ms"},
    {2, "not_finite", "no finite pose, or none that a Falcon has, for more than 2 ms"},
    {3, "overspeed", "tip faster than the limit"},
    {4, "force_law", "the scene's force law gave what is no number"},
    {5, "velocity_estimator", "the scene's velocity estimator gave what is no number"},
    {6, "stabiliser", "the scene's stabiliser gave what is no number"},
    {7, "wrong_dock", "parked at rest, but not where it was calibrated first"},
    {8, "sparse_input", "reports came too seldom for too long"},
};

// Each row: column, unit, meaning, condition under which it is valid.
constexpr LogColumn kColumns[] = {
    {"seq", "", "twice the number of records published before this one, + 2: a step of more than 2 "
     "is a gap. Twice `tick`, but in a watched replay"},
    {"tick", "tick", "count of servo steps since the start of the controller, from 1"},
    {"start_ns", "ns", "when the tick began, CLOCK_MONOTONIC; in lock-step `tick` times the manifest's `tick_ns`"},
    {"period_error_ns", "ns", "how late it began, after its deadline", "0 in lock-step"},
    {"execution_ns", "ns", "time that the servo step took", "0 in lock-step"},
    {"flags", "", "bits"},
    {"missed_deadlines", "tick", "deadlines missed since the start", "0 in lock-step"},
    {"encoder_counts", "count, mrad", "0 to 2: joints, unwrapped; 3 to 5: yaw, pitch and roll of "
     "the gimbal", "joints from docking on; before they count from any place"},
    {"position_mm", "mm", "tip in the scene", kDocked},
    {"orientation", "", "quaternion x, y, z, w: tool, as it is felt, to world", kDocked},
    {"velocity_mm_per_s", "mm/s", "of the device port, as report.json's velocity_estimator has it",
     "from the first tick in hand on; NaN before, and while homing is lost"},
    {"commanded_force_n", "N", "sent to the device, after all limits; at the device port",
     "0 while the motors are off"},
    {"contact_force_n", "N", "part of the wanted force that the contact makes, before limits", kContact},
    {"modification_force_n", "N", "part of it that cutting makes: reaction, or friction", kContact},
    {"proxy_offset_mm", "mm", "from the tip to the proxy's tip, in the scene",
     "with force.model = \"proxy\", in contact; else 0"},
    {"dac_counts", "count", "signed motor commands, 0 is no torque", "0 while the motors are off"},
    {"phase", "", "code: where the safety of the loop stands"},
    {"removed", "1/65535 voxel", "density taken away in this tick by this arm, all volumes"},
    {"port_energy_j", "J", "energy taken from the hand since the start: SUM -F.dx at the device, F the "
     "mean force sent since the last report"},
    {"port_minimum_j", "J", "its lowest value so far; below 0 the loop gave more than it took"},
    {"joint_torque_n_mm", "N mm", "motor torques about the joints, of commanded_force_n",
     "0 while the motors are off"},
    {"refused_packets", "packet", "since the start: no report, an old one, or one that repeats under force"},
    {"volume_hash", "", "hash chained over all changed boxes since the start"},
    {"output_hash", "", "hash chained over what the servo put out since the start"},
    {"dirty_lo", "voxel", "first voxel of the box that changed, in the first volume that did", kChange},
    {"dirty_hi", "voxel", "end of that box; it does not belong to it", kChange},
    {"lost_packets", "packet", "since the start, by the device's own counter",
     "Omni and Cartesian devices; 0 for devices that do not number their packets"},
    {"dirty_volumes", "", "bit v: volume v changed"},
    {"last_command", "", "index of the last command of a reader that was applied", "0: none yet"},
    {"tip_torque_n_mm", "N mm", "of contact and cutting about the tip; no device of ours renders it", kContact},
    {"spindle_ratio", "", "speed of the spindle over its reference speed", kPreston},
    {"raw", "count", "as the device sent it: 0 to 2 encoders, 3 to 5 and 6 to 8 both wipers of the "
     "gimbal's pots (a Cartesian device: position in the servo's steps, then its quaternion x, y, z, w as 16 bits), 9 bits (1 button, 2 second button, 4 parked, 8 not homed), 10 packet counter",
     "the last report that came; pots: Omni; quaternion: Inverse3, Touch"},
    {"press_n", "N", "normal force that cuts, in the scene", kPreston},
    {"energy_spring", "2^-32 mJ", "share of port_energy_j: the coupling or another force law, as if never sampled"},
    {"energy_damping", "2^-32 mJ", "share of the damping that is injected with the spring"},
    {"energy_friction", "2^-32 mJ", "share of the tool's friction on the solid"},
    {"energy_cutting", "2^-32 mJ", "share of the removal's reaction and of the cutter's friction"},
    {"energy_limits", "2^-32 mJ", "share of what peak, thermal, slew and motor limits changed"},
    {"energy_hold", "2^-32 mJ", "share of fading in, and of a force that was held or faded over a gap"},
    {"energy_leak", "2^-32 mJ", "share of holding spring and friction for a tick"},
    {"energy_stabiliser", "2^-32 mJ", "share of what the scene's stabiliser added"},
    {"spindle_load", "", "torque on the spindle over its stall torque", kPreston},
    {"active_tool", "", "index of the tool in the scene, from 0"},
    {"fault", "", "code: why there is no force"},
    {"stale", "", "1: no fresh report came for this tick, and nothing was felt in it"},
    {"penetration_mm", "mm", "how deep the hand is in the solid: length of proxy_offset_mm, or of the "
     "overlap along the force", kContact},
    {"plane_count", "", "planes that hold the tool, at most 3", "with force.model = \"proxy\""},
    {"plane_load_n", "N", "load along each plane's normal, before limits", "the first plane_count"},
    {"plane_normal", "", "x, y, z of each plane's normal, out of the solid", "the first plane_count"},
    {"plane_arm_mm", "mm", "x, y, z from the tool's centre to each contact", "the first plane_count"},
    {"command", "", "code: what was applied before this tick's step; 0: nothing"},
    {"command_argument", "", "of that command: index of the tool; hold: 1 on, 0 off"},
    {"crc32c", "", "checksum of the row from tick on"},
};
// clang-format on

/// True if each field of a tick record has a row, in the same order.
constexpr bool covers_all() {
  std::size_t row = 0;
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    if (row == std::size(kColumns) || kColumns[row].name != field.name) return false;
    ++row;
  }
  return row == std::size(kColumns);
}
static_assert(covers_all(), "log_columns.cpp: a row for each field of TickRecord, in its order");

}  // namespace

std::span<const LogColumn> log_columns() {
  return kColumns;
}
std::span<const LogCode> log_codes(std::string_view column) {
  if (column == "flags") return kFlags;
  if (column == "command") return kCommands;
  if (column == "phase") return kPhases;
  if (column == "fault") return kFaults;
  return {};
}
std::span<const LogCode> log_flags() {
  return kFlags;
}
std::span<const LogCode> log_commands() {
  return kCommands;
}
std::span<const LogCode> log_phases() {
  return kPhases;
}
std::span<const LogCode> log_faults() {
  return kFaults;
}

}  // namespace kerf
