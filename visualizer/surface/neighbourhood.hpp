// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstring>

#include <glm/glm.hpp>

#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

/// The densities of a block and one voxel around it, in one place and with air outside the volume,
/// so that what reads them needs no test for the border.
class Neighbourhood {
 public:
  static constexpr int kSamples = kBlockEdge + 1;  ///< a side of a block: both ends of its cells
  static constexpr std::array<int, 3> kStride{1, 16, 16 * (kSamples + 2)};  ///< by axis

  Neighbourhood(const VolumeSamples& volume, VoxelIndex start) {
    constexpr int kEdge = kSamples + 2;
    const VoxelIndex lo{start.x - 1, start.y - 1, start.z - 1};
    const VoxelBox in =
        VoxelBox{lo, {lo.x + kEdge, lo.y + kEdge, lo.z + kEdge}}.clipped(volume.grid.box());
    const auto bytes = static_cast<std::size_t>(in.hi.x - in.lo.x) * sizeof(Density);
    for (std::int32_t z = in.lo.z; z < in.hi.z; ++z) {
      for (std::int32_t y = in.lo.y; y < in.hi.y; ++y) {
        std::memcpy(&density_[index(in.lo.x - start.x, y - start.y, z - start.z)],
                    &volume.density[volume.grid.index(in.lo.x, y, z)], bytes);
      }
    }
  }

  /// Sample (0, 0, 0) is the block's start; each part -1..9.
  [[nodiscard]] const Density* at(int x, int y, int z) const { return &density_[index(x, y, z)]; }

  /// `Gradient::corners` of a sample 0..8, up to a factor.
  [[nodiscard]] static glm::vec3 corner_gradient(const Density* at) {
    // Sum and difference along x of the four rows, then along y and z.
    std::array<int, 4> sum{};
    std::array<int, 4> rise{};
    for (int row = 0; row < 4; ++row) {
      const Density* middle = at + ((row & 1) * 2 - 1) * kStride[1] + ((row & 2) - 1) * kStride[2];
      sum[static_cast<std::size_t>(row)] = middle[1] + middle[-1];
      rise[static_cast<std::size_t>(row)] = middle[1] - middle[-1];
    }
    return glm::vec3(rise[0] + rise[1] + rise[2] + rise[3], sum[1] - sum[0] + sum[3] - sum[2],
                     sum[2] + sum[3] - sum[0] - sum[1]);
  }
  /// `Gradient::central` of a sample 0..8, up to a factor.
  [[nodiscard]] static glm::vec3 central_gradient(const Density* at) {
    return glm::vec3(at[kStride[0]] - at[-kStride[0]], at[kStride[1]] - at[-kStride[1]],
                     at[kStride[2]] - at[-kStride[2]]);
  }

 private:
  static constexpr std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>((z + 1) * kStride[2] + (y + 1) * kStride[1] + x + 1);
  }

  std::array<Density, static_cast<std::size_t>(kStride[2]) * (kSamples + 2)> density_{};
};

}  // namespace kerf
