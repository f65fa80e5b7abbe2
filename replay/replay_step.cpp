// SPDX-License-Identifier: Apache-2.0
#include "replay/replay_step.hpp"

#include <array>
#include <cstddef>
#include <span>

#include "controller/tick/tick_record.hpp"

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

std::array<DeviceReport, kMaxArms> reports_of(const ArmRecords& recorded,
                                              const AnyServo& servo) noexcept {
  std::array<DeviceReport, kMaxArms> reports;
  for (std::size_t arm = 0; arm < servo.arms(); ++arm) {
    reports[arm] = report_of(recorded[arm], servo.report_kind(arm));
  }
  return reports;
}

std::array<ServoOutput, kMaxArms> give(CompiledScene& servo, const ArmRecords& recorded) noexcept {
  static_cast<void>(apply_commands(commands_of(of_arms(recorded, servo)), servo));
  for (std::size_t arm = 0; arm < servo.arms(); ++arm) {
    servo.repeat_force(arm, std::to_array(recorded[arm].contact_force_n));
  }
  const auto reports = reports_of(recorded, servo);
  std::array<ServoOutput, kMaxArms> outputs;
  servo.step(of_arms(reports, servo), of_arms(outputs, servo));
  return outputs;
}

ArmRecords ReplayStep::operator()(const ArmRecords& recorded) noexcept {
  return of(recorded, give(servo_, recorded));
}

ArmRecords ReplayStep::of(const ArmRecords& recorded,
                          const std::array<ServoOutput, kMaxArms>& outputs) noexcept {
  const auto reports = reports_of(recorded, servo_);
  ArmRecords records{};
  make_records(servo_, of_arms(reports, servo_), commands_of(of_arms(recorded, servo_)),
               of_arms(outputs, servo_), volume_chain_, of_arms(records, servo_));
  for (std::size_t arm = 0; arm < servo_.arms(); ++arm) {
    copy_times(recorded[arm], records[arm]);
    records[arm].crc32c = tick_record_crc(records[arm]);
  }
  return records;
}

}  // namespace kerf
