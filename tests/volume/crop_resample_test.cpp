// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/crop_resample.hpp"

#include <cmath>
#include <numeric>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/support/property.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::crop_resample_test {

using namespace kerf::test;

namespace {

/// Every voxel holds its own index + 1, as density and (low byte) as label.
VolumeImage numbered(VoxelGrid grid) {
  VolumeImage image = air(grid);
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    image.density[i] = static_cast<Density>(i + 1);
    image.labels.push_back(static_cast<Label>(i + 1));
  }
  return image;
}

std::array<double, 3> place(const VolumeImage& v, int i, int j, int k) {
  std::array<double, 3> p = v.origin_mm;
  const std::array<double, 3> step{i * v.spacing_mm[0], j * v.spacing_mm[1], k * v.spacing_mm[2]};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) p[r] += v.direction[3 * r + c] * step[c];
  }
  return p;
}

}  // namespace

TEST_CASE("a crop keeps every voxel's density, label and place; outside the source is air") {
  CHECK(property([] {
    const VoxelGrid grid{6, 5, 4};
    VolumeImage image = numbered(grid);
    image.spacing_mm = {0.5, 0.25, 2};
    image.origin_mm = {10, 20, 30};
    image.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    const auto edge = [] { return in_range(-4, 9); };
    const VoxelIndex lo{edge(), edge(), edge()};
    const auto size = [] { return in_range(1, 8); };
    const VoxelBox box{lo, {lo.x + size(), lo.y + size(), lo.z + size()}};
    const VolumeImage part = crop(image, box);
    HOLDS(part.grid == (VoxelGrid{box.extent().x, box.extent().y, box.extent().z}));
    for (const auto& [x, y, z] : voxels(part.grid)) {
      const VoxelIndex from{x + lo.x, y + lo.y, z + lo.z};
      const std::size_t at = part.grid.index(x, y, z);
      const bool inside = grid.contains(from);
      const std::size_t source = inside ? grid.index(from.x, from.y, from.z) : 0;
      HOLDS(part.density[at] == (inside ? image.density[source] : 0));
      HOLDS(part.labels[at] == (inside ? image.labels[source] : 0));
      HOLDS(place(part, x, y, z) == place(image, from.x, from.y, from.z));
    }
  }));
}

TEST_CASE("cropping to what is solid leaves three voxels of guard on every side") {
  VolumeImage image = air({20, 20, 20});
  image.density[image.grid.index(8, 9, 10)] = 1000;
  image.density[image.grid.index(11, 9, 10)] = 1000;
  const VolumeImage part = crop_to_solid(image, 1000);
  CHECK(part.grid == VoxelGrid{10, 7, 7});
  CHECK(solid_box(part, 1000) == VoxelBox{{3, 3, 3}, {7, 4, 4}});
  CHECK(part.origin_mm == std::array<double, 3>{5, 6, 7});
}

TEST_CASE("the guard exists even where the solid touches the border of the file") {
  VolumeImage image = air({4, 4, 4});
  std::fill(image.density.begin(), image.density.end(), Density{9});
  const VolumeImage part = crop_to_solid(image, 9);
  CHECK(part.grid == VoxelGrid{10, 10, 10});
  CHECK(solid_box(part, 9) == VoxelBox{{3, 3, 3}, {7, 7, 7}});
  CHECK(part.density[0] == 0);
  CHECK(part.origin_mm == std::array<double, 3>{-3, -3, -3});
}

TEST_CASE("what lies below iso in the guard is kept as it is") {
  VolumeImage image = air({9, 9, 9});
  std::fill(image.density.begin(), image.density.end(), Density{100});
  image.density[image.grid.index(4, 4, 4)] = 1000;
  const VolumeImage part = crop_to_solid(image, 500, 2);
  CHECK(part.grid == VoxelGrid{5, 5, 5});
  CHECK(part.density[0] == 100);
}

TEST_CASE("a cropped volume fades to air over two layers, and what is solid stays") {
  VolumeImage image = air({12, 11, 10});
  std::fill(image.density.begin(), image.density.end(), Density{400});
  image.density[image.grid.index(6, 5, 5)] = 1000;
  image.density[image.grid.index(7, 5, 5)] = 1000;
  VolumeImage part = crop_to_solid(image, 500);
  fade_to_air(part);
  const VoxelGrid& g = part.grid;
  for (const auto& [x, y, z] : voxels(g)) {
    const std::int32_t layer = std::min({x, g.nx - 1 - x, y, g.ny - 1 - y, z, g.nz - 1 - z});
    const bool solid = y == 3 && z == 3 && (x == 3 || x == 4);
    CAPTURE(layer);
    CHECK(part.density[g.index(x, y, z)] == (solid        ? 1000
                                             : layer == 0 ? 0
                                             : layer == 1 ? 200
                                                          : 400));
  }
}

TEST_CASE("nothing solid, an empty box and a box above the limit are refused in one line") {
  const VolumeImage image = air({4, 4, 4});
  try {
    static_cast<void>(crop_to_solid(image, 32768));
    FAIL("accepted");
  } catch (const LoadError& error) {
    CHECK(is_one_line(error.what()));
    CHECK(std::string(error.what()).find("nothing solid") != std::string::npos);
  }
  CHECK_THROWS_AS(static_cast<void>(crop(image, VoxelBox{{2, 0, 0}, {2, 4, 4}})), LoadError);
  CHECK_THROWS_AS(static_cast<void>(crop(image, VoxelBox{{0, 0, 0}, {2000, 4, 4}})), LoadError);
}

TEST_CASE(
    "a solid that ends at the border gets one voxel of air around it; no other image changes") {
  VolumeImage image;
  image.grid = {4, 5, 6};
  image.spacing_mm = {1, 2, 3};
  image.direction = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  image.density.assign(image.grid.voxel_count(), 100);
  image.density[image.grid.index(2, 2, 2)] = 1000;
  const VolumeImage inside = enclosed_in_air(image, 500);
  CHECK(inside.grid == image.grid);
  CHECK(inside.density == image.density);
  CHECK(enclosed_in_air(image, 2000).grid == image.grid);  // nothing is solid

  for (const VoxelIndex at : {VoxelIndex{0, 2, 2}, VoxelIndex{3, 2, 2}, VoxelIndex{2, 0, 2},
                              VoxelIndex{2, 4, 2}, VoxelIndex{2, 2, 0}, VoxelIndex{2, 2, 5}}) {
    VolumeImage border = image;
    border.density[border.grid.index(at.x, at.y, at.z)] = 500;
    const VolumeImage around = enclosed_in_air(border, 500);
    CHECK(around.grid == VoxelGrid{6, 7, 8});
    CHECK(around.origin_mm == std::array<double, 3>{-1, -2, -3});  // every voxel stays in its place
    CHECK(around.density[around.grid.index(at.x + 1, at.y + 1, at.z + 1)] == 500);
    CHECK(around.density[around.grid.index(0, 3, 3)] == 0);
  }
}

namespace {

using Three = std::array<double, 3>;

double ramp(double x_mm, double y_mm, double z_mm) {
  return 20000 + 900 * x_mm + 500 * y_mm - 700 * z_mm;
}

VolumeImage ramp_image(VoxelGrid grid, Three spacing_mm) {
  VolumeImage image = air(grid);
  image.spacing_mm = spacing_mm;
  for (const auto& [x, y, z] : voxels(grid)) {
    image.density[grid.index(x, y, z)] = static_cast<Density>(
        std::lround(ramp(x * spacing_mm[0], y * spacing_mm[1], z * spacing_mm[2])));
  }
  return image;
}

/// Largest deviation from the ramp, away from the border, where there is nothing to lean on.
double ramp_error(const VolumeImage& image) {
  double worst = 0;
  for (const auto& [x, y, z] :
       voxels(VoxelBox{{2, 2, 2}, {image.grid.nx - 2, image.grid.ny - 2, image.grid.nz - 2}})) {
    const double exact = ramp(image.origin_mm[0] + x * image.spacing_mm[0],
                              image.origin_mm[1] + y * image.spacing_mm[1],
                              image.origin_mm[2] + z * image.spacing_mm[2]);
    worst = std::max(worst, std::abs(image.density[image.grid.index(x, y, z)] - exact));
  }
  return worst;
}

double mean(const VolumeImage& image) {
  return std::accumulate(image.density.begin(), image.density.end(), 0.0) /
         static_cast<double>(image.density.size());
}

}  // namespace

TEST_CASE("refining and whole ratios keep a density ramp, on anisotropic voxels too") {
  const VolumeImage image = ramp_image({24, 20, 18}, {0.5, 0.4, 1.0});
  constexpr double kRounding = 1.0;  // the source and the result round by half a step each
  for (const Three spacing : {Three{0.25, 0.2, 0.5}, Three{0.17, 0.31, 0.9}, Three{0.5, 0.4, 1.0},
                              Three{1.0, 0.8, 2.0}, Three{1.5, 0.4, 0.3}}) {
    const VolumeImage result = resample(image, spacing);
    CAPTURE(spacing[0]);
    CHECK(result.spacing_mm == spacing);
    CHECK(ramp_error(result) <= kRounding);
  }
}

TEST_CASE("other ratios keep a density ramp within an eighth of a step per axis") {
  const VolumeImage image = ramp_image({24, 20, 18}, {0.5, 0.4, 1.0});
  const double eighths = (900 * 0.5 + 500 * 0.4 + 700 * 1.0) / 8;
  CHECK(ramp_error(resample(image, {0.8, 0.7, 1.3})) <= eighths + 1.0);
}

TEST_CASE("the extent stays: outer faces meet, and voxels that do not fit whole are left out") {
  const VolumeImage image = ramp_image({10, 10, 9}, {0.5, 0.5, 0.5});
  const VolumeImage half = resample(image, {1, 1, 1});
  CHECK(half.grid == VoxelGrid{5, 5, 4});  // the ninth layer is dropped, as 161 -> 80
  CHECK(half.origin_mm == Three{0.25, 0.25, 0.25});
  const VolumeImage fine = resample(image, {0.1, 0.1, 0.1});
  CHECK(fine.grid == VoxelGrid{50, 50, 45});
  CHECK(fine.origin_mm[0] == doctest::Approx(-0.2));
}

TEST_CASE("twice the spacing is the mean of 2 x 2 x 2 voxels") {
  VolumeImage image = air({2, 2, 2});
  image.density = {0, 100, 200, 300, 1000, 2000, 3000, 4002};
  const VolumeImage one = resample(image, {2, 2, 2});
  CHECK(one.density == std::vector<Density>{1325});  // 10602 / 8 = 1325.25
}

TEST_CASE("coarsening by a divisor of the grid keeps the mean") {
  CHECK(property([] {
    VolumeImage image = air({12, 12, 12});
    for (Density& d : image.density) d = any<Density>();
    const double s = std::array{2, 3, 4, 6}[in_range<std::size_t>(0, 4)];
    HOLDS(std::abs(mean(resample(image, {s, s, s})) - mean(image)) <= 0.5);
  }));
}

TEST_CASE("labels take the nearest voxel and are never mixed") {
  VolumeImage image = air({4, 1, 1});
  image.labels = {1, 1, 3, 3};
  CHECK(resample(image, {0.5, 1, 1}).labels == std::vector<Label>{1, 1, 1, 1, 3, 3, 3, 3});
  CHECK(resample(image, {2, 1, 1}).labels == std::vector<Label>{1, 3});
}

TEST_CASE("a spacing that is not positive or gives too many voxels is refused") {
  const VolumeImage image = air({4, 4, 4});
  CHECK_THROWS_AS(static_cast<void>(resample(image, {1, 0, 1})), LoadError);
  CHECK_THROWS_AS(static_cast<void>(resample(image, {1, -1, 1})), LoadError);
  CHECK_THROWS_AS(static_cast<void>(resample(image, {1, std::nan(""), 1})), LoadError);
  CHECK_THROWS_AS(static_cast<void>(resample(image, {1e-6, 1, 1})), LoadError);
}

}  // namespace kerf::crop_resample_test
