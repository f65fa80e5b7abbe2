// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/denoise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/volume/phantom.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::denoise_test {

using namespace kerf::test;

namespace {

/// One pass by its definition: (1 - B)^4 of the volume in air, with all 27 weights of B at once.
std::vector<Density> one_pass(const VoxelGrid& grid, const std::vector<Density>& density) {
  constexpr std::int32_t kAround = 4;
  const VoxelGrid wide{grid.nx + 2 * kAround, grid.ny + 2 * kAround, grid.nz + 2 * kAround};
  const auto place = [&](std::size_t entry) {
    const auto i = static_cast<std::int32_t>(entry);
    return wide.index(i % grid.nx + kAround, i / grid.nx % grid.ny + kAround,
                      i / grid.nx / grid.ny + kAround);
  };
  std::vector<std::int64_t> noise(wide.voxel_count());
  for (std::size_t i = 0; i < density.size(); ++i) noise[place(i)] = density[i] * 128;
  for (int stage = 0; stage < 4; ++stage) {
    const std::vector<std::int64_t> before = noise;
    for (const auto& [x, y, z] : voxels(wide)) {
      std::int64_t sum = 0;
      for (int k = 0; k < 27; ++k) {
        const VoxelIndex at{x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1};
        const int weight =
            (2 - std::abs(at.x - x)) * (2 - std::abs(at.y - y)) * (2 - std::abs(at.z - z));
        if (wide.contains(at)) sum += weight * before[wide.index(at.x, at.y, at.z)];
      }
      noise[wide.index(x, y, z)] -= (sum + 32) >> 6;
    }
  }
  std::vector<Density> smooth;
  for (std::size_t i = 0; i < density.size(); ++i) {
    const std::int64_t rest = density[i] - ((noise[place(i)] + 64) >> 7);
    smooth.push_back(static_cast<Density>(std::clamp<std::int64_t>(rest, 0, 65535)));
  }
  return smooth;
}

/// Density of every voxel from a function of its place.
template <class At>
std::vector<Density> made(const VoxelGrid& grid, At&& at) {
  std::vector<Density> density;
  for (const auto& [x, y, z] : voxels(grid)) {
    density.push_back(static_cast<Density>(std::lround(at(x, y, z))));
  }
  return density;
}

}  // namespace

TEST_CASE(
    "the filter is its definition, bit for bit, up to the border and in the thinnest volumes") {
  std::mt19937 random(1);
  for (const VoxelGrid grid : {VoxelGrid{1, 1, 1}, VoxelGrid{9, 1, 1}, VoxelGrid{1, 1, 7},
                               VoxelGrid{2, 3, 5}, VoxelGrid{13, 6, 4}, VoxelGrid{5, 17, 11}}) {
    for (int kind = 0; kind < 3; ++kind) {
      std::vector<Density> density(grid.voxel_count());
      for (Density& d : density) {
        d = kind == 0 ? static_cast<Density>(random())
                      : static_cast<Density>(kind == 1 ? random() % 2 * 65535 : 65535);
      }
      std::vector<Density> expected = density;
      for (int passes = 0; passes <= kMostPasses; ++passes) {
        std::vector<Density> found = density;
        denoise(grid, found, passes);
        CAPTURE(grid.nx);
        CAPTURE(grid.ny);
        CAPTURE(grid.nz);
        CAPTURE(kind);
        CAPTURE(passes);
        CHECK(found == expected);
        expected = one_pass(grid, expected);
      }
    }
  }
}

TEST_CASE("what stripes of 0 and 65535 leave at most still fits: no sum overflows") {
  // The sign of (1 - B)^4 at each voxel about the middle: no other volume leaves as much there.
  const VoxelGrid grid{9, 9, 9};
  for (int sign : {1, -1}) {
    std::vector<Density> density = made(
        grid, [](int x, int y, int z) { return x == 4 && y == 4 && z == 4 ? 40000.0 : 20000.0; });
    std::vector<Density> answer = density;
    denoise(grid, answer, 1);
    for (std::size_t i = 0; i < density.size(); ++i) {
      density[i] = (answer[i] > 20000) == (sign > 0) ? 65535 : 0;
    }
    std::vector<Density> found = density;
    denoise(grid, found, 1);
    CHECK(found == one_pass(grid, density));
  }
}

TEST_CASE("even density keeps its bits; ramps and bends up to the seventh power keep their place") {
  const VoxelGrid grid{25, 25, 25};
  for (const int power : {0, 1, 2, 3, 4, 5, 6, 7}) {
    const auto density = made(grid, [&](int x, int y, int z) {
      return 30000 + 20000 * std::pow((x - 12) / 12.0, power) -
             5000 * (y - 12) / 12.0 * (z - 12) / 12.0 * (power > 0 ? 1 : 0);
    });
    std::vector<Density> smooth = density;
    denoise(grid, smooth, 1);
    int most = 0;
    for (const auto& [x, y, z] : voxels(VoxelBox{{4, 4, 4}, {21, 21, 21}})) {
      const std::size_t i = grid.index(x, y, z);
      most = std::max(most, std::abs(smooth[i] - density[i]));
    }
    CAPTURE(power);
    CHECK(most <= (power == 0 ? 0 : 1));  // the densities themselves were rounded
  }
}

TEST_CASE(
    "a scan's edge of radius 6 moves by at most 0.02 voxels, convex and concave, anywhere on it") {
  constexpr double kRadius = 6, kFull = 60000;
  const VoxelGrid grid{28, 28, 28};
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<double> most(kMostPasses + 1);
  for (int place = 0; place < 100; ++place) {
    const double cx = 13 + share(random), cy = 13 + share(random), cz = 13 + share(random);
    const auto distance = [&](int x, int y, int z) {
      return std::sqrt((x - cx) * (x - cx) + (y - cy) * (y - cy) + (z - cz) * (z - cz)) - kRadius;
    };
    for (const double side : {1, -1}) {  // the solid inside, or outside
      auto density = made(grid, [&](int x, int y, int z) {
        return kFull / 2 * std::erfc(side * distance(x, y, z) / std::sqrt(2));
      });
      const std::vector<Density> before = density;
      for (int passes = 1; passes <= kMostPasses; ++passes) {
        denoise(grid, density, 1);
        for (const auto& [x, y, z] : voxels(grid)) {
          if (std::abs(distance(x, y, z)) > 0.01) continue;
          const std::size_t i = grid.index(x, y, z);
          constexpr double kSlope = 0.3989 * kFull;  // of a blur of one voxel, at its middle
          const double moved = (density[i] - before[i]) / kSlope;
          double& far = most[static_cast<std::size_t>(passes)];
          far = std::max(far, std::abs(moved));
        }
      }
    }
  }
  CHECK(most[1] < 0.008);
  CHECK(most[2] < 0.013);
  CHECK(most[3] < 0.017);
  CHECK(most[3] > 0.014);  // it is this filter
}

TEST_CASE("the sharp face of a block in air stays where it is") {
  const VoxelGrid grid{24, 24, 24};
  auto density = made(grid, [](int x, int y, int z) {
    return std::min({x, y, z}) >= 8 && std::max({x, y, z}) < 16 ? 50000.0 : 0.0;
  });
  denoise(grid, density, 1);
  const double inside = density[grid.index(15, 12, 12)], outside = density[grid.index(16, 12, 12)];
  CHECK(std::abs((inside - 25000) / (inside - outside) - 0.5) < 0.01);
}

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
    for (const auto& [x, y, z] : voxels(box)) {
      const double far = std::hypot(x - middle, y - middle, z - middle) - radius;
      const double share =
          ramp ? std::clamp(0.5 - far / 2, 0.0, 1.0) : 0.5 * std::erfc(far / std::sqrt(2));
      const double noisy = air + (1 - air) * share + noise * normal(random);
      values.push_back(static_cast<Density>(std::clamp(std::round(kSolid * noisy), 0.0, 65535.0)));
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

}  // namespace kerf::denoise_test
