// SPDX-License-Identifier: Apache-2.0
// Materials that are felt from densities of their own on: where a tool rests, and what a cut
// leaves.
#include <cmath>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/scene/scene_presets.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::soft_material_test {

using namespace kerf::extremes;

namespace {

constexpr Label kHard = 1, kSoft = 3;
constexpr double kSoftShare = 0.2;  // of full density, inside

std::vector<Material> materials() {
  std::vector<Material> table = default_materials();
  table[kSoft].felt_iso = kSoftShare / 2;
  table[kSoft].machinability = 1;
  return table;
}

/// A flat block under `face` of the y axis, hard for low x and soft for high x, labelled where it
/// is more than half there: each material's edge is over two voxels, and half of it bears no label.
VolumeImage hard_beside_soft(VoxelGrid grid, double face, double border) {
  VolumeImage image;
  image.grid = grid;
  const Body shape = blurred(grid, [&](Point p) { return p[1] - face; });
  for (std::size_t i = 0; i < shape.density.size(); ++i) {
    const double x = static_cast<double>(i % static_cast<std::size_t>(grid.nx));
    const bool soft = x > border;
    const double share = shape.density[i] * (soft ? kSoftShare : 1.0);
    image.density.push_back(static_cast<Density>(std::lround(share)));
    image.labels.push_back(shape.density[i] < kDensityMax / 2 ? Label{0} : soft ? kSoft : kHard);
  }
  return image;
}

}  // namespace

TEST_CASE_TEMPLATE("a ball rests at each material's own surface, and on their border", N,
                   FixedNumbers, DoubleNumbers) {
  constexpr double kFace = 18.3;
  VolumeImage image = hard_beside_soft({60, 40, 36}, kFace, 30);
  const auto rest = [&](double x) {
    const Body body{image.grid, image.density};
    const Point at{x, kFace + 8, 17.6};
    return rest_of<N>(tool_of_units("ball", 8, 16), body, at, {0, 1, 0})[1] - kFace - 8;
  };
  CHECK(std::abs(rest(15)) < 0.02);
  CHECK(rest(45) < -0.9);  // without a surface of its own the soft one bears nothing
  scale_to_felt_iso(materials(), kIso, image);
  for (const double x : {15.0, 29.0, 31.0, 45.0}) {
    CAPTURE(x);
    CHECK(std::abs(rest(x)) < 0.02);
  }
}

TEST_CASE("a soft material is cut, and felt after the cut, as a hard one of its shape") {
  const auto stroke = [](bool soft) {
    LoadedScene scene = test::half_space_scene(48);
    SceneVolume& volume = scene.volumes[0];
    volume.image.density = hard_beside_soft({48, 48, 48}, 23.5, soft ? -1 : 48).density;
    volume.image.labels = hard_beside_soft({48, 48, 48}, 23.5, soft ? -1 : 48).labels;
    scene.materials = materials();
    scale_to_felt_iso(scene.materials, volume.iso, volume.image);
    scene.force.model = ForceModel::proxy;
    scene.cut.model = CutModel::preston;
    scene.cut.machinability_mm3_per_s_n = 4;
    CuttingHand miller(std::move(scene));
    const ServoOutput out = miller.hold({0, 0.2, 0}, 0.3);
    return std::pair(miller.removed_mm3(), out);
  };
  const auto [hard_mm3, hard] = stroke(false);
  const auto [soft_mm3, soft] = stroke(true);
  CHECK(hard_mm3 > 0.1);
  CHECK(soft_mm3 == doctest::Approx(hard_mm3).epsilon(1e-3));
  CHECK(soft.press_n == doctest::Approx(hard.press_n).epsilon(1e-3));
  CHECK(soft.proxy_offset_mm[1] == doctest::Approx(hard.proxy_offset_mm[1]).epsilon(1e-3));
}

}  // namespace kerf::soft_material_test
