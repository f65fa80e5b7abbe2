// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace kerf::zwidth {

/// How the hand of one axis meets the wall: it starts so far before it with this speed, and goes on
/// pushing with Coulomb friction and `push_n`.
struct Press {
  double push_n = 0.5;
  double hit_mm_per_s = 0;
  double start_mm = 0.1;

  auto operator<=>(const Press&) const = default;
};

/// What of a press is given. The rest may be anything within these ranges: hardly a touch to 0.9 of
/// the peak of a scene, at which alone a hand goes through the wall; no start, a knock, a flick.
struct PressChoice {
  struct Range {
    double lowest, highest;
  };
  [[nodiscard]] static std::array<Range, 3> ranges();  ///< push N, hit mm/s, start mm

  std::array<std::optional<double>, 3> given{};  ///< in the order of the ranges

  /// Nothing is left to choose.
  [[nodiscard]] bool is_one() const noexcept { return given[0] && given[1] && given[2]; }
};

/// The speeds at which each stiffness is met, if none is given, mm/s.
inline constexpr std::array<double, 3> kHitsMmPerS{0, 50, 200};

/// The presses that each stiffness gets: what is given, else 0.5 N from 0.1 mm at `kHitsMmPerS`.
[[nodiscard]] std::vector<Press> standard_presses(const PressChoice& choice);

/// The n-th of a sequence that fills the ranges of what is not given evenly, whatever part of it is
/// taken (Roberts 2018, R3: parts of the powers of 1/g, g^4 = g + 1).
[[nodiscard]] Press press_of(const PressChoice& choice, std::uint64_t n);

/// Presses beside `press`: each value that is not given, less and more by `share` of its range, cut
/// off at its ends.
[[nodiscard]] std::vector<Press> presses_beside(const PressChoice& choice, const Press& press,
                                                double share);

}  // namespace kerf::zwidth
