// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/work_budget.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>

namespace kerf {
namespace {

std::string us_text(double us) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", us);
  return text;
}

}  // namespace

double work_us(const SceneCosts& costs, std::size_t tool) {
  double us = 0;
  for (const TickCost& tick : costs.ticks) us += tick.tool == tool ? work_us(tick.stages) : 0;
  return us;
}

double work_budget_us(const LoadedScene& scene) {
  return kBudgetRatio * 1e6 / scene.servo.rate_hz;
}

int highest_rate_hz(double work_us) {
  const double rate_hz = std::min(kBudgetRatio * 1e6 / work_us, double{kMaxRateHz});
  return rate_hz < kMinRateHz ? 0 : static_cast<int>(rate_hz);
}

std::size_t costliest_tool(const SceneCosts& costs) {
  const auto cheaper = [&](const TickCost& a, const TickCost& b) {
    return work_us(costs, a.tool) < work_us(costs, b.tool);
  };
  return std::max_element(costs.ticks.begin(), costs.ticks.end(), cheaper)->tool;
}

std::string budget_error(const LoadedScene& scene, const SceneCosts& costs) {
  const double budget_us = work_budget_us(scene);
  const std::size_t tool = costliest_tool(costs);
  const double sum_us = work_us(costs, tool);
  if (sum_us <= budget_us) return {};
  std::string parts, others, advice;
  const StageCost* most = nullptr;
  for (const TickCost& tick : costs.ticks) {
    if (tick.tool != tool) continue;
    parts += ", in " + scene.volumes[tick.volume].name + " " + us_text(work_us(tick.stages)) +
             " by the method " + tick.variant() + " (" + tick.choice.why + ")";
    if (advice.empty()) advice = tick.choice.method->advice;
    for (const StageCost& stage : tick.stages) {
      if (most == nullptr || work_us(stage) > work_us(*most)) most = &stage;
    }
  }
  for (std::size_t t = 0; t < scene.tools.size(); ++t) {
    if (t == tool || work_us(costs, t) <= budget_us) continue;
    others += (others.empty() ? " (too dear as well: " : ", ") + scene.tools[t].name;
  }
  const int rate_hz = highest_rate_hz(sum_us);
  const bool fixed = scene.servo.numeric == NumericKind::fixed;
  if (!fixed) advice = "fixed numbers";
  if (fixed && std::string_view(most->stage) == "queries") advice.clear();
  const std::string third = advice.empty() ? "" : ", or " + advice;
  return scene.path + ": tool " + scene.tools[tool].name + ": up to " + us_text(sum_us) +
         " us of work a tick, most of it " + most->stage + " (" + us_text(work_us(*most)) + ")" +
         parts + ", above the " + us_text(budget_us) + " us that are half a tick at " +
         std::to_string(scene.servo.rate_hz) + " Hz; use " +
         (rate_hz == 0 ? "" : "--rate " + std::to_string(rate_hz) + " or lower, ") +
         (rate_hz != 0 && third.empty() ? "or " : "") + "a smaller tool" + others +
         (others.empty() ? "" : ")") + third;
}

}  // namespace kerf
