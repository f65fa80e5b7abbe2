// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/servo/servo.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/layout.hpp"
#include "shared/volume/voxel_grid.hpp"

// A tick as a record of segment and log: made from what the servo was given and what it returned,
// and back. The loop, a replay, a tab and the interface for other programs all make it here.

namespace kerf {

/// A reader's command, valid or not, as the servo gets it; `none` for a kind that it lacks.
[[nodiscard]] ServoCommand servo_command(const SegmentCommand& command) noexcept;

/// What the servo was given in a tick besides the report: with it and the reports a run can be
/// repeated (replay/replayed_ticks.hpp).
struct TickCommands {
  ServoCommand command{};        ///< of a reader; `none` in most ticks
  bool fade_in = false;          ///< behind it, after a stall
  std::uint32_t missed = 0;      ///< ticks that were skipped before this one, at most kMostMissed
  std::uint32_t last_index = 0;  ///< `SegmentCommand::index` of the last one so far
};

/// Applies what a tick is given, in the order of every loop: the reader's command, the ticks that
/// were missed, the restart after a stall. The step follows. Returns false if the servo refuses the
/// reader's command.
inline bool apply_commands(const TickCommands& commands, AnyServo& servo) noexcept {
  const bool taken =
      commands.command.kind == ServoCommand::Kind::none || servo.apply(commands.command);
  if (commands.missed > 0) {
    static_cast<void>(
        servo.apply({.kind = ServoCommand::Kind::missed, .argument = commands.missed}));
  }
  if (commands.fade_in) {
    static_cast<void>(servo.apply({.kind = ServoCommand::Kind::fade_in}));
  }
  return taken;
}

/// The commands of a tick as an arm gets them: a tool of the other one is none.
[[nodiscard]] inline TickCommands commands_for(std::size_t arm, TickCommands commands) noexcept {
  const bool for_one = commands.command.kind == ServoCommand::Kind::select_tool;
  if (for_one && commands.command.arm != arm) commands.command = {};
  return commands;
}

/// The record of a tick of an arm, as far as report, commands and output determine it: all but
/// number, times, losses, changed boxes with their hashes, penetration and checksum.
[[nodiscard]] TickRecord record_of(const DeviceReport& report, const TickCommands& commands,
                                   const ServoOutput& output) noexcept;
/// The report in a record, and what `record_of` was given as commands.
[[nodiscard]] DeviceReport report_of(const TickRecord& record, DeviceReport::Kind kind) noexcept;
[[nodiscard]] TickCommands commands_of(const TickRecord& record) noexcept;
/// The commands of a tick, from the records of all arms.
[[nodiscard]] TickCommands commands_of(std::span<const TickRecord> records) noexcept;

/// Puts the boxes that changed into the record, and steps the chain of their hashes. `hash_of` a
/// volume and its box gives the hash of the densities there.
template <class HashOf>
void put_changes(const ServoOutput& output, const HashOf& hash_of, std::uint64_t& chain,
                 TickRecord& record) noexcept {
  const auto narrow = [](std::int32_t value) { return static_cast<std::uint16_t>(value); };
  const auto store = [&](std::uint16_t(&to)[3], VoxelIndex from) {
    to[0] = narrow(from.x);
    to[1] = narrow(from.y);
    to[2] = narrow(from.z);
  };
  for (std::size_t v = 0; v < output.changed.size(); ++v) {
    const VoxelBox& box = output.changed[v];
    if (box.empty()) continue;
    if (record.dirty_volumes == 0) {
      store(record.dirty_lo, box.lo);
      store(record.dirty_hi, box.hi);
    }
    record.dirty_volumes |= 1U << v;
    chain = fnv1a_step(chain, hash_of(v, box));
  }
  record.volume_hash = chain;
}

/// The records of a tick of all arms, after its step: all but number, times, losses and checksum.
/// `chain`: of the volumes' hashes so far, stepped. `hash_of` an output, a volume and its box gives
/// the hash of the densities there.
template <class HashOf>
void make_records(const AnyServo& servo, std::span<const DeviceReport> reports,
                  const TickCommands& commands, std::span<const ServoOutput> outputs,
                  std::uint64_t& chain, std::span<TickRecord> records,
                  const HashOf& hash_of) noexcept {
  for (std::size_t arm = 0; arm < outputs.size(); ++arm) {
    const ServoOutput& output = outputs[arm];
    records[arm] = record_of(reports[arm], commands_for(arm, commands), output);
    put_changes(
        output, [&](std::size_t v, const VoxelBox& box) { return hash_of(output, v, box); }, chain,
        records[arm]);
    records[arm].penetration_mm = static_cast<float>(servo.penetration_mm(arm));
  }
}
/// Makes the records; their hashes are those of the servo's own densities.
void make_records(const AnyServo& servo, std::span<const DeviceReport> reports,
                  const TickCommands& commands, std::span<const ServoOutput> outputs,
                  std::uint64_t& chain, std::span<TickRecord> records) noexcept;

/// Hash of the first `count` volumes as they are now: `volume_hash` of report.json. While no step
/// runs.
[[nodiscard]] std::uint64_t hash_of_volumes(const AnyServo& servo, std::size_t count) noexcept;

}  // namespace kerf
