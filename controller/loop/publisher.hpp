// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/servo/servo.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// Times and losses of a tick, which the loop knows and the servo step must not.
struct TickTiming {
  std::int64_t start_ns = 0;      ///< as TickSource has it
  std::int64_t heartbeat_ns = 0;  ///< CLOCK_MONOTONIC, in lock-step too
  std::int64_t late_ns = 0;
  std::int64_t compute_ns = 0;  ///< 0 in lock-step
  std::uint64_t missed_deadlines = 0;
  std::array<std::uint64_t, kMaxArms> lost_packets{};
  std::array<std::uint64_t, kMaxArms> refused_packets{};
};

/// A reader's command, valid or not, as the servo gets it; `none` for a kind that it lacks.
[[nodiscard]] ServoCommand servo_command(const Command& command) noexcept;

/// What the servo was given in a tick besides the report: with it and the reports a run can be
/// repeated (replay/replayed_ticks.hpp).
struct TickCommands {
  ServoCommand command;          ///< of a reader; `none` in most ticks
  bool fade_in = false;          ///< behind it, after a stall
  std::uint32_t missed = 0;      ///< ticks that were skipped before this one, at most kMostMissed
  std::uint32_t last_index = 0;  ///< `Command::index` of the last one so far
};

/// Applies to the servo that so many ticks were skipped before this one; 0 changes nothing.
inline void apply_missed(std::uint32_t missed, Servo& servo) noexcept {
  if (missed == 0) return;
  static_cast<void>(servo.apply({.kind = ServoCommand::Kind::missed, .argument = missed}));
}

/// The commands of a tick as an arm gets them: a tool of the other one is none.
[[nodiscard]] inline TickCommands commands_for(std::size_t arm, TickCommands commands) noexcept {
  const bool for_one = commands.command.kind == ServoCommand::Kind::select_tool;
  if (for_one && commands.command.arm != arm) commands.command = {};
  return commands;
}

/// The record of a tick of an arm, as far as report, commands and output determine it: all but
/// times, losses, hashes of volumes and penetration.
[[nodiscard]] TickRecord record_of(const DeviceReport& report, const TickCommands& commands,
                                   const ServoOutput& output) noexcept;
/// The report in a record, and what `record_of` was given as commands.
[[nodiscard]] DeviceReport report_of(const TickRecord& record) noexcept;
[[nodiscard]] TickCommands commands_of(const TickRecord& record) noexcept;
/// The same of a tick with the records of all arms.
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

/// Hash of the first `count` volumes as they are now: `volume_hash` of a report. While no step
/// runs.
[[nodiscard]] std::uint64_t hash_of_volumes(const Servo& servo, std::size_t count) noexcept;

/// The segment of this scene. Points into the scene: call it before `take`.
[[nodiscard]] SegmentSpec segment_spec(const LoadedScene& scene, const std::string& json,
                                       std::uint64_t hash);

/// Publishes each tick to the readers of the segment, after the device has its command.
///
/// Servo thread only; wait-free, no system call, no allocation.
class Publisher {
 public:
  Publisher(SegmentWriter& segment, const Servo& servo) noexcept
      : segment_(segment), servo_(servo) {}

  /// `reports` and `outputs` by arm.
  void publish(Tick tick, std::span<const DeviceReport> reports, const TickCommands& commands,
               std::span<const ServoOutput> outputs, const TickTiming& timing) noexcept;

 private:
  void publish_volumes(const ServoOutput& output, TickRecord& record) noexcept;

  SegmentWriter& segment_;
  const Servo& servo_;
  bool held_ = false;                         ///< as published
  std::uint64_t removal_hash_ = kFnv1aBasis;  ///< chain over the changed boxes
};

}  // namespace kerf
