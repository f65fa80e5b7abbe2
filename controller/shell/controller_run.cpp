// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/controller_run.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "controller/device/driver/device_driver.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/gain_margin.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/shell/check_scene.hpp"
#include "controller/shell/log_line.hpp"
#include "controller/shell/run_report.hpp"
#include "controller/shell/run_start.hpp"
#include "controller/shell/run_threads.hpp"
#include "controller/shell/waiting.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/volume/density_hash.hpp"
#include "shared/volume/material_rule.hpp"

namespace kerf {
namespace {

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
  return "the device was never taken in hand";
}

double removed_mm3(const LoadedScene& scene, const RunRecord& record) {
  double mm3 = 0;
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const auto& h = scene.volumes[v].image.spacing_mm;
    mm3 += static_cast<double>(record.removed_steps[v]) / kDensityMax * h[0] * h[1] * h[2];
  }
  return mm3;
}

/// Whether a voxel of the material can be at the surface, or within. Labels make solid whatever
/// they name.
bool is_felt(const LoadedScene& scene, const MaterialRule& rule, std::size_t material) {
  return std::ranges::any_of(scene.volumes, [&](const SceneVolume& volume) {
    if (!volume.image.labels.empty()) return true;
    for (std::uint32_t density = volume.iso; density <= kDensityMax; ++density) {
      if (rule.of(Label{0}, static_cast<Density>(density)) == material) return true;
    }
    return false;
  });
}

/// Of each material of the scene, since the last reset.
MaterialScores scores_of(const LoadedScene& scene, const CompiledScene& servo,
                         const RunRecord& record) {
  std::vector<double> isos;
  for (const Material& material : scene.materials) isos.push_back(material.iso);
  const MaterialRule rule(isos);
  std::vector<double> removed(rule.count());
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    StepsByMaterial steps;
    const VolumeImage& image = scene.volumes[v].image;
    add_removed(rule, servo.first_density(v), servo.density(v), image.labels, steps);
    const auto& h = image.spacing_mm;
    for (std::size_t m = 0; m < steps.size(); ++m) {
      removed[m] += static_cast<double>(steps[m]) / kDensityMax * h[0] * h[1] * h[2];
    }
  }
  MaterialScores scores;
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    if (m == 0 && removed[0] == 0) continue;  // "none": no voxel of it
    const Material& material = scene.materials[m];
    scores.push_back({material.name, removed[m], std::nullopt, is_felt(scene, rule, m)});
    if (!material.forbidden) continue;
    scores.back().forbidden_ms =
        static_cast<double>(record.forbidden_ticks[m]) * 1000 / scene.servo.rate_hz;
  }
  return scores;
}

std::uint64_t hash_of_volumes(const LoadedScene& scene, const Servo& servo) {
  std::uint64_t hash = kFnv1aBasis;
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    hash = fnv1a_step(hash, density_hash(servo.density(v)));
  }
  return hash;
}

/// The volumes as they are now.
void write_final(const ControllerOptions& options, const LoadedScene& scene, const Servo& servo) {
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    if (v > 0 && !scene.volumes[v].solid) continue;
    VolumeImage image = scene.volumes[v].image;
    const auto density = servo.density(v);
    image.density.assign(density.begin(), density.end());
    write_volume(image, final_path(options, scene, v));
  }
}

/// A fault of a law has only its kind; the scene knows the name.
void name_law_faults(const LoadedScene& scene, const EventList& faults) {
  const std::array<std::pair<Fault, const LawChoice*>, 3> laws{
      {{Fault::force_law, &scene.force.law},
       {Fault::velocity_estimator, &scene.servo.velocity},
       {Fault::stabiliser, &scene.force.stabiliser}}};
  for (const EventList::Event& event : faults.kept()) {
    for (const auto& [fault, law] : laws) {
      if (event.name != std::string_view(fault_name(fault))) continue;
      log_warning(std::string(kind_name(law->kind)) + " " + law->name +
                  " gave something that is no finite number at tick " + std::to_string(event.tick) +
                  ", and the motors went off; the lab tries it: law " + law->name);
    }
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
}

/// From the device's first packet to the report.
int run_with_device(const ControllerOptions& options, std::int64_t began_ns, RunStart& start,
                    std::atomic<bool>& stop, RunReport& report) {
  const LoadedScene& scene = start.planned.scene;
  CompiledScene& servo = *start.planned.servo;
  SegmentWriter& segment = start.segment;
  const std::unique_ptr<DeviceDriver> driver =
      make_driver(scene.device.personality, *start.port, scene.device.encoder_sign);
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
  const EndReason end =
      run_threads({options, start.port_text, scene.device.personality, scene.servo.rate_hz, segment,
                   start.server, servo, device, stop, report});
  if (!options.virtual_time) unlock_memory();

  const bool clean = end == EndReason::ticks_done || end == EndReason::stopped;
  segment.set_lifecycle(clean ? Lifecycle::clean_end : Lifecycle::fault);
  report.end = text_of(end);
  name_law_faults(scene, report.record.faults);
  report.removed_mm3 = removed_mm3(scene, report.record);
  report.materials = scores_of(scene, servo, report.record);
  report.workspace_scale = scene.device.workspace_scale;
  report.tool = scene.tools[scene.active_tool].name;
  report.tool_mm = 2 * scene.tools[scene.active_tool].radius_mm;
  report.lost_packets = device.lost();
  report.refused_packets = device.refused();
  report.link = start.port->counters();
  if (const std::int64_t first_ns = report.record.first_force_ns; first_ns > 0) {
    report.start_to_force_ms = static_cast<double>(first_ns - began_ns) / 1e6;
  }
  report.volume_hash = hash_of_volumes(scene, servo);
  std::fputs(summary(report).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, report_json(report));
  if (!options.final_volume.empty()) write_final(options, scene, servo);
  return clean && report.record.faults.count == 0 ? 0 : 1;
}

}  // namespace

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

}  // namespace kerf
