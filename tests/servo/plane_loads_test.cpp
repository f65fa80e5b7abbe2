// SPDX-License-Identifier: Apache-2.0
// What a device of six degrees of freedom needs: the load of each plane, and the moments of contact
// and cutting about the tool's centre.
#include <array>
#include <cmath>
#include <cstddef>

#include <doctest/doctest.h>

#include "shared/numeric/linear_algebra.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::plane_loads_test {

using namespace kerf::test;
using kerf::extremes::CuttingHand;
using vec3::cross, vec3::dot;

namespace {

using Point = std::array<double, 3>;

constexpr double kRadiusMm = 1;

Point sum_of(const Point& a, double by, const Point& b) {
  return {a[0] + by * b[0], a[1] + by * b[1], a[2] + by * b[2]};
}

/// A groove along z whose walls, a volume each, rise by 45 degrees on both sides of x = 0.
LoadedScene groove_scene(NumericKind numeric, double scale) {
  LoadedScene scene = half_space_scene(8);
  scene.volumes.clear();
  for (const double rises : {-1.0, 1.0}) {
    scene.volumes.push_back(volume_of(64, kVoxelMm, [&](double x, double y, double) {
      return (y - rises * x) / 2 / std::sqrt(2);
    }));
  }
  scene.servo.numeric = numeric;
  scene.device.workspace_scale = scale;
  scene.force.friction = 0;
  return scene;
}

}  // namespace

TEST_CASE("the planes' loads make the force, and their moments its torque") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const double scale : {1.0, 2.0}) {
      CAPTURE(static_cast<int>(numeric));
      CAPTURE(scale);
      LoadedScene scene = groove_scene(numeric, scale);
      ArmedServo armed(scene, {0, 4 / scale, 0}, 3);
      CHECK(armed.settled(0, 3 / scale, 0).plane_count == 0);
      const double bottom_mm = std::sqrt(2) * kRadiusMm;
      for (const double x_mm : {0.0, 0.1, -0.3, 0.4}) {
        CAPTURE(x_mm);
        const ServoOutput out = armed.settled(x_mm / scale, (bottom_mm - 0.5) / scale, 0);
        REQUIRE(out.plane_count == 2);
        Point force{}, torque{};
        for (std::size_t i = 0; i < out.plane_count; ++i) {
          const double load_n = out.planes[i].load_n;
          const Point normal = as_doubles(out.planes[i].normal);
          const Point lever_mm = as_doubles(out.planes[i].lever_mm);
          CHECK(length(normal) == doctest::Approx(1).epsilon(1e-4));
          CHECK(load_n > 0);
          CHECK(dot(lever_mm, normal) == doctest::Approx(-kRadiusMm / scale).epsilon(0.02));
          force = sum_of(force, load_n, normal);
          torque = sum_of(torque, load_n, cross(lever_mm, normal));
        }
        const double force_n = length(out.contact_force_n);
        CHECK(length(sum_of(force, -1, out.contact_force_n)) < 0.01 * force_n);
        CHECK(length(sum_of(torque, -1, out.tip_torque_n_mm)) < 0.01 * force_n);
      }
    }
  }
}

TEST_CASE("the friction of cutting turns the tool by its moment about the centre") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = half_space_scene(48);
    scene.servo.numeric = numeric;
    scene.cut.model = CutModel::preston;
    CuttingHand miller(scene);
    const ServoOutput out = miller.hold({0, 0.2, 0}, 0.1);
    REQUIRE(length(out.modification_n) > 0.05);
    REQUIRE(out.plane_count == 1);
    CHECK(out.planes[0].load_n == doctest::Approx(length(out.contact_force_n)).epsilon(0.02));
    // The ball rests on its lowest point.
    const Point moment = cross({0, -kRadiusMm, 0}, out.modification_n);
    CHECK(length(moment) > 0.05);
    CHECK(length(sum_of(moment, -1, out.tip_torque_n_mm)) < 0.1 * length(moment));
  }
}

}  // namespace kerf::plane_loads_test
