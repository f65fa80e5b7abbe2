// SPDX-License-Identifier: Apache-2.0
#include "controller/load/felt_density.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace kerf {
namespace {

/// Every unlabelled voxel beside a labelled one, along the axes, takes its label.
void grow_labels(const VoxelGrid& grid, std::vector<Label>& labels) {
  const std::vector<Label> before = labels;
  const std::array<std::int32_t, 3> extent{grid.nx, grid.ny, grid.nz};
  const std::array<std::ptrdiff_t, 3> stride{1, grid.nx, std::ptrdiff_t{grid.nx} * grid.ny};
  std::ptrdiff_t at = 0;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x, ++at) {
        Label& label = labels[static_cast<std::size_t>(at)];
        const std::array<std::int32_t, 3> place{x, y, z};
        for (std::size_t axis = 0; axis < 3 && label == 0; ++axis) {
          const auto beside = [&](std::ptrdiff_t step) {
            return before[static_cast<std::size_t>(at + step)];
          };
          if (place[axis] > 0) label = beside(-stride[axis]);
          if (label == 0 && place[axis] + 1 < extent[axis]) label = beside(stride[axis]);
        }
      }
    }
  }
}

}  // namespace

void scale_to_felt_iso(const std::vector<Material>& materials, Density iso, VolumeImage& image) {
  const auto own = [](const Material& material) { return material.felt_iso.has_value(); };
  if (image.labels.empty() || std::none_of(materials.begin(), materials.end(), own)) return;
  std::vector<double> scale;
  for (const Material& material : materials) {
    scale.push_back(material.felt_iso ? iso / (*material.felt_iso * kDensityMax) : 1.0);
  }
  std::vector<Label> labels = image.labels;
  for (int i = 0; i < kMaterialEdgeVoxels; ++i) grow_labels(image.grid, labels);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double density = image.density[i] * scale[labels[i]];
    image.density[i] = static_cast<Density>(std::lround(std::min(density, kDensityMax)));
  }
}

}  // namespace kerf
