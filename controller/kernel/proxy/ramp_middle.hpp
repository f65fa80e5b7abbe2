// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/contact_math.hpp"
#include "shared/numeric/fixed.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// A contact reads the density between air and the iso-surface alone: of a face that rises over two
/// units a layer of 2 iso units. At an iso of 0.05 that is a tenth of a unit, where some five
/// samples touch and a cell's gradient is that of the ramp's bend. Near 1 they read the bend at
/// the ramp's other end. The surfaces of equal density of one face have the same normals, so
/// normal and place are read where it is half dense (docs/theory.md 3.8).
///
/// Between these shares of full density the iso-surface is near enough to the middle: there the
/// normal is as good, and nothing more is read. In teeth density goes on changing below the face,
/// which makes the middle rough: with the look from 0.42 on the force steps by 3.5 instead of 0.9 %
/// on the GE tooth of 8 bits, iso 0.34 (rows `cutting`).
inline constexpr double kMidwayFrom = 0.32, kMidwayTo = 0.6;
/// The middle is sought so far to each side, units. It is at most one unit below the iso-surface,
/// and reads raise a surface of low iso by up to 0.6 more.
inline constexpr double kMidwayFarthest = 1.6;
inline constexpr int kMidwayLooks = 2;          ///< the second along the normal of the first,
inline constexpr double kMidwayAlike = 0.9998;  ///< if it is turned by more than a degree; cosine

[[nodiscard]] constexpr bool is_midway(const DensityScale& scale) noexcept {
  const double full_over_two_iso = scale_factor<double>(scale);
  return 2 * kMidwayFrom * full_over_two_iso < 1 && 2 * kMidwayTo * full_over_two_iso > 1;
}

/// The middle of a face's ramp.
template <class N>
struct RampMiddle {
  typename N::Real below{};  ///< how far below the contact it is, units
  Density level = 0;         ///< the density there; 0: there is no face
};

/// Seeks it from a contact on: where density is half of the highest one or 2.5 units below, where a
/// wall of two units has its middle, or a thick one its full density though reads raised its
/// surface. On a ramp of two units density rises by `half` per unit, so the first step finds it,
/// but for the bend; shorter ones then bear steeper ramps too. `density(below)` is 0 to 1.
template <class N, class DensityBelow>
[[nodiscard]] constexpr RampMiddle<N> ramp_middle(const DensityBelow& density) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  const Real half = multiply<Real>(std::max(density(Real(1)), density(Real(2.5))), Unit(0.5));
  if (half < Real(0.002)) return {};  // too few steps of density
  Real below{}, level = density(below);
  for (const double share : {1.0, 0.75, 0.75}) {
    const Real missing = (half - level) / half;
    below = std::clamp(below + multiply<Real>(missing, Unit(share)), Real(-kMidwayFarthest),
                       Real(kMidwayFarthest));
    level = density(below);
  }
  level = std::max(level, multiply<Real>(half, Unit(0.5)));
  if constexpr (N::kIsFixed) {
    return {below, static_cast<Density>(level.raw())};
  } else {
    return {below, static_cast<Density>(level * Real(kDensityMax))};
  }
}

}  // namespace kerf
