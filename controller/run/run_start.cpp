// SPDX-License-Identifier: Apache-2.0
#include "controller/run/run_start.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "controller/device/open_port.hpp"
#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/wait_state.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/gain_margin.hpp"
#include "controller/plan/plan_contact.hpp"
#include "controller/run/law_trial.hpp"
#include "controller/run/scene_check.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/segment.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// Bytes that programs can still take before the system runs out, by the estimate of the kernel
/// (MemAvailable); empty if it has none.
std::optional<std::uint64_t> available_memory() {
  std::ifstream table("/proc/meminfo");
  std::string name;
  std::uint64_t kib = 0;
  while (table >> name >> kib) {
    if (name == "MemAvailable:") return kib << 10;
    table.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::nullopt;
}

}  // namespace

void check_memory(const LoadedScene& scene, const SceneCosts& costs, std::uint64_t segment_bytes) {
  std::uint64_t bytes = segment_bytes;
  for (const ArrayBytes& array : costs.arrays) bytes += array.taken ? 0 : array.bytes;
  const auto free_bytes = available_memory();
  if (free_bytes && bytes > *free_bytes) {
    throw std::runtime_error(scene.path + ": needs " + std::to_string(bytes >> 20) + " MiB, and " +
                             std::to_string(*free_bytes >> 20) +
                             " MiB are free; crop or resample the volume with kerf-volume");
  }
}

namespace {

constexpr int kPortPatienceMs = 5000;

void warn_of_gains(const ControllerOptions& options, const LoadedScene& scene) {
  if (options.virtual_time) return;
  if (scene.second) warn_of_gains(options, second_arm_of(scene));
  const GainMargin margin = gain_margin(scene, PlayFriction::where_it_decides);
  check_gains(options, scene, margin);
  const std::string warning = gain_warning(scene, margin);
  if (!warning.empty()) log_warning(warning);
}

void warn_of_motors(const LoadedScene& scene) {
  for (std::size_t arm = 0; arm < arms_of(scene); ++arm) {
    if (device_of(scene, arm).torque_scale) continue;
    log_warning((scene.second ? "arm " + std::to_string(arm + 1) + ": " : std::string()) +
                "device.torque_scale is not set for " +
                std::string(word_of(device_of(scene, arm).personality)) +
                ": the motors stay off; measure it, and write device.personality beside it");
  }
}

/// Prints the notes of reading volumes and meshes, and the choices for a volume without settings,
/// at once, not with the summary.
void tell_proposal(const LoadedScene& scene) {
  for (const SceneVolume& volume : scene.volumes) {
    if (!volume.note.empty()) {
      std::fprintf(stderr, "kerf: %s: %s\n", escaped(volume.name).c_str(), volume.note.c_str());
    }
    for (std::string choice : volume.proposal) {
      choice.replace(choice.find('='), 1, " ");
      std::fprintf(stderr, "kerf: %s: %s\n", escaped(volume.name).c_str(), escaped(choice).c_str());
    }
    if (volume.proposal.empty()) continue;
    std::fprintf(stderr, "kerf: %s: ./kerf volume import %s writes a scene with other choices\n",
                 escaped(volume.name).c_str(), escaped(volume.file).c_str());
  }
  for (const SceneTool& tool : scene.tools) {
    const std::string note = tool.mesh.triangles.empty() ? "" : mesh_note(tool.mesh);
    if (note.empty()) continue;
    std::fprintf(stderr, "kerf: tool %s: %s\n", escaped(tool.name).c_str(), note.c_str());
  }
}

void tell_of_scene(const LoadedScene& scene, RunReport& report) {
  report.device = word_of(scene.device.personality);
  if (scene.second) {
    report.second.emplace();
    report.second->device = word_of(scene.second->device.personality);
  }
  report.numeric = word_of(scene.servo.numeric);
  report.velocity_estimator = scene.servo.velocity.name;
  report.rate_hz = scene.servo.rate_hz;
}

/// One port for each device, and no two the same.
std::vector<std::string> ports_of(const ControllerOptions& options, const LoadedScene& scene) {
  const std::vector<std::string>& given = options.ports;
  if (given.size() != arms_of(scene)) {
    const std::string count = std::to_string(given.size()) + " given";
    throw std::runtime_error("--port: " + count +
                             (scene.second ? ", and the scene has two [[device]]; give one for "
                                             "each, in their order"
                                           : ", and the scene has one [device]; give one"));
  }
  std::vector<std::string> ports, places;
  for (std::size_t arm = 0; arm < given.size(); ++arm) {
    const Personality personality = device_of(scene, arm).personality;
    ports.push_back(resolve_port(given[arm], personality));
    places.push_back(ports[arm] == "arm" ? "arm:" + std::string(word_of(personality)) : ports[arm]);
    if (arm == 0 || places[arm] != places[0]) continue;
    throw std::runtime_error("--port " + given[arm] +
                             ": is that of the first device too; name each one's own");
  }
  return ports;
}

PlannedScene checked_scene(const ControllerOptions& options, RunReport& report) {
  report.waiting = "loading " + options.scene;
  PlannedScene planned = load_and_plan(options);
  const LoadedScene& scene = planned.scene;
  tell_of_scene(scene, report);
  check_options(options, scene);
  static_cast<void>(ports_of(options, scene));
  check_budget(options, scene, planned.servo->costs());
  warn_of_gains(options, scene);
  warn_of_motors(scene);
  tell_proposal(scene);
  end_if_asked(options.scene);
  return planned;
}

SegmentWriter new_segment(const ControllerOptions& options, const PlannedScene& planned,
                          RunReport& report) {
  const LoadedScene& scene = planned.scene;
  Json json = scene_json(scene);
  report.config_hash = fnv1a(json.canonical());
  const std::string with_source = json_with_source(std::move(json), scene, planned.source);
  const SegmentSpec spec = segment_spec(scene, with_source, report.config_hash);
  check_memory(scene, planned.servo->costs(), plan_segment(spec).header.total_bytes);
  if (!options.emulator_args.empty()) write_new_file(options.emulator_args, hand_lines(scene));
  return SegmentWriter::create(spec, options.virtual_time);
}

}  // namespace

PlannedScene load_and_plan(const ControllerOptions& options) {
  SceneSource source = read_source(options.scene, options.overrides);
  LoadedScene scene = load_scene(options.scene, source.text, options.overrides);
  for (const std::string& line : try_own_laws(scene)) log_warning(line);
  std::unique_ptr<CompiledScene> servo = plan_scene(scene);
  end_if_asked(options.scene);
  return {std::move(source), std::move(scene), std::move(servo)};
}

void check_options(const ControllerOptions& options, const LoadedScene& scene) {
  if (static_cast<double>(options.real_time.spin_us) * scene.servo.rate_hz > 0.9e6) {
    throw std::runtime_error("--spin-us " + std::to_string(options.real_time.spin_us) +
                             " is more than 90 % of a tick at " +
                             std::to_string(scene.servo.rate_hz) + " Hz; spin less");
  }
  static_cast<void>(segment_socket(options.name));
  check_run_files(options, scene);
}

void check_budget(const ControllerOptions& options, const LoadedScene& scene,
                  const SceneCosts& costs) {
  const std::string refusal = options.virtual_time ? "" : budget_error(scene, costs);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

void check_gains(const ControllerOptions& options, const LoadedScene& scene,
                 const GainMargin& margin) {
  const std::string refusal = refused_gains(options, scene, margin);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

RunStart::RunStart(const ControllerOptions& options, const std::atomic<bool>& stop,
                   RunReport& report)
    : planned(checked_scene(options, report)),
      segment(new_segment(options, planned, report)),
      server(options.name, segment,
             {.tools = static_cast<std::uint32_t>(planned.scene.tools.size()),
              .arms = static_cast<std::uint32_t>(arms_of(planned.scene))}),
      port_texts(ports_of(options, planned.scene)) {
  LoadedScene& scene = planned.scene;
  if (scene.force.model == ForceModel::external) {
    if (options.virtual_time) {
      log_warning(
          "in lock-step ticks wait for no program, so that what it gives depends on the machine; "
          "Servo::give_force of kerf/servo.hpp is in step");
    }
    external = std::make_unique<ExternalPage>(
        options.name, ExternalPage::Run{arms_of(scene), scene.servo.rate_hz,
                                        scene.device.workspace_scale, stale_ticks(scene)});
  }
  planned.servo->take(scene);
  try {
    for (std::size_t arm = 0; arm < port_texts.size(); ++arm) {
      report.waiting = text_before_device(port_texts[arm]);
      const LinkHello ours{device_of(scene, arm).personality, options.virtual_time,
                           scene.servo.rate_hz};
      const LateNote waits(report.waiting);
      ports.push_back(open_port(port_texts[arm], ours, kPortPatienceMs, stop,
                                io_thread_of(options.real_time), true));
    }
  } catch (...) {
    if (stop) segment.set_lifecycle(Lifecycle::clean_end);
    throw;
  }
}

}  // namespace kerf
