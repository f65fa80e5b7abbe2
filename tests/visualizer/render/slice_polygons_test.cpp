// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>
#include <rapidcheck.h>

#include "visualizer/render/translucent_renderers.hpp"

using namespace kerf;

namespace {

BoxCorners rotated_bounds(double angle, glm::dvec3 axis, glm::dvec3 half_mm, double eye_mm) {
  const glm::dmat4 pose = glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, -eye_mm)),
                                      angle, glm::normalize(axis));
  BoxCorners corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec3 at((i & 1) != 0 ? half_mm.x : -half_mm.x,
                        (i & 2) != 0 ? half_mm.y : -half_mm.y,
                        (i & 4) != 0 ? half_mm.z : -half_mm.z);
    corners[i] = glm::dvec3(pose * glm::dvec4(at, 1.0));
  }
  return corners;
}

double area(const std::vector<glm::dvec2>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 a = polygon[i];
    const glm::dvec2 b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return 0.5 * twice;
}

}  // namespace

TEST_CASE("a box that faces the eye is cut in its rectangle, and not at all before and behind") {
  const BoxCorners box = rotated_bounds(0.0, {0, 0, 1}, {2, 3, 4}, 20.0);
  CHECK(cut_box(box, 20.0).size() == 4);
  CHECK(area(cut_box(box, 20.0)) == doctest::Approx(24.0));
  CHECK(cut_box(box, 15.9).empty());
  CHECK(cut_box(box, 24.1).empty());
}

TEST_CASE("a cube cut across its diagonal gives a hexagon") {
  const BoxCorners cube =
      rotated_bounds(std::acos(1.0 / std::sqrt(3.0)), {1, -1, 0}, {1, 1, 1}, 10.0);
  const auto hexagon = cut_box(cube, 10.0);
  CHECK(hexagon.size() == 6);
  CHECK(area(hexagon) == doctest::Approx(3.0 * std::sqrt(3.0)));  // edge sqrt(2)
}

TEST_CASE("the areas of all cuts add up to the volume of the box") {
  CHECK(rc::check([] {
    const auto number = rc::gen::inRange(1, 200);
    const glm::dvec3 half(*number * 0.02, *number * 0.02, *number * 0.02);
    const BoxCorners box = rotated_bounds(*number * 0.03, {*number, *number, *number}, half, 30.0);
    constexpr double kStep = 0.01;
    double sum = 0.0;
    for (double eye_mm = 20.0; eye_mm < 40.0; eye_mm += kStep) {
      sum += area(cut_box(box, eye_mm)) * kStep;
    }
    const double volume = 8.0 * half.x * half.y * half.z;
    RC_ASSERT(std::abs(sum - volume) < 0.02 * volume + 0.05);
  }));
}
