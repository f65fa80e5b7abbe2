// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/volume/crop_resample.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/scene/support.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::density_test {

using namespace kerf::test;

namespace {

constexpr VoxelGrid kGrid{40, 40, 40};
const std::string kTool = "[[tool]]\nshape = \"ball\"\nsize_vox = 8\n";

/// A ball with the edge of a scan, in values of a file; `shift` moves it along x.
std::vector<Density> ball(double noise, double shift = 0) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<Density> values;
  for (const auto& [x, y, z] : voxels(kGrid)) {
    const double far = std::hypot(x - 19.5 - shift, y - 19.5, z - 19.5) - 14;
    const double share = 0.1 + 0.4 * std::erfc(far / std::sqrt(2)) + 0.8 * noise * normal(random);
    values.push_back(static_cast<Density>(std::clamp(60000 * share, 0.0, 65535.0)));
  }
  return values;
}

/// A scene with that file and the lines of its volume.
std::filesystem::path scene_of(const TemporaryFolder& folder, const std::vector<Density>& values,
                               const std::string& lines) {
  static_cast<void>(folder.write("scan.nrrd", nrrd(kGrid, {0.1, 0.1, 0.1}, values)));
  return folder.write(
      "scene.toml",
      "[[volume]]\nfile = \"scan.nrrd\"\nwindow = [0, 65535]\niso = 0.458\n" + lines + kTool);
}

SceneVolume load(const std::vector<Density>& values, const std::string& lines) {
  const TemporaryFolder folder;
  return load_scene(scene_of(folder, values, lines)).volumes.at(0);
}

/// Standard deviation within 4 voxels of the middle.
double deviation(const VolumeImage& image) {
  double sum = 0, squares = 0, count = 0;
  const VoxelIndex middle{image.grid.nx / 2, image.grid.ny / 2, image.grid.nz / 2};
  for (std::int32_t z = -4; z <= 4; ++z) {
    for (std::int32_t y = -4; y <= 4; ++y) {
      for (std::int32_t x = -4; x <= 4; ++x) {
        const double d = image.density[image.grid.index(middle.x + x, middle.y + y, middle.z + z)];
        sum += d;
        squares += d * d;
        ++count;
      }
    }
  }
  return std::sqrt(squares / count - sum / count * sum / count);
}

}  // namespace

TEST_CASE("a noisy scan is smoothed as its noise asks; off, and a count, do as they say") {
  const std::vector<Density> noisy = ball(0.02);
  const SceneVolume off = load(noisy, "denoise = \"off\"\n");
  CHECK(off.denoised == 0);
  CHECK(off.noise.share == doctest::Approx(0.02).scale(0).epsilon(0.1));  // told all the same
  const SceneVolume automatic = load(noisy, "");
  CHECK(automatic.denoised >= 2);
  CHECK(automatic.noise.share == off.noise.share);
  CHECK(load(noisy, "denoise = \"auto\"\n").image.density == automatic.image.density);
  double before = deviation(off.image);
  CHECK(before == doctest::Approx(0.016 * 60000).scale(0).epsilon(0.1));
  const double left[] = {0.436, 0.358, 0.321};  // of white noise
  for (int passes = 1; passes <= kMostPasses; ++passes) {
    const SceneVolume smooth = load(noisy, "denoise = " + std::to_string(passes) + "\n");
    CHECK(smooth.denoised == passes);
    CHECK(deviation(smooth.image) ==
          doctest::Approx(left[passes - 1] * before).scale(0).epsilon(0.15));
    if (passes == automatic.denoised) CHECK(smooth.image.density == automatic.image.density);
  }
}

TEST_CASE("a clean scan keeps its bits under auto, and so its identity") {
  const std::vector<Density> clean = ball(0);
  const TemporaryFolder folder;
  const LoadedScene automatic = load_scene(scene_of(folder, clean, ""));
  const LoadedScene off = load_scene(scene_of(folder, clean, "denoise = \"off\"\n"));
  CHECK(automatic.volumes[0].denoised == 0);
  CHECK(canonical_json(automatic) == canonical_json(off));
  CHECK(canonical_json(load_scene(scene_of(folder, clean, "denoise = 1\n"))) !=
        canonical_json(off));
}

TEST_CASE("what is cropped before it is smoothed is what the whole volume would give") {
  for (const double shift : {0.0, 12.0, -12.0}) {  // in air, and over the border
    const std::vector<Density> noisy = ball(0.02, shift);
    for (int passes = 1; passes <= kMostPasses; ++passes) {
      VolumeImage whole;
      whole.grid = kGrid;
      whole.spacing_mm = {0.1, 0.1, 0.1};
      whole.density = noisy;
      const auto iso = static_cast<Density>(std::lround(0.458 * kDensityMax));
      whole = crop(whole, kGrid.box().grown(kGuardVoxels));
      denoise(whole.grid, whole.density, passes);
      const SceneVolume part = load(noisy, "denoise = " + std::to_string(passes) + "\n");
      CHECK(part.image.density == crop_to_solid(whole, iso).density);
    }
  }
}

TEST_CASE("a solid at the border keeps its face there within 0.02 voxels, cropped or not") {
  std::vector<Density> slab(kGrid.voxel_count());
  for (std::size_t i = 0; i < slab.size(); ++i) {
    slab[i] = static_cast<Density>(i % 40 < 20 ? 55000 + i * 7 % 31 : i * 7 % 31);
  }
  for (const char* crop : {"true", "false"}) {
    const SceneVolume volume = load(slab, std::string("denoise = 3\ncrop = ") + crop + "\n");
    const VoxelGrid& grid = volume.image.grid;
    const std::int32_t first = solid_box(volume.image, volume.iso).lo.x;
    REQUIRE(first > 0);
    const double in = volume.image.density[grid.index(first, grid.ny / 2, grid.nz / 2)];
    const double out = volume.image.density[grid.index(first - 1, grid.ny / 2, grid.nz / 2)];
    CHECK(std::abs((in - 55000 / 2) / (in - out) - 0.5) < 0.02);
    CHECK(volume.enclosed == (crop == std::string("false")));
  }
}

TEST_CASE("denoise of labels and of few levels is refused in one line; auto leaves them alone") {
  std::vector<Density> coarse = ball(0.02);
  for (Density& d : coarse) d = static_cast<Density>(d / 8000 * 8000);
  // Labels of 30 bodies and no gradation, in any order.
  std::vector<Density> labels(kGrid.voxel_count());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    labels[i] = static_cast<Density>((i % 40 / 8 * 6 + i / 40 % 40 / 7) * 7 % 30 * 2000);
  }
  const TemporaryFolder folder;
  const auto error = [&](const std::vector<Density>& values, const std::string& lines) {
    return test::error_of([&] { static_cast<void>(load_scene(scene_of(folder, values, lines))); });
  };
  const std::string few = error(coarse, "denoise = 2\n");
  CHECK(few.find("scene.toml:2: denoise: 2 for a file of 8 levels; noise can be distinguished from "
                 "16 on, leave it "
                 "out") != std::string::npos);
  CHECK(few.find('\n') == std::string::npos);
  const std::string map = error(labels, "denoise = 1\n");
  CHECK(
      has(map, "scene.toml:2: denoise: 1 for a label map, whose steps are no noise; leave it out"));
  CHECK(map.find('\n') == std::string::npos);
  CHECK(error(labels, "denoise = \"off\"\n").empty());
  CHECK(load(labels, "").denoised == 0);
  CHECK(load(coarse, "").denoised == 0);
  CHECK(load(coarse, "denoise = \"off\"\n").image.density == load(coarse, "").image.density);
}

TEST_CASE("the phantom is smoothed only where a scene says how often") {
  const TemporaryFolder folder;
  const auto phantom = [&](const std::string& lines) {
    return load_scene(folder.write("scene.toml",
                                   "[[volume]]\nfile = \"phantom\"\niso = 0.45\n"
                                   "size = [40, 40, 25]\n" +
                                       lines + kTool))
        .volumes.at(0);
  };
  const SceneVolume plain = phantom("");
  CHECK(plain.noise.share == 0);
  CHECK(plain.image.density == phantom("denoise = \"off\"\n").image.density);
  const SceneVolume smooth = phantom("denoise = 1\n");
  CHECK(smooth.denoised == 1);
  CHECK(smooth.image.labels.size() == smooth.image.density.size());
  CHECK(smooth.image.density != plain.image.density);
}

TEST_CASE("a volume of the command line keeps the scene's word on noise") {
  const TemporaryFolder folder;
  const std::filesystem::path scan =
      folder.write("other.nrrd", nrrd(kGrid, {0.1, 0.1, 0.1}, ball(0.02)));
  const SceneOverrides with{.volume_file = scan};
  CHECK(load_scene(scene_of(folder, ball(0), ""), with).volumes[0].denoised > 0);
  CHECK(load_scene(scene_of(folder, ball(0), "denoise = \"off\"\n"), with).volumes[0].denoised ==
        0);
  CHECK(load_scene(scene_of(folder, ball(0), "denoise = 1\n"), with).volumes[0].denoised == 1);
}

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
  const TemporaryFolder folder;
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
  const TemporaryFolder folder;
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
  CHECK(has(load_error(phantom + pulp + "0\n"), "material.felt_iso = 0 is out of range"));
  CHECK(has(load_error(phantom + pulp + "1.5\n"), "material.felt_iso = 1.5 is out of range"));
  const VoxelGrid grid{30, 30, 24};
  const TemporaryFolder folder;
  static_cast<void>(folder.write(
      "block.nrrd", nrrd(grid, {0.1, 0.1, 0.1}, block(grid, {{5, 5, 7}, {25, 25, 17}}, 1000))));
  const auto scene =
      folder.write("scene.toml", "[[volume]]\nfile = \"block.nrrd\"\n" + tool + pulp + "0.1\n");
  const std::string error = test::error_of([&] { static_cast<void>(load_scene(scene)); });
  CHECK(has(error, "material pulp has felt_iso = 0.1, and no volume has labels"));
}

TEST_CASE(
    "a scene's material without a voxel is refused with the nearest name; a place may be held") {
  const std::string tool = "[[tool]]\nshape = \"ball\"\nsize_vox = 8\n";
  const std::string phantom = "[[volume]]\nfile = \"phantom\"\nsize = [64, 64, 40]\n" + tool;
  const auto material = [](const std::string& name, const std::string& more = "") {
    return "[[material]]\nname = \"" + name + "\"\n" + more;
  };
  const std::string forbidden = "forbidden = true\n";
  CHECK(has(
      load_error(phantom + material("Pulp", forbidden)),
      "material.name = \"Pulp\" is unknown; did you mean \"pulp\"? known: enamel, dentin, pulp, "));
  CHECK(has(load_error(phantom + material("caries")), "\"caries\" is unknown; known: enamel"));
  CHECK(load_error(phantom + material("pulp", forbidden)).empty());

  // Labels 1 and 4 alone: 2 and 3 hold places.
  const VoxelGrid grid{30, 30, 24};
  const TemporaryFolder folder;
  static_cast<void>(folder.write(
      "block.nrrd", nrrd(grid, {0.1, 0.1, 0.1}, block(grid, {{5, 5, 7}, {25, 25, 17}}, 1000))));
  const std::string file = "[[volume]]\nfile = \"block.nrrd\"\n" + tool;
  const auto error = [&](const std::string& materials) {
    const auto scene = folder.write("scene.toml", file + materials);
    return test::error_of([&] { static_cast<void>(load_scene(scene)); });
  };
  CHECK(has(error(material("bone", forbidden)),
            "bone has forbidden = true, and no volume has labels"));
  CHECK(error(material("bone")).empty());
  auto labels = block(grid, {{5, 5, 7}, {25, 25, 17}}, 1);
  labels[(10 * 30 + 10) * 30 + 10] = 4;
  static_cast<void>(folder.write("block-labels.nrrd", nrrd(grid, {0.1, 0.1, 0.1}, labels)));
  CHECK(error(material("pulp") + material("nerve", forbidden)).empty());
  CHECK(has(error(material("pulp", forbidden) + material("nerve")),
            "material.name = \"pulp\" is unknown; known: enamel, nerve"));
  CHECK(has(error(material("nerve") + material("bone")), "\"bone\" is unknown; "));
}

}  // namespace kerf::density_test
