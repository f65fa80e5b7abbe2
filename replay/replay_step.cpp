// SPDX-License-Identifier: Apache-2.0
#include "replay/replay_step.hpp"

#include <cstddef>

#include "controller/loop/publisher.hpp"
#include "shared/segment/writer.hpp"
#include "shared/volume/brick_grid.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

/// What belongs to the machine of the run: so a replay's log has the time axis of the run.
void copy_times(const TickRecord& from, TickRecord& to) noexcept {
  to.seq = from.seq;
  to.tick = from.tick;
  to.start_ns = from.start_ns;
  to.period_error_ns = from.period_error_ns;
  to.execution_ns = from.execution_ns;
  to.missed_deadlines = from.missed_deadlines;
  to.lost_packets = from.lost_packets;
  to.refused_packets = from.refused_packets;
}

}  // namespace

ServoOutput give(CompiledScene& servo, const TickRecord& recorded) noexcept {
  const TickCommands commands = commands_of(recorded);
  // As the loop does: the reader's command, then the restart after a stall, then the step.
  if (commands.command.kind != ServoCommand::Kind::none) {
    static_cast<void>(servo.apply(commands.command));
  }
  if (commands.fade_in) {
    static_cast<void>(servo.apply({.kind = ServoCommand::Kind::fade_in}));
  }
  return servo.step(report_of(recorded));
}

TickRecord ReplayStep::operator()(const TickRecord& recorded) noexcept {
  const ServoOutput output = give(servo_, recorded);
  TickRecord record = record_of(report_of(recorded), commands_of(recorded), output);
  const auto hash_of = [&](std::size_t v, const VoxelBox& box) {
    return changed_box_hash(BrickGrid::of(servo_.grid(v)), servo_.density(v), box);
  };
  put_changes(output, hash_of, volume_chain_, record);
  record.penetration_mm = static_cast<float>(servo_.penetration_mm());
  copy_times(recorded, record);
  record.crc32c = tick_record_crc(record);
  return record;
}

}  // namespace kerf
