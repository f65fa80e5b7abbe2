// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/press.hpp"

#include <algorithm>
#include <cmath>

#include "controller/scene/scene.hpp"

namespace kerf::zwidth {
namespace {

constexpr std::array<double Press::*, 3> kValues{&Press::push_n, &Press::hit_mm_per_s,
                                                 &Press::start_mm};

}  // namespace

std::array<PressChoice::Range, 3> PressChoice::ranges() {
  return {{{0.05, 0.9 * LimitSettings().force_n}, {0, 500}, {0, 2}}};
}

std::vector<Press> standard_presses(const PressChoice& choice) {
  Press press;
  for (std::size_t i = 0; i < kValues.size(); ++i) {
    if (choice.given[i]) press.*kValues[i] = *choice.given[i];
  }
  if (choice.given[1]) return {press};
  std::vector<Press> presses;
  for (const double hit_mm_per_s : kHitsMmPerS) {
    press.hit_mm_per_s = hit_mm_per_s;
    presses.push_back(press);
  }
  return presses;
}

Press press_of(const PressChoice& choice, std::uint64_t n) {
  constexpr double kG = 1.2207440846057595;
  constexpr std::array<double, 3> kSteps{1 / kG, 1 / (kG * kG), 1 / (kG * kG * kG)};
  const auto ranges = PressChoice::ranges();
  Press press;
  for (std::size_t i = 0; i < kValues.size(); ++i) {
    const double turns = 0.5 + static_cast<double>(n) * kSteps[i], part = turns - std::floor(turns);
    const double any = ranges[i].lowest + (ranges[i].highest - ranges[i].lowest) * part;
    press.*kValues[i] = choice.given[i].value_or(any);
  }
  return press;
}

std::vector<Press> presses_beside(const PressChoice& choice, const Press& press, double share) {
  const auto ranges = PressChoice::ranges();
  std::vector<Press> beside;
  for (std::size_t i = 0; i < kValues.size(); ++i) {
    if (choice.given[i]) continue;
    for (const double way : {-share, share}) {
      const auto [lowest, highest] = ranges[i];
      Press other = press;
      other.*kValues[i] = std::clamp(press.*kValues[i] + way * (highest - lowest), lowest, highest);
      if (other != press) beside.push_back(other);
    }
  }
  return beside;
}

}  // namespace kerf::zwidth
