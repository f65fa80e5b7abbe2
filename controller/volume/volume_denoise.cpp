// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_denoise.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "controller/volume/volume_crop.hpp"
#include "controller/volume/volume_density.hpp"

namespace kerf {
namespace {

constexpr int kStages = kDenoiseReach;  // of (1 - B)^4; each reaches one voxel further
constexpr int kFineBits = 7;  // 64 * 2.68 * 65535 * 2^7 still fits; 2.68: the most 3 stages leave

using Plane = std::vector<std::int32_t>;

/// Takes planes one after the other and gives each, a plane late, as r - B r.
///
/// A plane has a rim of kStages voxels for what the stages make of the air outside. Its outermost
/// voxels stay 0: no stage reads what would be there.
class Stage {
 public:
  Stage(std::size_t width, std::size_t voxels)
      : width_(width), before_(voxels), once_(voxels), twice_(voxels), rows_(3 * width) {}

  /// In: plane z. Out: plane z - 1 of r - B r.
  void pass(Plane& plane) {
    const std::size_t last = plane.size() / width_ - 1;
    blur_row(plane, 0);
    blur_row(plane, 1);
    for (std::size_t y = 1; y < last; ++y) {
      blur_row(plane, y + 1);
      take_row(plane, y);
    }
  }

 private:
  [[nodiscard]] std::int32_t* row(std::size_t y) { return &rows_[y % 3 * width_]; }

  /// [1 2 1] along x.
  void blur_row(const Plane& plane, std::size_t y) {
    const std::int32_t* const __restrict from = &plane[y * width_];
    std::int32_t* const __restrict to = row(y);
    for (std::size_t x = 1; x + 1 < width_; ++x) to[x] = from[x - 1] + 2 * from[x] + from[x + 1];
  }

  /// [1 2 1] along y and z. Of the plane before, `once_` is blurred along x and y, and `twice_` is
  /// two of it and the one before that.
  void take_row(Plane& plane, std::size_t y) {
    constexpr int kBits = 6, kHalf = 1 << (kBits - 1);  // the weights of B sum to 64
    const std::int32_t* const __restrict low = row(y - 1);
    const std::int32_t* const __restrict middle = row(y);
    const std::int32_t* const __restrict high = row(y + 1);
    std::int32_t* const __restrict value = &plane[y * width_];
    std::int32_t* const __restrict before = &before_[y * width_];
    std::int32_t* const __restrict once = &once_[y * width_];
    std::int32_t* const __restrict twice = &twice_[y * width_];
    for (std::size_t x = 1; x + 1 < width_; ++x) {
      const std::int32_t blurred = low[x] + 2 * middle[x] + high[x], now = value[x];
      value[x] = before[x] - ((twice[x] + blurred + kHalf) >> kBits);
      before[x] = now;
      twice[x] = once[x] + 2 * blurred;
      once[x] = blurred;
    }
  }

  std::size_t width_;
  Plane before_, once_, twice_;
  std::vector<std::int32_t> rows_;
};

void denoise_once(const VoxelGrid& grid, std::span<Density> density) {
  const std::size_t nx = static_cast<std::size_t>(grid.nx), ny = static_cast<std::size_t>(grid.ny);
  const std::size_t width = nx + 2 * std::size_t{kStages};
  Plane plane(width * (ny + 2 * std::size_t{kStages}));
  std::vector<Stage> stages(kStages, Stage(width, plane.size()));
  const auto rows = [&](std::int32_t z, const auto& each) {
    for (std::size_t y = 0; y < ny; ++y) {
      each(&plane[(y + kStages) * width + kStages],
           density.subspan((static_cast<std::size_t>(z) * ny + y) * nx, nx));
    }
  };
  for (std::int32_t z = 0; z < grid.nz + kStages; ++z) {
    std::ranges::fill(plane, 0);
    if (z < grid.nz) {
      rows(z, [](std::int32_t* to, std::span<const Density> from) {
        for (const Density d : from) *to++ = std::int32_t{d} << kFineBits;
      });
    }
    for (Stage& stage : stages) stage.pass(plane);
    if (z < kStages) continue;
    rows(z - kStages, [](const std::int32_t* noise, std::span<Density> of) {
      for (Density& d : of) {
        const std::int32_t rest = d - ((*noise++ + (1 << (kFineBits - 1))) >> kFineBits);
        d = static_cast<Density>(std::clamp(rest, 0, 65535));
      }
    });
  }
}

}  // namespace

void denoise(const VoxelGrid& grid, std::span<Density> density, int passes) {
  for (int i = 0; i < passes; ++i) denoise_once(grid, density);
}

VolumeImage crop_for_passes(const VolumeImage& image, Density iso, int passes) {
  const VoxelBox solid = solid_box(image, iso);
  if (solid.empty()) return image;
  return crop(image, solid.grown(kGuardVoxels + passes * kDenoiseReach)
                         .clipped(image.grid.box().grown(kGuardVoxels)));
}

}  // namespace kerf
