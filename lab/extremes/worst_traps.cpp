// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/volume_density.hpp"
#include "lab/extremes/worst_tick.hpp"
#include "lab/rig/contact_rig.hpp"

namespace kerf::extremes {
namespace {

constexpr VoxelGrid kGrid{256, 256, 161};
constexpr Point kMiddle{128.3, 127.6, 96.6};

/// By signed distance from `kMiddle`, tilted so that no layer of voxels lies along a face.
Trap solid(const char* name, double (*distance)(Point)) {
  return {name,
          [distance] {
            return blurred(kGrid, [distance](Point p) {
              const Point d = p - kMiddle;
              return distance({0.96 * d[0] - 0.28 * d[2], d[1], 0.28 * d[0] + 0.96 * d[2]});
            });
          },
          kMiddle, kIso};
}

/// Any densities between two shares of the whole.
Trap tissue(const char* name, double low, double high) {
  return {name,
          [low, high] {
            Dice dice(5);
            return body_of(kGrid, [&](Point) { return dice.uniform(low, high); });
          },
          kMiddle, kIso};
}

Trap tooth(const std::filesystem::path& file) {
  const SourceVolume source = read_volume(file, {.spacing_mm = std::array{0.1, 0.1, 0.1}});
  VolumeImage image = apply_window(source, range_window(source));
  const Density iso = otsu_threshold(image);
  const Body body{image.grid, std::move(image.density)};
  // Along the middle of its slices to the first solid voxel.
  const std::int32_t x = body.grid.nx / 2, y = body.grid.ny / 2;
  std::int32_t z = body.grid.nz - 1;
  while (z > 0 && body.density[body.grid.index(x, y, z)] < iso) --z;
  return {"tooth", [body] { return body; }, {double(x), double(y), double(z)}, iso};
}

}  // namespace

std::vector<Trap> worst_traps(const std::filesystem::path& data) {
  std::vector<Trap> traps{
      solid("flat", [](Point p) { return p[2]; }),
      solid("edge", [](Point p) { return (p[2] + std::abs(p[0])) * std::sqrt(0.5); }),
      solid("crease", [](Point p) { return (p[2] - std::abs(p[0])) * std::sqrt(0.5); }),
      solid("ball of 6", [](Point p) { return length(p) - 6; }),
      // A slot with a play of 0.1 for a ball of 8, round at its bottom.
      solid("slot",
            [](Point p) {
              const double wall = 8.1 - (p[2] < 0 ? std::hypot(p[0], p[2]) : std::abs(p[0]));
              return std::max(wall, p[2] - 12);
            }),
      tissue("noise", 0.2, 0.6),
      tissue("soft tissue", 0.38, 0.48),
  };
  const std::filesystem::path file = data / "ge_tooth_16bit/tooth.nhdr";
  if (!data.empty() && std::filesystem::exists(file)) traps.push_back(tooth(file));
  return traps;
}

}  // namespace kerf::extremes
