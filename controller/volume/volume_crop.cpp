// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_crop.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_limits.hpp"
#include "controller/volume/volume_density.hpp"

namespace kerf {
namespace {

/// Copies what of `from` lies in `box`; the rest of the result is 0.
template <class T>
std::vector<T> cut(const std::vector<T>& from, const VoxelGrid& from_grid, const VoxelBox& box,
                   const VoxelGrid& to_grid) {
  std::vector<T> to(to_grid.voxel_count(), T{0});
  const VoxelBox shared = box.clipped(from_grid.box());
  if (shared.empty()) return to;
  for (std::int32_t z = shared.lo.z; z < shared.hi.z; ++z) {
    for (std::int32_t y = shared.lo.y; y < shared.hi.y; ++y) {
      const std::size_t source = from_grid.index(shared.lo.x, y, z);
      const std::size_t target = to_grid.index(shared.lo.x - box.lo.x, y - box.lo.y, z - box.lo.z);
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(source), shared.extent().x,
                  to.begin() + static_cast<std::ptrdiff_t>(target));
    }
  }
  return to;
}

}  // namespace

VolumeImage crop(const VolumeImage& image, const VoxelBox& box) {
  const VoxelIndex extent = box.extent();
  check_grid("crop", extent.x, extent.y, extent.z, "resample it to larger voxels first");
  VolumeImage part;
  part.grid = {extent.x, extent.y, extent.z};
  part.spacing_mm = image.spacing_mm;
  part.direction = image.direction;
  const std::array<double, 3> step{box.lo.x * image.spacing_mm[0], box.lo.y * image.spacing_mm[1],
                                   box.lo.z * image.spacing_mm[2]};
  for (std::size_t i = 0; i < 3; ++i) {
    const double* row = &image.direction[3 * i];
    part.origin_mm[i] = image.origin_mm[i] + row[0] * step[0] + row[1] * step[1] + row[2] * step[2];
  }
  part.density = cut(image.density, image.grid, box, part.grid);
  if (!image.labels.empty()) part.labels = cut(image.labels, image.grid, box, part.grid);
  return part;
}

VolumeImage enclosed_in_air(VolumeImage image, Density least) {
  const VoxelBox solid = solid_box(image, least), all = image.grid.box();
  const bool inside = solid.empty() || solid.grown(1).clipped(all) == solid.grown(1);
  return inside ? std::move(image) : crop(image, all.grown(1));
}

VolumeImage crop_to_solid(const VolumeImage& image, Density iso, std::int32_t guard) {
  const VoxelBox box = solid_box(image, iso);
  if (box.empty()) {
    std::ostringstream text;
    text << "iso: " << iso / kDensityMax
         << " leaves nothing solid in the volume; use a lower `iso` or another `window`";
    throw SceneError(text.str());
  }
  return crop(image, box.grown(guard));
}

void fade_to_air(VolumeImage& image) {
  const VoxelGrid& g = image.grid;
  const auto to_border = [](std::int32_t at, std::int32_t size) {
    return std::min(at, size - 1 - at);
  };
  for (std::int32_t z = 0; z < g.nz; ++z) {
    for (std::int32_t y = 0; y < g.ny; ++y) {
      Density* const row = &image.density[g.index(0, y, z)];
      const std::int32_t outside = std::min(to_border(y, g.ny), to_border(z, g.nz));
      const auto fade = [&](std::int32_t x) {
        const std::int32_t layer = std::min(outside, to_border(x, g.nx));
        if (layer < 2) row[x] = layer == 0 ? Density{0} : static_cast<Density>(row[x] / 2);
      };
      if (outside < 2) {
        for (std::int32_t x = 0; x < g.nx; ++x) fade(x);
      } else {
        for (const std::int32_t x : {0, 1, g.nx - 2, g.nx - 1}) fade(x);
      }
    }
  }
}

}  // namespace kerf
