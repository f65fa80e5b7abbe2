// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/scene/gradient_plan.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::gradient_test {
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

TEST_CASE("every set of kernels gives the same gradients, bit by bit, in any voxels") {
  CHECK(rc::check([] {
    const VoxelGrid grid{*rc::gen::inRange(1, 45), *rc::gen::inRange(1, 20),
                         *rc::gen::inRange(1, 20)};
    const auto density = random_density(grid);
    const double thick = *rc::gen::element(1.0, 1.5, 2.0, 5.0);
    const GradientPlan plan(*rc::gen::elementOf(std::vector(std::begin(kAll), std::end(kAll))),
                            {1.0, 1.0, thick});
    GradientWork plain;
    plain.kernels = &kFilterScalar;
    std::vector<glm::vec3> wanted;
    fill_gradients(plan, grid, density, grid.box(), wanted, plain);
    for (const FilterKernels* const* set = filter_kernels(); *set != nullptr; ++set) {
      GradientWork work;
      work.kernels = *set;
      // As after other boxes: what was in the memory before means nothing.
      work.fields.assign(14, std::vector<float>(100'000, std::nanf("")));
      std::vector<glm::vec3> made;
      fill_gradients(plan, grid, density, grid.box(), made, work);
      RC_ASSERT(made.size() == wanted.size());
      RC_ASSERT(std::memcmp(made.data(), wanted.data(), made.size() * sizeof(made[0])) == 0);
    }
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

namespace {

/// A change of the voxels of a volume that `is` true for.
template <class Is>
ChangedBricks changed_where(const BrickGrid& bricks, const Is& is) {
  std::vector<Density> before(bricks.grid.voxel_count()), after;
  for_each_voxel(bricks.grid.box(),
                 [&](int x, int y, int z) { after.push_back(is(x, y, z) ? 1 : 0); });
  return changed_between(bricks, before, after);
}

std::size_t voxels_of(const VoxelBox& box) {
  const VoxelIndex n = box.extent();
  return VoxelGrid{n.x, n.y, n.z}.voxel_count();
}

}  // namespace

TEST_CASE("what is around a cut is filtered once, not once for each of its bricks") {
  const BrickGrid bricks = BrickGrid::of({96, 96, 96});
  const GradientPlan plan(GradientFilter::adaptive);
  const auto ball = [](int cx, int cy, int cz) {
    return [=](int x, int y, int z) {
      const glm::ivec3 off(2 * x - cx, 2 * y - cy, 2 * z - cz);  // in half edges
      return off.x * off.x + off.y * off.y + off.z * off.z < 16 * 16;
    };
  };
  // 16 voxels across, in 20 bricks.
  const auto one = changed_where(bricks, ball(83, 83, 83));
  CHECK(one.size() == 20);
  const auto around_one = plan.around(one, bricks);
  REQUIRE(around_one.size() == 1);
  CHECK(around_one[0] == plan.around(one.bounds(bricks)));
  CHECK(around_one[0].extent() == VoxelIndex{30, 30, 30});
  // Two tools, whose bricks take turns.
  const auto left = ball(31, 61, 61), right = ball(151, 61, 61);
  const auto two =
      changed_where(bricks, [&](int x, int y, int z) { return left(x, y, z) || right(x, y, z); });
  CHECK(plan.around(two, bricks).size() == 2);
  const auto all = changed_where(bricks, [](int, int, int) { return true; });
  for (const VoxelBox& box : plan.around(all, bricks)) CHECK(voxels_of(box) <= 64 * 64 * 64);
  CHECK(plan.around(ChangedBricks{}, bricks).empty());
}

TEST_CASE(
    "the boxes around a change hold all that it reaches, and no more than one for each brick") {
  CHECK(rc::check([] {
    const BrickGrid bricks = BrickGrid::of({*rc::gen::inRange(1, 40), 33, 25});
    const GradientPlan plan(*rc::gen::element(GradientFilter::central, GradientFilter::adaptive));
    const int every = *rc::gen::element(1, 7, 400, 3000);
    const int seed = *rc::gen::inRange(0, 1000);
    const auto changed = changed_where(bricks, [&](int x, int y, int z) {
      return (x * 7919 + y * 104'729 + z * 1299 + seed) % every == 0;
    });
    const auto boxes = plan.around(changed, bricks);
    std::size_t each = 0, together = 0;
    for (const VoxelBox& box : boxes) together += voxels_of(box);
    for (const ChangedBrick& brick : changed) {
      const VoxelBox reached =
          plan.around(ChangedBricks::bounds(brick, bricks)).clipped(bricks.grid.box());
      each += voxels_of(reached);
      RC_ASSERT(std::any_of(boxes.begin(), boxes.end(),
                            [&](const VoxelBox& box) { return box.united(reached) == box; }));
    }
    RC_ASSERT(together <= each);
  }));
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

TEST_CASE("a gradient shows a surface as deep as its plan says") {
  for (const GradientFilter kind : kAll) {
    for (const glm::dvec3& edges_mm : {glm::dvec3(0.2), glm::dvec3(0.1, 0.1, 0.3)}) {
      const GradientPlan plan(kind, edges_mm);
      if (kind != GradientFilter::adaptive && edges_mm.x != edges_mm.z) continue;
      CAPTURE(name_of(kind));
      CAPTURE(edges_mm.z);
      constexpr VoxelGrid kGrid{45, 45, 40};  // far from the air beside it
      // The mean over places of the surface between two voxels, which a picture shows.
      constexpr int kPlaces = 10;
      double deep_mm = 0.0;
      for (int place = 0; place < kPlaces; ++place) {
        const double surface = 20.0 + static_cast<double>(place) / kPlaces;  // solid beyond it
        std::vector<Density> density;
        for_each_voxel(kGrid.box(), [&](int, int, int z) {
          const double filled = std::clamp(z + 0.5 - surface, 0.0, 1.0);
          density.push_back(static_cast<Density>(filled * kDensityMax));
        });
        std::vector<glm::vec3> made;
        fill_gradients(plan, kGrid, density, {{22, 22, 0}, {23, 23, 40}}, made);
        std::size_t z = 20;
        while (glm::length(made[z + 1]) > kSurfaceSlope) ++z;
        const double here = glm::length(made[z]), next = glm::length(made[z + 1]);
        const double at = static_cast<double>(z) + (here - kSurfaceSlope) / (here - next);
        deep_mm += (at - surface) * edges_mm.z / kPlaces;
      }
      CHECK(deep_mm == doctest::Approx(plan.surface_mm).epsilon(0.1));
    }
  }
}

TEST_CASE("a gradient has a name, and an unknown one is refused") {
  for (const GradientFilter kind : kAll) {
    CHECK(gradient_named(kGradientNames[static_cast<std::size_t>(kind)]) == kind);
  }
  CHECK_THROWS_AS(static_cast<void>(gradient_named("sobel")), VisualizerError);
}

}  // namespace kerf::gradient_test
