// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include <doctest/doctest.h>
#include <rapidcheck.h>

namespace {

using kerf::make_tool;
using kerf::SceneTool;
using kerf::ToolSize;
using std::numbers::pi;

/// Samples stand for one pitch^3 each.
double sampled_volume_mm3(const SceneTool& tool) {
  return static_cast<double>(tool.offsets.size()) * std::pow(tool.pitch_mm, 3);
}

/// Volume of the solid of revolution from the formula of each shape, independent of the profile.
double analytic_volume_mm3(const SceneTool& tool) {
  const double r = tool.radius_mm;
  const double l = tool.length_mm;
  if (tool.shape == "ball") return 4.0 / 3 * pi * r * r * r;
  if (tool.shape == "cylinder") return pi * r * r * l;
  if (tool.shape == "cone") return pi * r * r * l / 3;
  if (tool.shape == "inverted_cone") return pi * r * r * l * (1 + 0.6 + 0.36) / 3;
  // Ogive: 8/15 of 0.6 l; upper part: (1 - 1/3 + 1/20) of 0.4 l.
  if (tool.shape == "flame") return pi * r * r * l * (0.6 * 8 / 15 + 0.4 * (1 - 1.0 / 3 + 0.05));
  // Half of an ellipsoid: 2/3 of 0.3 l; the frustum above it.
  if (tool.shape == "pear") {
    return pi * r * r * l * (0.3 * 2 / 3 + 0.7 * (1 + 0.65 + 0.65 * 0.65) / 3);
  }
  const double rim = l / 2;  // wheel: Pappus for the half torus, and the disc inside of it
  const double core = r - rim;
  return pi * (core * core * l + core * pi * rim * rim + 4.0 / 3 * rim * rim * rim);
}

/// How far a place lies outside of a solid of revolution; 0 in it.
double outside_mm(const SceneTool& tool, double y_mm, double radius_mm) {
  if (radius_mm <= kerf::profile_radius_mm(tool, y_mm * (1 - 1e-12)) + 1e-4 * tool.radius_mm) {
    return 0;
  }
  double nearest_mm = std::numeric_limits<double>::max();
  for (const auto& [y, radius] : kerf::tool_profile(tool, 2000)) {
    const double across = std::max(0.0, radius_mm - radius);
    nearest_mm = std::min(nearest_mm, std::hypot(y - y_mm, across));
  }
  return nearest_mm;
}

}  // namespace

TEST_CASE("balls counted in voxels have the sample counts of the paper") {
  CHECK(make_tool("t", "ball", {.size_vox = 16}).offsets.size() == 2176);
  CHECK(make_tool("t", "ball", {.size_vox = 10}).offsets.size() == 552);
  CHECK(make_tool("t", "ball", {.size_vox = 1}).offsets.size() == 1);
}

TEST_CASE("a ball of five pitches of radius has 515 samples, whatever its pitch") {
  for (const double pitch_mm : {0.125, 0.1, 0.3, 0.007, 3.0}) {
    const SceneTool ball =
        make_tool("t", "ball", {.pitch_mm = pitch_mm, .radius_mm = 5 * pitch_mm});
    CHECK(ball.offsets.size() == 515);
    CHECK(ball.size_vox == std::array<std::int32_t, 3>{11, 11, 11});
  }
}

TEST_CASE("the samples of every shape fill its analytic volume") {
  for (const std::string_view shape : kerf::kToolShapes) {
    CAPTURE(shape);
    const SceneTool by_radius =
        make_tool("t", std::string(shape), {.pitch_mm = 0.05, .radius_mm = 0.62});
    CHECK(sampled_volume_mm3(by_radius) ==
          doctest::Approx(analytic_volume_mm3(by_radius)).epsilon(0.03));
    const SceneTool by_voxels = make_tool("t", std::string(shape), {.size_vox = 32});
    CHECK(sampled_volume_mm3(by_voxels) ==
          doctest::Approx(analytic_volume_mm3(by_voxels)).epsilon(0.03));
  }
}

TEST_CASE("every shape is symmetric about its axis and keeps its tip at the bottom") {
  for (const std::string_view shape : kerf::kToolShapes) {
    CAPTURE(shape);
    for (const ToolSize& size :
         {ToolSize{.pitch_mm = 0.1, .radius_mm = 0.83}, ToolSize{.size_vox = 14}}) {
      const SceneTool tool = make_tool("t", std::string(shape), size);
      const std::set<kerf::ToolOffset> samples(tool.offsets.begin(), tool.offsets.end());
      REQUIRE(samples.size() == tool.offsets.size());
      std::int64_t sum_y = 0;
      for (const auto& [x, y, z] : samples) {
        const auto mirrored = static_cast<std::int16_t>(-x);
        CHECK(samples.contains({mirrored, y, z}));
        CHECK(samples.contains({z, y, x}));
        sum_y += y;
      }
      if (shape == "cone" || shape == "flame") CHECK(sum_y > 0);  // heavier toward the shaft
      if (shape == "inverted_cone") CHECK(sum_y < 0);
      if (shape == "ball" || shape == "cylinder" || shape == "wheel") CHECK(sum_y == 0);
      CHECK(tool.round == (shape == "ball"));
    }
  }
}

TEST_CASE("the profile is closed, rises from tip to shaft and never leaves the radius") {
  for (const std::string_view shape : kerf::kToolShapes) {
    CAPTURE(shape);
    const SceneTool tool = make_tool("t", std::string(shape), {.pitch_mm = 0.1, .radius_mm = 1.2});
    const auto line = kerf::tool_profile(tool);
    CHECK(line.front() == std::array<double, 2>{-tool.length_mm / 2, 0.0});
    CHECK(line.back() == std::array<double, 2>{tool.length_mm / 2, 0.0});
    double widest = 0;
    double volume = 0;  // of the lathe of the line, by frusta
    for (std::size_t i = 1; i < line.size(); ++i) {
      const auto [y0, r0] = line[i - 1];
      const auto [y1, r1] = line[i];
      CHECK(y1 >= y0);
      widest = std::max(widest, r1);
      volume += pi * (y1 - y0) * (r0 * r0 + r0 * r1 + r1 * r1) / 3;
    }
    CHECK(widest <= 1.2);
    CHECK(widest == doctest::Approx(1.2).epsilon(0.01));
    CHECK(volume == doctest::Approx(analytic_volume_mm3(tool)).epsilon(0.01));
    CHECK(kerf::profile_radius_mm(tool, tool.length_mm / 2 + 1e-6) == 0.0);
    CHECK(kerf::profile_radius_mm(tool, -tool.length_mm / 2 - 1e-6) == 0.0);
    CHECK(kerf::profile_radius_mm(tool, std::numeric_limits<double>::quiet_NaN()) == 0.0);
  }
}

TEST_CASE("the wheel's rim is round: its edge recedes as a circle of half its thickness") {
  const SceneTool wheel =
      make_tool("t", "wheel", {.pitch_mm = 0.1, .radius_mm = 2.0, .length_mm = 1.0});
  for (const double y : {-0.4, -0.1, 0.0, 0.25, 0.5}) {
    CHECK(kerf::profile_radius_mm(wheel, y) == doctest::Approx(1.5 + std::sqrt(0.25 - y * y)));
  }
}

TEST_CASE("any size within the limits gives samples, inside the profile and within the limits") {
  CHECK(rc::check("sizes in mm and in voxels", [] {
    const std::string shape(*rc::gen::elementOf(
        std::vector<std::string_view>(kerf::kToolShapes.begin(), kerf::kToolShapes.end())));
    ToolSize size{.pitch_mm = *rc::gen::inRange(1, 400) / 1000.0};
    if (*rc::gen::arbitrary<bool>()) {
      size.size_vox = *rc::gen::inRange(1, 25);
    } else {
      size.radius_mm = *rc::gen::inRange(500, 12000) / 1000.0 * size.pitch_mm;
      if (shape != "ball" && *rc::gen::arbitrary<bool>()) {
        size.length_mm = *rc::gen::inRange(1, 2000) / 1000.0 * size.radius_mm;
      }
    }
    RC_PRE(kerf::tool_side_vox(shape, size) <= kerf::kMaxToolSide);
    const SceneTool tool = make_tool("t", shape, size);
    RC_ASSERT(!tool.offsets.empty());
    RC_ASSERT(tool.offsets.size() <= kerf::kMaxToolOffsets);
    for (const auto& [x, y, z] : tool.offsets) {
      const double half_mm = tool.pitch_mm / 2;
      // Half a pitch across each way, and three quarters along a head that is no whole pitches
      // long.
      RC_ASSERT(outside_mm(tool, y * half_mm, std::hypot(x * half_mm, z * half_mm)) <=
                std::hypot(0.5, 0.5, 0.75) * tool.pitch_mm * (1 + 1e-9));

      RC_ASSERT(std::abs(x) < tool.size_vox[0]);
      RC_ASSERT(std::abs(y) < tool.size_vox[1]);
      RC_ASSERT(std::abs(z) < tool.size_vox[2]);
    }
  }));
}

TEST_CASE("the largest tool has exactly the largest number of samples per side") {
  CHECK(kerf::tool_side_vox("cylinder", {.size_vox = 64}) == kerf::kMaxToolSide);
  CHECK(make_tool("t", "ball", {.size_vox = 64}).offsets.size() == 137376);
  CHECK(kerf::tool_side_vox("ball", {.pitch_mm = 0.1, .radius_mm = 1e6}) > kerf::kMaxToolSide);
}
