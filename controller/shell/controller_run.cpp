// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/controller_run.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "controller/device/driver/make_driver.hpp"
#include "controller/device/port/open_port.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/load/scene_load.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/work_budget.hpp"
#include "controller/scene/scene_words.hpp"
#include "controller/shell/call_guard.hpp"
#include "controller/shell/explain_scene.hpp"
#include "controller/shell/log_line.hpp"
#include "controller/shell/motor_guard.hpp"
#include "controller/shell/progress_bar.hpp"
#include "controller/shell/publisher.hpp"
#include "controller/shell/run_report.hpp"
#include "controller/shell/scene_segment.hpp"
#include "controller/shell/servo_loop.hpp"
#include "controller/shell/stop_signals.hpp"
#include "controller/shell/watchdog_thread.hpp"
#include "controller/volume/volume_write.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/segment/segment_plan.hpp"
#include "shared/volume/density_hash.hpp"

namespace kerf {
namespace {

constexpr int kPortPatienceMs = 5000;
constexpr double kArmingPatienceS = 60;
constexpr double kStableNPerMm = 0.7;  // CHAI3D's cap for the Omni; the design's for couplings
constexpr std::chrono::milliseconds kLookPeriod{5};

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
  return "the device was never calibrated: nobody parked it at rest; see docs/devices.md";
}

/// What the demo script hands to the emulator.
std::string hand_lines(const LoadedScene& scene) {
  char unit[64];
  std::snprintf(unit, sizeof unit, "%.9g", hand_unit_mm(scene));
  return "hand_unit_mm=" + std::string(unit) + "\nhand_script=" + scene.hand_script +
         "\nrate_hz=" + std::to_string(scene.servo.rate_hz) + "\n";
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

double removed_mm3(const LoadedScene& scene, const RunRecord& record) {
  double mm3 = 0;
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const auto& h = scene.volumes[v].image.spacing_mm;
    mm3 += static_cast<double>(record.removed_steps[v]) / kDensityMax * h[0] * h[1] * h[2];
  }
  return mm3;
}

std::uint64_t hash_of_volumes(const LoadedScene& scene, const Servo& servo) {
  std::uint64_t hash = kHashSeed;
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    hash = hash_word(hash, density_hash(servo.density(v)));
  }
  return hash;
}

/// The volumes as they are now: the first as `path`, others beside it under their names.
void write_final(const LoadedScene& scene, const Servo& servo, const std::filesystem::path& path) {
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    if (v > 0 && !scene.volumes[v].solid) continue;
    VolumeImage image = scene.volumes[v].image;
    const auto density = servo.density(v);
    image.density.assign(density.begin(), density.end());
    auto target = path;
    if (v > 0) {
      target.replace_filename(path.stem().string() + "-" + scene.volumes[v].name +
                              path.extension().string());
    }
    write_volume(image, target);
  }
}

/// Main thread while the servo runs: draws the progress bar.
void show_progress(const LoopSignals& signals, const std::atomic<bool>& ended,
                   const ControllerOptions& options, int rate_hz) {
  const ProgressBar bar(options.progress);
  while (!ended.load()) {
    const double done_s = static_cast<double>(signals.armed_ticks.load()) / rate_hz;
    char text[64];
    std::snprintf(text, sizeof text, "%.1f s", done_s);
    bar.show(options.seconds ? done_s / *options.seconds : 0,
             done_s > 0 ? text : "waiting for the device to be parked at rest");
    for (int i = 0; i < 10 && !ended.load(); ++i) std::this_thread::sleep_for(kLookPeriod);
  }
}

/// In lock-step the device waits: there is no deadline to keep.
void check_budget(const ControllerOptions& options, const LoadedScene& scene,
                  const SceneCosts& costs) {
  const std::string refusal = options.virtual_time ? "" : over_budget(scene, costs);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

/// Whatever can be said without memory for the loop.
int check_scene(const ControllerOptions& options, const LoadedScene& scene,
                const SceneCosts& costs) {
  std::printf("scene=%s\n", scene.path.c_str());
  for (const SceneVolume& v : scene.volumes) {
    const auto& g = v.image.grid;
    const auto& h = v.image.spacing_mm;
    std::printf("volume=%s %dx%dx%d spacing_mm=%g,%g,%g iso=%.4f solid=%d\n", v.name.c_str(), g.nx,
                g.ny, g.nz, h[0], h[1], h[2], v.iso / kDensityMax, v.solid ? 1 : 0);
  }
  for (const SceneTool& t : scene.tools) {
    std::printf("tool=%s %s samples=%zu pitch_mm=%g radius_mm=%g\n", t.name.c_str(),
                t.shape.c_str(), t.offsets.size(), t.pitch_mm, t.radius_mm);
  }
  const auto& o = scene.device.offset_mm;
  std::printf("workspace_scale=%g\noffset_mm=%g,%g,%g\n", scene.device.workspace_scale, o[0], o[1],
              o[2]);
  std::printf("force=%s\ncut=%s\n", std::string(word_of(scene.force.model)).c_str(),
              std::string(word_of(scene.cut.model)).c_str());
  std::printf("stiffness_at_device_n_per_mm=%g\n", device_stiffness_n_per_mm(scene));
  const std::size_t costliest = costliest_tool(costs);
  std::printf("costliest_tool=%s\nhighest_rate_hz=%d\n", scene.tools[costliest].name.c_str(),
              highest_rate_hz(work_us(costs, costliest)));
  std::fputs(hand_lines(scene).c_str(), stdout);
  check_budget(options, scene, costs);
  return 0;
}

/// Everything that can be known to go wrong, before the hand is moved.
void check_run(const ControllerOptions& options, const LoadedScene& scene,
               const SceneCosts& costs) {
  if (static_cast<double>(options.real_time.spin_us) * scene.servo.rate_hz > 0.9e6) {
    throw std::runtime_error("--spin-us " + std::to_string(options.real_time.spin_us) +
                             " is more than 90 % of a tick at " +
                             std::to_string(scene.servo.rate_hz) + " Hz; spin less");
  }
  check_budget(options, scene, costs);
  if (!options.report.empty()) check_new_file(options.report);
  if (!options.final_volume.empty()) check_volume_path(options.final_volume);
  if (const double stiffness = device_stiffness_n_per_mm(scene); stiffness > kStableNPerMm) {
    const bool paper = scene.force.model == ForceModel::paper;
    char text[160];
    std::snprintf(text, sizeof text,
                  "contact is %.3g N/mm stiff at the device, an Omni bears %.3g: it will tremble; "
                  "lower force.%s",
                  stiffness, kStableNPerMm, paper ? "p0_n_per_mm2" : "stiffness_n_per_mm");
    log_warning(text);
  }
  if (!scene.device.torque_scale) {
    const auto kind = static_cast<std::size_t>(scene.device.personality);
    log_warning("device.torque_scale is not set for " + std::string(kPersonalityWords[kind]) +
                ": the motors stay off; measure it, and write device.personality beside it");
  }
}

RunReport new_report(const ControllerOptions& options, const LoadedScene& scene,
                     std::uint64_t hash) {
  RunReport report;
  report.scene = options.scene;
  report.device = kPersonalityWords[static_cast<std::size_t>(scene.device.personality)];
  report.numeric = word_of(scene.servo.numeric);
  report.rate_hz = scene.servo.rate_hz;
  report.virtual_time = options.virtual_time;
  report.config_hash = hash;
  report.guarded = options.guard;
#ifdef KERF_SANITIZED
  report.allocations_counted = false;
#endif
  return report;
}

LoopLimits limits_of(const ControllerOptions& options, double rate_hz) {
  LoopLimits limits;
  if (options.seconds) {
    limits.armed_ticks = static_cast<std::uint64_t>(std::llround(*options.seconds * rate_hz));
  }
  limits.gone_ticks = static_cast<std::uint64_t>(2 * rate_hz);
  limits.arming_ticks = static_cast<std::uint64_t>(kArmingPatienceS * rate_hz);
  return limits;
}

/// What the threads of a run share.
struct Run {
  const ControllerOptions& options;
  const std::string& port;  ///< as `--port` names it, `auto` resolved
  int rate_hz;
  SegmentWriter& segment;
  SegmentServer& server;
  Servo& servo;
  DeviceDriver& device;
  std::atomic<bool>& stop;
  RunReport& report;
};

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
  LockStepTicks lock_step(run.device);
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

/// Servo, watchdog and progress until the run is over; the motors are off afterwards.
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
    const std::jthread servo_thread([&] {
      guard.guard_stack();
      try {
        end = serve(run, signals, calls ? &*calls : nullptr);
      } catch (...) {
        failure = std::current_exception();
      }
      ended = true;
    });
    std::jthread watching;
    if (!run.options.virtual_time) {
      watching = start_watchdog(watchdog, run.options.real_time);
    }
    show_progress(signals, ended, run.options, run.rate_hz);
  }
  run.report.watchdog_trips = watchdog.trips();
  if (failure) std::rethrow_exception(failure);
  return calls ? end_by(*calls, end, run.report) : end;
}

}  // namespace

int run_controller(const ControllerOptions& options) {
  const std::int64_t began_ns = monotonic_ns();
  std::atomic<bool>& stop = catch_stop_signals();

  LoadedScene scene = load_scene(options.scene, options.overrides);
  const std::unique_ptr<CompiledScene> servo = plan_scene(scene);
  if (options.check) return check_scene(options, scene, servo->costs());
  if (options.explain) {
    explain_scene(options, scene, *servo);
    return 0;
  }
  check_run(options, scene, servo->costs());

  const std::string json = canonical_json(scene);
  RunReport report = new_report(options, scene, fnv1a(json));
  const SegmentSpec spec = segment_spec(scene, json, report.config_hash);
  check_memory(scene, servo->costs(), plan_segment(spec).header.total_bytes);
  if (!options.emulator_args.empty()) write_new_file(options.emulator_args, hand_lines(scene));
  SegmentWriter segment = SegmentWriter::create(spec);
  SegmentServer server(options.name, segment,
                       {.tools = static_cast<std::uint32_t>(scene.tools.size())});
  servo->take(scene);
  const std::string port_text = resolve_port(options.port, scene.device.personality);
  std::unique_ptr<PacketPort> port;
  try {
    port = open_port(port_text, scene.servo.rate_hz, kPortPatienceMs, stop);
  } catch (const std::runtime_error&) {
    if (stop) return 1;  // asked to end before there was a device: nothing to tell
    throw;
  }
  const std::unique_ptr<DeviceDriver> driver = make_driver(scene.device.personality, *port);
  DeviceDriver& device = *driver;
  device.start();
  if (!options.virtual_time) {
    report.missing_rights = lock_memory();
    if (!segment.locked() && report.missing_rights.empty()) {
      report.missing_rights.push_back({"locked segment", "page faults may delay a tick"});
    }
    accept_rights(report.missing_rights, options.real_time.strict);
  }

  segment.set_lifecycle(Lifecycle::run);
  report.load_s = static_cast<double>(monotonic_ns() - began_ns) / 1e9;
  const EndReason end = run_threads(
      {options, port_text, scene.servo.rate_hz, segment, server, *servo, device, stop, report});
  if (!options.virtual_time) unlock_memory();

  const bool clean = end == EndReason::ticks_done || end == EndReason::stopped;
  segment.set_lifecycle(clean ? Lifecycle::clean_end : Lifecycle::fault);
  report.end = text_of(end);
  report.removed_mm3 = removed_mm3(scene, report.record);
  report.lost_packets = device.lost();
  report.refused_packets = device.refused();
  report.link = port->counters();
  if (const std::int64_t first_ns = report.record.first_force_ns; first_ns > 0) {
    report.start_to_force_ms = static_cast<double>(first_ns - began_ns) / 1e6;
  }
  report.volume_hash = hash_of_volumes(scene, *servo);
  std::fputs(summary(report).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, report_json(report));
  if (!options.final_volume.empty()) write_final(scene, *servo, options.final_volume);
  return clean && report.record.fault_count == 0 ? 0 : 1;
}

}  // namespace kerf
