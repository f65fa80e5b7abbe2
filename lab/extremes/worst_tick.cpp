// SPDX-License-Identifier: Apache-2.0
#include "lab/extremes/worst_tick.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "controller/servo/proxy_contact.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/rig/contact_rig.hpp"
#include "lab/rig/shaft_rig.hpp"

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
      : rig_(rig), plan_{.turn_step = rig.turn_step(), .ramp_per_tick = N::Real(1)} {}

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
void find_with(Rig& rig, const Trap& trap, int ticks, WorstTick& worst) {
  Stopwatch<Rig> stopwatch(rig);
  Dice dice(3);
  std::vector<Tick> tried;
  ProxyState<N> state;
  Point hand = trap.middle;
  ToolTurn<N> turn;
  for (int i = 0; i < ticks; ++i) {
    const bool far = i % 16 == 15;  // beyond the volume, and back
    hand = hand + std::pow(10.0, dice.uniform(0, 2)) * dice.direction();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      hand[axis] = std::clamp(hand[axis], trap.middle[axis] - 20, trap.middle[axis] + 20);
    }
    turn = compose(dice.turn<N>(i % 3 == 0 ? 3 : dice.uniform(0, 0.2)), turn);
    if (i % 64 == 63) state = {};  // looks for a place
    Tick tick{state, {place_of<N>(far ? 5000 * dice.direction() : hand), turn}};
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
      const Point off = std::pow(10.0, dice.uniform(-1, 1.5)) * dice.direction();
      beside.goal.centre = beside.goal.centre + place_of<N>(off);
      beside.goal.turn = compose(dice.turn<N>(dice.uniform(0, 0.3)), beside.goal.turn);
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
    if (tick.ns / 1e3 > worst.us) worst = {tick.ns / 1e3, tick.queries, trap.name, tick.samples};
  }
}

}  // namespace

void find_worst_tick(const SceneTool& tool, const Trap& trap, const Body& body, int ticks,
                     WorstTick& worst) {
  if (tool.shaft.radius_mm > 0) {
    ShaftRig<N> rig(tool, {&body}, trap.iso);
    return find_with(rig, trap, ticks, worst);
  }
  ContactRig<N> rig(tool, body, trap.iso);
  find_with(rig, trap, ticks, worst);
}

}  // namespace kerf::extremes
