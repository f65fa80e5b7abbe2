// SPDX-License-Identifier: Apache-2.0
#include "controller/tick/tick_record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "shared/numeric/energy_source.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/segment/writer.hpp"
#include "shared/volume/brick_grid.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

std::array<float, 3> floats(const std::array<double, 3>& v) noexcept {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

void put(float (&out)[3], const std::array<double, 3>& v) noexcept {
  std::ranges::copy(floats(v), out);
}

std::uint32_t flags_of(const DeviceReport& report, const ServoOutput& output) noexcept {
  std::uint32_t flags = 0;
  const auto set = [&](bool on, std::uint32_t bit) {
    if (on) flags |= bit;
  };
  set(report.button1, kFlagButton1);
  set(report.button2, kFlagButton2);
  set(report.parked, kFlagParked);
  set(output.contact, kFlagContact);
  set(output.clamped, kFlagClamped);
  set(output.stale, kFlagStaleInput);
  set(output.fault != Fault::none, kFlagDeviceFault);
  set(output.motors_on, kFlagMotorsOn);
  set(output.started, kFlagStarted);
  set(output.forbidden, kFlagForbidden);
  set(output.refused, kFlagRefused);
  set(output.shaft, kFlagShaft);
  set(output.resetting, kFlagReset);
  set(output.undoing, kFlagUndo);
  set(output.undoable, kFlagUndoable);
  set(output.redoing, kFlagRedo);
  set(output.redoable, kFlagRedoable);
  set(output.pedalled, kFlagPedal);
  return flags;
}

/// The pose, as far as it is known: before docking the joint angles have no zero, and what
/// kinematics makes of them is no place. Velocities of the dive to the first known place are none.
void put_pose(const ServoOutput& output, TickRecord& record) noexcept {
  const bool known = output.phase != Phase::off && output.phase != Phase::calibrating;
  if (known) {
    std::ranges::copy(output.position_mm, record.position_mm);
    std::ranges::transform(quaternion_of(output.rotation), record.orientation,
                           [](double q) { return static_cast<float>(q); });
  } else {
    std::ranges::fill(record.position_mm, std::numeric_limits<double>::quiet_NaN());
    std::ranges::fill(record.orientation, std::numeric_limits<float>::quiet_NaN());
  }
  if (known && output.started) {
    put(record.velocity_mm_per_s, output.velocity_mm_per_s);
  } else {
    std::ranges::fill(record.velocity_mm_per_s, std::numeric_limits<float>::quiet_NaN());
  }
}

void put_raw(const DeviceReport& report, TickRecord& record) noexcept {
  std::array<std::uint16_t, 6> words{};
  if (report.kind == DeviceReport::Kind::pose) {
    std::ranges::transform(report.orientation, words.begin(),
                           [](std::int16_t part) { return static_cast<std::uint16_t>(part); });
  } else {
    std::ranges::copy(report.wiper_b, std::ranges::copy(report.wiper_a, words.begin()).out);
  }
  for (std::size_t i = 0; i < 3; ++i) record.raw[kRawEncoder + i] = report.counts[i];
  for (std::size_t i = 0; i < words.size(); ++i) record.raw[kRawPot + i] = words[i];
  record.raw[kRawStatus] = (report.button1 ? 1 : 0) | (report.button2 ? 2 : 0) |
                           (report.parked ? 4 : 0) | (report.homed ? 0 : 8);
  record.raw[kRawDeviceCounter] = static_cast<std::int32_t>(report.counter);
}

}  // namespace

std::uint64_t hash_of_volumes(const AnyServo& servo, std::size_t count) noexcept {
  std::uint64_t hash = kFnv1aBasis;
  for (std::size_t v = 0; v < count; ++v) hash = fnv1a_step(hash, density_hash(servo.density(v)));
  return hash;
}

TickRecord record_of(const DeviceReport& report, const TickCommands& commands,
                     const ServoOutput& output) noexcept {
  TickRecord record{};
  put_raw(report, record);
  record.command = static_cast<std::uint32_t>(commands.command.kind) |
                   (commands.fade_in ? kCommandFadeIn : 0) | commands.missed << kCommandMissedShift;
  record.command_argument = commands.command.argument;
  record.last_command = commands.last_index;
  record.flags = flags_of(report, output);
  std::ranges::copy(output.encoder_counts, record.encoder_counts);
  for (std::size_t i = 0; i < 3; ++i) {
    record.encoder_counts[3 + i] =
        static_cast<std::int32_t>(std::lround(output.gimbal_rad[i] * 1000));
  }
  put_pose(output, record);
  put(record.commanded_force_n, output.commanded_force_n);
  put(record.contact_force_n, output.contact_force_n);
  put(record.modification_force_n, output.modification_n);
  put(record.joint_torque_n_mm, output.torque_n_mm);
  put(record.tip_torque_n_mm, output.tip_torque_n_mm);
  put(record.proxy_offset_mm, output.proxy_offset_mm);
  record.plane_count = output.plane_count;
  for (std::size_t i = 0; i < output.plane_count; ++i) {
    const PlaneLoad<DoubleNumbers>& plane = output.planes[i];
    record.plane_load_n[i] = static_cast<float>(plane.load_n);
    std::ranges::copy(floats(as_doubles(plane.normal)), record.plane_normal + 3 * i);
    std::ranges::copy(floats(as_doubles(plane.lever_mm)), record.plane_arm_mm + 3 * i);
  }
  std::ranges::copy(output.dac_counts, record.dac_counts);
  record.removed = static_cast<std::uint32_t>(std::accumulate(
      output.returned_by_volume.begin(), output.returned_by_volume.end(), output.removed_steps));
  record.port_energy_j = output.absorbed_mj / 1000.0;
  record.port_minimum_j = output.port_minimum_mj / 1000.0;
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    record.*kEnergyColumns[i] = output.energy_steps[i];
  }
  record.output_hash = output.output_hash;
  record.phase = static_cast<std::uint16_t>(output.phase);
  record.press_n = static_cast<float>(output.press_n);
  record.spindle_ratio = static_cast<float>(output.spindle_ratio);
  record.spindle_load = static_cast<float>(output.spindle_load);
  record.active_tool = output.active_tool;
  record.fault = static_cast<std::uint32_t>(output.fault);
  record.stale = output.stale ? 1 : 0;
  return record;
}

DeviceReport report_of(const TickRecord& record, DeviceReport::Kind kind) noexcept {
  DeviceReport report;
  report.kind = kind;
  const auto& raw = record.raw;
  for (std::size_t i = 0; i < 3; ++i) {
    report.counts[i] = static_cast<std::int16_t>(raw[kRawEncoder + i]);
    if (kind == DeviceReport::Kind::pose) continue;
    report.wiper_a[i] = static_cast<std::uint16_t>(raw[kRawPot + i]);
    report.wiper_b[i] = static_cast<std::uint16_t>(raw[kRawPot + 3 + i]);
  }
  for (std::size_t i = 0; i < 4 && kind == DeviceReport::Kind::pose; ++i) {
    report.orientation[i] = static_cast<std::int16_t>(raw[kRawPot + i]);
  }
  report.fresh = record.stale == 0;
  report.button1 = (raw[kRawStatus] & 1) != 0;
  report.button2 = (raw[kRawStatus] & 2) != 0;
  report.parked = (raw[kRawStatus] & 4) != 0;
  report.homed = (raw[kRawStatus] & 8) == 0;
  report.counter = static_cast<std::uint32_t>(raw[kRawDeviceCounter]);
  return report;
}

static_assert(static_cast<std::uint32_t>(ServoCommand::Kind::mark) == kCommandMark);

ServoCommand servo_command(const SegmentCommand& command) noexcept {
  switch (command.kind) {
    case CommandKind::select_tool:
      return {ServoCommand::Kind::select_tool, command.argument, command.arm};
    case CommandKind::hold:
      return {ServoCommand::Kind::hold, command.argument};
    case CommandKind::reset:
      return {ServoCommand::Kind::reset, 0};
    case CommandKind::undo:
      return {ServoCommand::Kind::undo, 0};
    case CommandKind::redo:
      return {ServoCommand::Kind::redo, 0};
    case CommandKind::mark:
      return {ServoCommand::Kind::mark, 0};
  }
  return {};
}

TickCommands commands_of(const TickRecord& record) noexcept {
  return {{static_cast<ServoCommand::Kind>(record.command & kCommandKind), record.command_argument},
          (record.command & kCommandFadeIn) != 0,
          record.command >> kCommandMissedShift,
          record.last_command};
}

TickCommands commands_of(std::span<const TickRecord> records) noexcept {
  TickCommands commands = commands_of(records.front());
  for (std::size_t arm = 1; arm < records.size(); ++arm) {
    const ServoCommand own = commands_of(records[arm]).command;
    if (own.kind != ServoCommand::Kind::select_tool) continue;  // all else is in every record
    commands.command = own;
    commands.command.arm = static_cast<std::uint32_t>(arm);
  }
  return commands;
}

void make_records(const AnyServo& servo, std::span<const DeviceReport> reports,
                  const TickCommands& commands, std::span<const ServoOutput> outputs,
                  std::uint64_t& chain, std::span<TickRecord> records) noexcept {
  make_records(servo, reports, commands, outputs, chain, records,
               [&](const ServoOutput& /*output*/, std::size_t v, const VoxelBox& box) {
                 return changed_box_hash(BrickGrid::of(servo.grid(v)), servo.density(v), box);
               });
}

}  // namespace kerf
