// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_shapes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/tool/surface_samples.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/property.hpp"

namespace kerf::tool_shapes_test {

using namespace kerf::test;

namespace {

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
  if (radius_mm <= profile_radius_mm(tool, y_mm * (1 - 1e-12)) + 1e-4 * tool.radius_mm) {
    return 0;
  }
  double nearest_mm = std::numeric_limits<double>::max();
  for (const auto& [y, radius] : tool_profile(tool, 2000)) {
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
  for (const std::string_view shape : kToolShapes) {
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
  for (const std::string_view shape : kToolShapes) {
    CAPTURE(shape);
    for (const ToolSize& size :
         {ToolSize{.pitch_mm = 0.1, .radius_mm = 0.83}, ToolSize{.size_vox = 14}}) {
      const SceneTool tool = make_tool("t", std::string(shape), size);
      const std::set<ToolOffset> samples(tool.offsets.begin(), tool.offsets.end());
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
  for (const std::string_view shape : kToolShapes) {
    CAPTURE(shape);
    const SceneTool tool = make_tool("t", std::string(shape), {.pitch_mm = 0.1, .radius_mm = 1.2});
    const auto line = tool_profile(tool);
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
    CHECK(profile_radius_mm(tool, tool.length_mm / 2 + 1e-6) == 0.0);
    CHECK(profile_radius_mm(tool, -tool.length_mm / 2 - 1e-6) == 0.0);
    CHECK(profile_radius_mm(tool, std::numeric_limits<double>::quiet_NaN()) == 0.0);
  }
}

TEST_CASE("the wheel's rim is round: its edge recedes as a circle of half its thickness") {
  const SceneTool wheel =
      make_tool("t", "wheel", {.pitch_mm = 0.1, .radius_mm = 2.0, .length_mm = 1.0});
  for (const double y : {-0.4, -0.1, 0.0, 0.25, 0.5}) {
    CHECK(profile_radius_mm(wheel, y) == doctest::Approx(1.5 + std::sqrt(0.25 - y * y)));
  }
}

TEST_CASE("any size within the limits gives samples, inside the profile and within the limits") {
  CHECK(property([] {
    const std::string shape(kToolShapes[in_range<std::size_t>(0, kToolShapes.size())]);
    ToolSize size{.pitch_mm = in_range(1, 400) / 1000.0};
    if (any<bool>()) {
      size.size_vox = in_range(1, 25);
    } else {
      size.radius_mm = in_range(500, 12000) / 1000.0 * size.pitch_mm;
      if (shape != "ball" && any<bool>()) {
        size.length_mm = in_range(1, 2000) / 1000.0 * size.radius_mm;
      }
    }
    if (!(tool_side_vox(shape, size) <= kMaxToolSide)) discard();
    const SceneTool tool = make_tool("t", shape, size);
    HOLDS(!tool.offsets.empty());
    HOLDS(tool.offsets.size() <= kMaxToolOffsets);
    for (const auto& [x, y, z] : tool.offsets) {
      const double half_mm = tool.pitch_mm / 2;
      // Half a pitch across each way, and three quarters along a head that is no whole pitches
      // long.
      HOLDS(outside_mm(tool, y * half_mm, std::hypot(x * half_mm, z * half_mm)) <=
            std::hypot(0.5, 0.5, 0.75) * tool.pitch_mm * (1 + 1e-9));

      HOLDS(std::abs(x) < tool.size_vox[0]);
      HOLDS(std::abs(y) < tool.size_vox[1]);
      HOLDS(std::abs(z) < tool.size_vox[2]);
    }
  }));
}

TEST_CASE("the largest tool has exactly the largest number of samples per side") {
  CHECK(tool_side_vox("cylinder", {.size_vox = 64}) == kMaxToolSide);
  CHECK(make_tool("t", "ball", {.size_vox = 64}).offsets.size() == 137376);
  CHECK(tool_side_vox("ball", {.pitch_mm = 0.1, .radius_mm = 1e6}) > kMaxToolSide);
}

namespace {

SceneTool tool_of(const char* shape, double radius_mm, double length_mm, const ShaftSize& shaft) {
  SceneTool tool =
      make_tool("bur", shape, {.pitch_mm = 1, .radius_mm = radius_mm, .length_mm = length_mm});
  tool.shaft = tool_shaft(shaft, length_mm);
  return tool;
}

double area_of(const ToolPart& part) {
  double area = 0;
  for (std::size_t k = 1; k < part.profile.size(); ++k) {
    const auto &a = part.profile[k - 1], &b = part.profile[k];
    area += 3.14159265358979 * (a[1] + b[1]) * std::hypot(b[0] - a[0], b[1] - a[1]);
  }
  return area;
}

}  // namespace

TEST_CASE("a tool without a shaft has no part behind its head") {
  const SceneTool tool = tool_of("ball", 8, 16, {});
  CHECK(shaft_parts(tool).empty());
  CHECK(shaft_profile(tool).empty());
}

TEST_CASE("a shaft begins where the head becomes narrower than it, and counts from the tip") {
  struct Case {
    const char* shape;
    double radius, length, shaft, begins;
  };
  for (const Case& c : {Case{"ball", 10, 20, 6, 8},  // 6, 8, 10
                        {"ball", 10, 20, 12, 10},    // behind it all
                        {"cylinder", 6, 20, 4, 10},
                        {"cone", 6, 20, 6, 10},
                        {"inverted_cone", 10, 20, 8, 0},  // 0.8 is halfway to 0.6
                        {"wheel", 10, 6, 3, 3}}) {
    CAPTURE(std::string(c.shape));
    const auto parts =
        shaft_parts(tool_of(c.shape, c.radius, c.length, {.radius_mm = c.shaft, .length_mm = 60}));
    REQUIRE(parts.size() == 1);
    CHECK(parts[0].profile.front()[0] == doctest::Approx(c.begins).epsilon(0.001));
    CHECK(parts[0].profile.back()[0] == doctest::Approx(60 - c.length / 2));
    CHECK(parts[0].profile.back()[1] == 0);
    CHECK(parts[0].middle_mm == doctest::Approx((c.begins + 60 - c.length / 2) / 2).epsilon(0.001));
  }
}

TEST_CASE("behind a mesh the shaft has a face of its own") {
  SceneTool tool = tool_of("cylinder", 6, 20, {.radius_mm = 4, .length_mm = 60});
  tool.mesh.triangles.push_back({0, 1, 2});  // its shape is no longer known
  const auto parts = shaft_parts(tool);
  REQUIRE(parts.size() == 1);
  CHECK(parts[0].profile[0] == std::array<double, 2>{10, 0});
  CHECK(parts[0].profile[1] == std::array<double, 2>{10, 4});
}

TEST_CASE("samples of both parts lie on their surface, evenly, and none on what is hidden") {
  const SceneTool tool = tool_of(
      "ball", 8, 16,
      {.radius_mm = 4, .length_mm = 48, .handpiece_radius_mm = 20, .handpiece_length_mm = {}});
  const auto parts = shaft_parts(tool);
  REQUIRE(parts.size() == 2);
  CHECK(shaft_profile(tool).size() == 5);  // of two cylinders, the common corner once
  for (const ToolPart& part : parts) {
    CAPTURE(std::string(part.name));
    const PartSamples samples = part_samples(tool, part, 1);
    const double area = area_of(part);
    const double pitch = std::max(1.0, std::sqrt(area / kMostPartSamples));
    CHECK(double(samples.samples.size()) == doctest::Approx(area / pitch / pitch).epsilon(0.03));
    CHECK(double(samples.close.size()) == doctest::Approx(area / 0.35 / 0.35).epsilon(0.03));
    for (const auto& [x, y, z] : samples.samples) {
      const double out = std::hypot(x, z), up = y + part.middle_mm;
      const bool wall = part.name == std::string("shaft")
                            ? std::abs(out - 4) < 1e-9 && up > 6.9 && up < 40
                            : std::abs(out - 20) < 1e-9 && up > 40 && up < 60;
      const bool face = out > 4 && (std::abs(up - 40) < 1e-9 || std::abs(up - 60) < 1e-9);
      const bool back = std::abs(up - 60) < 1e-9;
      CHECK((wall || face || back));
    }
  }
}

TEST_CASE("a part that is too large or too long is refused in one line with its way out") {
  const auto error_of = [](const ShaftSize& shaft) {
    const SceneTool tool = tool_of("ball", 8, 16, shaft);
    try {
      for (const ToolPart& part : shaft_parts(tool)) static_cast<void>(part_samples(tool, part, 1));
    } catch (const LoadError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(error_of({.radius_mm = 8, .length_mm = 600}).empty());
  CHECK(has(error_of({.radius_mm = 8, .length_mm = 700}), "'bur': its shaft has a surface of "));
  CHECK(error_of({.radius_mm = 2, .length_mm = 1020}).empty());
  const std::string longest = error_of({.radius_mm = 2, .length_mm = 1040});
  CHECK(has(longest, "'bur': its shaft reaches "));
  CHECK(has(longest, "; make it shorter"));
  CHECK(longest.find('\n') == std::string::npos);
}

namespace {

using Samples = std::vector<std::array<double, 3>>;

SceneTool bare_tool(const char* shape, double radius_mm, double length_mm) {
  return make_tool("tool", shape, {.pitch_mm = 1, .radius_mm = radius_mm, .length_mm = length_mm});
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Distance of the nearest other sample: the least of all, and the largest.
std::array<double, 2> nearest_distances(const Samples& samples) {
  double least = 1e9, largest = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    double nearest = 1e9;
    for (std::size_t j = 0; j < samples.size(); ++j) {
      if (j != i) nearest = std::min(nearest, distance(samples[i], samples[j]));
    }
    least = std::min(least, nearest);
    largest = std::max(largest, nearest);
  }
  return {least, largest};
}

}  // namespace

TEST_CASE("a ball of 8 voxels has some 800 samples, all on its surface and evenly spaced") {
  const Samples samples = surface_samples(bare_tool("ball", 8, 16), 1);
  CHECK(samples.size() == 805);
  for (const auto& s : samples) CHECK(distance(s, {}) == doctest::Approx(8));
  const auto [least, largest] = nearest_distances(samples);
  CHECK(least > 0.8);
  CHECK(largest < 1.2);
  double middle[3] = {};
  for (const auto& s : samples) {
    for (std::size_t axis = 0; axis < 3; ++axis) middle[axis] += s[axis] / 805;
  }
  CHECK(std::hypot(middle[0], middle[1], middle[2]) < 0.01);
}

TEST_CASE("other shapes have samples on their profile, as many as the area asks") {
  struct Case {
    const char* shape;
    double radius, length;
  };
  for (const Case& c : {Case{"cylinder", 6, 20},
                        {"cone", 8, 24},
                        {"inverted_cone", 9, 12},
                        {"flame", 7, 30},
                        {"wheel", 10, 6}}) {
    CAPTURE(std::string(c.shape));
    const SceneTool tool = bare_tool(c.shape, c.radius, c.length);
    const Samples samples = surface_samples(tool, 1);
    double area = 0;
    const auto profile = tool_profile(tool, 2048);
    for (std::size_t k = 1; k < profile.size(); ++k) {
      area += 3.14159265358979 * (profile[k][1] + profile[k - 1][1]) *
              std::hypot(profile[k][0] - profile[k - 1][0], profile[k][1] - profile[k - 1][1]);
    }
    const double pitch = std::min(1.0, std::sqrt(area / kMinSurfaceSamples));
    CHECK(static_cast<double>(samples.size()) ==
          doctest::Approx(area / (pitch * pitch)).epsilon(0.02));
    const double end = tool.length_mm / 2;
    int on_ends = 0;
    for (const auto& s : samples) {
      const double radius = std::hypot(s[0], s[2]), allowed = profile_radius_mm(tool, s[1]);
      const bool on_end = std::abs(std::abs(s[1]) - end) < 1e-6;
      on_ends += on_end ? 1 : 0;
      CHECK((on_end ? radius <= allowed + 1e-6 : std::abs(radius - allowed) < 2e-3));
    }
    CHECK(on_ends >= 30);
    const auto [least, largest] = nearest_distances(samples);
    CHECK(least > 0.3 * pitch);
    CHECK(largest < 1.6 * pitch);
  }
}

TEST_CASE("a pointed tool has a sample at its tip") {
  for (const char* shape : {"cone", "flame"}) {
    const SceneTool tool = bare_tool(shape, 5, 16);
    const Samples samples = surface_samples(tool, 1);
    CHECK(std::count(samples.begin(), samples.end(), std::array<double, 3>{0, -8, 0}) == 1);
  }
}

TEST_CASE("small tools get finer samples, large ones are refused in one line") {
  CHECK(surface_samples(bare_tool("ball", 1, 2), 1).size() == kMinSurfaceSamples);
  CHECK(surface_samples(bare_tool("cylinder", 0.5, 3), 1).size() ==
        doctest::Approx(512).epsilon(0.1));
  CHECK(surface_samples(bare_tool("ball", 31.5, 63), 1).size() == 7981);
  const SceneTool large = bare_tool("ball", 31.5, 63);
  CHECK_THROWS_WITH_AS(
      static_cast<void>(surface_samples(large, 0.5)),
      "tool 'tool': 31921 samples of its surface, of which contact reads at most 8000 in time; use "
      "a smaller tool or coarser voxels than 0.5 mm",
      LoadError);
}

}  // namespace kerf::tool_shapes_test
