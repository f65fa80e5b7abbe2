// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/gain_margin.hpp"
#include "controller/plan/scene_costs.hpp"
#include "controller/shell/controller_options.hpp"

namespace kerf {

/// What the demo script hands to the emulator.
[[nodiscard]] std::string hand_lines(const LoadedScene& scene);

/// The speed up to which no tool is dragged in air (air_speed.hpp), and a note where a hand is
/// faster.
[[nodiscard]] std::string air_lines(const LoadedScene& scene, const SceneCosts& costs);

/// A note where a volume ends in a density that contact counts; else nothing.
[[nodiscard]] std::string border_line(const SceneVolume& volume);

/// Where --final puts volume `v`: the first under the name that is given, others beside it under
/// their own.
[[nodiscard]] std::filesystem::path final_path(const ControllerOptions& options,
                                               const LoadedScene& scene, std::size_t v);

/// Refuses a report that could not be written, or would replace a file of the scene: before
/// anything else, since a run that is stopped early writes it too. Throws FileError or SceneError.
void check_report(const ControllerOptions& options);

/// Refuses now what could not be written at the end, or would replace a file of the scene. Throws
/// FileError or SceneError.
void check_run_files(const ControllerOptions& options, const LoadedScene& scene);

/// Why this scene is not run: gains above the most of its device (unless `--unchecked-gain`), or
/// beyond its stability. Empty: it is. In lock-step nobody holds the device, and any gain may be
/// studied.
[[nodiscard]] std::string refused_gains(const ControllerOptions& options, const LoadedScene& scene,
                                        const GainMargin& margin);

/// Prints what --check tells: whatever can be said without memory for the loop, one `name=value` a
/// line, and then every setting in effect as `table.key=value`.
void print_scene(const LoadedScene& scene, const SceneCosts& costs, const GainMargin& margin);

/// `--explain`: prints what the scene costs on this machine; it is not run. Throws
/// std::runtime_error with one line for a scene above the budget or with refused gains, after all
/// is told.
void explain_scene(const ControllerOptions& options, LoadedScene& scene, CompiledScene& servo);

}  // namespace kerf
