// SPDX-License-Identifier: Apache-2.0
#include "lab/extremes/hands.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "controller/load/scene_load.hpp"
#include "controller/scene/scene_error.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {
namespace {

void tell(const HandRun& run, const RowSink& add_row) {
  double peak_n = 0, step_n = 0;
  std::size_t contact = 0;
  const HandTick* before = nullptr;
  for (const HandTick& tick : run.ticks) {
    const Point& f = tick.force_n;
    peak_n = std::max(peak_n, length(f));
    contact += tick.contact ? 1 : 0;
    if (before != nullptr) step_n = std::max(step_n, length(f - before->force_n));
    before = &tick;
  }
  const Chatter chatter = chatter_of(run, kChatterHz);
  const auto row = [&](const char* what, double value, const char* unit,
                       std::optional<double> must = std::nullopt) {
    add_row({"hands", run.name + what, value, unit, must, {}});
  };
  row(": in contact", 100 * double(contact) / double(run.ticks.size()), "%");
  row(": peak force", peak_n, "N");
  row(": largest step of the force in a tick", step_n, "N");
  row(": removed", run.ticks.empty() ? 0 : run.ticks.back().removed_mm3, "mm^3");
  row(": force above 150 Hz over the mean", 100 * chatter.share, "%", 2);
  row(": the same, worst window of 0.128 s", 100 * chatter.worst, "%");
  row(": windows in contact", chatter.windows, "1");
  row(": ticks with a fault", double(run.faults), "ticks", 0);
}

}  // namespace

LoadedScene shipped_scene(const std::string& name, const Effort& effort) {
  try {
    return load_scene("scenes/" + name + ".toml", {.phantom_size = effort.phantom});
  } catch (const SceneError& error) {
    throw HilError(error.what());
  }
}

LoadedScene hand_scene(const Effort& effort, CutModel cut) {
  LoadedScene scene = shipped_scene("touch", effort);
  scene.cut.model = cut;
  return scene;
}

HandRun run_hand(const LoadedScene& scene, const std::string& name, const Effort& effort) {
  HandScript hand = read_hand_script("scenes/hands/" + name + ".toml");
  hand.unit_mm = hand_unit_mm(scene);
  HandRun run = run_hand(scene, hand, effort.hand_seconds);
  run.name = name;
  return run;
}

std::vector<HandRun> try_hands(const Effort& effort, const RowSink& add_row) {
  const LoadedScene feeling = hand_scene(effort, CutModel::none);
  const LoadedScene cutting = hand_scene(effort, CutModel::preston);
  std::vector<HandRun> runs;
  const auto run = [&](const LoadedScene& scene, const char* name) {
    runs.push_back(run_hand(scene, name, effort));
    tell(runs.back(), add_row);
  };
  run(feeling, "touch");
  run(feeling, "slide");
  run(cutting, "groove");
  run(cutting, "cut_cavity");
  run(feeling, "jerk");
  return runs;
}

}  // namespace kerf::extremes
