// SPDX-License-Identifier: Apache-2.0
// Removed volume against the analytic volume of milled shapes, in each material.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <vector>

#include <doctest/doctest.h>

#include "controller/scene/scene_presets.hpp"
#include "controller/volume/phantom.hpp"
#include "shared/volume/material.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::removed_volume_test {

using namespace kerf::test;

namespace {

using Centre = std::array<double, 3>;

/// The default materials of the phantom's labels, and caries behind them as its scenes name it.
MaterialRule phantom_rule() {
  std::vector<double> isos;
  for (const Material& material : default_materials()) isos.push_back(material.iso);
  isos.resize(kLabelCaries);
  isos.push_back(0.47);
  return MaterialRule(isos);
}

/// The part of a voxel that lies in a ball, by 8^3 points in it; lengths in voxels.
double covered(const VoxelIndex& at, const Centre& centre, double radius) {
  constexpr int kPoints = 8;
  const double away = std::hypot(at.x - centre[0], at.y - centre[1], at.z - centre[2]);
  if (away > radius + 1) return 0;
  if (away < radius - 1) return 1;
  int inside = 0;
  for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
    const auto off = [](int k) { return (k + 0.5) / kPoints - 0.5; };
    const double x = at.x + off(i % kPoints) - centre[0];
    const double y = at.y + off(i / kPoints % kPoints) - centre[1];
    const double z = at.z + off(i / kPoints / kPoints) - centre[2];
    inside += x * x + y * y + z * z <= radius * radius ? 1 : 0;
  }
  return static_cast<double>(inside) / (kPoints * kPoints * kPoints);
}

/// Takes the covered part of each voxel away, in `passes` of which each takes a part of the rest.
std::vector<Density> milled(const std::vector<Density>& first, const VoxelGrid& grid,
                            const Centre& centre, double radius, int passes = 1) {
  std::vector<Density> now = first;
  std::size_t i = 0;
  for (const auto& [x, y, z] : voxels(grid)) {
    const double left = 1 - covered({x, y, z}, centre, radius);
    for (int pass = 0; pass < passes; ++pass) {
      now[i] = static_cast<Density>(std::lround(now[i] * std::pow(left, 1.0 / passes)));
    }
    ++i;
  }
  return now;
}

std::vector<double> gone_voxels(Density iso, const std::vector<Density>& first,
                                const std::vector<Density>& now, const std::vector<Label>& labels) {
  StepsByMaterial steps;
  add_removed(phantom_rule(), iso, first, now, labels, steps);
  std::vector<double> sums;
  for (const std::uint64_t step : steps) sums.push_back(static_cast<double>(step) / kDensityMax);
  return sums;
}

double sum_of(const std::vector<double>& voxels) {
  return std::accumulate(voxels.begin(), voxels.end(), 0.0);
}

double ball_volume(double radius) {
  return 4.0 / 3 * std::numbers::pi * radius * radius * radius;
}

constexpr Density kIso = 29490;  // 0.45, of the phantom's scenes

/// A voxel of the label so deep in it that a ball of `radius` voxels meets no other one, nor an
/// edge, which is two voxels wide.
VoxelIndex inside_of(const VolumeImage& image, Label label, int radius) {
  const auto fits = [&](const VoxelIndex& at) {
    const int reach = radius + 2;
    const VoxelGrid& grid = image.grid;
    if (at.x < reach || at.y < reach || at.z < reach || at.x + reach >= grid.nx ||
        at.y + reach >= grid.ny || at.z + reach >= grid.nz) {
      return false;
    }
    for (int z = -reach; z <= reach; ++z) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
          if (x * x + y * y + z * z > reach * reach) continue;
          if (image.labels[grid.index(at.x + x, at.y + y, at.z + z)] != label) return false;
        }
      }
    }
    return true;
  };
  for (const auto& [x, y, z] : voxels(image.grid)) {
    if (image.labels[image.grid.index(x, y, z)] == label && fits({x, y, z})) return {x, y, z};
  }
  FAIL("no room in label " << int(label));
  return {};
}

}  // namespace

TEST_CASE("the removed volume of a ball is its volume in each material of the phantom") {
  const VolumeImage image = make_phantom({.shape = kCariousMolar});
  constexpr int kRadius = 3;  // voxels of 0.125 mm
  for (const Label label : {kLabelEnamel, kLabelDentin, kLabelPulp, kLabelCaries}) {
    const VoxelIndex at = inside_of(image, label, kRadius);
    const Centre centre{at.x + 0.31, at.y - 0.17, at.z + 0.05};
    for (const int passes : {1, 7}) {
      const std::vector<Density> now =
          milled(image.density, image.grid, centre, kRadius - 0.4, passes);
      CAPTURE(int(label));
      CAPTURE(passes);
      const auto labelled = gone_voxels(kIso, image.density, now, image.labels);
      CHECK(labelled.at(label) == doctest::Approx(ball_volume(kRadius - 0.4)).epsilon(0.02));
      // Without labels pulp lies below the surface, and is none.
      const double bare = sum_of(gone_voxels(kIso, image.density, now, {}));
      const double solid = label == kLabelPulp ? 0 : ball_volume(kRadius - 0.4);
      CHECK(bare == doctest::Approx(solid).epsilon(0.02));
    }
  }
}

TEST_CASE("a ball through the surface of a solid counts the solid part, and tissue below nothing") {
  // Solid from z = 20 on, with an edge of one voxel that is half full; below it soft tissue.
  constexpr VoxelGrid kGrid{40, 40, 40};
  constexpr double kRadius = 9;
  for (const Density solid : {Density{65535}, Density{40632}}) {
    for (const Density tissue : {Density{0}, Density{12000}}) {
      std::vector<Density> first;
      for (const auto& [x, y, z] : voxels(kGrid)) {
        first.push_back(z > 20 ? solid : z < 20 ? tissue : static_cast<Density>(solid / 2));
      }
      const Centre centre{19.7, 20.1, 20};  // on the surface: half of the ball
      const std::vector<Density> now = milled(first, kGrid, centre, kRadius);
      const auto half = static_cast<Density>(solid / 2);
      const double all = sum_of(gone_voxels(half, first, now, {}));
      // The half full voxels of the surface are solid: half of them lies beyond.
      const double slice = std::numbers::pi * kRadius * kRadius;
      CAPTURE(solid);
      CAPTURE(tissue);
      CHECK(all == doctest::Approx(ball_volume(kRadius) / 2 + slice / 2).epsilon(0.02));
      const auto above = static_cast<Density>(half + 1);
      CHECK(sum_of(gone_voxels(above, first, now, {})) ==
            doctest::Approx(ball_volume(kRadius) / 2 - slice / 2).epsilon(0.02));
    }
  }
}

TEST_CASE("the part that is gone of a voxel has both ends") {
  CHECK(solid_gone(65535, 0, 1) == 65535);
  CHECK(solid_gone(65535, 65535, 1) == 0);
  CHECK(solid_gone(1, 0, 1) == 65535);
  CHECK(solid_gone(0, 0, 0) == 0);
  CHECK(solid_gone(30000, 15000, 30000) == 32768);  // a half, rounded
  CHECK(solid_gone(30000, 15000, 30001) == 0);
  CHECK(solid_gone(30000, 30001, 30000) == 0);  // it has more than at first
  CHECK(solid_gone(40632, 40631, 1) == 2);
}

}  // namespace kerf::removed_volume_test
