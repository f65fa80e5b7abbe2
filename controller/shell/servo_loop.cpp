// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/servo_loop.hpp"

#include <algorithm>
#include <cmath>

#include "controller/shell/allocation_counter.hpp"
#include "controller/shell/clock.hpp"

namespace kerf {
namespace {

double length(const std::array<double, 3>& v) noexcept {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

ServoCommand servo_command(const Command& command) noexcept {
  switch (command.kind) {
    case CommandKind::select_tool:
      return {ServoCommand::Kind::select_tool, command.argument};
    case CommandKind::hold:
      return {ServoCommand::Kind::hold, command.argument};
  }
  return {};
}

/// Counts one armed tick.
void count(RunRecord& record, const ServoOutput& output, const TickTiming& timing) noexcept {
  ++record.ticks;
  record.stale_ticks += output.stale ? 1 : 0;
  record.contact_ticks += output.contact ? 1 : 0;
  record.peak_force_n = std::max(record.peak_force_n, length(output.force_n));
  for (std::size_t v = 0; v < kMaxVolumes; ++v) {
    record.removed_steps[v] += output.removed_by_volume[v];
  }
  record.absorbed_mj = output.absorbed_mj;
  record.output_hash = output.output_hash;
  record.wake.record(timing.late_ns);
  record.compute.record(timing.compute_ns);
}

}  // namespace

EndReason run_servo(TickSource& clock, OmniDriver& device, Servo& servo, Publisher& eyes,
                    SegmentServer& commands, const LoopLimits& limits, LoopSignals& signals,
                    RunRecord& record) noexcept {
  EndReason end = EndReason::stopped;
  Fault last_fault = Fault::none;
  std::uint32_t last_command = 0;
  std::uint64_t silent_ticks = 0;
  std::uint64_t overruns_before = 0;
  ThreadFaults faults_before = thread_faults();
  const CountedAllocations counted;
  std::uint64_t allocations_before = CountedAllocations::total();

  for (Tick tick = 1; !signals.stop.load(std::memory_order_relaxed); ++tick) {
    TickTiming timing;
    timing.late_ns = clock.wait_next();
    timing.start_ns = monotonic_ns();
    const DeviceReport report = device.read();  // newest pose; never blocks
    if (const auto command = commands.take_command()) {
      servo.apply(servo_command(*command));
      last_command = command->index;
    }
    if (signals.stalled.exchange(false, std::memory_order_relaxed)) {
      servo.apply({.kind = ServoCommand::Kind::fade_in});
      record.add_event(tick, "watchdog");
    }
    const std::int64_t in_hand_ns = monotonic_ns();
    const ServoOutput output = servo.step(report);  // all physics, all limits
    const std::int64_t ready_ns = monotonic_ns();
    timing.compute_ns = ready_ns - in_hand_ns;
    timing.missed_deadlines = clock.overruns();
    if (signals.stalled.load(std::memory_order_relaxed)) {
      device.release();  // this tick was the stall: its force is late, the next one fades in
    } else {
      device.command(output);  // the hand first,
    }
    const std::int64_t sent_ns = monotonic_ns();
    eyes.publish(tick, report, output, last_command, timing);  // then the eyes
    const std::int64_t published_ns = monotonic_ns();

    signals.heartbeat.store(tick, std::memory_order_relaxed);
    silent_ticks = report.fresh ? 0 : silent_ticks + 1;
    if (output.fault != last_fault) {
      if (output.fault != Fault::none) record.add_fault(tick, fault_name(output.fault));
      last_fault = output.fault;
    }
    if (output.armed) {
      if (record.ticks == 0) {  // figures of a run begin with arming
        record.armed_at_tick = tick;
        overruns_before = clock.overruns();
        faults_before = thread_faults();
        allocations_before = CountedAllocations::total();
      }
      count(record, output, timing);
      record.publish.record(published_ns - sent_ns);
      signals.armed_ticks.store(record.ticks, std::memory_order_relaxed);
    }
    if (record.ticks >= limits.armed_ticks) {
      end = EndReason::ticks_done;
      break;
    }
    if (silent_ticks >= limits.gone_ticks) {
      record.add_fault(tick, "device_gone");
      end = EndReason::device_gone;
      break;
    }
    if (!output.armed && tick >= limits.arming_ticks) {
      end = EndReason::never_armed;
      break;
    }
  }
  device.release();  // motors off on the way out
  const ThreadFaults faults = thread_faults();
  record.faults_of_pages = {faults.minor - faults_before.minor, faults.major - faults_before.major};
  record.allocations = CountedAllocations::total() - allocations_before;
  record.overruns = clock.overruns() - overruns_before;
  return end;
}

}  // namespace kerf
