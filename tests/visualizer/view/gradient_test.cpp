// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/scene/gradient_plan.hpp"
#include "visualizer/scene/visualizer_error.hpp"

using namespace kerf;

namespace {

constexpr GradientFilter kAll[]{GradientFilter::central, GradientFilter::corners,
                                GradientFilter::farid5, GradientFilter::adaptive};
/// Those that are sums of their taps.
constexpr GradientFilter kLinear[]{GradientFilter::central, GradientFilter::corners,
                                   GradientFilter::farid5};

std::vector<Density> random_density(const VoxelGrid& grid) {
  return *rc::gen::container<std::vector<Density>>(grid.voxel_count(),
                                                   rc::gen::arbitrary<Density>());
}

/// As the taps say, voxel by voxel.
glm::dvec3 plain_gradient(GradientFilter kind, const VoxelGrid& grid,
                          const std::vector<Density>& density, VoxelIndex at) {
  const AxisTaps taps = GradientPlan(kind).voxel[0];
  glm::dvec3 sum(0.0);
  for (int z = -taps.reach; z <= taps.reach; ++z) {
    for (int y = -taps.reach; y <= taps.reach; ++y) {
      for (int x = -taps.reach; x <= taps.reach; ++x) {
        const VoxelIndex v{at.x + x, at.y + y, at.z + z};
        if (!grid.contains(v)) continue;
        const auto place = [](int i) { return static_cast<std::size_t>(AxisTaps::kMiddle + i); };
        const auto smooth = [&](int i) { return double{taps.smooth[place(i)]}; };
        const auto slope = [&](int i) { return double{taps.slope[place(i)]}; };
        sum += static_cast<double>(density[grid.index(v.x, v.y, v.z)]) *
               glm::dvec3(slope(x) * smooth(y) * smooth(z), smooth(x) * slope(y) * smooth(z),
                          smooth(x) * smooth(y) * slope(z));
      }
    }
  }
  return sum / (0.5 * taps.slope_sum * taps.smooth_sum * taps.smooth_sum * kDensityMax);
}

}  // namespace

TEST_CASE("every gradient of a linear field is that of the field, a step over two edges being 1") {
  const VoxelGrid grid{19, 18, 17};
  std::vector<Density> density;
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    density.push_back(static_cast<Density>(30000 + 1000 * x - 750 * y + 250 * z));
  });
  for (const GradientFilter kind : kAll) {
    std::vector<glm::vec3> gradients;
    fill_gradients(GradientPlan(kind), grid, density, {{7, 7, 7}, {12, 11, 10}}, gradients);
    for (const glm::vec3& g : gradients) {
      const glm::dvec3 off = glm::dvec3(g) - glm::dvec3(2000, -1500, 500) / kDensityMax;
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
    fill_gradients(GradientPlan(kind), grid, density, grid.box(), whole);
    const VoxelIndex lo{*rc::gen::inRange(0, grid.nx), *rc::gen::inRange(0, grid.ny),
                        *rc::gen::inRange(0, grid.nz)};
    const VoxelBox box = VoxelBox{lo, {lo.x + 3, lo.y + 2, lo.z + 4}}.clipped(grid.box());
    std::vector<glm::vec3> part;
    fill_gradients(GradientPlan(kind), grid, density, box, part);
    std::size_t at = 0;
    for_each_voxel(box, [&](int x, int y, int z) {
      RC_ASSERT(part[at] == whole[grid.index(x, y, z)]);
      if (kind != GradientFilter::adaptive) {
        const glm::dvec3 plain = plain_gradient(kind, grid, density, {x, y, z});
        RC_ASSERT(glm::length(glm::dvec3(part[at]) - plain) < 1e-6);
      }
      ++at;
    });
    RC_ASSERT(at == part.size());
  }));
}

TEST_CASE("a gradient depends on no voxel beyond its reach") {
  constexpr VoxelGrid kGrid{15, 15, 15};
  for (const GradientFilter kind : kLinear) {
    std::vector<Density> density(kGrid.voxel_count());
    density[kGrid.index(7, 7, 7)] = 60'000;
    std::vector<glm::vec3> gradients;
    fill_gradients(GradientPlan(kind), kGrid, density, kGrid.box(), gradients);
    VoxelBox reached;
    for (int i = 0; i < static_cast<int>(gradients.size()); ++i) {
      if (gradients[static_cast<std::size_t>(i)] == glm::vec3(0.0F)) continue;
      reached = reached.with({i % 15, i / 15 % 15, i / 225});
    }
    CHECK(reached == VoxelBox{{7, 7, 7}, {8, 8, 8}}.grown(GradientPlan(kind).voxel[0].reach));
  }
}

TEST_CASE("the adaptive gradient keeps an edge as sharp as farid5, and its length everywhere") {
  // A corner of a block: three edges of 90 degrees.
  constexpr VoxelGrid kGrid{40, 40, 40};
  std::vector<Density> density;
  for_each_voxel(kGrid.box(), [&](int x, int y, int z) {
    density.push_back(x < 20 && y < 20 && z < 20 ? 65'535 : 0);
  });
  std::vector<glm::vec3> narrow, adaptive;
  fill_gradients(GradientPlan(GradientFilter::farid5), kGrid, density, kGrid.box(), narrow);
  fill_gradients(GradientPlan(GradientFilter::adaptive), kGrid, density, kGrid.box(), adaptive);
  for (std::size_t i = 0; i < narrow.size(); ++i) {
    REQUIRE(glm::length(adaptive[i]) == doctest::Approx(glm::length(narrow[i])).epsilon(1e-4));
  }
  const auto angle = [&](VoxelIndex at) {
    const glm::vec3 a = glm::normalize(narrow[kGrid.index(at.x, at.y, at.z)]);
    const glm::vec3 b = glm::normalize(adaptive[kGrid.index(at.x, at.y, at.z)]);
    return std::acos(std::min(glm::dot(a, b), 1.0F)) * 57.2958F;
  };
  for (int y = 10; y < 20; ++y) CHECK(angle({19, y, 10}) < 12.0F);  // along a face to its edge
}

TEST_CASE("a gradient has a name, and an unknown one is refused") {
  for (const GradientFilter kind : kAll) {
    CHECK(gradient_named(kGradientNames[static_cast<std::size_t>(kind)]) == kind);
  }
  CHECK_THROWS_AS(static_cast<void>(gradient_named("sobel")), VisualizerError);
}
