// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// Owner of a volume's FreeSpaceMap. Load time; moving it keeps the map valid.
class FreeBrickMap {
 public:
  /// A voxel counts when its density reaches `faintest`, below which there is no contact. While
  /// the map is made it takes half a byte more for each voxel.
  FreeBrickMap(const VoxelGrid& grid, std::span<const Density> density, Density faintest);

  [[nodiscard]] FreeSpaceMap bricks() const noexcept { return {grid_, distance_.data()}; }
  [[nodiscard]] std::size_t bytes() const noexcept { return distance_.size(); }

  /// Makes every distance at least that of `other`, a map of the same grid, less `steps`.
  void raise_to(const FreeBrickMap& other, std::int32_t steps);

 private:
  VoxelGrid grid_;
  std::vector<std::uint8_t> distance_;
};

/// A volume as contact reads it, with its free-space map (docs/theory.md 2.3): the distance within
/// which no sample reads density that counts, or is near enough to an iso voxel for a force. Load
/// time; the density, which the caller keeps, may lose but not gain. Moving it keeps the field
/// valid.
class MappedField {
 public:
  MappedField(const VoxelGrid& grid, std::span<const Density> density, Density iso);

  [[nodiscard]] DensityField field() const& noexcept {
    return {grid_, density_, density_scale(iso_), free_.bricks()};
  }

 private:
  VoxelGrid grid_;
  const Density* density_;
  Density iso_;
  FreeBrickMap free_;
};

}  // namespace kerf
