// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/cost/work_budget.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <stdexcept>

#include "controller/scene/scene_file.hpp"

namespace kerf {
namespace {

struct Price {
  std::string_view variant, stage;
  double ns;
};

constexpr std::array kPrices{
    Price{"aligned/avx512", "copy", 0.08},
    Price{"aligned/avx512", "contact", 0.005},
    Price{"aligned/avx512", "mill", 0.011},
    Price{"aligned/avx512", "cover", 0.011},
    Price{"aligned/avx512", "bend", 0.8},
    Price{"aligned/avx2", "copy", 0.08},
    Price{"aligned/avx2", "contact", 0.012},
    Price{"aligned/avx2", "mill", 0.021},
    Price{"aligned/avx2", "cover", 0.025},
    Price{"aligned/avx2", "bend", 0.8},
    Price{"aligned/scalar", "copy", 1.1},
    Price{"aligned/scalar", "contact", 0.06},
    Price{"aligned/scalar", "mill", 0.27},
    Price{"aligned/scalar", "cover", 0.35},
    Price{"aligned/scalar", "bend", 0.8},
    Price{"gather/avx512", "contact", 0.2},
    Price{"gather/avx2", "contact", 0.3},
    Price{"gather/scalar", "contact", 3},
    Price{"splat/avx512", "place", 0.06},
    Price{"splat/avx512", "copy", 0.08},
    Price{"splat/avx512", "splat", 0.3},
    Price{"splat/avx512", "press", 0.16},
    Price{"splat/avx512", "cover", 0.11},
    Price{"splat/avx512", "bend", 1.1},
    Price{"splat/avx512", "cut", 0.11},
    Price{"splat/avx2", "place", 0.08},
    Price{"splat/avx2", "copy", 0.08},
    Price{"splat/avx2", "splat", 0.3},
    Price{"splat/avx2", "press", 0.2},
    Price{"splat/avx2", "cover", 0.13},
    Price{"splat/avx2", "bend", 1.1},
    Price{"splat/avx2", "cut", 0.25},
    Price{"splat/scalar", "place", 0.5},
    Price{"splat/scalar", "copy", 1.1},
    Price{"splat/scalar", "splat", 0.75},
    Price{"splat/scalar", "press", 1.5},
    Price{"splat/scalar", "cover", 0.57},
    Price{"splat/scalar", "bend", 1.1},
    Price{"splat/scalar", "cut", 1.5},
    Price{"gather/float", "contact", 1.4},
    Price{"gather/float", "overlap", 0.9},
    Price{"gather/float", "modification", 0.5},
    Price{"gather/float", "removal", 3},
    Price{"gather/float", "bent removal", 4.3},
    Price{"gather/float", "refresh", 9},
    Price{"gather/double", "contact", 2},
    Price{"gather/double", "overlap", 1.1},
    Price{"gather/double", "modification", 0.5},
    Price{"gather/double", "removal", 3},
    Price{"gather/double", "bent removal", 4.3},
    Price{"gather/double", "refresh", 9},
    // Probes cost the same beside every plan, and so does cutting by force: groups of voxels where
    // kernels do it, voxels in float and double.
    Price{"avx512", "probes", 2.4},
    Price{"avx2", "probes", 2.6},
    Price{"scalar", "probes", 18},
    Price{"neon", "probes", 9},
    Price{"float", "probes", 19},
    Price{"double", "probes", 18},
    Price{"avx512", "list", 32},
    Price{"avx2", "list", 42},
    Price{"scalar", "list", 80},
    Price{"neon", "list", 130},
    Price{"float", "list", 8},
    Price{"double", "list", 8},
    Price{"avx512", "spend", 9},
    Price{"avx2", "spend", 12},
    Price{"scalar", "spend", 36},
    Price{"neon", "spend", 65},
    Price{"float", "spend", 4},
    Price{"double", "spend", 4},
    // NEON was never measured on hardware: guesses, for slower cores.
    Price{"aligned/neon", "copy", 0.2},
    Price{"aligned/neon", "contact", 0.03},
    Price{"aligned/neon", "mill", 0.06},
    Price{"aligned/neon", "cover", 0.06},
    Price{"aligned/neon", "bend", 1.6},
    Price{"gather/neon", "contact", 1},
    Price{"splat/neon", "place", 0.5},
    Price{"splat/neon", "copy", 0.2},
    Price{"splat/neon", "splat", 0.6},
    Price{"splat/neon", "press", 0.6},
    Price{"splat/neon", "cover", 0.3},
    Price{"splat/neon", "bend", 2.2},
    Price{"splat/neon", "cut", 0.4},
};

struct StageWork {
  const char* stage = "";
  double us = 0;
};

std::string us_text(double us) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", us);
  return text;
}

}  // namespace

double reference_price_ns(std::string_view variant, std::string_view stage) {
  const auto* const price = std::find_if(kPrices.begin(), kPrices.end(), [&](const Price& p) {
    return p.stage == stage &&
           (p.variant == variant || p.variant == variant.substr(variant.find('/') + 1));
  });
  if (price != kPrices.end()) return price->ns;
  throw std::logic_error("no price for " + std::string(variant) + " " + std::string(stage));
}

double work_us(const PlanCost& cost, const StageCost& stage) {
  return static_cast<double>(stage.operations) * reference_price_ns(cost.variant, stage.stage) /
         1000;
}

double work_us(const PlanCost& cost) {
  double us = 0;
  for (const StageCost& stage : cost.stages) us += work_us(cost, stage);
  return us;
}

double work_us(const SceneCosts& costs, std::size_t tool) {
  double us = 0;
  for (const TickCost& tick : costs.ticks) us += tick.tool == tool ? work_us(tick.cost) : 0;
  return us;
}

double work_budget_us(const LoadedScene& scene) {
  return kBudgetShare * 1e6 / scene.servo.rate_hz;
}

int highest_rate_hz(double work_us) {
  const double rate_hz = std::min(kBudgetShare * 1e6 / work_us, double{kMaxRateHz});
  return rate_hz < kMinRateHz ? 0 : static_cast<int>(rate_hz);
}

std::size_t costliest_tool(const SceneCosts& costs) {
  const auto cheaper = [&](const TickCost& a, const TickCost& b) {
    return work_us(costs, a.tool) < work_us(costs, b.tool);
  };
  return std::max_element(costs.ticks.begin(), costs.ticks.end(), cheaper)->tool;
}

std::string over_budget(const LoadedScene& scene, const SceneCosts& costs) {
  const double budget_us = work_budget_us(scene);
  const std::size_t tool = costliest_tool(costs);
  const double sum_us = work_us(costs, tool);
  if (sum_us <= budget_us) return {};
  std::string parts, others;
  bool may_align = false;
  StageWork most;
  for (const TickCost& tick : costs.ticks) {
    if (tick.tool != tool) continue;
    parts += ", in " + scene.volumes[tick.volume].name + " " + us_text(work_us(tick.cost)) +
             " by plan " + tick.cost.variant + " (" + tick.choice.why + ")";
    may_align = may_align || tick.choice.plan == Plan::splat || tick.choice.plan == Plan::gather;
    for (const StageCost& stage : tick.cost.stages) {
      const double us = work_us(tick.cost, stage);
      if (us > most.us) most = {stage.stage, us};
    }
  }
  for (std::size_t t = 0; t < scene.tools.size(); ++t) {
    if (t == tool || work_us(costs, t) <= budget_us) continue;
    others += (others.empty() ? " (too dear as well: " : ", ") + scene.tools[t].name;
  }
  const int rate_hz = highest_rate_hz(sum_us);
  const bool fixed = scene.servo.numeric == NumericKind::fixed;
  const bool helps = fixed && may_align && std::string_view(most.stage) != "probes";
  const std::string third = helps   ? ", or a round or unturned tool on the volume's lattice"
                            : fixed ? ""
                                    : ", or fixed numbers";
  return scene.path + ": tool " + scene.tools[tool].name + ": up to " + us_text(sum_us) +
         " us of work a tick, most of it " + most.stage + " (" + us_text(most.us) + ")" + parts +
         ", above the " + us_text(budget_us) + " us that are half a tick at " +
         std::to_string(scene.servo.rate_hz) + " Hz; use " +
         (rate_hz == 0 ? "" : "--rate " + std::to_string(rate_hz) + " or lower, ") +
         (rate_hz != 0 && third.empty() ? "or " : "") + "a smaller tool" + others +
         (others.empty() ? "" : ")") + third;
}

}  // namespace kerf
