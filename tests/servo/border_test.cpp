// SPDX-License-Identifier: Apache-2.0
// A solid that ends at its volume's border: felt and cut as if air lay outside.
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/crop_resample.hpp"
#include "tests/case_count.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::border_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

constexpr int kEdge = 48;
constexpr double kRadiusMm = 1;
/// The iso is half of full density, so the face is half a voxel outside of the last one's middle.
constexpr double kFaceMm = kVoxelMm * kEdge / 2.0;

/// A volume that is solid from border to border, as a scene with `crop = false` loads it, under a
/// tool that stands upright.
LoadedScene block_scene(const char* shape, NumericKind numeric, int rate_hz) {
  LoadedScene scene = half_space_scene(8);
  SceneVolume& volume = scene.volumes[0];
  volume = volume_of(kEdge, kVoxelMm, [](double, double, double) { return -1.0; });
  volume.image.origin_mm = volume.pose.position_mm;
  volume.image = enclosed_in_air(std::move(volume.image), volume.iso);
  REQUIRE(volume.image.grid.nx == kEdge + 2);
  volume.pose.position_mm = volume.image.origin_mm;
  scene.tools = {make_tool(shape, shape, {.pitch_mm = kVoxelMm, .size_vox = 16})};
  scene.tools[0].turns = false;
  scene.servo.numeric = numeric;
  scene.servo.rate_hz = rate_hz;
  return scene;
}

constexpr double kAboveMm = kFaceMm + kRadiusMm + 0.3;
constexpr double kPressMm = kFaceMm + kRadiusMm - 1;  ///< some 0.4 N

/// Down on the face within 50 ms, and held there.
ServoOutput press(CuttingHand& hand, int rate_hz, double seconds) {
  const int ticks = rate_hz / 20;
  for (int i = 1; i <= ticks; ++i) {
    static_cast<void>(hand.step({0, kAboveMm + (kPressMm - kAboveMm) * i / ticks, 0}));
  }
  return hand.hold({0, kPressMm, 0}, seconds);
}

double proxy_mm(const ServoOutput& out, std::size_t axis) {
  return out.position_mm[axis] + out.proxy_offset_mm[axis];
}

}  // namespace

TEST_CASE("on a solid that ends at the volume's border a tool rests, slides and cuts") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const int rate_hz : kinds({1000, 250, 8000})) {
      for (const char* shape : {"ball", "cylinder", "cone", "wheel"}) {
        CAPTURE(static_cast<int>(numeric));
        CAPTURE(rate_hz);
        CAPTURE(std::string(shape));
        LoadedScene scene = block_scene(shape, numeric, rate_hz);
        CuttingHand hand(scene, {0, kAboveMm, 0});
        const double bottom_mm = scene.tools[0].round ? kRadiusMm : 0;
        const ServoOutput rests = press(hand, rate_hz, 0.1);
        CHECK(length(rests.commanded_force_n) > 0.1);
        if (bottom_mm > 0) {
          CHECK(std::abs(proxy_mm(rests, 1) - kFaceMm - bottom_mm) < 0.1 * kVoxelMm);
        }
        ServoOutput slid = rests;
        const int ticks = rate_hz / 10;
        for (int i = 1; i <= ticks; ++i) slid = hand.step({double(i) / ticks, kPressMm, 0});
        const double went_mm = slid.position_mm[0] - rests.position_mm[0];
        REQUIRE(went_mm > 0.9);
        CHECK(proxy_mm(slid, 0) - proxy_mm(rests, 0) == doctest::Approx(went_mm).epsilon(0.02));

        scene.cut.model = CutModel::preston;
        scene.cut.machinability_mm3_per_s_n = 4;
        CuttingHand cuts(scene, {0, kAboveMm, 0});
        const ServoOutput cut = press(cuts, rate_hz, 0.5);
        CHECK(cuts.removed_mm3() > 0.1);
        // What a tick is fed it removes, or the next one.
        const double tick_mm3 =
            scene.cut.machinability_mm3_per_s_n * length(cut.commanded_force_n) / rate_hz;
        const double left_mm3 = cuts.fed_mm3() - cuts.removed_mm3();
        CHECK(left_mm3 > -0.01 * tick_mm3);
        CHECK(left_mm3 < tick_mm3);
      }
    }
  }
}

}  // namespace kerf::border_test
