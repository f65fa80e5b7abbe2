// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/render/volume_textures.hpp"

namespace kerf::voxel_texels_test {
namespace {

const GradientPlan kCorners(GradientFilter::corners);

const std::vector<MaterialView> kTwo{
    {"none", 0.0, {0, 0, 0}}, {"hard", 0.8, {1, 1, 1}}, {"soft", 0.2, {0, 0, 1}}};

}  // namespace

TEST_CASE(
    "the gradient of a linear field is the same everywhere inside, and right to half a step") {
  const VoxelGrid grid{9, 8, 7};
  std::vector<Density> density;
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    density.push_back(static_cast<Density>(30000 + 2000 * x - 1500 * y + 500 * z));
  });
  std::vector<GradientTexel> texels;
  fill_gradient_texels(kCorners, grid, density, {{1, 1, 1}, {8, 7, 6}}, texels);
  // A step over two edges counts as g = 1: 127 * 2 * 2000 / 65535 = 7.75, and so on.
  for (const GradientTexel& texel : texels) {
    CHECK(texel.x == 128 + 8);
    CHECK(texel.y == 128 - 6);
    CHECK(texel.z == 128 + 2);
  }
  CHECK(texels.front().density == doctest::Approx(31000 / 257.0).epsilon(0.01));
}

TEST_CASE("a box alone gives the texels that the whole volume gives there") {
  CHECK(rc::check([] {
    const auto edge = rc::gen::inRange(1, 12);
    const VoxelGrid grid{*edge, *edge, *edge};
    const auto density = *rc::gen::container<std::vector<Density>>(grid.voxel_count(),
                                                                   rc::gen::arbitrary<Density>());
    std::vector<GradientTexel> whole;
    fill_gradient_texels(kCorners, grid, density, grid.box(), whole);
    const VoxelIndex lo{*rc::gen::inRange(0, grid.nx), *rc::gen::inRange(0, grid.ny),
                        *rc::gen::inRange(0, grid.nz)};
    const VoxelBox box = VoxelBox{lo, {lo.x + 3, lo.y + 2, lo.z + 4}}.clipped(grid.box());
    std::vector<GradientTexel> part;
    fill_gradient_texels(kCorners, grid, density, box, part);
    std::size_t at = 0;
    for_each_voxel(
        box, [&](int x, int y, int z) { RC_ASSERT(part[at++] == whole[grid.index(x, y, z)]); });
    RC_ASSERT(at == part.size());
  }));
}

TEST_CASE("air is the air of the shell around a volume") {
  std::vector<GradientTexel> texels;
  const std::vector<Density> air(8, 0);
  fill_gradient_texels(kCorners, {2, 2, 2}, air, {{0, 0, 0}, {2, 2, 2}}, texels);
  for (const GradientTexel& texel : texels) CHECK(texel == kAirTexel);
}

TEST_CASE(
    "a label colours its voxel and the unlabelled border around, density what is far from any") {
  const VoxelGrid grid{20, 1, 1};
  std::vector<Label> labels(20, 0);
  labels[9] = 2;
  labels[10] = 1;
  const std::vector<Density> density(20, 60000);
  const Palette palette = make_palette(kTwo);
  const MaterialTexels materials(grid, labels, palette);
  const auto texels = materials.of_all(density);
  CHECK(texels[9] == MaterialTexel{0, 0, 255, 102});
  CHECK(texels[10].r == 255);
  CHECK(texels[7] == texels[9]);  // only that one is within reach
  CHECK(texels[8].r > 0);         // both are, the soft one nearer
  CHECK(texels[8].r < 128);
  CHECK(texels[8].b == 255);
  CHECK(texels[2] == texels[10]);  // dense, so the hard one
  const auto part = materials.of({{1, 0, 0}, {12, 1, 1}}, density);
  CHECK(part == std::vector<MaterialTexel>(texels.begin() + 1, texels.begin() + 12));
}

}  // namespace kerf::voxel_texels_test
