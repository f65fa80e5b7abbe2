// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "controller/device/device_driver.hpp"
#include "controller/device/devices.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/loop/motor_guard.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/servo_loop.hpp"
#include "controller/loop/wait_state.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/gain_margin.hpp"
#include "controller/run/controller_options.hpp"
#include "controller/run/probe.hpp"
#include "controller/run/run_report.hpp"
#include "controller/run/run_start.hpp"
#include "controller/run/scene_check.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/posix/threads.hpp"
#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/material.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {
namespace {

/// Shared by the threads of a run.
struct Run {
  const ControllerOptions& options;
  const std::vector<std::string>& ports;  ///< those of `--port`, with `auto` resolved
  const LoadedScene& scene;
  int rate_hz;
  SegmentWriter& segment;
  SegmentServer& server;
  AnyServo& servo;
  ExternalPage* external;
  Devices devices;
  std::atomic<bool>& stop;
  RunReport& report;
};

constexpr std::chrono::milliseconds kLookPeriod{5};

/// A looping thread cannot be ended: the program ends, as in a crash, and logs why. Readers keep
/// all ticks before it.
[[noreturn]] void end_looping_servo(const Run& run, std::uint64_t tick) {
  static_cast<void>(run.devices.release_for_good());
  run.segment.set_lifecycle(Lifecycle::fault);
  log_error("the step after tick " + std::to_string(tick) + " did not end in " +
            std::to_string(StepWatchdog::kMostSeconds) +
            " s; motors off; give every loop of your law a bound that does not depend on its input "
            "(the lab tries it: law NAME)");
  constexpr std::chrono::milliseconds kBusCycles{2};  // as after a crash
  std::this_thread::sleep_for(kBusCycles);
  std::_Exit(1);
}

/// What a device waits for; of two, with which it is.
std::string waits_of(const Run& run, std::size_t arm, Waiting waiting) {
  const std::string text = text_of(device_of(run.scene, arm).personality, waiting);
  if (text.empty() || run.devices.size() == 1) return text;
  return "arm " + std::to_string(arm + 1) + ": " + text;
}

/// The text of the first arm that waits; empty if none does.
std::string waits_of(const Run& run, const LoopSignals& signals) {
  for (std::size_t arm = 0; arm < run.devices.size(); ++arm) {
    std::string text = waits_of(run, arm, signals.waiting[arm].load(std::memory_order_relaxed));
    if (!text.empty()) return text;
  }
  return "";
}

/// Main thread while the servo runs: draws the progress bar, logs what the device waits for, and
/// checks for steps that do not end.
void show_progress(const LoopSignals& signals, const std::atomic<bool>& ended, const Run& run,
                   StepWatchdog& step) {
  const ControllerOptions& options = run.options;
  const ProgressBar bar(options.progress);
  std::array<WaitNotice, kMaxArms> tellers;
  while (!ended.load()) {
    if (step.look()) end_looping_servo(run, signals.heartbeat.load(std::memory_order_relaxed));
    const double servo_s =
        static_cast<double>(signals.heartbeat.load(std::memory_order_relaxed)) / run.rate_hz;
    for (std::size_t arm = 0; arm < run.devices.size(); ++arm) {
      const Waiting waiting = signals.waiting[arm].load(std::memory_order_relaxed);
      const auto servo_ns = static_cast<std::int64_t>(servo_s * kNsPerSecond);
      if (!tellers[arm].look(waiting, monotonic_ns(), servo_ns)) continue;
      bar.hide();
      log_note(waits_of(run, arm, waiting));
    }
    const double done_s = static_cast<double>(signals.armed_ticks.load()) / run.rate_hz;
    char text[64];
    std::snprintf(text, sizeof text, "%.1f s", done_s);
    bar.show(options.seconds ? done_s / *options.seconds : 0,
             done_s > 0 ? text : waits_of(run, signals));
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

/// Warns of each missing right, or refuses under --strict.
void accept_rights(const std::vector<MissingRight>& missing, bool strict) {
  for (const MissingRight& right : missing) {
    if (strict) {
      throw std::runtime_error("--strict: no " + right.what + "; without it " + right.effect);
    }
    log_warning("no " + right.what + ": " + right.effect);
  }
}

/// The servo thread from its first to its last tick. Throws for a missing right under --strict.
EndReason serve(const Run& run, LoopSignals& signals, CallGuard* calls) {
  const ControllerOptions& options = run.options;
  if (!options.virtual_time) {
    const auto missing = become_real_time(options.real_time);
    accept_rights(missing, options.real_time.strict);
    auto& all = run.report.missing_rights;
    all.insert(all.end(), missing.begin(), missing.end());
  }
  Publisher publisher(run.segment, run.servo);
  RealTimeTicks real_time(kNsPerSecond / run.rate_hz, options.real_time.spin_us * 1000);
  std::optional<TickGate> gate;
  if (!options.until.empty()) gate.emplace(options.until, run.stop);
  LockStepTicks lock_step(run.devices, kNsPerSecond / run.rate_hz, gate ? &*gate : nullptr);
  TickSource& clock = options.virtual_time ? static_cast<TickSource&>(lock_step) : real_time;
  if (calls != nullptr) calls->enter(run.ports);
  const EndReason end =
      run_servo(clock, run.devices, run.servo, publisher, run.server,
                limits_of(options, run.rate_hz), signals, run.report.record, run.external);
  if (calls != nullptr) calls->leave();
  return end;
}

/// The end after a check of the guard, which stops the loop in the same way as a signal.
EndReason end_by(const CallGuard& calls, EndReason end, RunReport& report) {
  report.unexpected_call = calls.unexpected();
  if (report.unexpected_call.empty()) return end;
  log_error("--guard: system call " + report.unexpected_call +
            " on the servo thread; motors off; keep it out of the loop");
  report.record.add_fault(report.record.armed_at_tick + report.record.ticks, "unexpected_call");
  return EndReason::unexpected_call;
}

/// Runs servo, watchdog and progress bar until the run is over; the motors are off afterwards. Main
/// thread. Throws the exception of the servo thread, for example for a missing right under
/// --strict.
EndReason run_threads(const Run& run) {
  LoopSignals signals{run.stop};
  Watchdog watchdog(run.devices, signals);
  std::atomic<bool> ended{false};
  EndReason end = EndReason::stopped;
  std::exception_ptr failure;
  std::optional<CallGuard> calls;
  {
    MotorGuard guard(run.devices);
    if (run.options.guard) calls.emplace(run.devices, run.stop);
    // The watchdog first: if the system has no thread for one of the two, no servo runs without it.
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
    const BlockStopSignals to_the_threads_above;
    StepWatchdog step(servo_thread.native_handle(), signals.heartbeat);
    try {
      show_progress(signals, ended, run, step);
    } catch (...) {
      run.stop = true;  // else the wait for the servo would not end
      throw;
    }
  }
  run.report.watchdog_trips = watchdog.trips();
  run.report.waiting = waits_of(run, signals);
  if (failure) std::rethrow_exception(failure);
  return calls ? end_by(*calls, end, run.report) : end;
}

const char* text_of(EndReason end) {
  switch (end) {
    case EndReason::ticks_done:
      return "finished";
    case EndReason::stopped:
      return "stopped";
    case EndReason::device_gone:
      return "the device went away";
    case EndReason::unexpected_call:
      return "the servo thread made an unexpected system call";
    case EndReason::never_armed:
      break;
  }
  return "the user never picked up the device";
}

/// Density that was taken away, over full density.
double removed_density_mm3(const LoadedScene& scene, const RunRecord& record) {
  double mm3 = 0;
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const auto& h = scene.volumes[v].image.spacing_mm;
    mm3 += static_cast<double>(record.removed_steps[v]) / kDensityMax * h[0] * h[1] * h[2];
  }
  return mm3;
}

/// Solid that is gone, by index of the scene's materials.
std::vector<double> removed_mm3(const LoadedScene& scene, const CompiledScene& servo) {
  std::vector<double> isos;
  for (const Material& material : scene.materials) isos.push_back(material.iso);
  const MaterialRule rule(isos);
  std::vector<double> removed(rule.count());
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    StepsByMaterial steps;
    const VolumeImage& image = scene.volumes[v].image;
    add_removed(rule, scene.volumes[v].iso, servo.first_density(v), servo.density(v), image.labels,
                steps);
    const auto& h = image.spacing_mm;
    for (std::size_t m = 0; m < steps.size(); ++m) {
      removed[m] += static_cast<double>(steps[m]) / kDensityMax * h[0] * h[1] * h[2];
    }
  }
  return removed;
}

/// The mark that the scene asks for.
std::optional<PulpHeat> pulp_heat(const SceneSettings& scene) {
  if (scene.cut.pulp == PulpMark::off) return std::nullopt;
  const auto water_c =
      scene.cut.pulp == PulpMark::water ? std::optional(scene.cut.water_c) : std::nullopt;
  return PulpHeat({scene.spindle.stall_torque_n_mm, kReferenceSpeedKrpm}, water_c,
                  1.0 / scene.servo.rate_hz);
}

/// Scores of each material of the scene, since the last reset.
MaterialScores scores_of(const LoadedScene& scene, const std::vector<double>& removed,
                         const RunRecord& record) {
  MaterialScores scores;
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    if (m == 0 && removed[0] == 0) continue;  // "none": no voxel of it
    const Material& material = scene.materials[m];
    scores.push_back({material.name, removed[m]});
    if (!material.forbidden) continue;
    scores.back().forbidden_ms =
        static_cast<double>(record.forbidden_ticks[m]) * 1000 / scene.servo.rate_hz;
  }
  return scores;
}

/// Writes the volumes in their current state.
void write_final(const ControllerOptions& options, const LoadedScene& scene,
                 const AnyServo& servo) {
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    if (v > 0 && !scene.volumes[v].solid) continue;
    VolumeImage image = scene.volumes[v].image;
    const auto density = servo.density(v);
    image.density.assign(density.begin(), density.end());
    write_volume(image, final_path(options, scene, v));
  }
}

/// Warns with the names of faulty laws: the fault has only their kind.
void name_law_faults(const LoadedScene& scene, const EventList& faults, const std::string& arm) {
  const std::array<std::pair<Fault, const LawChoice*>, 3> laws{
      {{Fault::force_law, &scene.force.law},
       {Fault::velocity_estimator, &scene.servo.velocity},
       {Fault::stabiliser, &scene.force.stabiliser}}};
  for (const EventList::Event& event : faults.kept()) {
    for (const auto& [fault, law] : laws) {
      if (event.name != std::string_view(fault_name(fault))) continue;
      log_warning(arm + std::string(kind_name(law->kind)) + " " + law->name +
                  " gave something that is no finite number at tick " + std::to_string(event.tick) +
                  ", and the motors went off; the lab tries it: law " + law->name);
    }
  }
}

/// Warns once of each fault whose name does not show the way out.
void explain_faults(const EventList& faults, const std::string& port, const std::string& arm) {
  const bool is_emulated = port.starts_with("socket:") || port.starts_with("udp:");
  const std::array<std::pair<Fault, const char*>, 2> why{
      {{Fault::wrong_dock,
        ": the device rested parked elsewhere than in its first calibration, and the motors went "
        "off; rest it there, or start again if it lies there"},
       {Fault::sparse_input,
        is_emulated
            ? ": the emulator's reports came more than 5 ms apart again and again, and the motors "
              "went off; if no fault script held them back, its machine is too busy for real time: "
              "end what else runs on it, or run in lock-step (--virtual)"
            : ": reports came more than 5 ms apart again and again, and the motors went off; see "
              "to the cable, and to what else this machine does (docs/first-hour.md)"}}};
  for (const auto& [fault, way_out] : why) {
    const auto first = std::ranges::find(
        faults.kept(), std::string_view(fault_name(fault)),
        [](const EventList::Event& event) { return std::string_view(event.name); });
    if (first == faults.kept().end()) continue;
    log_warning(arm + first->name + " at tick " + std::to_string(first->tick) + way_out);
  }
}

/// Warns if no force came, or came too late, or was refused.
void tell_of_forces(const ExternalPage& external, double stale_ms) {
  if (external.taken() == 0) {
    log_warning("no program gave a force: examples/external has one to begin with");
  }
  if (external.refused() > 0) {
    log_warning(std::to_string(external.refused()) + " of " + std::to_string(external.taken()) +
                " forces of the program were refused: a number was not finite or out of bounds, or "
                "stiffness or damping were below 0 or above the scene's; see docs/own-law.md");
  }
  if (external.gaps() > 1) {
    log_warning("the program's force became stale " + std::to_string(external.gaps()) +
                " times: a program ended, or its next one came after more than force.stale_ms = " +
                number_text(stale_ms) + "; set that to two or three periods of the program");
  }
}

RunReport new_report(const ControllerOptions& options) {
  RunReport report;
  report.end = text_of(EndReason::stopped);
  report.scene = options.scene;
  report.virtual_time = options.virtual_time;
  report.guarded = options.guard;
#ifdef KERF_SANITIZED
  report.allocations_counted = false;
#endif
  return report;
}

/// `--check` and `--explain`.
void look_at_scene(const ControllerOptions& options) {
  PlannedScene planned = load_and_plan(options);
  const LoadedScene& scene = planned.scene;
  const SceneCosts& costs = planned.servo->costs();
  if (options.explain) return explain_scene(options, planned.scene, *planned.servo);
  check_hand_script(scene);
  check_options(options, scene);
  const GainMargin margin = gain_margin(scene);
  print_scene(scene, costs, margin);
  check_budget(options, scene, costs);
  check_gains(options, scene, margin);
  if (!scene.second) return;
  const LoadedScene second = second_arm_of(scene);
  check_hand_script(second);
  check_gains(options, second, gain_margin(second));
}

/// Makes a driver for each port and starts it.
std::vector<std::unique_ptr<DeviceDriver>> start_drivers(const LoadedScene& scene,
                                                         RunStart& start) {
  std::vector<std::unique_ptr<DeviceDriver>> drivers;
  for (std::size_t arm = 0; arm < start.ports.size(); ++arm) {
    const DeviceSettings& device = device_of(scene, arm);
    drivers.push_back(make_driver(device.personality, *start.ports[arm], device.encoder_sign,
                                  scene.servo.rate_hz));
    drivers.back()->start();
  }
  return drivers;
}

/// Locks the memory of a run in real time. Writes missing rights to `report`; throws if `--strict`
/// forbids them.
void take_rights(const ControllerOptions& options, const SegmentWriter& segment,
                 RunReport& report) {
  report.missing_rights = lock_memory();
  if (!segment.locked() && report.missing_rights.empty()) {
    report.missing_rights.push_back({"locked segment", "page faults may delay a tick"});
  }
  accept_rights(report.missing_rights, options.real_time.strict);
}

/// Warns of faults and of late or refused forces, with the remedy.
void warn_of_faults(const RunStart& start, const RunReport& report) {
  const LoadedScene& scene = start.planned.scene;
  for (std::size_t arm = 0; arm < start.ports.size(); ++arm) {
    const EventList& faults = report.record.arm(arm).faults;
    const std::string name = scene.second ? "arm " + std::to_string(arm + 1) + ": " : "";
    name_law_faults(scene, faults, name);
    explain_faults(faults, start.port_texts[arm], name);
  }
  if (start.external) tell_of_forces(*start.external, scene.force.stale_ms);
}

/// Writes removal, tools, link counters and the hash of the volumes to `report`.
void report_results(const RunStart& start, const Devices& devices, RunReport& report) {
  const LoadedScene& scene = start.planned.scene;
  const CompiledScene& servo = *start.planned.servo;
  report.removed_density_mm3 = removed_density_mm3(scene, report.record);
  const std::vector<double> removed = removed_mm3(scene, servo);
  report.removed_mm3 = std::accumulate(removed.begin(), removed.end(), 0.0);
  report.materials = scores_of(scene, removed, report.record);
  report.workspace_scale = scene.device.workspace_scale;
  report.tool = scene.tools[scene.active_tool].name;
  report.tool_mm = 2 * scene.tools[scene.active_tool].radius_mm;
  report.lost_packets = devices[0].lost();
  report.refused_packets = devices[0].refused();
  report.link = start.ports[0]->counters();
  if (report.second) {
    const SceneTool& tool = scene.tools[scene.second_tool];
    *report.second = {report.second->device, tool.name,
                      2 * tool.radius_mm,    devices[1].lost(),
                      devices[1].refused(),  start.ports[1]->counters()};
  }
  report.volume_hash = hash_of_volumes(servo, scene.volumes.size());
}

/// The run from the first packet of the device to the report.
int run_with_device(const ControllerOptions& options, std::int64_t began_ns, RunStart& start,
                    std::atomic<bool>& stop, RunReport& report) {
  const LoadedScene& scene = start.planned.scene;
  CompiledScene& servo = *start.planned.servo;
  SegmentWriter& segment = start.segment;
  const auto drivers = start_drivers(scene, start);
  const Devices devices(*drivers[0], drivers.size() > 1 ? drivers[1].get() : nullptr);
  if (!options.virtual_time) take_rights(options, segment, report);

  report.record.pulp = pulp_heat(scene);
  segment.set_lifecycle(Lifecycle::run);
  report.load_s = static_cast<double>(monotonic_ns() - began_ns) / 1e9;
  const EndReason end =
      run_threads({options, start.port_texts, scene, scene.servo.rate_hz, segment, start.server,
                   servo, start.external.get(), devices, stop, report});
  if (!options.virtual_time) unlock_memory();

  const bool clean = end == EndReason::ticks_done || end == EndReason::stopped;
  segment.set_lifecycle(clean ? Lifecycle::clean_end : Lifecycle::fault);
  report.end = text_of(end);
  warn_of_faults(start, report);
  report_results(start, devices, report);
  if (const std::int64_t first_ns = report.record.first_force_ns; first_ns > 0) {
    report.start_to_force_ms = static_cast<double>(first_ns - began_ns) / 1e6;
  }
  std::fputs(summary(report).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, report_json(report));
  if (!options.final_volume.empty()) write_final(options, scene, servo);
  return clean && !report.record.has_faults() ? 0 : 1;
}

/// Runs the controller from the scene to the report and returns the exit code: 0 on success, also
/// if a signal ended it, even before there was a device; 1 if the device went away or was never
/// docked, or a fault latched. Throws std::exception with one line for bad input or set-up.
int run_controller(const ControllerOptions& options) {
  const std::int64_t began_ns = monotonic_ns();
  std::atomic<bool>& stop = catch_stop_and_pause_signals();
  if (options.check || options.explain) {
    look_at_scene(options);
    return 0;
  }
  check_report(options);
  RunReport report = new_report(options);
  std::optional<RunStart> start;
  try {
    start.emplace(options, stop, report);
  } catch (const std::exception&) {
    if (!stop) throw;
    tell_stopped_early(report.waiting);
    if (!options.report.empty()) write_new_file(options.report, report_json(report));
    return 0;
  }
  return run_with_device(options, began_ns, *start, stop, report);
}

}  // namespace

int run_controller_program(int argc, char** argv) {
  return run_program("kerf-controller", [&] {
    ControllerOptions options;
    const auto early = parse_options(argc, argv, options);
    return early ? *early : options.probe ? run_probe(options) : run_controller(options);
  });
}

}  // namespace kerf
