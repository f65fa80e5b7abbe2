// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "controller/servo/proxy_contact.hpp"
#include "hil/lab/accuracy/contact_method.hpp"
#include "hil/lab/bench_scene.hpp"
#include "hil/lab/extremes/hands.hpp"
#include "hil/lab/extremes/measures.hpp"
#include "hil/lab/extremes/wall_shake.hpp"
#include "hil/lab/tick_timer.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr VoxelGrid kGrid{256, 256, 161};
constexpr double kRadius = 8;

ProxyPose<N> goal_at(const bench::Place& p) {
  return {place_of<N>({p[0], p[1], p[2]}), {}};
}

/// The 20 costliest of random ticks at a wall, each the fastest of some repetitions: what other
/// programs steal does not count, what the input costs does.
double worst_us(const ShakenTool& shaken, const Body& half, double face, int ticks) {
  ShellRig<N> rig(shaken.made(), half);
  struct Costly {
    std::int32_t probes;
    ProxyPose<N> from, goal;
  };
  std::vector<Costly> all;
  Dice dice(3);
  Point hand{128, 128, face + shaken.reach() + 3};
  ProxyPose<N> pose{place_of<N>(hand), {}}, goal = pose;
  const auto tick = [&](ProxyPose<N>& at, const ProxyPose<N>& to) {
    return ProxySweep<N, ShellProbe<N>>(rig.field(), at, {}, rig.turn_step()).tick(to).probes;
  };
  for (int i = 0; i < ticks; ++i) {
    hand = hand + std::pow(10.0, dice.uniform(0, 2)) * dice.direction();
    hand = {std::clamp(hand[0], 40.0, 200.0), std::clamp(hand[1], 40.0, 200.0),
            std::clamp(hand[2], face - 14, face + 14)};
    goal.centre = place_of<N>(hand);
    goal.turn = compose(dice.turn<N>(i % 3 == 0 ? 3 : dice.uniform(0, 0.2)), goal.turn);
    const ProxyPose<N> from = pose;
    all.push_back({tick(pose, goal), from, goal});
  }
  std::sort(all.begin(), all.end(),
            [](const Costly& a, const Costly& b) { return a.probes > b.probes; });
  all.resize(std::min<std::size_t>(all.size(), 20));
  double worst_ns = 0;
  for (const Costly& costly : all) {
    constexpr int kRepetitions = 25;
    double fastest_ns = 1e12;
    for (int i = 0; i < kRepetitions; ++i) {
      const TickTimes times = time_ticks(
          1, [] {},
          [&](int) {
            ProxyPose<N> at = costly.from;
            bench::use(tick(at, costly.goal));
          });
      fastest_ns = std::min(fastest_ns, times.p50_ns);
    }
    worst_ns = std::max(worst_ns, fastest_ns);
  }
  return worst_ns / 1e3;
}

/// The whole servo in the default demo, ticks back to back; of each tick the fastest of some runs,
/// which are alike to the bit.
void measure_cutting_ticks(const Effort& effort, const Told& told) {
  const Scene scene = shipped_scene("phantom", effort);
  constexpr int kRuns = 4;
  std::vector<double> us;
  for (int i = 0; i < kRuns; ++i) {
    const HandRun run = run_hand(scene, "cut_cavity", effort);
    us.resize(run.ticks.size());
    for (std::size_t t = 0; t < us.size(); ++t) {
      us[t] = i == 0 ? run.ticks[t].compute_us : std::min(us[t], run.ticks[t].compute_us);
    }
  }
  std::sort(us.begin(), us.end());
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  told({"ticks", "whole servo, default scene, cutting: p50", at(0.5), "us", {}, {}});
  told({"ticks", "whole servo, default scene, cutting: p99.9", at(0.999), "us", 100, 50});
}

}  // namespace

void measure_ticks(const Effort& effort, const Told& told) {
  const auto row = [&](const char* name, double us, std::optional<double> must,
                       std::optional<double> aim = std::nullopt) {
    told({"ticks", name, us, "us", must, aim});
  };
  const Body ball{kGrid, bench::ball_in(kGrid)};
  {
    const SceneTool tool = tool_of_units("ball", kRadius, 2 * kRadius);
    ShellRig<N> rig(tool, ball);
    const ProxyPlan<N> plan{.ramp_per_tick = N::Real(1)};
    ProxyState<N> state;
    state.pose = {place_of<N>({200, 80, 128}), {}};
    // Half a unit a tick: 50 mm/s.
    const auto place = [&](int i) { return bench::around(kGrid, 16, i, 580); };
    for (int i = 0; i < 40; ++i)
      bench::use(follow(plan, state, rig.field(), goal_at(place(0))).probes);
    const TickTimes times = time_ticks(
        effort.tick_count, [] {},
        [&](int i) { bench::use(follow(plan, state, rig.field(), goal_at(place(i))).probes); });
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
  constexpr double kFace = 96.6;
  const Body half{kGrid,
                  bench::densities(kGrid, [](double, double, double z) { return kFace - z; })};
  const int ticks = 10 * effort.tick_count;
  row("proxy, ball, costliest of random ticks", worst_us({}, half, kFace, ticks), 60, 40);
  row("proxy, turning cylinder, costliest of random ticks",
      worst_us({.round = false, .radius = 5, .half = 8}, half, kFace, ticks), 60, 40);
  measure_cutting_ticks(effort, told);
}

}  // namespace kerf::extremes
