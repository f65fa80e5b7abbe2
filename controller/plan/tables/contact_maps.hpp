// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/plan/tables/free_brick_map.hpp"

namespace kerf {

/// A volume as contact reads it, with the maps that tell where a tool goes without a look
/// (docs/theory.md 2.3): where nothing is felt, and where nothing bears. Load time; moving it keeps
/// the maps valid. The caller keeps the densities.
class ContactMaps {
 public:
  ContactMaps(const VoxelGrid& grid, std::span<const Density> density, Density iso)
      : grid_(grid),
        density_(density.data()),
        scale_(density_scale(iso)),
        felt_(grid, density, static_cast<Density>(iso / kFeltShare)),
        bearing_(grid, density, least_at_iso(scale_)) {}

  [[nodiscard]] DensityField field() const noexcept {
    return {grid_, density_, scale_, felt_.bricks(), bearing_.bricks()};
  }
  [[nodiscard]] std::size_t bytes() const noexcept { return felt_.bytes() + bearing_.bytes(); }

 private:
  /// A density below this part of the iso is not felt: r < 1/16, and r is 1/2 at the iso.
  static constexpr Density kFeltShare = 8;

  VoxelGrid grid_;
  const Density* density_;
  DensityScale scale_;
  FreeBrickMap felt_, bearing_;
};

}  // namespace kerf
