// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/stage_cost.hpp"

#include <stdexcept>
#include <string>

namespace kerf {
namespace {

double price_ns(const Prices& prices, std::string_view runs_it) noexcept {
  if (runs_it == "avx512") return prices.avx512;
  if (runs_it == "avx2") return prices.avx2;
  if (runs_it == "neon") return prices.neon;
  if (runs_it == "scalar") return prices.scalar;
  if (runs_it == "float") return prices.float32;
  return runs_it == "double" ? prices.float64 : 0;
}

}  // namespace

double work_us(const StageCost& stage) noexcept {
  return static_cast<double>(stage.operations) * stage.price_ns / 1000;
}

double work_us(const std::vector<StageCost>& stages) noexcept {
  double us = 0;
  for (const StageCost& stage : stages) us += work_us(stage);
  return us;
}

StageCost priced(const char* stage, std::uint64_t operations, const Prices& prices,
                 std::string_view runs_it) {
  const double ns = price_ns(prices, runs_it);
  if (!(ns > 0)) {
    throw std::logic_error("no price for " + std::string(stage) + " by " + std::string(runs_it));
  }
  return {stage, operations, ns};
}

StageCost query_stage(std::uint64_t samples, std::string_view runs_it) {
  return priced("queries", samples, {2.4, 2.6, 9, 18, 19, 18}, runs_it);
}

void add_force_stages(std::uint64_t covered, std::string_view runs_it,
                      std::vector<StageCost>& stages) {
  stages.push_back(priced("list", covered, {32, 42, 130, 80, 8, 8}, runs_it));
  stages.push_back(priced("spend", covered, {9, 12, 65, 36, 4, 4}, runs_it));
}

}  // namespace kerf
