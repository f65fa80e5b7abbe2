// SPDX-License-Identifier: Apache-2.0
// Which of the materials around a tool a press cuts: those that bear it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/phantom.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::material_share_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

constexpr double kRadiusMm = 1, kTopMm = 1.5, kDownMm = -1;
constexpr Label kLow = kLabelEnamel, kHigh = kLabelDentin;  // of low x, of high x

/// A vertical bore as the tool leaves it, a quarter of a voxel wider than itself, in one material
/// for x below 0 and another one above. Edges are over two voxels.
LoadedScene bored_scene(const char* shape) {
  LoadedScene scene = half_space_scene(8);
  scene.volumes[0] = volume_of(48, kVoxelMm, [&](double x, double y, double z) {
    return std::max(kRadiusMm + kVoxelMm / 4 - std::hypot(x, z), y - kTopMm) / 2;
  });
  VolumeImage& image = scene.volumes[0].image;
  for (int i = 0; i < int(image.grid.voxel_count()); ++i) {
    image.labels.push_back(i % image.grid.nx < image.grid.nx / 2 ? kLow : kHigh);
  }
  scene.tools = {make_tool(shape, shape, {.pitch_mm = kVoxelMm, .size_vox = 16})};
  scene.tools[0].turns = false;  // upright in its bore
  scene.materials = default_materials();
  scene.materials[kLow].machinability = scene.materials[kHigh].machinability = 1;
  scene.cut.model = CutModel::preston;
  scene.cut.machinability_mm3_per_s_n = 2;
  return scene;
}

/// Steps of density that are gone since `before`: of one label, and of all others.
struct TakenOf {
  double of_label = 0, of_others = 0;
};
TakenOf removed_since(const std::vector<Density>& before, CuttingHand& miller,
                      const std::vector<Label>& labels, Label label) {
  TakenOf removed;
  const auto after = miller.servo().density(0);
  for (std::size_t i = 0; i < before.size(); ++i) {
    (labels[i] == label ? removed.of_label : removed.of_others) += before[i] - after[i];
  }
  return removed;
}

/// The fraction of what a press removes that is of high x.
double share_of_high(const LoadedScene& scene, const std::array<double, 3>& press_mm) {
  CuttingHand miller(scene, {0, kTopMm + 1.5, 0});
  for (double y = kTopMm + 1.5; y > kDownMm; y -= 0.01) static_cast<void>(miller.step({0, y, 0}));
  const auto density = miller.servo().density(0);
  const std::vector<Density> before(density.begin(), density.end());
  static_cast<void>(miller.hold(press_mm, 0.2));
  const TakenOf removed = removed_since(before, miller, scene.volumes[0].image.labels, kHigh);
  CHECK(removed.of_label + removed.of_others > 10 * kDensityMax);
  return removed.of_label / (removed.of_label + removed.of_others);
}

}  // namespace

TEST_CASE("a tool in its bore cuts the material that it presses on") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    for (const char* shape : {"ball", "cylinder"}) {
      LoadedScene scene = bored_scene(shape);
      scene.servo.numeric = numeric;
      const double left = share_of_high(scene, {-0.5, kDownMm, 0});
      const double right = 1 - share_of_high(scene, {0.5, kDownMm, 0});
      MESSAGE(std::string(shape), " of the other: ", left, " ", right);
      CHECK(left < 0.005);
      CHECK(right < 0.005);
    }
  }
}

TEST_CASE("two materials under one face share the press by what lies ahead in each") {
  for (const char* shape : {"ball", "cylinder"}) {
    CAPTURE(std::string(shape));
    LoadedScene scene = bored_scene(shape);
    scene.volumes[0].image.density = volume_of(48, kVoxelMm, [](double, double y, double) {
                                       return (y - kTopMm) / 2;
                                     }).image.density;
    const double bottom_mm = scene.tools[0].length_mm / 2;
    CuttingHand miller(scene, {0, kTopMm + bottom_mm + 0.3, 0});
    static_cast<void>(miller.hold({0, kTopMm + bottom_mm - 0.5, 0}, 0.3));
    const VolumeImage& image = scene.volumes[0].image;
    const TakenOf taken = removed_since(image.density, miller, image.labels, kHigh);
    CHECK(taken.of_label + taken.of_others > 10 * kDensityMax);
    CHECK(taken.of_label == doctest::Approx(taken.of_others).epsilon(0.1));
  }
}

namespace {

constexpr Density kSoft = 14000;  // of an iso of 32768

/// A cone upright above a hole of three quarters of its largest radius, full of `filling`.
LoadedScene filled_hole(Density filling, bool forbidden) {
  LoadedScene scene = bored_scene("cone");
  SceneVolume& volume = scene.volumes[0];
  VolumeImage& image = volume.image;
  const double corner_mm = volume.pose.position_mm[0];
  const auto at_mm = [&](int i) { return corner_mm + i * kVoxelMm; };
  for (int i = 0; i < int(image.grid.voxel_count()); ++i) {
    const int n = image.grid.nx;
    const double x = at_mm(i % n), y = at_mm(i / n % n), z = at_mm(i / n / n);
    const bool hole = std::hypot(x, z) < 0.75 * kRadiusMm;
    const auto at = static_cast<std::size_t>(i);
    image.labels[at] = hole ? kLabelPulp : kLow;
    image.density[at] = y > kTopMm ? Density{0} : hole ? filling : Density{65535};
  }
  scene.materials[kLabelPulp].forbidden = forbidden;
  return scene;
}

/// What presses of half a second take of either material, in voxels, and the least press.
struct Taken {
  double rim = 0, filling = 0, press_n = 10;
};
void press_into(LoadedScene scene, double x_mm, double z_mm, Taken& taken) {
  const std::vector<Label> labels = scene.volumes[0].image.labels;
  const std::vector<Density> before = scene.volumes[0].image.density;
  const double half_mm = scene.tools[0].length_mm / 2;
  CuttingHand miller(std::move(scene), {x_mm, kTopMm + half_mm + 0.5, z_mm});
  taken.press_n = std::min(taken.press_n, miller.hold({x_mm, kTopMm - half_mm, z_mm}, 0.5).press_n);
  const TakenOf gone = removed_since(before, miller, labels, kLabelPulp);
  taken.filling += gone.of_label / kDensityMax;
  taken.rim += gone.of_others / kDensityMax;
}

}  // namespace

TEST_CASE("a cone on its flank cuts the rim of a hole, whatever soft matter fills it") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    const auto press = [&](Density filling, bool forbidden) {
      // Beside the middle the cone has a side to lean on. In the middle it leans anywhere: what it
      // takes there differs by up to a sixth between places 0.06 mm apart.
      constexpr double kBesideMm = 0.3;
      Taken taken;
      for (const double angle : {0.4, 2.0, 3.5, 5.1}) {
        LoadedScene scene = filled_hole(filling, forbidden);
        scene.servo.numeric = numeric;
        press_into(std::move(scene), kBesideMm * std::cos(angle), kBesideMm * std::sin(angle),
                   taken);
      }
      return taken;
    };
    const Taken empty = press(0, true), forbidden = press(kSoft, true), soft = press(kSoft, false);
    MESSAGE("rim of an empty hole ", empty.rim, ", of one full of soft matter that may not be cut ",
            forbidden.rim, ", that may ", soft.rim, " and of that ", soft.filling);
    CHECK(empty.press_n > 0.1);
    CHECK(empty.rim > 10);
    // The soft matter bears nothing: the rim gets all of the press.
    CHECK(forbidden.rim == doctest::Approx(empty.rim).epsilon(0.05));
    CHECK(forbidden.filling == 0);
    CHECK(soft.rim == doctest::Approx(empty.rim).epsilon(0.05));
    CHECK(soft.filling > 1);
  }
}

namespace {

/// A flat at height 0 below `layers` voxels of soft matter that is never cut: it is forbidden, or
/// nothing machines it.
LoadedScene covered_flat(double share_of_iso, int layers, bool forbidden) {
  LoadedScene scene = half_space_scene(48);
  VolumeImage& image = scene.volumes[0].image;
  const auto soft = static_cast<Density>(share_of_iso * scene.volumes[0].iso);
  for (int i = 0; i < int(image.grid.voxel_count()); ++i) {
    const int above = i / image.grid.nx % image.grid.ny - image.grid.ny / 2;
    const auto at = static_cast<std::size_t>(i);
    image.labels.push_back(above >= layers ? Label{0} : above >= 0 ? kLabelPulp : kLow);
    image.density[at] = above >= layers ? Density{0} : above >= 0 ? soft : Density{65535};
  }
  scene.materials = default_materials();
  scene.materials[kLabelPulp].forbidden = forbidden;
  scene.materials[kLabelPulp].machinability = 0;
  scene.cut.model = CutModel::preston;
  return scene;
}

}  // namespace

TEST_CASE("soft matter that is never cut lets a press through to what bears it") {
  for (const int rate_hz : {250, 1000, 8000}) {
    const auto removed_mm3 = [&](double share_of_iso, int layers, NumericKind numeric,
                                 bool forbidden) {
      LoadedScene scene = covered_flat(share_of_iso, layers, forbidden);
      scene.servo.numeric = numeric;
      scene.servo.rate_hz = rate_hz;
      const std::vector<Label> labels = scene.volumes[0].image.labels;
      const std::vector<Density> before = scene.volumes[0].image.density;
      CuttingHand miller(std::move(scene), {0, 2, 0});
      miller.travel({0, -0.5, 0});
      static_cast<void>(miller.hold({0, -0.5, 0}, 0.5));
      CHECK(removed_since(before, miller, labels, kLabelPulp).of_label == 0);
      // What is fed while the tool reaches deeper, some 10 ms in 0.5 s, is not removed.
      CHECK(miller.removed_mm3() == doctest::Approx(miller.fed_mm3()).epsilon(0.02));
      return miller.removed_mm3();
    };
    const double bare_mm3 = removed_mm3(0, 0, NumericKind::fixed, true);
    CHECK(bare_mm3 > 0.02);
    for (const double share_of_iso : {0.3, 0.9, 0.97}) {
      for (const int layers : {1, 4}) {
        for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
          for (const bool forbidden : {true, false}) {
            CAPTURE(rate_hz);
            CAPTURE(share_of_iso);
            CAPTURE(layers);
            CAPTURE(static_cast<int>(numeric));
            CAPTURE(forbidden);
            CHECK(removed_mm3(share_of_iso, layers, numeric, forbidden) ==
                  doctest::Approx(bare_mm3).epsilon(0.05));
          }
        }
      }
    }
  }
}

TEST_CASE("matter that bears a press and may not be cut keeps what is below it") {
  for (const double share_of_iso : {1.02, 1.1, 1.9}) {
    CAPTURE(share_of_iso);
    CuttingHand miller(covered_flat(share_of_iso, 1, true), {0, 2, 0});
    miller.travel({0, -0.5, 0});
    const ServoOutput out = miller.hold({0, -0.5, 0}, 0.5);
    CHECK(out.press_n > 0.1);
    CHECK(out.forbidden);
    CHECK(miller.removed_mm3() == 0);
  }
}

}  // namespace kerf::material_share_test
