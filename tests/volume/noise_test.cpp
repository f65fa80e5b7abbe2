// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/volume/denoise.hpp"
#include "controller/volume/phantom.hpp"

using namespace kerf;

namespace {

constexpr Density kIso = 26214;  // half of what a ball is
constexpr double kSolid = 2.0 * kIso;

/// A ball of that radius in air, all noisy, with the edge of a scan or a ramp over two voxels.
struct Ball {
  double radius = 12;
  double noise = 0;  ///< deviation over kSolid
  bool ramp = false;
  double air = 0;  ///< density over kSolid

  [[nodiscard]] VoxelGrid grid() const {
    const auto side = static_cast<std::int32_t>(2 * radius + 10);
    return {side, side, side};
  }
  [[nodiscard]] std::vector<Density> density() const {
    const VoxelGrid box = grid();
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const double middle = box.nx / 2 + 0.3;
    std::vector<Density> values;
    for (std::int32_t z = 0; z < box.nz; ++z) {
      for (std::int32_t y = 0; y < box.ny; ++y) {
        for (std::int32_t x = 0; x < box.nx; ++x) {
          const double far = std::hypot(x - middle, y - middle, z - middle) - radius;
          const double share =
              ramp ? std::clamp(0.5 - far / 2, 0.0, 1.0) : 0.5 * std::erfc(far / std::sqrt(2));
          const double noisy = air + (1 - air) * share + noise * normal(random);
          values.push_back(
              static_cast<Density>(std::clamp(std::round(kSolid * noisy), 0.0, 65535.0)));
        }
      }
    }
    return values;
  }
};

Noise found_in(const Ball& ball) {
  return noise_of(ball.grid(), ball.density(), kIso);
}

}  // namespace

TEST_CASE(
    "the noise that was put in is found, in a plateau and where edges are most of what is solid") {
  for (const double radius : {10.0, 14.0, 20.0}) {
    for (const double noise : {0.005, 0.01, 0.02, 0.04}) {
      const Noise found = found_in({.radius = radius, .noise = noise});
      CAPTURE(radius);
      CAPTURE(noise);
      CAPTURE(found.share);
      CHECK(found.share == doctest::Approx(noise).scale(0).epsilon(0.08));
      CHECK(found.density ==
            doctest::Approx(found.share * kSolid / kDensityMax).scale(0).epsilon(0.02));
    }
  }
}

TEST_CASE("the surface's step begins at the volume's own air") {
  // The iso is no longer in the middle: at 0.3 of the way up, so that the step is 0.4 of full.
  const Noise found = found_in({.radius = 14, .noise = 0.01, .air = 0.3});
  CHECK(found.share == doctest::Approx(0.01 / (2 * (0.5 - 0.3))).scale(0).epsilon(0.08));
}

TEST_CASE("a clean volume has no noise to speak of: auto leaves its bits as they are") {
  for (const bool ramp : {false, true}) {
    for (const double radius : {4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 20.0}) {
      const Noise found = found_in({.radius = radius, .ramp = ramp});
      CAPTURE(radius);
      CAPTURE(ramp);
      CAPTURE(found.share);
      CHECK(passes_for(found) == 0);
      CHECK(found.share < 0.003);
    }
  }
  for (const VoxelGrid grid : {VoxelGrid{256, 256, 161},
                               {128, 128, 80},
                               {96, 96, 60},
                               {64, 64, 40},
                               {48, 48, 30},
                               {32, 32, 20},
                               {16, 16, 16}}) {
    const VolumeImage image = make_phantom({.grid = grid});
    const Noise found = noise_of(image.grid, image.density, 29491);  // as in its scene, 0.45
    CAPTURE(grid.nx);
    CAPTURE(found.share);
    CHECK(passes_for(found) == 0);
    if (grid.nx >= 128) CHECK(found.share < 0.0005);
  }
}

TEST_CASE("air and what is clipped say nothing of the noise of what is solid") {
  // A ball, clean, with three times as much noisy air beside it, or with noise that is clipped.
  const Ball ball{.radius = 14};
  const VoxelGrid part = ball.grid(), grid{4 * part.nx, part.ny, part.nz};
  const std::vector<Density> clean = ball.density();
  std::mt19937 random(3);
  std::vector<Density> noisy_air, clipped = clean;
  for (std::size_t row = 0; row < clean.size(); row += static_cast<std::size_t>(part.nx)) {
    noisy_air.insert(noisy_air.end(), &clean[row], &clean[row] + part.nx);
    for (int i = 0; i < 3 * part.nx; ++i) {
      noisy_air.push_back(static_cast<Density>(500 + random() % 8000));
    }
  }
  for (Density& d : clipped) {
    if (d > 45000) d = static_cast<Density>(65535 - random() % 2 * 6000);
  }
  CHECK(noise_of(grid, noisy_air, kIso).density < 0.002);
  CHECK(noise_of(part, clipped, kIso).density < 0.002);
}

TEST_CASE("steps of an 8-bit file are no noise") {
  std::vector<Density> density = Ball{.radius = 14}.density();
  for (Density& d : density) d = static_cast<Density>(d / 257 * 257);
  CHECK(passes_for(noise_of(Ball{.radius = 14}.grid(), density, kIso)) == 0);
}

TEST_CASE("few levels, few voxels and flat volumes have none that is told") {
  const Ball ball{.radius = 14, .noise = 0.05};
  std::vector<Density> density = ball.density();
  CHECK(passes_for(noise_of(ball.grid(), density, kIso)) == kMostPasses);
  CHECK(levels_of(density) == kLeastLevels);
  CHECK(noise_of(ball.grid(), density, 65535).share == 0);  // nothing is solid
  for (Density& d : density) d = static_cast<Density>(d / 4400 * 4400);
  CHECK(levels_of(density) < kLeastLevels);
  CHECK(noise_of(ball.grid(), density, kIso).share == 0);
  CHECK(levels_of({}) == 0);
  for (const VoxelGrid flat :
       {VoxelGrid{1, 1, 1}, {200, 200, 1}, {200, 200, 2}, {2, 200, 200}, {1, 200, 200}}) {
    std::vector<Density> values;
    std::mt19937 random(4);
    for (std::size_t i = 0; i < flat.voxel_count(); ++i)
      values.push_back(static_cast<Density>(30000 + random() % 9000));
    CHECK(noise_of(flat, values, kIso).share == 0);
  }
}

TEST_CASE(
    "the most noise for each count of passes is what the filter leaves of the contact's limits") {
  // White noise at a place between voxels, by the answer to one voxel: docs/theory.md 2.4.
  const VoxelGrid grid{43, 43, 43};
  std::vector<Density> answer(grid.voxel_count(), 20000);
  constexpr double kOne = 40000;
  answer[grid.index(21, 21, 21)] += static_cast<Density>(kOne);
  constexpr double kLimit = 0.9 * 0.03, kWorst = 1.8, kSlope = 0.3989;
  for (int passes = 1; passes < kMostPasses; ++passes) {
    denoise(grid, answer, 1);
    // Along each axis the mean square of a + t (b - a) over t is (a a + a b + b b) / 3.
    double square = 0;
    for (std::int32_t z = 12; z <= 31; ++z) {  // as far as two passes reach, from it or the border
      for (std::int32_t y = 12; y <= 31; ++y) {
        for (std::int32_t x = 12; x <= 31; ++x) {
          for (int a = 0; a < 8; ++a) {
            for (int b = 0; b < 8; ++b) {
              const auto value = [&](int k) {
                return (answer[grid.index(x - k % 2, y - k / 2 % 2, z - k / 4)] - 20000) / kOne;
              };
              double weight = 1;
              for (const int axis : {1, 2, 4})
                weight *= (a & axis) == (b & axis) ? 1.0 / 3 : 1.0 / 6;
              square += weight * value(a) * value(b);
            }
          }
        }
      }
    }
    const double most = kLimit * kSlope / (kWorst * std::sqrt(square));
    CAPTURE(passes);
    CAPTURE(std::sqrt(square));
    CAPTURE(most);
    CHECK(kMostNoise[static_cast<std::size_t>(passes)] ==
          doctest::Approx(most).scale(0).epsilon(0.01));
  }
  // Without a filter the tilt between two voxels is what meets its limit first.
  constexpr double kTilt = 0.9 * 1.8 * 3.14159265 / 180;
  CHECK(kMostNoise[0] == doctest::Approx(kTilt * kSlope / std::sqrt(2)).scale(0).epsilon(0.01));
}

TEST_CASE("passes grow with the noise, and end") {
  CHECK(passes_for({}) == 0);
  CHECK(passes_for({0.1, 0.008}) == 0);
  CHECK(passes_for({0, 0.0081}) == 1);
  CHECK(passes_for({0, 0.019}) == 2);
  CHECK(passes_for({0, 0.021}) == 3);
  CHECK(passes_for({0, 10}) == kMostPasses);
}

TEST_CASE("a label map has steps alone; a scan, the phantom, and what is even are none") {
  const VoxelGrid grid{30, 20, 20};
  std::vector<Density> labels;
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    labels.push_back(static_cast<Density>(i % 30 / 4 * 3 + i / 30 % 20 / 3));
  }
  CHECK(is_label_map(grid, labels));
  for (Density& d : labels) d = d > 9 ? 65535 : 0;
  CHECK(is_label_map(grid, labels));
  CHECK_FALSE(is_label_map(grid, std::vector<Density>(grid.voxel_count(), 7)));
  for (const Ball& ball : {Ball{}, Ball{.noise = 0.02}, Ball{.ramp = true}}) {
    CHECK_FALSE(is_label_map(ball.grid(), ball.density()));
  }
  const VolumeImage image = make_phantom({.grid = {64, 64, 40}});
  CHECK_FALSE(is_label_map(image.grid, image.density));
  const std::vector<Density> numbers(image.labels.begin(), image.labels.end());
  CHECK(is_label_map(image.grid, numbers));
}
