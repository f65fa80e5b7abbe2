// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace kerf {

/// One thing the hand does for a while. Lengths in script units (`HandScript::unit_mm`), in the
/// device frame; the origin is the surface point under the tool.
struct HandStep {
  enum class Kind : std::uint8_t {
    move,    ///< to `to`
    hold,    ///< stay
    circle,  ///< around here in the horizontal plane, out to `size[0]` and back
    zigzag   ///< around here: `turns` strokes of width `size[0]` (x) while z covers `size[1]`
  };
  enum class Ease : std::uint8_t {
    smooth,  ///< least jerk: starts and ends at rest
    linear   ///< constant speed
  };

  Kind kind = Kind::hold;
  double seconds = 1.0;
  Ease ease = Ease::smooth;
  std::array<double, 3> to{};
  std::array<double, 2> size{};
  double turns = 1.0;
  double sink = 0.0;                                     ///< circle, zigzag: ends this much lower
  std::optional<std::array<double, 3>> orientation_rad;  ///< reached at the end of the step
  int button = 0;                                        ///< 1 or 2: pressed during the step
};

/// A scripted hand.
struct HandScript {
  double unit_mm = 1.0;                  ///< device mm per script unit
  std::array<double, 3> start{0, 5, 0};  ///< first point above the surface
  std::vector<HandStep> steps;
  std::optional<std::size_t> repeat_from;  ///< after the last step go on here; none: stay
};

}  // namespace kerf
