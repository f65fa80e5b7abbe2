// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/contact/rows.hpp"

namespace kerf::extremes {

/// Both forces on a hand that presses straight into a wall, N.
struct Press {
  double depth_mm, paper_n, proxy_n;
};
/// At an update rate: the speed of a straight stroke from which on a hand can get through the face
/// without one tick of force. Up to 10 m/s: there the supervisor stops every hand.
struct Loss {
  double rate_hz;
  std::optional<double> paper_mm_per_s, proxy_mm_per_s;
};
struct Wall {
  std::string name;
  double thickness;  ///< voxels
  std::vector<Press> presses{};
  double paper_most_n = 0;     ///< of a slow press
  double paper_unfelt_mm = 0;  ///< of its way behind the face
  std::vector<Loss> losses{};
};

/// Both forces along one slide over a bump, over their means.
struct SlideTick {
  double travel_mm, paper, proxy;
};
struct Slide {
  std::vector<SlideTick> ticks;
  double paper_step = 0, proxy_step = 0;        ///< largest from tick to tick, over the mean
  double paper_degrees = 0, proxy_degrees = 0;  ///< largest to the normal
};

/// The paper's force and the swept proxy on the same motions, with the gains that scenes have by
/// default: a ball of 16 voxels of 0.1 mm.
struct Comparison {
  std::vector<Wall> walls{{"a wall of 5 mm", 50}, {"a wall of 2 voxels", 2}};
  Slide slide;
};

[[nodiscard]] Comparison compare(const Effort& effort, const RowSink& add_row);

}  // namespace kerf::extremes
