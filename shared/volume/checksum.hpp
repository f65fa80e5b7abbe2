// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/numeric/fnv1a.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// 64-bit hash of rows of densities: four multiplicative lanes, so that the multiplier's latency is
/// hidden. For comparing contents; it does not resist deliberate collisions. Same value on every
/// machine, whatever its byte order.
class DensityHasher {
 public:
  void add_row(std::span<const Density> row) noexcept;
  [[nodiscard]] std::uint64_t value() const noexcept;

 private:
  std::uint64_t voxels_ = 0;
  std::array<std::uint64_t, 4> lane_{0x9e3779b97f4a7c15, 0xbf58476d1ce4e5b9, 0x94d049bb133111eb,
                                     0xd6e8feb86659fd93};
};

/// Hash of a whole volume.
[[nodiscard]] std::uint64_t density_hash(std::span<const Density> density) noexcept;

/// fnv1a of all densities, low byte first, and all labels: the content of a volume, as the JSON of
/// a scene and the files beside a log name it.
[[nodiscard]] inline std::uint64_t volume_hash(std::span<const Density> density,
                                               std::span<const Label> labels) noexcept {
  std::uint64_t hash = kFnv1aBasis;
  for (const Density one : density) hash = fnv1a_bytes(hash, one, sizeof one);
  for (const Label label : labels) hash = fnv1a_step(hash, label);
  return hash;
}

/// Hash of the densities in `box` of the volume `linear`, row by row; `box` lies in `grid`.
[[nodiscard]] std::uint64_t box_hash(std::span<const Density> linear, const VoxelGrid& grid,
                                     const VoxelBox& box) noexcept;

/// CRC-32C (Castagnoli, reflected, start and end inverted), eight bytes per step. No allocation.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept;

}  // namespace kerf
