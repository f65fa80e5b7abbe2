// SPDX-License-Identifier: Apache-2.0
#include "replay/replay_step.hpp"

#include <cstddef>
#include <span>

#include "controller/loop/publisher.hpp"
#include "shared/segment/writer.hpp"
#include "shared/volume/brick_grid.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

/// Copies what the machine of the run determined, so that a replay's log has the run's time axis.
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

std::array<DeviceReport, kMaxArms> reports_of(const ArmRecords& recorded) noexcept {
  return {report_of(recorded[0]), report_of(recorded[1])};
}

std::array<ServoOutput, kMaxArms> give(CompiledScene& servo, const ArmRecords& recorded) noexcept {
  const TickCommands commands = commands_of(of_arms(recorded, servo));
  // As the loop does: the reader's command, the ticks that were missed, then the restart after a
  // stall, then the step.
  if (commands.command.kind != ServoCommand::Kind::none) {
    static_cast<void>(servo.apply(commands.command));
  }
  apply_missed(commands.missed, servo);
  if (commands.fade_in) {
    static_cast<void>(servo.apply({.kind = ServoCommand::Kind::fade_in}));
  }
  const auto reports = reports_of(recorded);
  std::array<ServoOutput, kMaxArms> outputs;
  servo.step(of_arms(reports, servo), of_arms(outputs, servo));
  return outputs;
}

ArmRecords ReplayStep::operator()(const ArmRecords& recorded) noexcept {
  return of(recorded, give(servo_, recorded));
}

ArmRecords ReplayStep::of(const ArmRecords& recorded,
                          const std::array<ServoOutput, kMaxArms>& outputs) noexcept {
  const auto hash_of = [&](std::size_t v, const VoxelBox& box) {
    return changed_box_hash(BrickGrid::of(servo_.grid(v)), servo_.density(v), box);
  };
  ArmRecords records{};
  for (std::size_t arm = 0; arm < servo_.arms(); ++arm) {
    TickRecord& record = records[arm];
    record = record_of(report_of(recorded[arm]), commands_of(recorded[arm]), outputs[arm]);
    put_changes(outputs[arm], hash_of, volume_chain_, record);
    record.penetration_mm = static_cast<float>(servo_.penetration_mm(arm));
    copy_times(recorded[arm], record);
    record.crc32c = tick_record_crc(record);
  }
  return records;
}

}  // namespace kerf
