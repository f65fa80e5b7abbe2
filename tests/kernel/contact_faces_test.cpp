// SPDX-License-Identifier: Apache-2.0
// Tools that touch with a flat face: normal and place of the contact.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "lab/rig/geometry.hpp"
#include "lab/rig/tool_meshes.hpp"
#include "tests/kernel/contact_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr double kThin = 2;

/// A square plate, thin along an axis.
SceneTool blade(std::size_t axis) {
  std::vector<LooseTriangle> triangles = prism(11.3, kThin, 4);
  for (LooseTriangle& triangle : triangles) {
    for (auto& corner : triangle) std::swap(corner[1], corner[axis]);
  }
  return mesh_of_units("blade", triangles);
}

/// Axes of a tool whose face `sign` across `axis` looks along -up.
Axes facing(std::size_t axis, double sign, const Point& up, Dice& dice) {
  Point along[3];
  along[axis] = -sign * up;
  along[(axis + 1) % 3] = dice.across(up);
  along[(axis + 2) % 3] = cross(along[axis], along[(axis + 1) % 3]);
  return {along[0], along[1], along[2]};
}

}  // namespace

TEST_CASE_TEMPLATE("either face of a thin tool touches a bump where it is, with its normal", N,
                   FixedNumbers, DoubleNumbers) {
  constexpr double kBump = 40;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const SampledTool tool(blade(axis));
    for (const double sign : {-1.0, 1.0}) {
      Dice dice(3);
      const Point up = dice.direction(), top{20, 20, 20};
      const TestVolume bump =
          blurred({40, 40, 40}, [&](Point p) { return length(p - top + kBump * up) - kBump; });
      ContactRig<N> rig(tool, bump);
      const Axes axes = facing(axis, sign, up, dice);
      rig.field().turn(axes.turn<N>());
      double turned = 0, beside = 0;
      for (int i = 0; i < 60; ++i) {
        Point touching{};
        touching[axis] = sign * kThin / 2;
        touching[(axis + 1) % 3] = dice.uniform(-4, 4);
        touching[(axis + 2) % 3] = dice.uniform(-4, 4);
        const Point centre = top - axes.to_world(touching) + dice.uniform(-0.05, 0.05) * up;
        const Contacts<N> felt = rig.field().query(place_of<N>(centre));
        REQUIRE(felt.count == 1);
        turned = std::max(turned, degrees_between(normal_of(felt.plane[0]), up));
        beside = std::max(beside, length(axes.to_tool(point_of<N>(felt.plane[0].arm)) - touching));
      }
      CAPTURE(axis);
      CAPTURE(sign);
      CHECK(turned < 0.5);
      CHECK(beside < 0.3);
    }
  }
}

TEST_CASE_TEMPLATE("a face that lies on a flat is held in its middle, on noise too", N,
                   FixedNumbers, DoubleNumbers) {
  for (const SceneTool& block :
       {mesh_of_units("block", prism(11.3, 16, 4)), tool_of_units("cylinder", 8, 16)}) {
    const SampledTool tool(block);
    for (const double noise : {0.0, 0.02}) {
      Dice dice(3);
      const Point up = dice.direction(), top{30, 30, 30};
      const TestVolume flat = body_of({60, 60, 60}, [&](Point p) {
        return 0.5 - dot(p - top, up) / 2 + std::sqrt(3) * dice.uniform(-noise, noise);
      });
      ContactRig<N> rig(tool, flat);
      const Axes axes = facing(1, -1, up, dice);
      rig.field().turn(axes.turn<N>());
      double turned = 0, beside = 0, steps = 0;
      Point last{};
      for (int i = 0; i < 200; ++i) {
        const Contacts<N> felt = rig.field().query(place_of<N>(top + 8.0 * up + 0.01 * i * axes.x));
        REQUIRE(felt.count == 1);
        const Point arm = axes.to_tool(point_of<N>(felt.plane[0].arm));
        turned = std::max(turned, degrees_between(normal_of(felt.plane[0]), up));
        beside = std::max(beside, length(arm - Point{0, -8, 0}));
        if (i > 0) steps = std::max(steps, length(arm - last));
        last = arm;
      }
      CAPTURE(noise);
      CHECK(turned < (noise > 0 ? 0.5 : 0.2));
      CHECK(beside < (noise > 0 ? 0.3 : 0.1));
      CHECK(steps < 0.01);
    }
  }
}

TEST_CASE("no group of samples has its middle outside of the tool's reach") {
  // Levers beyond it would leave 31 bits on the way to places.
  for (double radius = 0.5; radius < 31; radius *= 1.007) {
    const SampledTool ball(tool_of_units("ball", radius, 2 * radius));
    const PointShellTable<FixedNumbers> tool(ball.samples, true);
    const PointTable<FixedNumbers> table = tool.point_shell().table;
    double farthest = 0;
    for (std::int32_t group = 0; group < table.groups; ++group) {
      farthest = std::max(farthest, std::hypot(table.middle[0][group], table.middle[1][group],
                                               table.middle[2][group]));
    }
    CAPTURE(radius);
    CHECK(farthest <= 32768 + 1);
  }
}
