// SPDX-License-Identifier: Apache-2.0
#include "lab/energy/ledger_cost.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

#include "controller/law/coupling.hpp"
#include "controller/law/energy_bounding.hpp"
#include "controller/law/passivity_controller.hpp"
#include "controller/servo/energy_ledger.hpp"
#include "lab/rig/bench_scene.hpp"

namespace kerf::energy {
namespace {

constexpr std::size_t kPlaces = 4096;
constexpr int kRounds = 9;

/// Of one tick, as a hand that trembles on a wall makes them.
template <class N>
struct Tick {
  DeviceVec<typename N::Real> force_n, moved_mm, spring_mm;
};

template <class N>
std::vector<Tick<N>> random_ticks() {
  using Real = typename N::Real;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&](double most) {
    const double x = any(random) * most, y = any(random) * most, z = any(random) * most;
    return DeviceVec<Real>{static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z)};
  };
  std::vector<Tick<N>> ticks(kPlaces);
  for (Tick<N>& tick : ticks) {
    tick.force_n = vector(2);
    tick.moved_mm = vector(0.2);
    tick.spring_mm = vector(1);
  }
  return ticks;
}

template <class Run>
double fastest_ns(Run&& run) {
  using Clock = std::chrono::steady_clock;
  double best = 1e18;
  for (int round = 0; round < kRounds; ++round) {
    const auto start = Clock::now();
    run();
    const std::chrono::duration<double, std::nano> took = Clock::now() - start;
    best = std::min(best, took.count() / kPlaces);
  }
  return best;
}

template <class N>
std::int64_t whole(typename N::Energy energy) {
  return static_cast<std::int64_t>(energy);
}

template <class N>
double ledger_ns(const std::vector<Tick<N>>& ticks) {
  EnergyLedger<N> ledger;
  const Coupling<N> spring{typename N::Ratio(0.4F), {}};
  const double ns = fastest_ns([&] {
    for (const Tick<N>& tick : ticks) {
      ledger.move(tick.force_n, tick.moved_mm, 1);
      const auto spring_n = coupling_force(spring, tick.spring_mm, {});
      const ForceParts<N> parts{.felt = true,
                                .spring = spring_n,
                                .damping = tick.force_n - spring_n,
                                .friction = tick.moved_mm,
                                .cutting = tick.spring_mm};
      ledger.split(parts);
      ledger.send(parts);
    }
  });
  bench::use(whole<N>(ledger.lowest_mj()));
  return ns;
}

template <class N, class Law>
double law_ns(const std::vector<Tick<N>>& ticks, double value) {
  const std::array values{value};
  const Law law(LawSetup(1000, 0, Law::kSettings, values));
  typename Law::State state;
  typename N::Energy taken{};
  DeviceVec<typename N::Real> sent{};
  const double ns = fastest_ns([&] {
    for (const Tick<N>& tick : ticks) {
      taken = sum_of_energy<N>(taken, work_of_hand<N>(sent, tick.moved_mm));
      sent = law.step({tick.force_n, sent, tick.moved_mm, 1, tick.force_n, taken, true}, state);
    }
  });
  bench::use(whole<N>(taken));
  return ns;
}

template <class N>
void add_rows(std::vector<TickCostRow>& rows) {
  const auto ticks = random_ticks<N>();
  rows.push_back({"ledger and observer", N::kName, ledger_ns<N>(ticks)});
  rows.push_back({"passivity", N::kName, law_ns<N, PassivityController<N>>(ticks, 0.045)});
  rows.push_back({"energy_bounding", N::kName, law_ns<N, EnergyBounding<N>>(ticks, 0.0002)});
}

}  // namespace

std::vector<TickCostRow> ledger_costs() {
  std::vector<TickCostRow> rows;
  add_rows<FixedNumbers>(rows);
  add_rows<FloatNumbers>(rows);
  add_rows<DoubleNumbers>(rows);
  return rows;
}

}  // namespace kerf::energy
