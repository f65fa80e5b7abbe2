// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/run_threads.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "controller/shell/guard/call_guard.hpp"
#include "controller/shell/guard/motor_guard.hpp"
#include "controller/shell/log_line.hpp"
#include "controller/shell/publisher.hpp"
#include "controller/shell/watchdog.hpp"
#include "shared/posix/endless_step.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/progress_bar.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

constexpr std::chrono::milliseconds kLookPeriod{5};

/// Nothing ends a thread that loops: its program goes, as in a crash, and says why. Readers keep
/// all ticks before it.
[[noreturn]] void end_looping_servo(const Run& run, std::uint64_t tick) {
  static_cast<void>(run.device.release_for_good());
  run.segment.set_lifecycle(Lifecycle::fault);
  log_error("the step after tick " + std::to_string(tick) + " did not end in " +
            std::to_string(EndlessStep::kMostSeconds) +
            " s; motors off; give every loop of your law a bound that does not depend on its input "
            "(the lab tries it: law NAME)");
  constexpr std::chrono::milliseconds kBusCycles{2};  // as after a crash
  std::this_thread::sleep_for(kBusCycles);
  std::_Exit(1);
}

/// Main thread while the servo runs: draws the progress bar, says what the device waits for, and
/// looks after steps that do not end.
void show_progress(const LoopSignals& signals, const std::atomic<bool>& ended, const Run& run,
                   EndlessStep& step) {
  const ControllerOptions& options = run.options;
  const ProgressBar bar(options.progress);
  WaitTeller teller;
  while (!ended.load()) {
    if (step.look()) end_looping_servo(run, signals.heartbeat.load(std::memory_order_relaxed));
    const Waiting waiting = signals.waiting.load(std::memory_order_relaxed);
    const std::string waits = text_of(run.personality, waiting);
    const double servo_s =
        static_cast<double>(signals.heartbeat.load(std::memory_order_relaxed)) / run.rate_hz;
    if (teller.look(waiting, monotonic_ns(), static_cast<std::int64_t>(servo_s * kNsPerSecond))) {
      bar.hide();
      log_note(waits);
    }
    const double done_s = static_cast<double>(signals.armed_ticks.load()) / run.rate_hz;
    char text[64];
    std::snprintf(text, sizeof text, "%.1f s", done_s);
    bar.show(options.seconds ? done_s / *options.seconds : 0, done_s > 0 ? text : waits);
    for (int i = 0; i < 10 && !ended.load(); ++i) std::this_thread::sleep_for(kLookPeriod);
  }
}

LoopLimits limits_of(const ControllerOptions& options, double rate_hz) {
  LoopLimits limits;
  if (options.seconds) {
    limits.armed_ticks = static_cast<std::uint64_t>(std::llround(*options.seconds * rate_hz));
  }
  limits.gone_ticks = static_cast<std::uint64_t>(2 * rate_hz);
  limits.arming_ticks = static_cast<std::uint64_t>(std::llround(options.wait_s * rate_hz));
  return limits;
}

/// The servo thread from its first to its last tick. Throws where --strict misses a right.
EndReason serve(const Run& run, LoopSignals& signals, CallGuard* calls) {
  const ControllerOptions& options = run.options;
  if (!options.virtual_time) {
    const auto missing = become_real_time(options.real_time);
    accept_rights(missing, options.real_time.strict);
    auto& all = run.report.missing_rights;
    all.insert(all.end(), missing.begin(), missing.end());
  }
  Publisher eyes(run.segment, run.servo);
  RealTimeTicks real_time(kNsPerSecond / run.rate_hz, options.real_time.spin_us * 1000);
  std::optional<TickLeash> leash;
  if (!options.until.empty()) leash.emplace(options.until, run.stop);
  LockStepTicks lock_step(run.device, leash ? &*leash : nullptr);
  TickSource& clock = options.virtual_time ? static_cast<TickSource&>(lock_step) : real_time;
  if (calls != nullptr) calls->enter(run.port);
  const EndReason end = run_servo(clock, run.device, run.servo, eyes, run.server,
                                  limits_of(options, run.rate_hz), signals, run.report.record);
  if (calls != nullptr) calls->leave();
  return end;
}

/// The end as the guard knows it: what looked like a wish to stop may have been its own.
EndReason end_by(const CallGuard& calls, EndReason end, RunReport& report) {
  report.unexpected_call = calls.unexpected();
  if (report.unexpected_call.empty()) return end;
  log_error("--guard: system call " + report.unexpected_call +
            " on the servo thread; motors off; keep it out of the loop");
  report.record.add_fault(report.record.armed_at_tick + report.record.ticks, "unexpected_call");
  return EndReason::unexpected_call;
}

}  // namespace

void accept_rights(const std::vector<MissingRight>& missing, bool strict) {
  for (const MissingRight& right : missing) {
    if (strict) {
      throw std::runtime_error("--strict: no " + right.what + "; without it " + right.effect);
    }
    log_warning("no " + right.what + ": " + right.effect);
  }
}

EndReason run_threads(const Run& run) {
  LoopSignals signals{run.stop};
  Watchdog watchdog(run.device, signals);
  std::atomic<bool> ended{false};
  EndReason end = EndReason::stopped;
  std::exception_ptr failure;
  std::optional<CallGuard> calls;
  {
    MotorGuard guard(run.device);
    if (run.options.guard) calls.emplace(run.device, run.stop);
    // The watchdog first: where there is no thread for one of the two, no servo runs without it.
    std::jthread watching;
    if (!run.options.virtual_time) {
      watching = start_watchdog(watchdog, run.options.real_time);
    }
    std::jthread servo_thread([&] {
      const HandlerStack handlers = guard.guard_stack();
      try {
        end = serve(run, signals, calls ? &*calls : nullptr);
      } catch (...) {
        failure = std::current_exception();
      }
      ended = true;
    });
    const StopSignalsElsewhere to_the_threads_above;
    EndlessStep step(servo_thread.native_handle(), signals.heartbeat);
    try {
      show_progress(signals, ended, run, step);
    } catch (...) {
      run.stop = true;  // or the servo would be waited for in vain
      throw;
    }
  }
  run.report.watchdog_trips = watchdog.trips();
  run.report.waiting = text_of(run.personality, signals.waiting.load());
  if (failure) std::rethrow_exception(failure);
  return calls ? end_by(*calls, end, run.report) : end;
}

}  // namespace kerf
