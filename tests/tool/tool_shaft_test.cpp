// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"

using namespace kerf;

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
  CHECK(error_of({.radius_mm = 8, .length_mm = 700}).find("'bur': its shaft has a surface of ") !=
        std::string::npos);
  CHECK(error_of({.radius_mm = 2, .length_mm = 1020}).empty());
  const std::string longest = error_of({.radius_mm = 2, .length_mm = 1040});
  CHECK(longest.find("'bur': its shaft reaches ") != std::string::npos);
  CHECK(longest.find("; make it shorter") != std::string::npos);
  CHECK(longest.find('\n') == std::string::npos);
}
