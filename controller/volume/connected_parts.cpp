// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/connected_parts.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace kerf {
namespace {

/// Union-find of connected runs: each points to one of its set, the first of a set to itself.
class RunSets {
 public:
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  std::uint32_t first_of(std::uint32_t run) {
    while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
    return run;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = first_of(a);
    b = first_of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Joins the touching runs of two neighbouring rows; both in the order of x.
void join_rows(std::span<const SolidRun> row, std::span<const SolidRun> beside, RunSets& sets) {
  auto other = beside.begin();
  for (const SolidRun& run : row) {
    while (other != beside.end() && other->x1 <= run.x0) ++other;
    for (auto touching = other; touching != beside.end() && touching->x0 < run.x1; ++touching) {
      sets.join(run.part, touching->part);
    }
  }
}

void add_runs(const Density* row, std::int32_t nx, std::int32_t y, std::int32_t z, Density least,
              RunSets& sets, std::vector<SolidRun>& runs) {
  const auto solid = [least](Density d) { return d >= least; };
  const Density* const end = row + nx;
  for (const Density* at = std::find_if(row, end, solid); at != end;) {
    const Density* const stop = std::find_if_not(at, end, solid);
    runs.push_back({static_cast<std::int32_t>(at - row), static_cast<std::int32_t>(stop - row), y,
                    z, sets.add()});
    at = std::find_if(stop, end, solid);
  }
}

}  // namespace

SolidParts::SolidParts(const VoxelGrid& grid, std::span<const Density> density, Density least) {
  RunSets sets;
  const auto ny = static_cast<std::size_t>(grid.ny);
  // First run of each row, in this layer and in the one before.
  std::vector<std::size_t> begins(ny + 1, 0), before(ny + 1, 0);
  const auto row_of = [&](const std::vector<std::size_t>& of, std::size_t y) {
    return std::span<const SolidRun>(runs_).subspan(of[y], of[y + 1] - of[y]);
  };
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    std::swap(begins, before);
    for (std::size_t y = 0; y < ny; ++y) {
      begins[y] = runs_.size();
      const auto row_y = static_cast<std::int32_t>(y);
      add_runs(&density[grid.index(0, row_y, z)], grid.nx, row_y, z, least, sets, runs_);
      begins[y + 1] = runs_.size();
      if (y > 0) join_rows(row_of(begins, y), row_of(begins, y - 1), sets);
      if (z > 0) join_rows(row_of(begins, y), row_of(before, y), sets);
    }
  }

  std::vector<std::uint32_t> part_of(runs_.size());  // by the first run of its set
  for (SolidRun& run : runs_) {
    const std::uint32_t first = sets.first_of(run.part);
    if (first == run.part) {
      part_of[first] = static_cast<std::uint32_t>(parts_.size());
      parts_.push_back({0, {{run.x0, run.y, run.z}, {run.x1, run.y + 1, run.z + 1}}});
    }
    run.part = part_of[first];
    SolidPart& part = parts_[run.part];
    part.voxels += static_cast<std::uint64_t>(run.x1 - run.x0);
    part.box.lo = {std::min(part.box.lo.x, run.x0), std::min(part.box.lo.y, run.y), part.box.lo.z};
    part.box.hi = {std::max(part.box.hi.x, run.x1), std::max(part.box.hi.y, run.y + 1), run.z + 1};
  }

  std::vector<std::uint32_t> order(parts_.size()), place(parts_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return parts_[a].voxels > parts_[b].voxels; });
  std::vector<SolidPart> sorted;
  for (const std::uint32_t part : order) {
    place[part] = static_cast<std::uint32_t>(sorted.size());
    sorted.push_back(parts_[part]);
  }
  parts_ = std::move(sorted);
  for (SolidRun& run : runs_) run.part = place[run.part];
}

namespace {

/// Cells along the longest axis: one layer is then a hundredth of a scan, so that a couch of 2 cm
/// vanishes in one of 1 m, and a head rest of 8 mm in one of 25 cm.
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
  if (parts.parts().empty()) {  // all parts are thin: take the largest part unchanged
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
