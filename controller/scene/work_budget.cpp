// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/work_budget.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <stdexcept>

namespace kerf {
namespace {

struct Price {
  std::string_view way, stage;
  double ns;
};

constexpr std::array kPrices{
    Price{"aligned/avx512", "copy", 0.08},
    Price{"aligned/avx512", "contact", 0.005},
    Price{"aligned/avx512", "mill", 0.01},
    Price{"aligned/avx2", "copy", 0.08},
    Price{"aligned/avx2", "contact", 0.011},
    Price{"aligned/avx2", "mill", 0.021},
    Price{"aligned/scalar", "copy", 1.0},
    Price{"aligned/scalar", "contact", 0.042},
    Price{"aligned/scalar", "mill", 0.22},
    Price{"gather/avx512", "contact", 0.25},
    Price{"gather/avx2", "contact", 0.35},
    Price{"gather/scalar", "contact", 3.5},
    Price{"splat/avx512", "place", 0.05},
    Price{"splat/avx512", "copy", 0.09},
    Price{"splat/avx512", "splat", 0.2},
    Price{"splat/avx512", "press", 0.8},
    Price{"splat/avx512", "cut", 0.2},
    Price{"splat/avx2", "place", 0.06},
    Price{"splat/avx2", "copy", 0.12},
    Price{"splat/avx2", "splat", 0.22},
    Price{"splat/avx2", "press", 1.2},
    Price{"splat/avx2", "cut", 0.25},
    Price{"splat/scalar", "place", 0.2},
    Price{"splat/scalar", "copy", 1.2},
    Price{"splat/scalar", "splat", 0.5},
    Price{"splat/scalar", "press", 8},
    Price{"splat/scalar", "cut", 2.5},
    Price{"aligned/neon", "copy", 0.2},
    Price{"aligned/neon", "contact", 0.03},
    Price{"aligned/neon", "mill", 0.06},
    Price{"gather/neon", "contact", 1},
    Price{"splat/neon", "place", 0.1},
    Price{"splat/neon", "copy", 0.2},
    Price{"splat/neon", "splat", 0.4},
    Price{"splat/neon", "press", 3},
    Price{"splat/neon", "cut", 0.6},
    Price{"gather/float", "contact", 1.4},
    Price{"gather/float", "overlap", 0.8},
    Price{"gather/float", "modification", 0.6},
    Price{"gather/float", "removal", 2.2},
    Price{"gather/float", "refresh", 8.0},
    Price{"gather/double", "contact", 1.9},
    Price{"gather/double", "overlap", 0.95},
    Price{"gather/double", "modification", 0.6},
    Price{"gather/double", "removal", 2.2},
    Price{"gather/double", "refresh", 8.0},
};

}  // namespace

double reference_price_ns(std::string_view way, std::string_view stage) {
  const auto* const price = std::find_if(kPrices.begin(), kPrices.end(), [&](const Price& p) {
    return p.way == way && p.stage == stage;
  });
  if (price != kPrices.end()) return price->ns;
  throw std::logic_error("no price for " + std::string(way) + " " + std::string(stage));
}

double work_us(const PlanCost& cost) {
  double ns = 0;
  for (const StageCost& stage : cost.stages) {
    ns += static_cast<double>(stage.operations) * reference_price_ns(cost.way, stage.stage);
  }
  return ns / 1000;
}

double work_budget_us(const Scene& scene) {
  return kBudgetShare * 1e6 / scene.servo.rate_hz;
}

std::string over_budget(const Scene& scene, const SceneCosts& costs) {
  const double budget_us = work_budget_us(scene);
  for (std::size_t t = 0; t < scene.tools.size(); ++t) {
    double sum_us = 0;
    std::uint64_t operations = 0;
    const TickCost* dearest = nullptr;
    for (const TickCost& tick : costs.ticks) {
      if (tick.tool != t) continue;
      sum_us += work_us(tick.cost);
      for (const StageCost& stage : tick.cost.stages) operations += stage.operations;
      if (dearest == nullptr || work_us(tick.cost) > work_us(dearest->cost)) dearest = &tick;
    }
    if (sum_us <= budget_us) continue;
    char text[320];
    std::snprintf(text, sizeof text,
                  ": tool %s: up to %llu operations a tick by plan %s (%s), %.0f us of work, above "
                  "the %.0f us for %d Hz; use a smaller tool, a lower rate%s",
                  scene.tools[t].name.c_str(), static_cast<unsigned long long>(operations),
                  dearest->cost.way.c_str(), dearest->choice.why.c_str(), sum_us, budget_us,
                  scene.servo.rate_hz,
                  dearest->choice.plan == Plan::aligned ? "" : ", or what plan aligned needs");
    return scene.path + text;
  }
  return {};
}

}  // namespace kerf
