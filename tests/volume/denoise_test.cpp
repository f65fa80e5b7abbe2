// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/denoise.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include <doctest/doctest.h>

using namespace kerf;

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
    for (std::int32_t z = 0; z < wide.nz; ++z) {
      for (std::int32_t y = 0; y < wide.ny; ++y) {
        for (std::int32_t x = 0; x < wide.nx; ++x) {
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
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        density.push_back(static_cast<Density>(std::lround(at(x, y, z))));
      }
    }
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
    for (std::int32_t z = 4; z < 21; ++z) {
      for (std::int32_t y = 4; y < 21; ++y) {
        for (std::int32_t x = 4; x < 21; ++x) {
          const std::size_t i = grid.index(x, y, z);
          most = std::max(most, std::abs(smooth[i] - density[i]));
        }
      }
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
        for (std::int32_t z = 0; z < grid.nz; ++z) {
          for (std::int32_t y = 0; y < grid.ny; ++y) {
            for (std::int32_t x = 0; x < grid.nx; ++x) {
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
