// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/body_mask.hpp"

#include <algorithm>
#include <cstddef>

#include "controller/volume/solid_parts.hpp"

namespace kerf {
namespace {

/// Cells along the longest axis: one layer is then a hundredth of a scan, so a couch of 2 cm goes
/// in one of 1 m, and a head rest of 8 mm in one of 25 cm.
constexpr std::int32_t kCells = 96;
constexpr Density kInside = 1;

/// Each cell takes the least or the most of its 27 neighbours; outside is like the cell at the
/// border.
template <class Pick>
void spread(const VoxelGrid& grid, std::vector<Density>& cells, const Pick& pick) {
  const auto along = [&](std::size_t stride, std::int32_t count) {
    std::vector<Density> line(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i / stride % static_cast<std::size_t>(count) != 0) continue;
      for (std::size_t k = 0; k < line.size(); ++k) line[k] = cells[i + k * stride];
      for (std::size_t k = 0; k < line.size(); ++k) {
        cells[i + k * stride] =
            pick({line[k == 0 ? 0 : k - 1], line[k], line[std::min(k + 1, line.size() - 1)]});
      }
    }
  };
  const auto nx = static_cast<std::size_t>(grid.nx);
  along(1, grid.nx);
  along(nx, grid.ny);
  along(nx * static_cast<std::size_t>(grid.ny), grid.nz);
}

}  // namespace

BodyMask::BodyMask(const VolumeImage& image, Density skin) {
  const VoxelGrid& from = image.grid;
  edge_ = (std::max({from.nx, from.ny, from.nz}) + kCells - 1) / kCells;
  const auto count = [&](std::int32_t voxels) { return (voxels + edge_ - 1) / edge_; };
  grid_ = {count(from.nx), count(from.ny), count(from.nz)};
  std::vector<std::uint32_t> solid(grid_.voxel_count()), all(solid);
  for (std::int32_t z = 0; z < from.nz; ++z) {
    for (std::int32_t y = 0; y < from.ny; ++y) {
      const Density* const row = &image.density[from.index(0, y, z)];
      for (std::int32_t x = 0; x < from.nx; x += edge_) {
        const std::int32_t end = std::min(x + edge_, from.nx);
        const std::size_t cell = grid_.index(x / edge_, y / edge_, z / edge_);
        all[cell] += static_cast<std::uint32_t>(end - x);
        solid[cell] += static_cast<std::uint32_t>(
            std::count_if(row + x, row + end, [skin](Density d) { return d >= skin; }));
      }
    }
  }
  cells_.resize(solid.size());
  for (std::size_t i = 0; i < solid.size(); ++i) {
    cells_[i] = 2 * solid[i] >= all[i] ? kInside : Density{0};
  }
  const std::vector<Density> whole = cells_;
  spread(grid_, cells_, [](std::initializer_list<Density> near) { return std::min(near); });
  SolidParts parts(grid_, cells_, kInside);
  if (parts.parts().empty()) {  // all is thin: the largest part as it is
    cells_ = whole;
    parts = SolidParts(grid_, cells_, kInside);
  }
  std::ranges::fill(cells_, Density{0});
  for (const SolidRun& run : parts.runs()) {
    if (run.part != 0) continue;
    const std::size_t begin = grid_.index(run.x0, run.y, run.z);
    std::fill_n(cells_.begin() + static_cast<std::ptrdiff_t>(begin), run.x1 - run.x0, kInside);
  }
  for (int layer = 0; layer < 3; ++layer) {
    spread(grid_, cells_, [](std::initializer_list<Density> near) { return std::max(near); });
  }
}

}  // namespace kerf
