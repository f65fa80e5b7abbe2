// SPDX-License-Identifier: Apache-2.0

#include "visualizer/sound/spindle_sound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kerf {

namespace {

constexpr double kDt = 1.0 / SpindleVoice::kSamplesPerS;
constexpr double kMostTurnsPerS = 1e4;  // twice what a scene may ask of a spindle

/// 1 for a tone that is heard in full, 0 for one that is too high.
double audible(double hz) {
  return std::clamp((SpindleVoice::kSilentFromHz - hz) /
                        (SpindleVoice::kSilentFromHz - SpindleVoice::kFadesFromHz),
                    0.0, 1.0);
}

/// A slow spindle hums as much less as its unbalance pulls less, up to a certain speed.
double hum_of(double turns_per_s) {
  constexpr double kFullTurnsPerS = 1000;  // chosen: of a fast handpiece with a motor
  return std::min(turns_per_s / kFullTurnsPerS, 1.0);
}

double tone(double turns) {
  return std::sin(2.0 * std::numbers::pi * turns);
}

/// Of -1 to 1; xorshift (Marsaglia 2003).
double next_random(std::uint32_t& dice) {
  dice ^= dice << 13;
  dice ^= dice >> 17;
  dice ^= dice << 5;
  return dice / 2147483648.0 - 1.0;
}

}  // namespace

void SpindleVoice::render(const ToolSound& now, std::span<float> samples) noexcept {
  const double turns_per_s = std::clamp(static_cast<double>(now.turns_per_s), 0.0, kMostTurnsPerS);
  const double load = std::clamp(static_cast<double>(now.load), 0.0, 1.0);
  const double contact = std::clamp(static_cast<double>(now.contact), 0.0, 1.0);
  constexpr double kStep = kDt / kGlideS;
  constexpr double kHissHz = 3000;  // chosen: above it the noise falls off
  constexpr double kHissStep = 2.0 * std::numbers::pi * kHissHz * kDt;
  for (float& sample : samples) {
    turns_per_s_ += (turns_per_s - turns_per_s_) * kStep;
    load_ += (load - load_) * kStep;
    contact_ += (contact - contact_) * kStep;
    turn_ += turns_per_s_ * kDt;
    turn_ -= std::floor(turn_);
    hiss_ += (next_random(dice_) - hiss_) * kHissStep;
    const double turning = hum_of(turns_per_s_);
    const double hum = (kHum + kHumOfLoad * load_) * turning * audible(turns_per_s_);
    const double blades = kBladesOfLoad * load_ * turning * audible(kBlades * turns_per_s_);
    sample = static_cast<float>(hum * tone(turn_) + blades * tone(kBlades * turn_) +
                                kHiss * contact_ * hiss_);
  }
}

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
