// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/gradient.hpp"

#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/scene/visualizer_error.hpp"

using namespace kerf;

namespace {

constexpr GradientFilter kAll[]{GradientFilter::central, GradientFilter::corners,
                                GradientFilter::farid5};

std::vector<Density> random_density(const VoxelGrid& grid) {
  return *rc::gen::container<std::vector<Density>>(grid.voxel_count(),
                                                   rc::gen::arbitrary<Density>());
}

/// As the taps say, voxel by voxel.
glm::dvec3 plain_gradient(GradientFilter kind, const VoxelGrid& grid,
                          const std::vector<Density>& density, VoxelIndex at) {
  const FilterTaps taps = gradient_taps(kind);
  glm::dvec3 sum(0.0);
  for (int z = 0; z < 5; ++z) {
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 5; ++x) {
        const VoxelIndex v{at.x + x - 2, at.y + y - 2, at.z + z - 2};
        if (!grid.contains(v)) continue;
        const auto smooth = [&](int i) { return double{taps.smooth[static_cast<std::size_t>(i)]}; };
        const auto slope = [&](int i) { return double{taps.slope[static_cast<std::size_t>(i)]}; };
        sum += static_cast<double>(density[grid.index(v.x, v.y, v.z)]) *
               glm::dvec3(slope(x) * smooth(y) * smooth(z), smooth(x) * slope(y) * smooth(z),
                          smooth(x) * smooth(y) * slope(z));
      }
    }
  }
  return sum / double{taps.divisor};
}

}  // namespace

TEST_CASE("every gradient of a linear field is that of the field, a step over two edges being 1") {
  const VoxelGrid grid{9, 8, 7};
  std::vector<Density> density;
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    density.push_back(static_cast<Density>(30000 + 2000 * x - 1500 * y + 500 * z));
  });
  for (const GradientFilter kind : kAll) {
    std::vector<glm::vec3> gradients;
    fill_gradients(kind, grid, density, {{2, 2, 2}, {7, 6, 5}}, gradients);
    for (const glm::vec3& g : gradients) {
      const glm::dvec3 off = glm::dvec3(g) - glm::dvec3(4000, -3000, 1000) / kDensityMax;
      CHECK(glm::length(off) < 1e-6);
    }
  }
}

TEST_CASE("a gradient is the sum of its taps, with air around, and has the same bits in any box") {
  CHECK(rc::check([] {
    const auto edge = rc::gen::inRange(1, 12);
    const VoxelGrid grid{*edge, *edge, *edge};
    const auto density = random_density(grid);
    const GradientFilter kind =
        *rc::gen::elementOf(std::vector<GradientFilter>(std::begin(kAll), std::end(kAll)));
    std::vector<glm::vec3> whole;
    fill_gradients(kind, grid, density, grid.box(), whole);
    const VoxelIndex lo{*rc::gen::inRange(0, grid.nx), *rc::gen::inRange(0, grid.ny),
                        *rc::gen::inRange(0, grid.nz)};
    const VoxelBox box = VoxelBox{lo, {lo.x + 3, lo.y + 2, lo.z + 4}}.clipped(grid.box());
    std::vector<glm::vec3> part;
    fill_gradients(kind, grid, density, box, part);
    std::size_t at = 0;
    for_each_voxel(box, [&](int x, int y, int z) {
      RC_ASSERT(part[at] == whole[grid.index(x, y, z)]);
      const glm::dvec3 plain = plain_gradient(kind, grid, density, {x, y, z});
      RC_ASSERT(glm::length(glm::dvec3(part[at]) - plain) < 1e-6);
      ++at;
    });
    RC_ASSERT(at == part.size());
  }));
}

TEST_CASE("a gradient depends on no voxel beyond its reach") {
  constexpr VoxelGrid kGrid{9, 9, 9};
  for (const GradientFilter kind : kAll) {
    std::vector<Density> density(kGrid.voxel_count());
    density[kGrid.index(4, 4, 4)] = 60'000;
    std::vector<glm::vec3> gradients;
    fill_gradients(kind, kGrid, density, kGrid.box(), gradients);
    VoxelBox reached;
    for (int i = 0; i < static_cast<int>(gradients.size()); ++i) {
      if (gradients[static_cast<std::size_t>(i)] == glm::vec3(0.0F)) continue;
      const VoxelIndex at{i % 9, i / 9 % 9, i / 81};
      reached = reached.united({at, {at.x + 1, at.y + 1, at.z + 1}});
    }
    CHECK(reached == VoxelBox{{4, 4, 4}, {5, 5, 5}}.grown(gradient_reach(kind)));
  }
}

TEST_CASE("a gradient has a name, and an unknown one is refused") {
  for (const GradientFilter kind : kAll) {
    CHECK(gradient_named(kGradientNames[static_cast<std::size_t>(kind)]) == kind);
  }
  CHECK_THROWS_AS(static_cast<void>(gradient_named("sobel")), VisualizerError);
}
