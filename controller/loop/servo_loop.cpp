// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/servo_loop.hpp"

#include <algorithm>
#include <bit>

#include "controller/loop/allocation_counter.hpp"
#include "controller/loop/tick_source.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/threads.hpp"

namespace kerf {
namespace {

/// Statistics of the armed ticks; counts from before arming are subtracted.
class RunStatistics {
 public:
  RunStatistics(RunRecord& record, const TickSource& clock) noexcept
      : record_(record), clock_(clock) {}

  /// Times as the processor took them, in lock-step too.
  struct Spent {
    std::int64_t late_ns, compute_ns, sent_ns, publish_ns;
  };
  void count(Tick tick, const ServoOutput& output, const Spent& spent) noexcept {
    if (output.fault != last_fault_ && output.fault != Fault::none) {
      record_.add_fault(tick, fault_name(output.fault));
    }
    last_fault_ = output.fault;
    if (output.refused && !last_refused_) record_.add_event(tick, "no_free_place");
    last_refused_ = output.refused;
    if (output.resetting && !last_reset_) {
      ++record_.resets;
      record_.add_event(tick, "reset");
    }
    last_reset_ = output.resetting;
    if (output.resetting) {
      record_.removed_steps = {};
      record_.forbidden_ticks = {};
    }
    if (output.undoing && !last_undo_) {
      ++record_.undos;
      record_.add_event(tick, "undo");
    }
    last_undo_ = output.undoing;
    if (output.redoing && !last_redo_) {
      ++record_.redos;
      record_.add_event(tick, "redo");
    }
    last_redo_ = output.redoing;
    for (std::size_t v = 0; v < kMaxVolumes; ++v) {
      record_.removed_steps[v] -= output.returned_by_volume[v];
    }
    if (!output.started) return;
    if (record_.ticks == 0) {
      record_.armed_at_tick = tick;
      start();
    }
    ++record_.ticks;
    record_.stale_ticks += output.stale ? 1 : 0;
    stale_in_a_row_ = output.stale ? stale_in_a_row_ + 1 : 0;
    record_.contact_ticks += output.contact ? 1 : 0;
    record_.shaft_ticks += output.shaft ? 1 : 0;
    const double force_n = vec3::length(output.force_n);
    record_.peak_force_n = std::max(record_.peak_force_n, force_n);
    if (record_.first_force_ns == 0 && output.motors_on && force_n > 0) {
      record_.first_force_ns = spent.sent_ns;
    }
    for (std::size_t v = 0; v < kMaxVolumes; ++v) {
      record_.removed_steps[v] += output.removed_by_volume[v];
    }
    for (std::uint64_t left = output.forbidden_materials; left != 0; left &= left - 1) {
      ++record_.forbidden_ticks[static_cast<std::size_t>(std::countr_zero(left))];
    }
    record_.absorbed_mj = output.absorbed_mj;
    record_.port_minimum_mj = output.port_minimum_mj;
    std::ranges::transform(output.energy_steps, record_.energy_mj.begin(), energy_mj_of_steps);
    record_.output_hash = output.output_hash;
    record_.wake.record(spent.late_ns);
    record_.compute.record(spent.compute_ns);
    record_.publish.record(spent.publish_ns);
  }

  /// The device has gone: ticks without a report since then are no losses on the way.
  void forget_last_stale() noexcept { record_.stale_ticks -= stale_in_a_row_; }

  void start() noexcept {
    overruns_ = clock_.overruns();
    faults_ = thread_faults();
    allocations_ = CountedAllocations::total();
  }

  void finish() noexcept {
    const ThreadFaults faults = thread_faults();
    record_.faults_of_pages = {faults.minor - faults_.minor, faults.major - faults_.major};
    record_.allocations = CountedAllocations::total() - allocations_;
    record_.overruns = clock_.overruns() - overruns_;
  }

 private:
  RunRecord& record_;
  const TickSource& clock_;
  Fault last_fault_ = Fault::none;
  bool last_refused_ = false;
  bool last_reset_ = false;
  bool last_undo_ = false;
  std::uint64_t stale_in_a_row_ = 0;
  bool last_redo_ = false;
  std::uint64_t overruns_ = 0;
  std::uint64_t allocations_ = 0;
  ThreadFaults faults_;
};

}  // namespace

EndReason run_servo(TickSource& clock, DeviceDriver& device, Servo& servo, Publisher& eyes,
                    SegmentServer& commands, const LoopLimits& limits, LoopSignals& signals,
                    RunRecord& record) noexcept {
  EndReason end = EndReason::stopped;
  TickCommands given;
  std::uint64_t silent_ticks = 0;
  const CountedAllocations counted;
  RunStatistics books(record, clock);
  books.start();

  for (Tick tick = 1; !signals.stop.load(std::memory_order_relaxed); ++tick) {
    TickTiming timing;
    timing.late_ns = clock.wait_next();
    timing.heartbeat_ns = monotonic_ns();
    timing.start_ns = clock.start_ns(tick);
    const DeviceReport report = device.read();  // newest pose; never blocks
    given.command = {};
    if (const auto command = commands.take_command()) {
      given.command = servo_command(*command);
      given.last_index = command->index;
      if (!servo.apply(given.command)) record.add_event(tick, "refused_command");
    }
    const char* const stall = recover(signals, clock.stood_still(), servo);
    given.fade_in = stall != nullptr;
    if (given.fade_in) record.add_event(tick, stall);
    const std::int64_t in_hand_ns = monotonic_ns();
    const ServoOutput output = servo.step(report);  // all physics, all limits
    const std::int64_t compute_ns = monotonic_ns() - in_hand_ns;
    timing.compute_ns = clock.takes_time() ? compute_ns : 0;
    timing.missed_deadlines = clock.overruns();
    timing.lost_packets = device.lost();
    timing.refused_packets = device.refused();
    send_tick(output, signals, device);  // the device first,
    const std::int64_t sent_ns = monotonic_ns();
    eyes.publish(tick, report, given, output, timing);  // then the readers
    books.count(tick, output, {timing.late_ns, compute_ns, sent_ns, monotonic_ns() - sent_ns});

    signals.heartbeat.store(tick, std::memory_order_relaxed);
    signals.armed_ticks.store(record.ticks, std::memory_order_relaxed);
    signals.waiting.store(waiting_for(report, output), std::memory_order_relaxed);
    silent_ticks = report.fresh ? 0 : silent_ticks + 1;
    if (record.ticks >= limits.armed_ticks) {
      end = EndReason::ticks_done;
      break;
    }
    if (silent_ticks >= limits.gone_ticks) {
      record.add_fault(tick, "device_gone");
      books.forget_last_stale();
      end = EndReason::device_gone;
      break;
    }
    if (!output.started && tick >= limits.arming_ticks) {
      end = EndReason::never_armed;
      break;
    }
  }
  device.release();  // motors off on the way out
  books.finish();
  return end;
}

std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo) {
  return std::jthread([&watchdog, above = io_thread_of(servo)](const std::stop_token& stop) {
    // Linux keeps a part of each core for ordinary threads (docs/devices.md): if another program
    // uses up the rest, all real-time threads of that core stop together.
    static_cast<void>(avoid_core(above.core));
    static_cast<void>(set_fifo(above.priority));
    while (!stop.stop_requested()) {
      watchdog.look(monotonic_ns());
      std::this_thread::sleep_for(kWatchdogPeriod);
    }
  });
}

}  // namespace kerf
