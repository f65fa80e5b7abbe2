// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/load/loaded_scene.hpp"
#include "tests/scene/support.hpp"

namespace {

using kerf::Matrix3;
using kerf::Point3;

constexpr Matrix3 kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

kerf::SceneVolume volume_of(kerf::VoxelGrid grid, Point3 spacing_mm,
                            std::vector<kerf::Density> density, const Matrix3& orientation,
                            Point3 middle_mm) {
  kerf::SceneVolume volume;
  volume.name = "test";
  volume.image.grid = grid;
  volume.image.spacing_mm = spacing_mm;
  volume.image.density = std::move(density);
  volume.pose = kerf::place_volume(volume.image, orientation, middle_mm);
  return volume;
}

void check_near(const Point3& a, const Point3& b, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i) CHECK(std::abs(a[i] - b[i]) <= tolerance);
}

/// A unit quaternion with w >= 0 and no component near a sign change.
std::array<double, 4> any_quaternion() {
  std::array<double, 4> q{};
  double square = 0;
  for (double& component : q) {
    component = *rc::gen::inRange(-1000, 1001) / 1000.0;
    square += component * component;
  }
  RC_PRE(square > 0.01 && std::abs(q[3]) > 1e-3);
  const double scale = (q[3] < 0 ? -1 : 1) / std::sqrt(square);
  for (double& component : q) component *= scale;
  return q;
}

}  // namespace

TEST_CASE("a quaternion and its rotation matrix are the same rotation") {
  CHECK(rc::check("round trip", [] {
    const auto q = any_quaternion();
    const auto back = kerf::quaternion_of(kerf::rotation_of(q));
    for (std::size_t i = 0; i < 4; ++i) RC_ASSERT(std::abs(q[i] - back[i]) < 1e-9);
  }));
  // Half turns, where w is zero.
  CHECK(kerf::quaternion_of({1, 0, 0, 0, -1, 0, 0, 0, -1}) == std::array<double, 4>{1, 0, 0, 0});
  CHECK(kerf::quaternion_of({-1, 0, 0, 0, 1, 0, 0, 0, -1}) == std::array<double, 4>{0, 1, 0, 0});
  CHECK(kerf::quaternion_of({-1, 0, 0, 0, -1, 0, 0, 0, 1}) == std::array<double, 4>{0, 0, 1, 0});
}

TEST_CASE("a standing source has its z axis up and its y axis away from the user") {
  check_near(kerf::rotated(kerf::kSourceStanding, {1, 2, 3}), {1, 3, -2}, 0);
  const auto q = kerf::quaternion_of(kerf::kSourceStanding);
  CHECK(q[0] == doctest::Approx(-std::sqrt(0.5)));
  CHECK(q[3] == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE("the middle of the box comes to the wanted place, in any pose") {
  CHECK(rc::check("middle", [] {
    const Matrix3 rotation = kerf::rotation_of(any_quaternion());
    const auto volume =
        volume_of({5, 6, 7}, {0.5, 1, 2}, std::vector<kerf::Density>(210), rotation, {1, -2, 3});
    const kerf::WorldBox box = kerf::world_box(volume);
    const Point3 wanted = {1, -2, 3};
    for (std::size_t i = 0; i < 3; ++i) {
      RC_ASSERT(std::abs((box.lo_mm[i] + box.hi_mm[i]) / 2 - wanted[i]) < 1e-9);
      double reach = 0;
      const Point3 side = {2.5, 6, 14};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        reach += std::abs(rotation[3 * i + axis]) * side[axis];
      }
      RC_ASSERT(std::abs(box.hi_mm[i] - box.lo_mm[i] - reach) < 1e-9);
    }
  }));
}

TEST_CASE("the directions of the file come before the orientation of the scene") {
  kerf::VolumeImage image;
  image.grid = {3, 3, 3};
  image.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // its x axis is the source's y
  const kerf::Pose pose = kerf::place_volume(image, kerf::kSourceStanding, {0, 0, 0});
  check_near(kerf::rotated(kerf::rotation_of(pose.orientation), {1, 0, 0}), {0, 0, -1}, 1e-12);
}

TEST_CASE("a hand from above meets a slab where its density passes iso") {
  // Top face: density 1 at z = 5, 0 at z = 6; iso 0.25 is met three quarters of the way up.
  const kerf::VoxelGrid grid{9, 9, 12};
  auto volume =
      volume_of(grid, {0.5, 0.5, 0.2}, kerf::test::block(grid, {{0, 0, 2}, {9, 9, 6}}, 60000),
                kerf::kSourceStanding, {10, 0, -4});
  volume.iso = 15000;
  const double top_mm = (5.75 - 5.5) * 0.2;  // from the middle of the box
  check_near(kerf::first_surface_from_above(volume), {10, top_mm, -4}, 0.002);
}

TEST_CASE("where the middle is empty the nearest column is met, at its top") {
  // Two pillars: the nearer one is lower.
  const kerf::VoxelGrid grid{20, 20, 20};
  auto density = kerf::test::block(grid, {{13, 9, 2}, {14, 10, 6}}, 65535);
  const auto far = kerf::test::block(grid, {{1, 2, 2}, {3, 5, 18}}, 65535);
  for (std::size_t i = 0; i < density.size(); ++i) density[i] = std::max(density[i], far[i]);
  auto volume = volume_of(grid, {1, 1, 1}, density, kIdentity, {9.5, 9.5, 9.5});
  volume.iso = 32768;
  // Identity: y is up, so the pillar x = 13, y = 9, z = 2..5 has its top half a voxel above y = 9;
  // its voxel nearest to the middle is the one at z = 5.
  check_near(kerf::first_surface_from_above(volume), {13, 9.5, 5}, 0.01);
}

TEST_CASE("a lone voxel is found in any pose, and its surface is at iso") {
  CHECK(rc::check("lone voxel", [] {
    const kerf::VoxelGrid grid{9, 8, 7};
    const std::int32_t x = *rc::gen::inRange(1, 8), y = *rc::gen::inRange(1, 7),
                       z = *rc::gen::inRange(1, 6);
    auto volume = volume_of(grid, {1, 0.5, 2},
                            kerf::test::block(grid, {{x, y, z}, {x + 1, y + 1, z + 1}}, 40000),
                            kerf::rotation_of(any_quaternion()), {3, 2, 1});
    volume.iso = static_cast<kerf::Density>(*rc::gen::inRange(1, 40001));
    const Point3 hit = kerf::first_surface_from_above(volume);
    Point3 voxel =
        kerf::rotated(kerf::rotation_of(volume.pose.orientation), {x * 1.0, y * 0.5, z * 2.0});
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      voxel[i] += volume.pose.position_mm[i];
      square += (hit[i] - voxel[i]) * (hit[i] - voxel[i]);
    }
    RC_ASSERT(hit[1] >= voxel[1] - 2.3);  // within the cells around the voxel
    RC_ASSERT(std::sqrt(square) <= 2.3);
  }));
}

TEST_CASE("a volume without anything solid has no surface, and says so") {
  const kerf::VoxelGrid grid{4, 4, 4};
  const auto volume =
      volume_of(grid, {1, 1, 1}, std::vector<kerf::Density>(64, 100), kIdentity, {});
  const std::string error =
      kerf::test::error_of([&] { static_cast<void>(kerf::first_surface_from_above(volume)); });
  CHECK(error.find("no voxel reaches the iso density") != std::string::npos);
}
