// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/surface_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/tool/tool_shapes.hpp"

using namespace kerf;

namespace {

using Samples = std::vector<std::array<double, 3>>;

SceneTool tool_of(const char* shape, double radius_mm, double length_mm) {
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
  const Samples samples = surface_samples(tool_of("ball", 8, 16), 1);
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
    const SceneTool tool = tool_of(c.shape, c.radius, c.length);
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
    const SceneTool tool = tool_of(shape, 5, 16);
    const Samples samples = surface_samples(tool, 1);
    CHECK(std::count(samples.begin(), samples.end(), std::array<double, 3>{0, -8, 0}) == 1);
  }
}

TEST_CASE("small tools get finer samples, large ones are refused in one line") {
  CHECK(surface_samples(tool_of("ball", 1, 2), 1).size() == kMinSurfaceSamples);
  CHECK(surface_samples(tool_of("cylinder", 0.5, 3), 1).size() ==
        doctest::Approx(512).epsilon(0.1));
  CHECK(surface_samples(tool_of("ball", 31.5, 63), 1).size() == 7981);
  const SceneTool large = tool_of("ball", 31.5, 63);
  CHECK_THROWS_WITH_AS(
      static_cast<void>(surface_samples(large, 0.5)),
      "tool 'tool': 31921 samples of its surface, of which contact reads at most 8000 in time; use "
      "a smaller tool or coarser voxels than 0.5 mm",
      LoadError);
}
