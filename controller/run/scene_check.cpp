// SPDX-License-Identifier: Apache-2.0
#include "controller/run/scene_check.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/plan/compile.hpp"
#include "controller/run/run_start.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_keys.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/threads.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

std::uint64_t operations(const StageCost& stage) {
  return stage.operations;
}
std::uint64_t operations(const std::vector<StageCost>& stages) {
  std::uint64_t sum = 0;
  for (const StageCost& stage : stages) sum += stage.operations;
  return sum;
}

struct ToolWork {
  std::string tool;
  double us = 0;  ///< over all volumes
};

std::vector<ToolWork> works_of(const CostReport& explanation) {
  std::vector<ToolWork> works;
  for (const ExplainedTick& tick : explanation.ticks) {
    if (works.empty() || works.back().tool != tick.tool) works.push_back({tick.tool, 0});
    works.back().us += static_cast<double>(explanation.arms) * work_us(tick.most);
  }
  return works;
}

/// The line of a stage, or of a whole tick.
template <class Work>
std::string work_line(const char* name, const Work& most, const Work& timed, double factor) {
  const auto count = [](const Work& work) {
    return static_cast<unsigned long long>(operations(work));
  };
  return format("  %-14s%12llu%12.2f%12llu%14.2f", name, count(most), work_us(most), count(timed),
                factor * work_us(timed));
}

/// One line with a size in bytes, KiB or MiB.
std::string memory_line(const std::string& name, std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  const bool mega = bytes >= 1 << 20, kilo = bytes >= 1 << 10;
  return format("  %-36s%*.*f %s\n", name.c_str(), 12, mega || kilo ? 1 : 0,
                mega ? size / (1 << 20) : (kilo ? size / (1 << 10) : size),
                mega ? "MiB" : (kilo ? "KiB" : "B"));
}

std::string tick_text(const ExplainedTick& tick, double factor) {
  std::string text =
      "\n" + tick.tool + " in " + tick.volume + ": " + tick.variant + " (" + tick.why + ")\n";
  for (std::size_t s = 0; s < tick.most.size(); ++s) {
    text += work_line(tick.most[s].stage, tick.most[s], tick.time.stages[s], factor) + "\n";
  }
  return text + work_line("tick", tick.most, tick.time.stages, factor) +
         format("%14.2f%10.2f\n", tick.time.median_us, tick.time.p99_us);
}

std::string budget_text(const CostReport& e) {
  std::string text = std::string("\nbudget: work of one tool in all volumes") +
                     (e.arms > 1 ? ", in both hands" : "") + ", at most " +
                     format("%.1f us: half a tick at %d Hz\n", e.budget_us, e.rate_hz);
  for (const ToolWork& work : works_of(e)) {
    text += format("  %-36s%12.1f us%8.1f %%%8d Hz at most\n", work.tool.c_str(), work.us,
                   100 * work.us / e.budget_us, highest_rate_hz(work.us));
  }
  return text;
}

}  // namespace

std::vector<ArrayBytes> segment_arrays(const SegmentPlan& plan, const LoadedScene& scene) {
  const SegmentHeader& header = plan.header;
  std::vector<std::pair<std::uint64_t, std::string>> parts{
      {0, "header"},
      {header.off_volume_table, "volume table"},
      {header.off_scene, "scene"},
      {header.off_state, "ring of ticks"},
      {header.off_dirty, header.dirty_slots > 1 ? "ring of changes" : "ring of changes (unused)"}};
  if (header.off_state_2 != 0) parts.emplace_back(header.off_state_2, "ring of the second arm");
  for (std::size_t v = 0; v < plan.volumes.size(); ++v) {
    const VolumeDescriptor& volume = plan.volumes[v];
    const std::string& name = scene.volumes[v].name;
    parts.emplace_back(volume.off_versions, "brick versions of " + name);
    parts.emplace_back(volume.off_bricks, "bricks of " + name);
    if (volume.off_labels != 0) parts.emplace_back(volume.off_labels, "labels of " + name);
  }
  std::sort(parts.begin(), parts.end());
  std::vector<ArrayBytes> arrays;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::uint64_t end = i + 1 < parts.size() ? parts[i + 1].first : header.total_bytes;
    arrays.push_back({"segment: " + parts[i].second, end - parts[i].first, false});
  }
  return arrays;
}

CostReport explain(const LoadedScene& scene, CompiledScene& servo, const SegmentPlan& segment) {
  const SceneCosts& costs = servo.costs();
  CostReport explanation{.scene = scene.path,
                         .numeric = std::string(word_of(scene.servo.numeric)),
                         .cut = std::string(word_of(scene.cut.model)),
                         .machine = processor_name(),
                         .rate_hz = scene.servo.rate_hz,
                         .budget_us = work_budget_us(scene),
                         .arms = costs.arms,
                         .ticks = {},
                         .arrays = costs.arrays,
                         .gain = gain_margin(scene),
                         .gain_lines = {}};
  explanation.gain_lines = gain_lines(scene, explanation.gain);
  for (ArrayBytes& array : segment_arrays(segment, scene))
    explanation.arrays.push_back(std::move(array));
  double measured_us = 0, timed_us = 0;
  for (std::size_t i = 0; i < costs.ticks.size(); ++i) {
    const TickCost& tick = costs.ticks[i];
    const TickTime time = servo.time_tick(i);
    measured_us += time.median_us;
    timed_us += work_us(time.stages);
    explanation.ticks.push_back({scene.tools[tick.tool].name, scene.volumes[tick.volume].name,
                                 tick.variant(), tick.choice.why, tick.stages, time});
  }
  // A tick without contact has no operations that have a price.
  explanation.machine_factor = timed_us > 0 ? measured_us / timed_us : 1;
  return explanation;
}

std::string explanation_text(const CostReport& e) {
  std::string text = e.scene + ": " + std::to_string(e.rate_hz) + " Hz, " + e.numeric +
                     " numbers, cut " + e.cut + "\n\n";
  text += format("  %-14s%12s%12s%12s%14s%14s%10s\n", "", "at most", "work us", "timed",
                 "predicted us", "measured us", "p99");
  for (const ExplainedTick& tick : e.ticks) text += tick_text(tick, e.machine_factor);
  text +=
      "\nat most: operations of any tick; work: their price on the reference machine\n"
      "timed: operations of a tick at its worst; predicted: their price, times " +
      format("%.2f, which fits these ticks on this machine\n", e.machine_factor) +
      "measured: median and p99 of that tick, as the servo computes it\n";
  text += budget_text(e);
  text += "\nstability\n" + e.gain_lines + "\nmemory\n";
  for (const ArrayBytes& array : e.arrays) text += memory_line(array.name, array.bytes);
  text += memory_line("total", total_bytes(e.arrays));
  return text;
}

std::string explanation_json(const CostReport& e) {
  const auto figures = [&](Json json, const auto& most, const auto& timed) {
    json["operations"] = operations(most);
    json["work_us"] = work_us(most);
    json["timed_operations"] = operations(timed);
    json["predicted_us"] = e.machine_factor * work_us(timed);
    return json;
  };
  Json ticks = Json::List{};
  for (const ExplainedTick& tick : e.ticks) {
    const std::vector<StageCost>& timed = tick.time.stages;
    Json stages = Json::List{};
    for (std::size_t s = 0; s < tick.most.size(); ++s) {
      stages.push_back(figures({{"stage", tick.most[s].stage}}, tick.most[s], timed[s]));
    }
    ticks.push_back(figures({{"tool", tick.tool},
                             {"volume", tick.volume},
                             {"method", tick.variant},
                             {"why", tick.why},
                             {"measured_us", tick.time.median_us},
                             {"measured_p99_us", tick.time.p99_us},
                             {"stages", stages}},
                            tick.most, timed));
  }
  Json tools = Json::List{};
  for (const ToolWork& work : works_of(e)) {
    tools.push_back(
        {{"tool", work.tool}, {"work_us", work.us}, {"highest_rate_hz", highest_rate_hz(work.us)}});
  }
  Json arrays = Json::List{};
  for (const ArrayBytes& array : e.arrays) {
    arrays.push_back({{"name", array.name}, {"bytes", array.bytes}});
  }
  const Json json{{"program", "kerf-controller"},
                  {"version", KERF_VERSION},
                  {"scene", e.scene},
                  {"rate_hz", e.rate_hz},
                  {"numeric", e.numeric},
                  {"cut", e.cut},
                  {"machine", e.machine},
                  {"machine_factor", e.machine_factor},
                  {"budget_us", e.budget_us},
                  {"stability",
                   {{"stiffness_n_per_mm", e.gain.stiffness_n_per_mm},
                    {"damping_ns_per_mm", e.gain.damping_ns_per_mm},
                    {"highest_n_per_mm", e.gain.highest_n_per_mm},
                    {"margin", e.gain.margin()},
                    {"highest_with_friction_n_per_mm", e.gain.highest_with_friction_n_per_mm},
                    {"margin_with_friction", e.gain.with_friction()}}},
                  {"tools", tools},
                  {"ticks", ticks},
                  {"arrays", arrays},
                  {"total_bytes", total_bytes(e.arrays)}};
  return json.document();
}

// `--check`, and the checks of a start.

namespace {

/// The densest voxel on the border of a volume.
Density border_density(const VolumeImage& image) {
  const VoxelGrid& g = image.grid;
  Density most = 0;
  for (std::int32_t z = 0; z < g.nz; ++z) {
    for (std::int32_t y = 0; y < g.ny; ++y) {
      const bool whole_row = z == 0 || z == g.nz - 1 || y == 0 || y == g.ny - 1;
      const std::int32_t step = whole_row ? 1 : std::max(1, g.nx - 1);
      for (std::int32_t x = 0; x < g.nx; x += step) {
        most = std::max(most, image.density[g.index(x, y, z)]);
      }
    }
  }
  return most;
}

/// The scene as text would have it, with the changes of the command line.
SceneSpec as_written(const LoadedScene& scene) {
  SceneSpec written;
  static_cast<SceneSettings&>(written) = scene;
  written.volumes = scene.volume_specs;
  written.tools = scene.tool_specs;
  return written;
}

/// The input files of a scene.
std::vector<fs::path> files_read(const ControllerOptions& options, const SceneSpec& scene) {
  const fs::path folder = fs::path(scene.path).parent_path();
  std::vector<fs::path> files{scene.path, scene.hand_script, scene.device.identified};
  if (scene.second) {
    files.emplace_back(scene.second->hand_script);
    files.emplace_back(scene.second->device.identified);
  }
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const bool from_command_line = v == 0 && options.overrides.volume_file;
    const fs::path file =
        from_command_line ? *options.overrides.volume_file : fs::path(scene.volumes[v].file);
    if (file == kPhantomFile) continue;
    files.push_back(from_command_line ? file : volume_path(folder, file.string()));
    const fs::path labels = labels_path(files.back());
    std::error_code fault;
    if (fs::exists(fs::symlink_status(labels, fault))) files.push_back(labels);
  }
  for (const ToolSpec& tool : scene.tools) {
    if (!tool.file.empty()) files.push_back(folder / tool.file);
  }
  return files;
}

/// For the emulator, if the scene names one.
std::string identified_line(const char* arm, const LoadedScene& scene) {
  if (!scene.identified) return {};
  return std::string(arm) + "identified=" + scene.device.identified + "\n";
}

/// Highest speed of a free hand over a tooth; a lower limit is reported.
constexpr double kHandSpeedMmPerS = 1000;

}  // namespace

std::string hand_lines(const LoadedScene& scene) {
  char unit[64];
  std::snprintf(unit, sizeof unit, "%.9g", hand_unit_mm(scene));
  const std::string lines =
      "hand_unit_mm=" + std::string(unit) + "\nhand_script=" + scene.hand_script +
      "\nrate_hz=" + std::to_string(scene.servo.rate_hz) + "\n" + identified_line("", scene);
  if (!scene.second) return lines;
  const LoadedScene second = second_arm_of(scene);
  std::snprintf(unit, sizeof unit, "%.9g", hand_unit_mm(second));
  return lines + "device=" + std::string(word_of(scene.device.personality)) +
         "\nsecond_device=" + std::string(word_of(second.device.personality)) +
         "\nsecond_hand_unit_mm=" + unit + "\nsecond_hand_script=" + second.hand_script + "\n" +
         identified_line("second_", second);
}

std::string air_lines(const LoadedScene& scene, const SceneCosts& costs) {
  const std::vector<double>& speeds = costs.air_speeds_mm_per_s;
  if (speeds.empty()) return {};
  const auto slowest = std::min_element(speeds.begin(), speeds.end());
  char speed[32];
  std::snprintf(speed, sizeof speed, "%.2f", *slowest / 1000);
  std::string lines = "free_of_drag_m_per_s=" + std::string(speed) + "\n";
  if (*slowest >= kHandSpeedMmPerS) return lines;
  const auto tool = static_cast<std::size_t>(slowest - speeds.begin());
  return lines + "note=tool " + scene.tools[tool].name +
         " has drag in air near a surface if the hand is faster than " + speed +
         " m/s; a higher rate or larger voxels raise that\n";
}

std::string border_line(const SceneVolume& volume) {
  const Density border = border_density(volume.image);
  if (!volume.solid || 8.0 * border < volume.iso) return {};  // a sample below that counts as air
  char text[256];
  std::snprintf(
      text, sizeof text,
      "note=%s ends in a density of %.3f, of an iso of %.3f, and air is 0: a fast tool may "
      "feel that step; give it a window that begins at its air\n",
      volume.name.c_str(), border / double(kDensityMax), volume.iso / kDensityMax);
  return text;
}

void print_scene(const LoadedScene& scene, const SceneCosts& costs, const GainMargin& margin) {
  std::printf("scene=%s\n", scene.path.c_str());
  for (const SceneVolume& v : scene.volumes) {
    const auto& g = v.image.grid;
    const auto& h = v.image.spacing_mm;
    std::printf("volume=%s %dx%dx%d spacing_mm=%g,%g,%g iso=%.4f solid=%d\n", v.name.c_str(), g.nx,
                g.ny, g.nz, h[0], h[1], h[2], v.iso / kDensityMax, v.solid ? 1 : 0);
    if (!v.note.empty()) std::printf("note=%s %s\n", v.name.c_str(), v.note.c_str());
    for (const std::string& choice : v.proposal) std::printf("proposed_%s\n", choice.c_str());
    std::printf("noise=%s share=%.4f passes=%d\n", v.name.c_str(), v.noise.share, v.denoised);
    if (v.enclosed) {
      std::printf("note=%s is solid at its border; one voxel of air was laid around it\n",
                  v.name.c_str());
    }
    std::printf("%s", border_line(v).c_str());
  }
  for (const SceneTool& t : scene.tools) {
    std::printf("tool=%s %s samples=%zu pitch_mm=%g radius_mm=%g\n", t.name.c_str(),
                t.shape.c_str(), t.offsets.size(), t.pitch_mm, t.radius_mm);
    if (t.law != BurLaw{}) {
      const auto or_none = [](double value) { return value > 0 ? number_text(value) : "none"; };
      std::printf(
          "bur_law=%s force_exponent=%s speed_exponent=%s saturation_n=%s wear_half_n_s=%s\n",
          t.name.c_str(), number_text(t.law.force_exponent).c_str(),
          number_text(t.law.speed_exponent).c_str(), or_none(t.law.saturation_n).c_str(),
          or_none(t.law.wear_half_n_s).c_str());
    }
    const std::string note = t.mesh.triangles.empty() ? "" : mesh_note(t.mesh);
    if (!note.empty()) std::printf("note=tool %s: %s\n", t.name.c_str(), note.c_str());
  }
  const auto& o = scene.device.offset_mm;
  std::printf("workspace_scale=%g\noffset_mm=%g,%g,%g\n", scene.device.workspace_scale, o[0], o[1],
              o[2]);
  if (scene.second) {
    const auto& s = scene.second->device.offset_mm;
    std::printf("second_offset_mm=%g,%g,%g\nsecond_tool=%s\n", s[0], s[1], s[2],
                scene.tools[scene.second_tool].name.c_str());
  }
  std::printf("force=%s\ncut=%s\n", std::string(word_of(scene.force.model)).c_str(),
              std::string(word_of(scene.cut.model)).c_str());
  std::printf("stiffness_at_device_n_per_mm=%g\n", margin.stiffness_n_per_mm);
  std::fputs(gain_lines(scene, margin).c_str(), stdout);
  const std::size_t costliest = costliest_tool(costs);
  std::printf("costliest_tool=%s\nhighest_rate_hz=%d\n", scene.tools[costliest].name.c_str(),
              highest_rate_hz(work_us(costs, costliest)));
  std::fputs(air_lines(scene, costs).c_str(), stdout);
  std::fputs(hand_lines(scene).c_str(), stdout);
  std::fputs(settings_text(as_written(scene)).c_str(), stdout);
}

fs::path final_path(const ControllerOptions& options, const LoadedScene& scene, std::size_t v) {
  fs::path path = options.final_volume;
  if (v > 0) {
    path.replace_filename(path.stem().string() + "-" + scene.volumes[v].name +
                          path.extension().string());
  }
  return path;
}

void check_report(const ControllerOptions& options) {
  const SceneSpec scene = parse_scene_file(options.scene, options.overrides.settings);
  check_outputs(files_read(options, scene), {{"--report", options.report, ".json"}});
}

void check_run_files(const ControllerOptions& options, const LoadedScene& scene) {
  std::vector<OutputFile> written{{"--report", options.report, ".json"},
                                  {"--emulator-args", options.emulator_args, {}}};
  if (!options.final_volume.empty()) {
    for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
      const fs::path volume = final_path(options, scene, i);
      written.push_back({"--final", volume, ".nrrd"});
      written.push_back({"--final", labels_path(volume), ".nrrd"});
    }
  }
  check_outputs(files_read(options, as_written(scene)), written);
  if (!options.final_volume.empty()) check_volume_path(options.final_volume);
}

std::string refused_gains(const ControllerOptions& options, const LoadedScene& scene,
                          const GainMargin& margin) {
  if (options.virtual_time) return "";
  const std::string above = options.unchecked_gain ? "" : device_limit_error(scene);
  return above.empty() ? gain_error(scene, margin) : above;
}

void explain_scene(const ControllerOptions& options, LoadedScene& scene, CompiledScene& servo) {
  check_run_files(options, scene);
  const int core = core_of(options.real_time);
  static_cast<void>(pin_to_core(core));  // without the right, times vary more
  const SegmentPlan segment = plan_segment(segment_spec(scene, canonical_json(scene), 0));
  check_memory(scene, servo.costs(), 0);
  servo.take(scene);
  const CostReport explanation = explain(scene, servo, segment);
  std::fputs(explanation_text(explanation).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, explanation_json(explanation));
  std::string refusal = budget_error(scene, servo.costs());
  if (refusal.empty()) refusal = refused_gains(options, scene, explanation.gain);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

}  // namespace kerf
