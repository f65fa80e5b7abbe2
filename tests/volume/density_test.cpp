// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// Of values that outlive it.
SourceVolume source(std::vector<float>& values) {
  SourceVolume v;
  v.grid = {static_cast<std::int32_t>(values.size()), 1, 1};
  v.spacing_mm = {0.5, 0.25, 2};
  v.origin_mm = {1, 2, 3};
  v.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  v.values = VoxelValues(values);
  v.min = static_cast<double>(*std::min_element(values.begin(), values.end()));
  v.max = static_cast<double>(*std::max_element(values.begin(), values.end()));
  return v;
}

VolumeImage row(const std::vector<Density>& densities) {
  VolumeImage image = air({static_cast<std::int32_t>(densities.size()), 1, 1});
  image.density = densities;
  return image;
}

}  // namespace

TEST_CASE("the window of the range maps the ends to 0 and 65535 and rounds to the nearest") {
  std::vector<float> values{-1000, 0, 1000, 500.01F};
  const SourceVolume v = source(values);
  const Window window = range_window(v);
  CHECK(window.lo == -1000);
  CHECK(window.hi == 1000);
  const VolumeImage image = apply_window(v, window);
  CHECK(image.density == std::vector<Density>{0, 32768, 65535, 49152});  // 32767.5 rounds up
  CHECK(image.spacing_mm == v.spacing_mm);
  CHECK(image.origin_mm == v.origin_mm);
  CHECK(image.direction == v.direction);
}

TEST_CASE("values outside a window are clamped") {
  std::vector<float> values{-3000, 0, 50, 100, 4000};
  const VolumeImage image = apply_window(source(values), {0, 100});
  CHECK(image.density == std::vector<Density>{0, 0, 32768, 65535, 65535});
}

TEST_CASE("a window without width is refused, and a uniform file is named as the reason") {
  std::vector<float> fives{5, 5, 5};
  const SourceVolume uniform = source(fives);
  CHECK_THROWS_WITH_AS(static_cast<void>(apply_window(uniform, range_window(uniform))),
                       doctest::Contains("nothing to see"), LoadError);
  for (const Window bad :
       {Window{2, 1}, Window{1, 1}, Window{0, std::numeric_limits<double>::infinity()},
        Window{std::numeric_limits<double>::quiet_NaN(), 1}}) {
    std::vector<float> values{0, 1};
    CHECK_THROWS_AS(static_cast<void>(apply_window(source(values), bad)), LoadError);
  }
}

TEST_CASE("windowing is monotonic and within half a step of the straight line") {
  CHECK(rc::check("window", [] {
    auto values = *rc::gen::container<std::vector<float>>(
        20, rc::gen::map(rc::gen::inRange(-30000, 30000),
                         [](int v) { return 0.1F * static_cast<float>(v); }));
    const SourceVolume v = source(values);
    RC_PRE(v.min < v.max);
    const VolumeImage image = apply_window(v, range_window(v));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double exact = (static_cast<double>(values[i]) - v.min) / (v.max - v.min) * 65535;
      RC_ASSERT(std::abs(image.density[i] - exact) <= 0.5 + 1e-6);
    }
  }));
}

TEST_CASE("Otsu parts two groups in the middle of the gap between them") {
  std::vector<Density> densities;
  for (int i = 0; i < 900; ++i) densities.push_back(static_cast<Density>(10000 + i % 100));
  for (int i = 0; i < 100; ++i) densities.push_back(static_cast<Density>(50000 + i % 100));
  const Density threshold = otsu_threshold(row(densities));
  CHECK(threshold == doctest::Approx((10100 + 50000) / 2).epsilon(0.01));
}

TEST_CASE("Otsu finds the valley between two bell curves of different width") {
  // Counts of two normal distributions, summed exactly instead of drawn.
  std::vector<Density> densities;
  const auto add_bell = [&](double mean, double sigma, double voxels) {
    for (int d = 0; d < 65536; d += 16) {
      const double t = (d - mean) / sigma;
      const double count = voxels * 16 / sigma / std::sqrt(2 * M_PI) * std::exp(-t * t / 2);
      densities.insert(densities.end(), static_cast<std::size_t>(count + 0.5),
                       static_cast<Density>(d));
    }
  };
  add_bell(18000, 1500, 60000);
  add_bell(45000, 4000, 40000);
  const Density threshold = otsu_threshold(row(densities));
  CHECK(threshold > 18000 + 3 * 1500);
  CHECK(threshold < 45000 - 3 * 4000);
}

TEST_CASE("Otsu puts every voxel of the upper group at or above the threshold") {
  CHECK(rc::check("two values", [] {
    const auto low = *rc::gen::inRange(0, 65535 - 32);
    const auto high = *rc::gen::inRange(low + 32, 65536);  // not in the same bin of 16
    const auto share = *rc::gen::inRange<std::size_t>(1, 100);
    std::vector<Density> densities(100, static_cast<Density>(low));
    std::fill_n(densities.begin(), share, static_cast<Density>(high));
    const Density threshold = otsu_threshold(row(densities));
    RC_ASSERT(low < threshold);
    RC_ASSERT(threshold <= high);
  }));
}

TEST_CASE("Otsu of a uniform volume is the middle of the range") {
  CHECK(otsu_threshold(row({7, 7, 7})) == 32768);
}

TEST_CASE("the solid box is the tightest one, and empty when nothing is solid") {
  VolumeImage image = air({9, 8, 7});
  CHECK(solid_box(image, 1).empty());
  image.density[image.grid.index(2, 3, 4)] = 100;
  CHECK(solid_box(image, 100) == VoxelBox{{2, 3, 4}, {3, 4, 5}});
  CHECK(solid_box(image, 101).empty());
  image.density[image.grid.index(8, 0, 6)] = 200;
  CHECK(solid_box(image, 100) == VoxelBox{{2, 0, 4}, {9, 4, 7}});
}
