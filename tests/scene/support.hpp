// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::test {

/// NRRD text and data of u16 values, x fastest, little-endian.
inline std::string nrrd(VoxelGrid grid, std::array<double, 3> spacing_mm,
                        const std::vector<Density>& values) {
  std::string text =
      "NRRD0004\ntype: uint16\ndimension: 3\nencoding: raw\nendian: little\nsizes: " +
      std::to_string(grid.nx) + " " + std::to_string(grid.ny) + " " + std::to_string(grid.nz) +
      "\nspacings: " + std::to_string(spacing_mm[0]) + " " + std::to_string(spacing_mm[1]) + " " +
      std::to_string(spacing_mm[2]) + "\n\n";
  for (const Density value : values) {
    text += static_cast<char>(value & 0xff);
    text += static_cast<char>(value >> 8);
  }
  return text;
}

/// A box of `inside` in a grid of air.
inline std::vector<Density> block(VoxelGrid grid, VoxelBox box, Density inside) {
  std::vector<Density> values(grid.voxel_count(), 0);
  for_each_voxel(box, [&](auto x, auto y, auto z) { values[grid.index(x, y, z)] = inside; });
  return values;
}

}  // namespace kerf::test
