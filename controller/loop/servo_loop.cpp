// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/servo_loop.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <span>
#include <utility>

#include "controller/loop/allocation_counter.hpp"
#include "controller/loop/tick_source.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/threads.hpp"

namespace kerf {
namespace {

/// Statistics of the armed ticks of one arm.
class ArmStatistics {
 public:
  explicit ArmStatistics(ArmRecord& record) noexcept : record_(record) {}

  void count(Tick tick, const ServoOutput& output) noexcept {
    if (output.fault != last_fault_ && output.fault != Fault::none) {
      record_.faults.add(tick, fault_name(output.fault));
    }
    last_fault_ = output.fault;
    if (!output.started) return;
    record_.in_use = true;
    is_gone_ = is_gone_ && output.stale;
    stale_in_a_row_ = output.stale ? stale_in_a_row_ + 1 : 0;
    record_.stale_ticks += output.stale && !is_gone_ ? 1 : 0;
    record_.contact_ticks += output.contact ? 1 : 0;
    record_.shaft_ticks += output.shaft ? 1 : 0;
    record_.peak_force_n = std::max(record_.peak_force_n, vec3::length(output.commanded_force_n));
    record_.sharpness = output.sharpness;
    record_.absorbed_mj = output.absorbed_mj;
    record_.port_minimum_mj = output.port_minimum_mj;
    std::ranges::transform(output.energy_steps, record_.energy_mj.begin(), energy_mj_of_steps);
    record_.output_hash = output.output_hash;
  }

  /// The device has gone: ticks without a report since then are no losses on the way, nor are those
  /// until it comes back.
  void lose_device() noexcept {
    record_.stale_ticks -= stale_in_a_row_;
    is_gone_ = true;
  }

 private:
  ArmRecord& record_;
  Fault last_fault_ = Fault::none;
  std::uint64_t stale_in_a_row_ = 0;
  bool is_gone_ = false;
};

/// Statistics of the armed ticks of a run; counts from before arming are subtracted.
class RunStatistics {
 public:
  RunStatistics(RunRecord& record, const TickSource& clock) noexcept
      : record_(record), clock_(clock) {}

  /// Times as the processor took them, in lock-step too.
  struct Spent {
    std::int64_t late_ns, compute_ns, sent_ns, publish_ns;
  };
  void count(Tick tick, std::span<const ServoOutput> outputs, const Spent& spent) noexcept {
    for (std::size_t a = 0; a < outputs.size(); ++a) {
      arms_[a].count(tick, outputs[a]);
      follow(outputs[a].refused, last_refused_[a], "no_free_place", tick);
    }
    count_restores(tick, outputs.front());
    if (std::ranges::none_of(outputs, &ServoOutput::started)) return;
    if (record_.ticks == 0) {
      record_.armed_at_tick = tick;
      start();
    }
    ++record_.ticks;
    std::uint64_t forbidden = 0;
    for (const ServoOutput& output : outputs) {
      if (record_.first_force_ns == 0 && output.motors_on &&
          vec3::length(output.commanded_force_n) > 0) {
        record_.first_force_ns = spent.sent_ns;
      }
      for (std::size_t v = 0; v < kMaxVolumes; ++v) {
        record_.removed_steps[v] += output.removed_by_volume[v];
      }
      forbidden |= output.forbidden_materials;
      if (record_.pulp) record_.pulp->add(output.spindle_load, output.spindle_ratio);
    }
    if (record_.pulp) record_.pulp->advance();
    for (; forbidden != 0; forbidden &= forbidden - 1) {
      ++record_.forbidden_ticks[static_cast<std::size_t>(std::countr_zero(forbidden))];
    }
    record_.wake.record(spent.late_ns);
    record_.compute.record(spent.compute_ns);
    record_.publish.record(spent.publish_ns);
  }

  /// The device of an arm has gone.
  void lose(Tick tick, std::size_t arm) noexcept {
    record_.arm(arm).faults.add(tick, "device_gone");
    arms_[arm].lose_device();
  }

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
  /// Whether a state begins in this tick; then it is an event.
  bool follow(bool now, bool& last, const char* name, Tick tick) noexcept {
    const bool begins = now && !last;
    last = now;
    if (begins) record_.add_event(tick, name);
    return begins;
  }

  /// The volumes are those of all arms, and what comes back to them is in the first output.
  void count_restores(Tick tick, const ServoOutput& first) noexcept {
    if (follow(first.resetting, last_reset_, "reset", tick)) ++record_.resets;
    if (first.resetting) {
      record_.removed_steps = {};
      record_.forbidden_ticks = {};
      if (record_.pulp) record_.pulp->restart();
    }
    if (follow(first.undoing, last_undo_, "undo", tick)) ++record_.undos;
    if (follow(first.redoing, last_redo_, "redo", tick)) ++record_.redos;
    for (std::size_t v = 0; v < kMaxVolumes; ++v) {
      record_.removed_steps[v] -= first.returned_by_volume[v];
    }
  }

  RunRecord& record_;
  const TickSource& clock_;
  std::array<ArmStatistics, kMaxArms> arms_{ArmStatistics(record_), ArmStatistics(record_.second)};
  std::array<bool, kMaxArms> last_refused_{};
  bool last_reset_ = false;
  bool last_undo_ = false;
  bool last_redo_ = false;
  std::uint64_t overruns_ = 0;
  std::uint64_t allocations_ = 0;
  ThreadFaults faults_;
};

/// Ticks that were skipped, from one tick to the next.
class MissedTicks {
 public:
  explicit MissedTicks(std::uint64_t overruns) noexcept : overruns_(overruns) {}

  /// Once per tick, with the clock's count.
  [[nodiscard]] std::uint32_t next(std::uint64_t overruns) noexcept {
    const std::uint64_t missed = overruns - std::exchange(overruns_, overruns);
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(missed, kMostMissed));
  }

 private:
  std::uint64_t overruns_;
};

/// Which devices have stopped sending.
class SilentDevices {
 public:
  SilentDevices(std::size_t count, std::uint64_t gone_ticks) noexcept
      : count_(count), gone_ticks_(gone_ticks) {}

  [[nodiscard]] bool is_gone(std::size_t arm) const noexcept { return ticks_[arm] >= gone_ticks_; }

  /// After each tick. Returns whether no device is left; `lose` is called for each that goes.
  bool follow(std::span<const DeviceReport> reports, const auto& lose) noexcept {
    bool is_left = false;
    for (std::size_t a = 0; a < count_; ++a) {
      ticks_[a] = reports[a].fresh ? 0 : ticks_[a] + 1;
      if (ticks_[a] == gone_ticks_) lose(a);
      is_left = is_left || !is_gone(a);
    }
    return !is_left;
  }

 private:
  std::size_t count_;
  std::uint64_t gone_ticks_;
  std::array<std::uint64_t, kMaxArms> ticks_{};
};

/// At most one command of a reader.
void take_command(SegmentServer& server, TickCommands& commands) noexcept {
  commands.command = {};
  const auto command = server.take_command();
  if (!command) return;
  commands.command = servo_command(*command);
  commands.last_index = command->index;
}

/// The newest force that a program has given each arm since the last tick.
void take_forces(ExternalPage& external, AnyServo& servo) noexcept {
  ProgramForce force;
  for (std::size_t a = 0; a < servo.arms(); ++a) {
    if (external.take(a, force) && !servo.give_force(a, force)) external.refuse(a);
  }
}

/// The tick for the program, the first arm last: one that sees its tick finds the other's.
void show_forces(const Publisher& publisher, ExternalPage& external, std::size_t arms) noexcept {
  for (std::size_t a = arms; a-- > 0;) external.publish(a, publisher.record(a));
}

void count_packets(const Devices& devices, TickTiming& timing) noexcept {
  for (std::size_t a = 0; a < devices.size(); ++a) {
    timing.lost_packets[a] = devices[a].lost();
    timing.refused_packets[a] = devices[a].refused();
  }
}

/// Reports the end of a tick to the watchdog, and of each device what it waits for.
void signal_tick(LoopSignals& signals, Tick tick, std::span<const DeviceReport> reports,
                 std::span<const ServoOutput> outputs, const SilentDevices& silent) noexcept {
  signals.heartbeat.store(tick, std::memory_order_relaxed);
  for (std::size_t a = 0; a < reports.size(); ++a) {
    const Waiting waiting = silent.is_gone(a) ? Waiting::gone : waiting_for(reports[a], outputs[a]);
    signals.waiting[a].store(waiting, std::memory_order_relaxed);
  }
}

}  // namespace

EndReason run_servo(TickSource& clock, const Devices& devices, AnyServo& servo,
                    Publisher& publisher, SegmentServer& server, const LoopLimits& limits,
                    LoopSignals& signals, RunRecord& record, ExternalPage* external) noexcept {
  EndReason end = EndReason::stopped;
  TickCommands commands;
  const CountedAllocations counted;
  RunStatistics statistics(record, clock);
  statistics.start();
  MissedTicks missed(clock.overruns());
  SilentDevices silent_devices(devices.size(), limits.gone_ticks);
  std::array<DeviceReport, kMaxArms> all_reports;
  std::array<ServoOutput, kMaxArms> all_outputs;
  const auto reports = std::span(all_reports).first(devices.size());
  const auto outputs = std::span(all_outputs).first(devices.size());

  for (Tick tick = 1; !signals.stop.load(std::memory_order_relaxed); ++tick) {
    TickTiming timing;
    timing.late_ns = clock.wait_next();
    timing.heartbeat_ns = monotonic_ns();
    timing.start_ns = clock.start_ns(tick);
    for (std::size_t a = 0; a < reports.size(); ++a) {
      reports[a] = devices[a].read();  // newest pose; never blocks
    }
    take_command(server, commands);
    if (external != nullptr) take_forces(*external, servo);
    commands.missed = missed.next(clock.overruns());
    const char* const stall = stall_before(signals, clock.stood_still());
    commands.fade_in = stall != nullptr;
    if (!apply_commands(commands, servo)) record.add_event(tick, "refused_command");
    if (commands.fade_in) record.add_event(tick, stall);
    const std::int64_t in_hand_ns = monotonic_ns();
    servo.step(reports, outputs);  // all physics, all limits
    const std::int64_t compute_ns = monotonic_ns() - in_hand_ns;
    timing.compute_ns = clock.takes_time() ? compute_ns : 0;
    timing.missed_deadlines = clock.overruns();
    count_packets(devices, timing);
    send_tick(outputs, signals, devices);  // the devices first,
    const std::int64_t sent_ns = monotonic_ns();
    publisher.publish(tick, reports, commands, outputs, timing);  // then the readers
    if (external != nullptr) show_forces(publisher, *external, outputs.size());
    statistics.count(tick, outputs,
                     {timing.late_ns, compute_ns, sent_ns, monotonic_ns() - sent_ns});

    signal_tick(signals, tick, reports, outputs, silent_devices);
    signals.armed_ticks.store(record.ticks, std::memory_order_relaxed);
    if (record.ticks >= limits.armed_ticks) {
      end = EndReason::ticks_done;
      break;
    }
    if (silent_devices.follow(reports, [&](std::size_t arm) { statistics.lose(tick, arm); })) {
      end = EndReason::device_gone;
      break;
    }
    if (record.ticks == 0 && tick >= limits.arming_ticks) {
      end = EndReason::never_armed;
      break;
    }
  }
  devices.release();  // motors off on the way out
  statistics.finish();
  return end;
}

std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo) {
  return std::jthread([&watchdog, above = io_thread_of(servo)](const std::stop_token& stop) {
    // Linux keeps a part of each core for ordinary threads (docs/first-hour.md): if another program
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
