// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/check_scene.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "controller/load/scene_json.hpp"
#include "controller/load/scene_load.hpp"
#include "controller/plan/cost/explain.hpp"
#include "controller/plan/cost/work_budget.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_page.hpp"
#include "controller/shell/scene_segment.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "shared/posix/cores.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"

namespace kerf {
namespace fs = std::filesystem;

std::string hand_lines(const LoadedScene& scene) {
  char unit[64];
  std::snprintf(unit, sizeof unit, "%.9g", hand_unit_mm(scene));
  return "hand_unit_mm=" + std::string(unit) + "\nhand_script=" + scene.hand_script +
         "\nrate_hz=" + std::to_string(scene.servo.rate_hz) + "\n";
}

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

/// A scene as its text has it, after what the command line changed.
Scene as_written(const LoadedScene& scene) {
  Scene written;
  static_cast<SceneSettings&>(written) = scene;
  written.volumes = scene.volume_specs;
  written.tools = scene.tool_specs;
  return written;
}

/// The files that a scene is made of.
std::vector<fs::path> files_read(const ControllerOptions& options, const Scene& scene) {
  const fs::path folder = fs::path(scene.path).parent_path();
  std::vector<fs::path> files{scene.path, scene.hand_script};
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const bool from_command_line = v == 0 && options.overrides.volume_file;
    const fs::path file =
        from_command_line ? *options.overrides.volume_file : fs::path(scene.volumes[v].file);
    if (file == kPhantomFile) continue;
    files.push_back(from_command_line ? file : folder / file);
    const fs::path labels = labels_path(files.back());
    std::error_code fault;
    if (fs::exists(fs::symlink_status(labels, fault))) files.push_back(labels);
  }
  for (const ToolSpec& tool : scene.tools) {
    if (!tool.file.empty()) files.push_back(folder / tool.file);
  }
  return files;
}

/// A free hand over a tooth moves up to so fast; what is slower than that is told.
constexpr double kHandSpeedMmPerS = 1000;

}  // namespace

std::string air_lines(const LoadedScene& scene, const SceneCosts& costs) {
  const std::vector<double>& speeds = costs.air_speeds_mm_per_s;
  if (speeds.empty()) return {};
  const auto slowest = std::min_element(speeds.begin(), speeds.end());
  char speed[32];
  std::snprintf(speed, sizeof speed, "%.2f", *slowest / 1000);
  const std::string lines = "free_of_drag_m_per_s=" + std::string(speed) + "\n";
  if (*slowest >= kHandSpeedMmPerS) return lines;
  const auto tool = static_cast<std::size_t>(slowest - speeds.begin());
  return lines + "note=tool " + scene.tools[tool].name +
         " is dragged in air, beside a surface, by a hand faster than " + speed +
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
  }
  const auto& o = scene.device.offset_mm;
  std::printf("workspace_scale=%g\noffset_mm=%g,%g,%g\n", scene.device.workspace_scale, o[0], o[1],
              o[2]);
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
  const Scene scene = parse_scene_file(options.scene, options.overrides.settings);
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
  const std::string above = options.unchecked_gain ? "" : above_device(scene);
  return above.empty() ? gain_refusal(scene, margin) : above;
}

void explain_scene(const ControllerOptions& options, LoadedScene& scene, CompiledScene& servo) {
  check_run_files(options, scene);
  const int core = core_of(options.real_time);
  static_cast<void>(pin_to_core(core));  // where it may not, times are less even
  const SegmentPlan segment = plan_segment(segment_spec(scene, canonical_json(scene), 0));
  check_memory(scene, servo.costs(), 0);
  servo.take(scene);
  const Explanation explanation = explain(scene, servo, segment);
  std::fputs(explanation_text(explanation).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, explanation_json(explanation));
  std::string refusal = over_budget(scene, servo.costs());
  if (refusal.empty()) refusal = refused_gains(options, scene, explanation.gain);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

}  // namespace kerf
