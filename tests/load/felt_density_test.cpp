// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/scene/scene_presets.hpp"
#include "tests/scene/support.hpp"

using namespace kerf;

namespace {

constexpr Density kIso = 32768;

/// A row of voxels along x.
VolumeImage row(std::vector<Density> density, std::vector<Label> labels) {
  VolumeImage image;
  image.grid = {static_cast<std::int32_t>(density.size()), 1, 1};
  image.density = std::move(density);
  image.labels = std::move(labels);
  return image;
}

std::vector<Material> soft_pulp(double felt_iso) {
  std::vector<Material> materials = default_materials();
  materials[3].felt_iso = felt_iso;
  return materials;
}

std::string load_error(const std::string& lines) {
  const test::TempFolder folder;
  const auto scene = folder.write("scene.toml", lines);
  return test::error_of([&] { static_cast<void>(load_scene(scene)); });
}

}  // namespace

TEST_CASE("a material's own iso becomes the volume's, full density stays full") {
  VolumeImage image = row({4096, 16000, 40000, 65535}, {3, 3, 3, 3});
  scale_to_felt_iso(soft_pulp(0.25), kIso, image);
  CHECK(image.density == std::vector<Density>{8192, 32000, 65535, 65535});
}

TEST_CASE("other materials, air far away and an image without labels keep their densities") {
  const std::vector<Density> density{5000, 5000, 5000, 5000, 5000, 5000, 5000};
  VolumeImage image = row(density, {3, 0, 0, 0, 0, 1, 1});
  scale_to_felt_iso(soft_pulp(0.25), kIso, image);
  // Three unlabelled voxels are the pulp's edge at most, and the enamel has its own.
  CHECK(image.density == std::vector<Density>{10000, 10000, 10000, 5000, 5000, 5000, 5000});
  VolumeImage bare = row(density, {});
  scale_to_felt_iso(soft_pulp(0.25), kIso, bare);
  CHECK(bare.density == density);
  VolumeImage same = row(density, std::vector<Label>(7, 3));
  scale_to_felt_iso(default_materials(), kIso, same);
  CHECK(same.density == density);
}

TEST_CASE("a scene's felt_iso is read, and makes the phantom's pulp solid") {
  const std::string scene =
      "[[volume]]\nfile = \"phantom\"\nsize = [64, 64, 40]\niso = 0.45\n"
      "[[tool]]\nshape = \"ball\"\nsize_vox = 8\n"
      "[[material]]\nname = \"pulp\"\n";
  const test::TempFolder folder;
  const LoadedScene hollow = load_scene(folder.write("hollow.toml", scene));
  const LoadedScene full = load_scene(folder.write("full.toml", scene + "felt_iso = 0.14\n"));
  CHECK(full.materials[3].felt_iso == 0.14);
  const VolumeImage &before = hollow.volumes[0].image, &after = full.volumes[0].image;
  REQUIRE(before.grid == after.grid);
  int pulp = 0;
  for (std::size_t i = 0; i < before.density.size(); ++i) {
    // A voxel of half of the pulp's density or more is inside of it.
    if (after.labels[i] == 3 && before.density[i] >= 0.15 * kDensityMax) {
      ++pulp;
      REQUIRE(after.density[i] > full.volumes[0].iso);
    }
    if (after.labels[i] == 1) REQUIRE(after.density[i] == before.density[i]);
  }
  CHECK(pulp > 50);
}

TEST_CASE("a felt_iso that cannot be is refused with a way out") {
  const std::string tool = "[[tool]]\nshape = \"ball\"\nsize_vox = 8\n";
  const std::string phantom = "[[volume]]\nfile = \"phantom\"\nsize = [64, 64, 40]\n" + tool;
  const std::string pulp = "[[material]]\nname = \"pulp\"\nfelt_iso = ";
  CHECK(load_error(phantom + pulp + "0\n").find("material.felt_iso = 0 is out of range") !=
        std::string::npos);
  CHECK(load_error(phantom + pulp + "1.5\n").find("material.felt_iso = 1.5 is out of range") !=
        std::string::npos);
  const VoxelGrid grid{30, 30, 24};
  const test::TempFolder folder;
  static_cast<void>(folder.write(
      "block.nrrd",
      test::nrrd(grid, {0.1, 0.1, 0.1}, test::block(grid, {{5, 5, 7}, {25, 25, 17}}, 1000))));
  const auto scene =
      folder.write("scene.toml", "[[volume]]\nfile = \"block.nrrd\"\n" + tool + pulp + "0.1\n");
  const std::string error = test::error_of([&] { static_cast<void>(load_scene(scene)); });
  CHECK(error.find("material pulp has felt_iso = 0.1, and no volume has labels") !=
        std::string::npos);
}
