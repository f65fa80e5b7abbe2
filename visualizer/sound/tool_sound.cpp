// SPDX-License-Identifier: Apache-2.0
#include "visualizer/sound/tool_sound.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

double length(const float (&v)[3]) {
  const double all = std::hypot(double{v[0]}, double{v[1]}, double{v[2]});
  return std::isfinite(all) ? all : 0.0;
}

}  // namespace

ToolSound tool_sound(const TickRecord& record) {
  constexpr double kReferenceTurnsPerS = 5000;  // of spindle_ratio 1: 300,000 in a minute
  // Chosen: from here on it hisses no louder.
  constexpr double kFullForceN = 3.3, kFullTurnsPerS = 100, kFullSpeedMmPerS = 50;
  const double ratio = std::isfinite(record.spindle_ratio) ? double{record.spindle_ratio} : 0.0;
  const double turns_per_s = ratio * kReferenceTurnsPerS;
  const double rubs =
      std::max(turns_per_s / kFullTurnsPerS, length(record.velocity_mm_per_s) / kFullSpeedMmPerS);
  const double pressed = length(record.contact_force_n) / kFullForceN;
  return {.turns_per_s = static_cast<float>(turns_per_s),
          .load = std::isfinite(record.spindle_load) ? record.spindle_load : 0.0F,
          .contact = static_cast<float>(std::min(pressed, 1.0) * std::min(rubs, 1.0))};
}

}  // namespace kerf
