// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/crop_resample.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/windowing.hpp"

namespace kerf {
namespace {

/// Copies the part of `from` in `box`; the rest of the result is 0.
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
    throw LoadError(text.str());
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

namespace {

/// Maps one axis of `old_count` voxels to new ones of `ratio` old voxels each. Positions are in old
/// voxels from the outer face of the first.
class AxisMap {
 public:
  AxisMap(std::int32_t old_count, double ratio) : old_count_(old_count), ratio_(ratio) {
    // A hair of tolerance, so that rounding of the ratio does not lose the last voxel.
    constexpr double kSlack = 1e-6;
    const double whole = std::floor(old_count / ratio + kSlack);
    // Far above the limit is still above it; the caller checks.
    new_count_ = static_cast<std::int32_t>(std::clamp(whole, 1.0, 1e9));
  }

  [[nodiscard]] std::int32_t new_count() const noexcept { return new_count_; }

  /// Old voxel at the middle of new voxel `i`.
  [[nodiscard]] std::int32_t nearest(std::int32_t i) const noexcept {
    return inside(std::floor((i + 0.5) * ratio_));
  }

  /// Calls `add(old index, weight)` for every old voxel with a weight; the weights sum to 1.
  template <class Add>
  void weights(std::int32_t i, Add&& add) const {
    if (ratio_ <= 1.0) {
      const double centre = (i + 0.5) * ratio_ - 0.5;
      const double low = std::floor(centre);
      const double t = centre - low;
      add(inside(low), 1.0 - t);
      add(inside(low + 1.0), t);
      return;
    }
    const double from = i * ratio_;
    const double to = from + ratio_;
    for (auto cell = static_cast<std::int64_t>(from); static_cast<double>(cell) < to; ++cell) {
      const auto face = static_cast<double>(cell);
      const double covered = std::min(face + 1.0, to) - std::max(face, from);
      if (covered > 0.0) add(inside(face), covered / ratio_);
    }
  }

 private:
  [[nodiscard]] std::int32_t inside(double index) const noexcept {
    return static_cast<std::int32_t>(std::clamp(index, 0.0, old_count_ - 1.0));
  }

  std::int32_t old_count_;
  double ratio_;
  std::int32_t new_count_ = 1;
};

/// Applies `map` along the axis whose neighbours are `stride` apart: the array is runs of
/// count x stride values.
std::vector<float> along(const AxisMap& map, const std::vector<float>& from, std::int32_t old_count,
                         std::size_t stride) {
  struct Tap {
    std::size_t to, from;
    float weight;
  };
  std::vector<Tap> taps;
  for (std::int32_t i = 0; i < map.new_count(); ++i) {
    map.weights(i, [&](std::int32_t old, double weight) {
      taps.push_back({static_cast<std::size_t>(i) * stride, static_cast<std::size_t>(old) * stride,
                      static_cast<float>(weight)});
    });
  }
  const std::size_t from_run = static_cast<std::size_t>(old_count) * stride;
  const std::size_t to_run = static_cast<std::size_t>(map.new_count()) * stride;
  const std::size_t runs = from.size() / from_run;
  std::vector<float> to(runs * to_run, 0.0F);
  for (std::size_t run = 0; run < runs; ++run) {
    for (const Tap& tap : taps) {
      const float* source = from.data() + run * from_run + tap.from;
      float* target = to.data() + run * to_run + tap.to;
      for (std::size_t s = 0; s < stride; ++s) target[s] += tap.weight * source[s];
    }
  }
  return to;
}

}  // namespace

VolumeImage resample(const VolumeImage& image, const std::array<double, 3>& spacing_mm) {
  check_spacing("resample", spacing_mm);
  const VoxelGrid& old = image.grid;
  const AxisMap x(old.nx, spacing_mm[0] / image.spacing_mm[0]);
  const AxisMap y(old.ny, spacing_mm[1] / image.spacing_mm[1]);
  const AxisMap z(old.nz, spacing_mm[2] / image.spacing_mm[2]);
  check_grid("resample", x.new_count(), y.new_count(), z.new_count(), "ask for larger voxels");

  VolumeImage result;
  result.grid = {x.new_count(), y.new_count(), z.new_count()};
  result.spacing_mm = spacing_mm;
  result.direction = image.direction;
  for (std::size_t i = 0; i < 3; ++i) {
    result.origin_mm[i] = image.origin_mm[i];
    for (std::size_t j = 0; j < 3; ++j) {
      result.origin_mm[i] +=
          image.direction[3 * i + j] * 0.5 * (spacing_mm[j] - image.spacing_mm[j]);
    }
  }

  const auto nx = static_cast<std::size_t>(result.grid.nx);
  const auto ny = static_cast<std::size_t>(result.grid.ny);
  std::vector<float> field(image.density.begin(), image.density.end());
  field = along(x, field, old.nx, 1);
  field = along(y, field, old.ny, nx);
  field = along(z, field, old.nz, nx * ny);
  result.density.resize(field.size());
  std::transform(field.begin(), field.end(), result.density.begin(),
                 [](float v) { return nearest_density(static_cast<double>(v)); });

  if (image.labels.empty()) return result;
  result.labels.reserve(field.size());
  for (std::int32_t k = 0; k < result.grid.nz; ++k) {
    for (std::int32_t j = 0; j < result.grid.ny; ++j) {
      for (std::int32_t i = 0; i < result.grid.nx; ++i) {
        result.labels.push_back(image.labels[old.index(x.nearest(i), y.nearest(j), z.nearest(k))]);
      }
    }
  }
  return result;
}

}  // namespace kerf
