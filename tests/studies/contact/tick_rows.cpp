// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "controller/kernel/proxy/proxy.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/windowing.hpp"
#include "lab/accuracy/contact_method.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/run/lab_run.hpp"
#include "shared/numeric/statistics.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/studies/contact/hands.hpp"
#include "tests/studies/contact/rows.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

struct Tick {
  ProxyState<N> from;
  ProxyPose<N> goal;
  double ns = 0;
  std::int32_t queries = 0;
  std::int64_t samples = 0;
};

template <class Rig>
class Stopwatch {
 public:
  explicit Stopwatch(Rig& rig)
      : rig_(rig), plan_{.rotation_step = rig.rotation_step(), .ramp_per_tick = N::Real(1)} {}

  /// Fastest of some runs; the state after them.
  ProxyState<N> time(Tick& tick, int runs) {
    using Clock = std::chrono::steady_clock;
    ProxyState<N> after;
    double fastest_ns = 1e12;
    for (int i = 0; i < runs; ++i) {
      after = tick.from;
      rig_.field().begin_tick();
      const auto start = Clock::now();
      const ProxyContact<N> felt = rig_.follow(plan_, after, tick.goal);
      bench::use(felt.spring.x.raw());
      const double ns = std::chrono::duration<double, std::nano>(Clock::now() - start).count();
      fastest_ns = std::min(fastest_ns, ns);
      tick.queries = felt.queries;
      tick.samples = rig_.field().spent();
    }
    tick.ns = fastest_ns;
    return after;
  }

 private:
  Rig& rig_;
  ProxyPlan<N> plan_;
};

/// The `count` that took longest, in that order.
void keep_costliest(std::vector<Tick>& ticks, std::size_t count) {
  std::sort(ticks.begin(), ticks.end(), [](const Tick& a, const Tick& b) { return a.ns > b.ns; });
  ticks.resize(std::min(ticks.size(), count));
}

template <class Rig>
void find_with(Rig& rig, const WorstCase& worst_case, int ticks, WorstTick& worst) {
  Stopwatch<Rig> stopwatch(rig);
  RandomNumbers random(3);
  std::vector<Tick> tried;
  ProxyState<N> state;
  Point hand = worst_case.middle;
  Orientation<N> orientation;
  for (int i = 0; i < ticks; ++i) {
    const bool far = i % 16 == 15;  // beyond the volume, and back
    hand = hand + std::pow(10.0, random.uniform(0, 2)) * random.direction();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      hand[axis] =
          std::clamp(hand[axis], worst_case.middle[axis] - 20, worst_case.middle[axis] + 20);
    }
    orientation = compose(random.rotation<N>(i % 3 == 0 ? 3 : random.uniform(0, 0.2)), orientation);
    if (i % 64 == 63) state = {};  // looks for a place
    Tick tick{state, {place_of<N>(far ? 5000 * random.direction() : hand), orientation}};
    state = stopwatch.time(tick, 2);
    tried.push_back(tick);
  }
  constexpr std::size_t kCostliest = 16;
  keep_costliest(tried, kCostliest);
  // Goals beside the costliest ones.
  constexpr int kBeside = 24;
  for (std::size_t k = 0; k < std::min(kCostliest, tried.size()); ++k) {
    for (int i = 0; i < kBeside; ++i) {
      Tick beside = tried[k];
      const Point off = std::pow(10.0, random.uniform(-1, 1.5)) * random.direction();
      beside.goal.centre = beside.goal.centre + place_of<N>(off);
      beside.goal.orientation =
          compose(random.rotation<N>(random.uniform(0, 0.3)), beside.goal.orientation);
      stopwatch.time(beside, 2);
      tried.push_back(beside);
    }
  }
  keep_costliest(tried, kCostliest);
  // In rounds: another program on the same core may last as long as many repetitions.
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    for (Tick& tick : tried) {
      const double before_ns = tick.ns;
      stopwatch.time(tick, 5);
      tick.ns = std::min(tick.ns, before_ns);
    }
  }
  for (const Tick& tick : tried) {
    if (tick.ns / 1e3 > worst.us)
      worst = {tick.ns / 1e3, tick.queries, worst_case.name, tick.samples};
  }
}

constexpr VoxelGrid kGrid{256, 256, 161};
constexpr Point kMiddle{128.3, 127.6, 96.6};

/// By signed distance from `kMiddle`, tilted so that no layer of voxels lies along a face.
WorstCase solid(const char* name, double (*distance)(Point)) {
  return {name,
          [distance] {
            return blurred(kGrid, [distance](Point p) {
              const Point d = p - kMiddle;
              return distance({0.96 * d[0] - 0.28 * d[2], d[1], 0.28 * d[0] + 0.96 * d[2]});
            });
          },
          kMiddle, kIso};
}

/// Any densities between two shares of the whole.
WorstCase tissue(const char* name, double low, double high) {
  return {name,
          [low, high] {
            RandomNumbers random(5);
            return body_of(kGrid, [&](Point) { return random.uniform(low, high); });
          },
          kMiddle, kIso};
}

WorstCase tooth(const std::filesystem::path& file) {
  const SourceVolume source = read_volume(file, {.override_spacing_mm = std::array{0.1, 0.1, 0.1}});
  VolumeImage image = apply_window(source, range_window(source));
  const Density iso = otsu_threshold(image);
  const Body body{image.grid, std::move(image.density)};
  // Along the middle of its slices to the first solid voxel.
  const std::int32_t x = body.grid.nx / 2, y = body.grid.ny / 2;
  std::int32_t z = body.grid.nz - 1;
  while (z > 0 && body.density[body.grid.index(x, y, z)] < iso) --z;
  return {"tooth", [body] { return body; }, {double(x), double(y), double(z)}, iso};
}

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
  for (const WorstCase& worst_case : worst_cases(effort.data)) {
    const Body body = worst_case.body();
    for (Subject& subject : subjects) {
      find_worst_tick(subject.tool, worst_case, body, 2 * effort.tick_count, subject.worst);
    }
  }
  for (const Subject& subject : subjects) {
    add_row({"ticks",
             std::string("proxy, ") + subject.name + ", costliest tick found (" + subject.worst.at +
                 ")",
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

void find_worst_tick(const SceneTool& tool, const WorstCase& worst_case, const Body& body,
                     int ticks, WorstTick& worst) {
  if (tool.shaft.radius_mm > 0) {
    ShaftRig<N> rig(tool, {&body}, worst_case.iso);
    return find_with(rig, worst_case, ticks, worst);
  }
  ContactRig<N> rig(tool, body, worst_case.iso);
  find_with(rig, worst_case, ticks, worst);
}

std::vector<WorstCase> worst_cases(const std::filesystem::path& data) {
  std::vector<WorstCase> cases{
      solid("flat", [](Point p) { return p[2]; }),
      solid("edge", [](Point p) { return (p[2] + std::abs(p[0])) * std::sqrt(0.5); }),
      solid("crease", [](Point p) { return (p[2] - std::abs(p[0])) * std::sqrt(0.5); }),
      solid("ball of 6", [](Point p) { return length(p) - 6; }),
      // A slot with a play of 0.1 for a ball of 8, round at its bottom.
      solid("slot",
            [](Point p) {
              const double wall = 8.1 - (p[2] < 0 ? std::hypot(p[0], p[2]) : std::abs(p[0]));
              return std::max(wall, p[2] - 12);
            }),
      tissue("noise", 0.2, 0.6),
      tissue("soft tissue", 0.38, 0.48),
  };
  const std::filesystem::path file = data / "ge_tooth_16bit/tooth.nhdr";
  if (!data.empty() && std::filesystem::exists(file)) cases.push_back(tooth(file));
  return cases;
}

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
