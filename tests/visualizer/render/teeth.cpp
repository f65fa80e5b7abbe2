// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/render/teeth.hpp"

#include <cmath>
#include <utility>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/support/real_data.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"

namespace kerf::test {

Tooth::Tooth(VolumeImage of, double iso, bool with_labels)
    : image(std::move(of)), labelled(with_labels) {
  VolumeView volume;
  volume.name = "tooth";
  volume.bricks = BrickGrid::of(image.grid);
  volume.world_from_voxel = glm::rotate(glm::dmat4(1.0), glm::radians(-90.0), {1, 0, 0}) *
                            centred(image.grid, glm::dvec3(image.spacing_mm[0]));
  volume.iso = static_cast<Density>(iso * kDensityMax);
  scene.volumes = {volume};
  scene.materials = {{"none", 0.0, {}},
                     {"enamel", 0.8, {0.88, 0.86, 0.80}},
                     {"dentin", 0.45, {0.80, 0.60, 0.36}},
                     {"pulp", 0.2, {0.70, 0.16, 0.14}}};
}

VolumeContent Tooth::content() const {
  return {image.density, labelled ? std::span<const Label>(image.labels) : std::span<Label>()};
}

ChangedBricks Tooth::drill() {
  const VoxelGrid& grid = image.grid;
  const double radius_vox = 0.05 * grid.nx;
  for (int z = grid.nz * 3 / 8; z < grid.nz; ++z) {
    for (int y = 0; y < grid.ny; ++y) {
      for (int x = 0; x < grid.nx; ++x) {
        if (std::hypot(x - 0.5 * grid.nx, y - 0.5 * grid.ny) < radius_vox) {
          image.density[grid.index(x, y, z)] = 0;
        }
      }
    }
  }
  return changed_in(scene.volumes[0].bricks, grid.box());
}

Tooth phantom(VoxelGrid grid, bool labelled) {
  constexpr double kIso = 0.45;
  return {make_phantom({.grid = grid}), kIso, labelled};
}

std::optional<Tooth> ct_tooth() {
  const auto file = real_data("ge_tooth_16bit/tooth.nhdr");
  if (!file.has_value()) return std::nullopt;
  ReadOptions options;
  options.override_spacing_mm = {0.125, 0.125, 0.125};
  constexpr double kAir = 391.0;
  constexpr double kMost = 1300.0;
  constexpr double kIso = 620.0;
  return Tooth(apply_window(read_volume(*file, options), {kAir, kMost}),
               (kIso - kAir) / (kMost - kAir), false);
}

}  // namespace kerf::test
