// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string_view>

#include "controller/scene/scene.hpp"
#include "controller/servo/servo.hpp"

namespace kerf::faults {

/// Where a steady program has its floor: the hands of scenes/hands touch there with the scenes'
/// balls of radius 1.
inline constexpr double kFloorMm = 1;

/// What a program that gives the force of an external scene does (docs/own-law.md).
enum class ProgramWay : std::uint8_t {
  steady,      ///< renders a floor by a goal, at 200 Hz
  stops,       ///< gives nothing for 300 ms, and goes on
  dies,        ///< gives nothing any more
  no_numbers,  ///< gives for 300 ms what is not finite, and goes on
  floods       ///< gives 20 forces a tick for 300 ms, up to the largest there are and beyond
};
inline constexpr std::array<std::string_view, 5> kProgramWords{
    "program", "program stops", "program dies", "program gives NaN", "program floods"};

/// That program. From `go_wrong` on it does what its way says; before, all are steady. The same
/// seed gives the same forces.
class EmulatedProgram {
 public:
  EmulatedProgram(const ForceSettings& scene, ProgramWay way, std::uint32_t seed)
      : scene_(scene), way_(way), random_(seed) {}

  void go_wrong(double time_ms) noexcept { wrong_since_ms_ = time_ms; }
  /// Its turn before a tick; `last` is the tick before. Returns whether the servo took a force.
  bool turn(double time_ms, const ServoOutput& last, AnyServo& servo);

 private:
  [[nodiscard]] double any(double most);
  bool push(const ServoOutput& last, AnyServo& servo);
  bool flood(AnyServo& servo);

  ForceSettings scene_;
  ProgramWay way_;
  std::mt19937 random_;
  double wrong_since_ms_ = -1;  ///< negative: not yet
  double next_turn_ms_ = 0;
  bool was_above_ = false;  ///< the floor; the tip begins in its dock, below
};

}  // namespace kerf::faults
