// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include "controller/servo/proxy_contact.hpp"
#include "lab/accuracy/contact_method.hpp"
#include "lab/extremes/hands.hpp"
#include "lab/extremes/measured_tools.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/extremes/worst_tick.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/rig/contact_rig.hpp"
#include "lab/rig/shaft_rig.hpp"
#include "lab/rig/tick_timer.hpp"
#include "shared/numeric/percentile.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr VoxelGrid kGrid{256, 256, 161};
constexpr double kRadius = 8;

ProxyPose<N> goal_at(const bench::Place& p) {
  return {place_of<N>({p[0], p[1], p[2]}), {}};
}

void measure_worst_ticks(const Effort& effort, const RowSink& add_row) {
  struct Subject {
    const char* name;
    SceneTool tool;
    WorstTick worst;
  };
  Subject subjects[] = {
      {"ball", tool_of_units("ball", kRadius, 2 * kRadius), {}},
      {"turning cylinder", tool_of_units("cylinder", 5, 16), {}},
      {"turning bur (STL)", shipped_bur(), {}},
      {"ball with a shaft", tool_with("ball", 5.6, 11.2, {.radius_mm = 3.6, .length_mm = 72}), {}},
      {"inverted cone with a handpiece",
       tool_with("inverted_cone", 6, 12,
                 {.radius_mm = 4, .length_mm = 40, .handpiece_radius_mm = 12}),
       {}}};
  for (const Trap& trap : worst_traps(effort.data)) {
    const Body body = trap.body();
    for (Subject& subject : subjects) {
      find_worst_tick(subject.tool, trap, body, 2 * effort.tick_count, subject.worst);
    }
  }
  for (const Subject& subject : subjects) {
    add_row({"ticks",
             std::string("proxy, ") + subject.name + ", costliest tick found (" +
                 subject.worst.trap + ")",
             subject.worst.us, "us", 60, 40});
    add_row({"ticks",
             std::string("proxy, ") + subject.name + ", samples of that tick",
             static_cast<double>(subject.worst.samples),
             "",
             {},
             {}});
  }
}

/// The whole servo in the default demo, ticks back to back; of each tick the fastest of some runs,
/// which are alike to the bit.
void measure_cutting_ticks(const Effort& effort, const RowSink& add_row) {
  const LoadedScene scene = shipped_scene("phantom", effort);
  constexpr int kRuns = 4;
  std::vector<double> us;
  for (int i = 0; i < kRuns; ++i) {
    const HandRun run = run_hand(scene, "cut_cavity", effort);
    us.resize(run.ticks.size());
    for (std::size_t t = 0; t < us.size(); ++t) {
      us[t] = i == 0 ? run.ticks[t].compute_us : std::min(us[t], run.ticks[t].compute_us);
    }
  }
  add_row({"ticks", "whole servo, default scene, cutting: p50", percentile(us, 0.5), "us", {}, {}});
  add_row({"ticks", "whole servo, default scene, cutting: p99.9", percentile(us, 0.999), "us", 100,
           50});
}

}  // namespace

void measure_ticks(const Effort& effort, const RowSink& add_row) {
  const auto row = [&](const char* name, double us, std::optional<double> must,
                       std::optional<double> aim = std::nullopt) {
    add_row({"ticks", name, us, "us", must, aim});
  };
  const Body ball{kGrid, bench::ball_in(kGrid)};
  {
    const SceneTool tool = tool_of_units("ball", kRadius, 2 * kRadius);
    ContactRig<N> rig(tool, ball);
    const ProxyPlan<N> plan{.ramp_per_tick = N::Real(1)};
    ProxyState<N> state;
    state.pose = {place_of<N>({200, 80, 128}), {}};
    // Half a unit a tick: 50 mm/s.
    const auto place = [&](int i) { return bench::around(kGrid, 16, i, 580); };
    for (int i = 0; i < 40; ++i) bench::use(rig.follow(plan, state, goal_at(place(0))).queries);
    const TickTimes times = time_ticks(
        effort.tick_count, [] {},
        [&](int i) { bench::use(rig.follow(plan, state, goal_at(place(i))).queries); });
    row("proxy, sliding at 50 mm/s: p50", times.p50_ns / 1e3, 15, 6);
    row("proxy, sliding at 50 mm/s: p99", times.p99_ns / 1e3, std::nullopt);
  }
  {
    const accuracy::AnalyticVolume volume{kGrid, 0.1, ball.density};
    const auto paper = accuracy::contact_method(
        {.storage = accuracy::Storage::aligned, .voxel_mm = volume.voxel_mm}, volume,
        accuracy::ball_tool(0.8, 0.1));
    const TickTimes times = time_ticks(
        effort.tick_count, [] {},
        [&](int i) {
          const bench::Place p = bench::around(kGrid, 16, i, 580);
          bench::use(static_cast<std::int64_t>(paper->tool_sum({p[0], p[1], p[2]}).x));
        });
    row("paper, sliding at 50 mm/s: p50", times.p50_ns / 1e3, std::nullopt);
    row("paper, sliding at 50 mm/s: p99", times.p99_ns / 1e3, std::nullopt);
  }
  measure_worst_ticks(effort, add_row);
  measure_cutting_ticks(effort, add_row);
}

}  // namespace kerf::extremes
