// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/controller_run.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "controller/device/driver/device_driver.hpp"
#include "controller/device/port/open_port.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/load/scene_load.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/gain_margin.hpp"
#include "controller/plan/cost/work_budget.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/shell/check_scene.hpp"
#include "controller/shell/late_note.hpp"
#include "controller/shell/law_trial.hpp"
#include "controller/shell/log_line.hpp"
#include "controller/shell/run_report.hpp"
#include "controller/shell/run_threads.hpp"
#include "controller/shell/scene_segment.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/segment_plan.hpp"
#include "shared/volume/density_hash.hpp"
#include "shared/volume/material_rule.hpp"

namespace kerf {
namespace {

constexpr int kPortPatienceMs = 5000;

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

/// In lock-step the device waits: there is no deadline to keep.
void check_budget(const ControllerOptions& options, const LoadedScene& scene,
                  const SceneCosts& costs) {
  const std::string refusal = options.virtual_time ? "" : over_budget(scene, costs);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

void check_gains(const ControllerOptions& options, const LoadedScene& scene,
                 const GainMargin& margin) {
  const std::string refusal = refused_gains(options, scene, margin);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

/// What the command line asks for is refused now, also what would be met at the end.
void check_options(const ControllerOptions& options, const LoadedScene& scene) {
  if (static_cast<double>(options.real_time.spin_us) * scene.servo.rate_hz > 0.9e6) {
    throw std::runtime_error("--spin-us " + std::to_string(options.real_time.spin_us) +
                             " is more than 90 % of a tick at " +
                             std::to_string(scene.servo.rate_hz) + " Hz; spin less");
  }
  static_cast<void>(segment_socket(options.name));
  check_run_files(options, scene);
}

/// Everything that can be known to go wrong, before the hand is moved.
void check_run(const ControllerOptions& options, const LoadedScene& scene,
               const SceneCosts& costs) {
  check_options(options, scene);
  check_budget(options, scene, costs);
  if (!options.virtual_time) {
    const GainMargin margin = gain_margin(scene, PlayFriction::where_it_decides);
    check_gains(options, scene, margin);
    const std::string warning = gain_warning(scene, margin);
    if (!warning.empty()) log_warning(warning);
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
  report.velocity_estimator = scene.servo.velocity.name;
  report.rate_hz = scene.servo.rate_hz;
  report.virtual_time = options.virtual_time;
  report.config_hash = hash;
  report.guarded = options.guard;
#ifdef KERF_SANITIZED
  report.allocations_counted = false;
#endif
  return report;
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

/// What was chosen for a volume of which nobody said anything: now, not with the summary.
void tell_proposal(const LoadedScene& scene) {
  for (const SceneVolume& volume : scene.volumes) {
    for (std::string choice : volume.proposal) {
      choice.replace(choice.find('='), 1, " ");
      std::fprintf(stderr, "kerf: %s: %s\n", volume.name.c_str(), choice.c_str());
    }
    if (volume.proposal.empty()) continue;
    std::fprintf(stderr, "kerf: %s: ./kerf volume import %s writes a scene with other choices\n",
                 volume.name.c_str(), volume.file.c_str());
  }
}

}  // namespace

int run_controller(const ControllerOptions& options) {
  const std::int64_t began_ns = monotonic_ns();
  std::atomic<bool>& stop = catch_stop_and_pause_signals();

  LoadedScene scene = load_scene(options.scene, options.overrides);
  for (const std::string& line : try_own_laws(scene)) log_warning(line);
  const std::unique_ptr<CompiledScene> servo = plan_scene(scene);
  if (options.check) {
    check_hand_script(scene);
    check_options(options, scene);
    const GainMargin margin = gain_margin(scene);
    print_scene(scene, servo->costs(), margin);
    check_budget(options, scene, servo->costs());
    check_gains(options, scene, margin);
    return 0;
  }
  if (options.explain) {
    explain_scene(options, scene, *servo);
    return 0;
  }
  check_run(options, scene, servo->costs());
  tell_proposal(scene);

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
    const Hello ours{scene.device.personality, options.virtual_time, scene.servo.rate_hz};
    const LateNote waits("waiting for a device that answers at --port " + port_text);
    port = open_port(port_text, ours, kPortPatienceMs, stop, io_thread_of(options.real_time));
  } catch (const std::runtime_error&) {
    if (stop) return 1;  // asked to end before there was a device: nothing to tell
    throw;
  }
  const std::unique_ptr<DeviceDriver> driver =
      make_driver(scene.device.personality, *port, scene.device.encoder_sign);
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
      run_threads({options, port_text, scene.device.personality, scene.servo.rate_hz, segment,
                   server, *servo, device, stop, report});
  if (!options.virtual_time) unlock_memory();

  const bool clean = end == EndReason::ticks_done || end == EndReason::stopped;
  segment.set_lifecycle(clean ? Lifecycle::clean_end : Lifecycle::fault);
  report.end = text_of(end);
  name_law_faults(scene, report.record.faults);
  report.removed_mm3 = removed_mm3(scene, report.record);
  report.materials = scores_of(scene, *servo, report.record);
  report.workspace_scale = scene.device.workspace_scale;
  report.tool = scene.tools[scene.active_tool].name;
  report.tool_mm = 2 * scene.tools[scene.active_tool].radius_mm;
  report.lost_packets = device.lost();
  report.refused_packets = device.refused();
  report.link = port->counters();
  if (const std::int64_t first_ns = report.record.first_force_ns; first_ns > 0) {
    report.start_to_force_ms = static_cast<double>(first_ns - began_ns) / 1e6;
  }
  report.volume_hash = hash_of_volumes(scene, *servo);
  std::fputs(summary(report).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, report_json(report));
  if (!options.final_volume.empty()) write_final(options, scene, *servo);
  return clean && report.record.faults.count == 0 ? 0 : 1;
}

}  // namespace kerf
