// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numeric>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/crop_resample.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Three = std::array<double, 3>;

double ramp(double x_mm, double y_mm, double z_mm) {
  return 20000 + 900 * x_mm + 500 * y_mm - 700 * z_mm;
}

VolumeImage ramp_image(VoxelGrid grid, Three spacing_mm) {
  VolumeImage image = air(grid);
  image.spacing_mm = spacing_mm;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        image.density[grid.index(x, y, z)] = static_cast<Density>(
            std::lround(ramp(x * spacing_mm[0], y * spacing_mm[1], z * spacing_mm[2])));
      }
    }
  }
  return image;
}

/// Largest deviation from the ramp, away from the border, where there is nothing to lean on.
double ramp_error(const VolumeImage& image) {
  double worst = 0;
  for (std::int32_t z = 2; z < image.grid.nz - 2; ++z) {
    for (std::int32_t y = 2; y < image.grid.ny - 2; ++y) {
      for (std::int32_t x = 2; x < image.grid.nx - 2; ++x) {
        const double exact = ramp(image.origin_mm[0] + x * image.spacing_mm[0],
                                  image.origin_mm[1] + y * image.spacing_mm[1],
                                  image.origin_mm[2] + z * image.spacing_mm[2]);
        worst = std::max(worst, std::abs(image.density[image.grid.index(x, y, z)] - exact));
      }
    }
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
  CHECK(rc::check("mean", [] {
    VolumeImage image = air({12, 12, 12});
    for (Density& d : image.density) d = *rc::gen::arbitrary<Density>();
    const auto ratio = *rc::gen::element(2, 3, 4, 6);
    const auto s = static_cast<double>(ratio);
    RC_ASSERT(std::abs(mean(resample(image, {s, s, s})) - mean(image)) <= 0.5);
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
