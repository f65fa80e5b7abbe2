// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/solid_parts.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace kerf {
namespace {

/// Sets of runs that hang together: each points to one of its set, the first of it to itself.
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

/// Joins the runs of two rows that lie beside each other; both in the order of x.
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
  // Where the runs of each row of this layer and of the one before begin.
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

}  // namespace kerf
