// SPDX-License-Identifier: Apache-2.0
// What a shaft may bear of a press: faces, edges and gaps in closed form.
#include <array>
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include "tests/rig/contact_rig.hpp"
#include "tests/rig/exact_contact.hpp"
#include "tests/rig/geometry.hpp"

namespace kerf::shaft_touch_test {

using namespace kerf::extremes;

namespace {

const VoxelGrid kGrid{80, 80, 64};
constexpr std::array<double, 9> kUpright{1, 0, 0, 0, 1, 0, 0, 0, 1};
/// A ball of radius 5 with a shaft of radius 3 up to 40 above its centre.
const SceneTool kTool = tool_with("ball", 5, 10, {.radius_mm = 3, .length_mm = 45});
constexpr Point kPlace{40, 28, 32};  ///< of its centre

/// The least share of the head, where a press is to be borne along `bears`.
template <class Distance>
double head_fraction(const Distance& distance, Point bears,
                     const std::array<double, 9>& rotation = kUpright) {
  SceneVolume volume;
  Body body = blurred(kGrid, distance);
  volume.image.grid = body.grid;
  volume.image.spacing_mm = {1, 1, 1};
  return ShaftTouch(volume, body.density)
      .least_head_share(kTool, kPlace, rotation, -1 * unit(bears));
}

constexpr double kNear = 0.03;  ///< ways are 1.5 degrees apart, so some part of 0.026 is unseen

}  // namespace

TEST_CASE("a wall beside a shaft bears the normal part of a press and nothing along it") {
  const auto wall = [](Point p) { return p[0] - 37; };  // the flank's at x = 37
  CHECK(head_fraction(wall, {1, 0, 0}) < kNear);
  CHECK(head_fraction(wall, {0, 1, 0}) > 1 - kNear);
  CHECK(head_fraction(wall, {-1, 0, 0}) == doctest::Approx(1));  // it pulls
  for (const double angle : {0.3, 0.8, 1.2}) {
    CHECK(std::abs(head_fraction(wall, {std::cos(angle), std::sin(angle), 0}) - std::sin(angle)) <
          kNear);
  }
  // Half a voxel off it bears nothing.
  CHECK(head_fraction([](Point p) { return p[0] - 36.4; }, {1, 0.5, 0}) > 0.6);
}

TEST_CASE("two walls bear what is between their normals") {
  const auto corner = [](Point p) { return std::min(p[0] - 37, p[2] - 29); };
  for (const double angle : {0.0, 0.4, 0.8, 1.2, std::numbers::pi / 2}) {
    CHECK(head_fraction(corner, {std::cos(angle), 0, std::sin(angle)}) < kNear);
  }
  CHECK(head_fraction(corner, {1, 1, 1}) == doctest::Approx(1 / std::sqrt(3.0)).epsilon(0.1));
}

TEST_CASE("an edge bears a press along the flank's normal, whatever its faces' are") {
  // The shaft leans to -x over the edge of a block at (30, 50), whose faces look to +x and +y.
  const double lean = 0.5;
  const std::array<double, 9> leaning{
      std::cos(lean), -std::sin(lean), 0, std::sin(lean), std::cos(lean), 0, 0, 0, 1};
  const Point flank{-std::cos(lean), -std::sin(lean), 0};  // the side towards the block
  // Trilinear density has its iso-surface some 0.2 below a sharp edge.
  const Point edge = kPlace + 2.8 * flank + 25 * Point{-std::sin(lean), std::cos(lean), 0};
  const auto block = [&](Point p) { return std::max(p[0] - edge[0], p[1] - edge[1]); };
  CHECK(head_fraction(block, -1 * flank, leaning) < kNear);
  // Along the shaft it slides.
  CHECK(head_fraction(block, {-std::sin(lean), std::cos(lean), 0}, leaning) > 1 - kNear);
}

TEST_CASE("a shaft in air bears nothing") {
  CHECK(head_fraction([](Point p) { return p[1] - 23; }, {0, 1, 0}) == 1);
}

}  // namespace kerf::shaft_touch_test
