// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/gain_margin.hpp"
#include "controller/run/controller_options.hpp"
#include "shared/segment/segment.hpp"

// Checks of a scene before a run: `--check`, `--explain`, outputs, gains.

namespace kerf {

/// One tool in one volume: upper bounds of its work, and a timed tick.
struct ExplainedTick {
  std::string tool, volume, variant, why;
  std::vector<StageCost> most;  ///< their work counts against the budget (compile.hpp)
  TickTime time;
};

/// The figures of `--explain`.
struct CostReport {
  std::string scene, numeric, cut, machine;
  /// Time here over work on the reference machine, of all timed ticks. The work of a stage
  /// times this predicts its time here.
  double machine_factor = 1;
  int rate_hz = 1000;
  double budget_us = 0;  ///< of work, for one tool in all volumes
  std::size_t arms = 1;
  std::vector<ExplainedTick> ticks;
  std::vector<ArrayBytes> arrays;  ///< of the servo, then of the segment
  GainMargin gain;
  std::string gain_lines;  ///< `gain` as text for a person
};

/// The parts of a segment by its layout, each up to the begin of the next one.
[[nodiscard]] std::vector<ArrayBytes> segment_arrays(const SegmentPlan& plan,
                                                     const LoadedScene& scene);

/// Times every tool in every volume of a scene that `servo` has taken; see
/// `CompiledScene::time_tick`.
[[nodiscard]] CostReport explain(const LoadedScene& scene, CompiledScene& servo,
                                 const SegmentPlan& segment);

/// The report for a person.
[[nodiscard]] std::string explanation_text(const CostReport& explanation);

/// The report as JSON; ends with a newline.
[[nodiscard]] std::string explanation_json(const CostReport& explanation);

/// The lines that the demo script passes to the emulator.
[[nodiscard]] std::string hand_lines(const LoadedScene& scene);

/// The speed up to which no tool has drag in air (air_speed.hpp), and a note if a hand is faster.
[[nodiscard]] std::string air_lines(const LoadedScene& scene, const SceneCosts& costs);

/// A note if a volume ends in a density that contact counts; else empty.
[[nodiscard]] std::string border_line(const SceneVolume& volume);

/// Output file of volume `v` for --final. The first volume gets the given path FOLDER/STEM.EXT,
/// each other one FOLDER/STEM-VOLUME.EXT.
[[nodiscard]] std::filesystem::path final_path(const ControllerOptions& options,
                                               const LoadedScene& scene, std::size_t v);

/// Refuses a report that could not be written, or would replace a file of the scene. Called first,
/// since a run that is stopped early writes it too. Throws FileError or LoadError.
void check_report(const ControllerOptions& options);

/// Refuses output files that could not be written at the end, or would replace a file of the scene.
/// Throws FileError or LoadError.
void check_run_files(const ControllerOptions& options, const LoadedScene& scene);

/// Why this scene may not run: gains above the largest of its device (unless `--unchecked-gain`),
/// or beyond its stability. Empty if it may. In lock-step no hand holds the device, and any gain
/// may be studied.
[[nodiscard]] std::string refused_gains(const ControllerOptions& options, const LoadedScene& scene,
                                        const GainMargin& margin);

/// Prints the lines of --check: all facts that need no memory of the loop, one `name=value` a line,
/// and then every setting in effect as `table.key=value`.
void print_scene(const LoadedScene& scene, const SceneCosts& costs, const GainMargin& margin);

/// `--explain`: prints the cost of the scene on this machine; it does not run. Throws
/// std::runtime_error with one line for a scene above the budget or with refused gains, after the
/// print.
void explain_scene(const ControllerOptions& options, LoadedScene& scene, CompiledScene& servo);

}  // namespace kerf
