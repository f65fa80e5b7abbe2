// SPDX-License-Identifier: Apache-2.0
// Where tools rest on bodies of known shape, and what they feel there. Edges over two voxels.
#include "controller/kernel/proxy/contact_query.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <string>

#include <doctest/doctest.h>

#include "tests/kernel/contact_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr double kRadius = 8;

/// A body that touches a ball at P when the ball rests `rest` beyond it along n; b is across n.
struct Solid {
  const char* name;
  double rest;
  double most;     ///< offset of the mean
  double degrees;  ///< of the normal
  std::function<double(const Point& n, const Point& b, const Point& from_p)> distance;
};

double plane(const Point& n, const Point& /*b*/, const Point& x) {
  return dot(n, x);
}
/// Radius below 0: a hollow.
auto sphere(double radius) {
  return [radius](const Point& n, const Point& /*b*/, const Point& x) {
    const double from_middle = length(x + radius * n);
    return radius > 0 ? from_middle - radius : -radius - from_middle;
  };
}
double crease(const Point& n, const Point& b, const Point& x) {
  return std::sqrt(0.5) * (dot(n, x) - std::abs(dot(b, x)));
}
auto rod(double radius) {
  return [radius](const Point& n, const Point& /*b*/, const Point& x) {
    const double up = dot(n, x);
    return std::max(length(x - up * n) - radius, up);
  };
}
double plate_on_edge(const Point& n, const Point& b, const Point& x) {
  return std::max(std::abs(dot(b, x)) - 1, dot(n, x));
}

struct Rest {
  double mean = 0, lowest = 9, highest = -9, worst_angle_deg = 0;
};

/// The ball of radius 8 in random places on a body turned at random.
template <class N>
Rest rest_on(const Solid& body_under, int places) {
  static const SceneTool ball = tool_of_units("ball", kRadius, 2 * kRadius);
  Dice dice(3);
  Rest found;
  for (int i = 0; i < places; ++i) {
    const Point n = dice.direction(), b = dice.across(n);
    const Point centre{13 + dice.uniform(0, 1), 13 + dice.uniform(0, 1), 13 + dice.uniform(0, 1)};
    const Point p = centre - body_under.rest * n;
    const TestVolume volume =
        blurred({28, 28, 28}, [&](const Point& x) { return body_under.distance(n, b, x - p); });
    QueryRig<N> rig(ball, volume);
    const double offset = rig.rest(centre, n);
    found.mean += offset / places;
    found.lowest = std::min(found.lowest, offset);
    found.highest = std::max(found.highest, offset);
    const Contacts<N> felt = rig.at(centre + offset * n);
    REQUIRE(felt.count == 1);
    found.worst_angle_deg =
        std::max(found.worst_angle_deg, degrees_between(normal_of(felt.plane[0]), n));
  }
  return found;
}

}  // namespace

TEST_CASE_TEMPLATE("a ball rests where its surface touches", N, FixedNumbers, DoubleNumbers) {
  // Trilinear densities place the iso-surface of a ball 1 / (6 R) too low: 0.028 for a radius of 6,
  // 0.012 for 14. The rest of the offset is the contact's.
  const std::array<Solid, 7> bodies{
      {{"plane", 8, 0.02, 0.4, plane},
       {"ball of 40", 8, 0.02, 0.4, sphere(40)},
       {"ball of 14", 8, 0.025, 0.4, sphere(14)},
       {"ball of 6", 8, 0.05, 0.5, sphere(6)},
       {"hollow of 40", 8, 0.02, 0.4, sphere(-40)},
       {"hollow of 14", 8, 0.02, 0.4, sphere(-14)},
       {"crease of 90 degrees", 8 * std::sqrt(2.0), 0.02, 0.9, crease}}};
  for (const Solid& body_under : bodies) {
    const Rest rest = rest_on<N>(body_under, 100);
    CAPTURE(std::string(body_under.name));
    CHECK(std::abs(rest.mean) < body_under.most);
    CHECK(rest.lowest > -0.06);
    CHECK(rest.highest < 0.02);
    CHECK(rest.worst_angle_deg < body_under.degrees);
  }
}

TEST_CASE_TEMPLATE("thin things hold a ball too", N, FixedNumbers, DoubleNumbers) {
  // What is thinner than the samples are apart lets the ball in by part of its edge.
  const Rest needle = rest_on<N>({"rod of 2", 8, 0, 0, rod(1)}, 40);
  CHECK(std::abs(needle.mean) < 0.1);
  CHECK(needle.lowest > -0.35);
  const Rest rod4 = rest_on<N>({"rod of 4", 8, 0, 0, rod(2)}, 40);
  CHECK(std::abs(rod4.mean) < 0.05);
  CHECK(rod4.lowest > -0.05);
  const Rest blade = rest_on<N>({"plate of 2 on edge", 8, 0, 0, plate_on_edge}, 40);
  CHECK(std::abs(blade.mean) < 0.05);
  CHECK(blade.lowest > -0.12);
}

TEST_CASE_TEMPLATE("sliding over a ball of 40 the height is steady and the normal true", N,
                   FixedNumbers, DoubleNumbers) {
  const SceneTool ball = tool_of_units("ball", kRadius, 2 * kRadius);
  Dice dice(5);
  for (int path = 0; path < 3; ++path) {
    const Point n = dice.direction(), along = dice.across(n);
    const Point middle = Point{15.2, 15.4, 15.7} - (40 + kRadius) * n;
    const TestVolume volume =
        blurred({32, 32, 32}, [&](const Point& x) { return length(x - middle) - 40; });
    QueryRig<N> rig(ball, volume);
    double sum = 0, squares = 0, worst_deg = 0;
    constexpr int kSteps = 60;
    for (int i = 0; i < kSteps; ++i) {
      const double angle = (i - kSteps / 2) * 0.08 / 48;
      const Point radial = std::cos(angle) * n + std::sin(angle) * along;
      const Point q = middle + 48 * radial;
      const double height = rig.rest(q, radial, 0.2);
      sum += height;
      squares += height * height;
      const Contacts<N> felt = rig.at(q + height * radial);
      worst_deg = std::max(worst_deg, degrees_between(normal_of(felt.plane[0]), radial));
    }
    const double mean = sum / kSteps;
    CHECK(std::sqrt(std::max(0.0, squares / kSteps - mean * mean)) < 0.003);
    CHECK(worst_deg < 0.4);
  }
}

TEST_CASE("fixed point feels what double feels, on noise as well") {
  const SceneTool tools[] = {tool_of_units("ball", kRadius, 2 * kRadius),
                             tool_of_units("cylinder", 5, 16)};
  Dice dice(7);
  for (const SceneTool& tool : tools) {
    double worst_height = 0, worst_deg = 0;
    for (int i = 0; i < 120; ++i) {
      const Point n = dice.direction();
      const double noise = i % 3 == 0 ? 0.02 : 0, rise = std::abs(n[1]);
      const double support = tool.round ? 8 : 8 * rise + 5 * std::sqrt(1 - rise * rise);
      const Point centre{15 + dice.uniform(0, 1), 15 + dice.uniform(0, 1), 15 + dice.uniform(0, 1)};
      const TestVolume volume = blurred({32, 32, 32}, [&](const Point& x) {
        return dot(n, x - centre) + support - 0.3 + dice.uniform(-noise, noise);
      });
      QueryRig<FixedNumbers> fixed(tool, volume);
      QueryRig<DoubleNumbers> real(tool, volume);
      const Contacts<FixedNumbers> a = fixed.at(centre);
      const Contacts<DoubleNumbers> b = real.at(centre);
      REQUIRE(a.count == b.count);
      REQUIRE(b.count == 1);
      // Depth is height over a slope of 1/2: half of its difference is that of the height.
      worst_height =
          std::max(worst_height, std::abs(double(a.plane[0].depth) - b.plane[0].depth) / 2);
      worst_deg =
          std::max(worst_deg, degrees_between(normal_of(a.plane[0]), normal_of(b.plane[0])));
    }
    CAPTURE(tool.shape);
    CHECK(worst_height < 5e-4);
    CHECK(worst_deg < 0.03);
  }
}

TEST_CASE_TEMPLATE("a turned cylinder rests on rim, side and face", N, FixedNumbers,
                   DoubleNumbers) {
  const SceneTool cylinder = tool_of_units("cylinder", 5, 16);
  Dice dice(3);
  double mean = 0;
  constexpr int kPlaces = 100;
  for (int i = 0; i < kPlaces; ++i) {
    const Point n = dice.direction();
    // The tool's axis anywhere, then along n, then across it.
    const Point axis = i % 4 == 0 ? n : i % 4 == 1 ? dice.across(n) : dice.direction();
    const double rise = std::abs(dot(n, axis));
    const double support = 8 * rise + 5 * std::sqrt(1 - std::min(1.0, rise * rise));
    const Point centre{15 + dice.uniform(0, 1), 15 + dice.uniform(0, 1), 15 + dice.uniform(0, 1)};
    const TestVolume volume =
        blurred({32, 32, 32}, [&](const Point& x) { return dot(n, x - centre) + support; });
    QueryRig<N> rig(cylinder, volume);
    rig.turn(turned_to(axis, dice));
    const double offset = rig.rest(centre, n);
    mean += offset / kPlaces;
    CHECK(std::abs(offset) < 0.075);
    const Contacts<N> felt = rig.at(centre + offset * n);
    REQUIRE(felt.count == 1);
    CHECK(degrees_between(normal_of(felt.plane[0]), n) < 0.6);
    // The arm leads to the contact: as deep along n as the tool reaches.
    const Point arm{double(felt.plane[0].arm.x), double(felt.plane[0].arm.y),
                    double(felt.plane[0].arm.z)};
    CHECK(dot(arm, n) == doctest::Approx(-support).epsilon(0.08));
  }
  CHECK(std::abs(mean) < 0.02);
}

TEST_CASE_TEMPLATE("every shape rests on planes whatever its pose", N, FixedNumbers,
                   DoubleNumbers) {
  struct Case {
    const char* shape;
    double radius, length;
  };
  for (const Case& c : {Case{"cone", 5, 16},
                        {"inverted_cone", 5, 10},
                        {"flame", 5, 16},
                        {"wheel", 8, 6},
                        {"cylinder", 1, 12}}) {
    const SceneTool tool = tool_of_units(c.shape, c.radius, c.length);
    const auto profile = tool_profile(tool, 512);
    Dice dice(11);
    double mean = 0;
    constexpr int kPlaces = 30;
    for (int i = 0; i < kPlaces; ++i) {
      const Point n = dice.direction(), axis = dice.direction();
      const double rise = dot(n, axis), across = std::sqrt(1 - rise * rise);
      double support = 0;
      for (const auto& [y, radius] : profile)
        support = std::max(support, radius * across - y * rise);
      const Point centre{14 + dice.uniform(0, 1), 14 + dice.uniform(0, 1), 14 + dice.uniform(0, 1)};
      const TestVolume volume =
          blurred({30, 30, 30}, [&](const Point& x) { return dot(n, x - centre) + support; });
      QueryRig<N> rig(tool, volume);
      rig.turn(turned_to(axis, dice));
      const double offset = rig.rest(centre, n);
      CAPTURE(std::string(c.shape));
      CHECK(std::abs(offset) < 0.075);
      mean += offset / kPlaces;
      const Contacts<N> felt = rig.at(centre + offset * n);
      REQUIRE(felt.count == 1);
      CHECK(degrees_between(normal_of(felt.plane[0]), n) < 0.6);
    }
    CAPTURE(std::string(c.shape));
    CHECK(std::abs(mean) < 0.04);
  }
}
