// SPDX-License-Identifier: Apache-2.0
// Where tools rest on bodies of known shape, and what they feel there. Edges over two voxels.
#include "controller/kernel/proxy/contact_query.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/point_shell/free_path.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "tests/case_count.hpp"
#include "tests/kernel/contact_support.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/rig/tool_meshes.hpp"

namespace kerf::contact_query_test {

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
  RandomNumbers random(3);
  Rest found;
  for (int i = 0; i < places; ++i) {
    const Point n = random.direction(), b = random.across(n);
    const Point centre{13 + random.uniform(0, 1), 13 + random.uniform(0, 1),
                       13 + random.uniform(0, 1)};
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
  RandomNumbers random(5);
  for (int path = 0; path < 3; ++path) {
    const Point n = random.direction(), along = random.across(n);
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
  RandomNumbers random(7);
  for (const SceneTool& tool : tools) {
    double worst_height = 0, worst_deg = 0;
    for (int i = 0; i < 120; ++i) {
      const Point n = random.direction();
      const double noise = i % 3 == 0 ? 0.02 : 0, rise = std::abs(n[1]);
      const double support = tool.round ? 8 : 8 * rise + 5 * std::sqrt(1 - rise * rise);
      const Point centre{15 + random.uniform(0, 1), 15 + random.uniform(0, 1),
                         15 + random.uniform(0, 1)};
      const TestVolume volume = blurred({32, 32, 32}, [&](const Point& x) {
        return dot(n, x - centre) + support - 0.3 + random.uniform(-noise, noise);
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
  RandomNumbers random(3);
  double mean = 0;
  constexpr int kPlaces = 100;
  for (int i = 0; i < kPlaces; ++i) {
    const Point n = random.direction();
    // The tool's axis anywhere, then along n, then across it.
    const Point axis = i % 4 == 0 ? n : i % 4 == 1 ? random.across(n) : random.direction();
    const double rise = std::abs(dot(n, axis));
    const double support = 8 * rise + 5 * std::sqrt(1 - std::min(1.0, rise * rise));
    const Point centre{15 + random.uniform(0, 1), 15 + random.uniform(0, 1),
                       15 + random.uniform(0, 1)};
    const TestVolume volume =
        blurred({32, 32, 32}, [&](const Point& x) { return dot(n, x - centre) + support; });
    QueryRig<N> rig(cylinder, volume);
    rig.orient(turned_to(axis, random));
    const double offset = rig.rest(centre, n);
    mean += offset / kPlaces;
    CHECK(std::abs(offset) < 0.075);
    const Contacts<N> felt = rig.at(centre + offset * n);
    REQUIRE(felt.count == 1);
    CHECK(degrees_between(normal_of(felt.plane[0]), n) < 0.6);
    // The lever leads to the contact: as deep along n as the tool reaches.
    const Point lever{double(felt.plane[0].lever.x), double(felt.plane[0].lever.y),
                      double(felt.plane[0].lever.z)};
    CHECK(dot(lever, n) == doctest::Approx(-support).epsilon(0.08));
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
    RandomNumbers random(11);
    double mean = 0;
    constexpr int kPlaces = 30;
    for (int i = 0; i < kPlaces; ++i) {
      const Point n = random.direction(), axis = random.direction();
      const double rise = dot(n, axis), across = std::sqrt(1 - rise * rise);
      double support = 0;
      for (const auto& [y, radius] : profile)
        support = std::max(support, radius * across - y * rise);
      const Point centre{14 + random.uniform(0, 1), 14 + random.uniform(0, 1),
                         14 + random.uniform(0, 1)};
      const TestVolume volume =
          blurred({30, 30, 30}, [&](const Point& x) { return dot(n, x - centre) + support; });
      QueryRig<N> rig(tool, volume);
      rig.orient(turned_to(axis, random));
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

// Tools that touch with a flat face: normal and place of the contact.

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
Axes facing(std::size_t axis, double sign, const Point& up, RandomNumbers& random) {
  Point along[3];
  along[axis] = -sign * up;
  along[(axis + 1) % 3] = random.across(up);
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
      RandomNumbers random(3);
      const Point up = random.direction(), top{20, 20, 20};
      const TestVolume bump =
          blurred({40, 40, 40}, [&](Point p) { return length(p - top + kBump * up) - kBump; });
      ContactRig<N> rig(tool, bump);
      const Axes axes = facing(axis, sign, up, random);
      rig.field().orient(axes.orientation<N>());
      double turned = 0, beside = 0;
      for (int i = 0; i < 60; ++i) {
        Point touching{};
        touching[axis] = sign * kThin / 2;
        touching[(axis + 1) % 3] = random.uniform(-4, 4);
        touching[(axis + 2) % 3] = random.uniform(-4, 4);
        const Point centre = top - axes.to_world(touching) + random.uniform(-0.05, 0.05) * up;
        const Contacts<N> felt = rig.field().query(place_of<N>(centre));
        REQUIRE(felt.count == 1);
        turned = std::max(turned, degrees_between(normal_of(felt.plane[0]), up));
        beside =
            std::max(beside, length(axes.to_tool(point_of<N>(felt.plane[0].lever)) - touching));
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
      RandomNumbers random(3);
      const Point up = random.direction(), top{30, 30, 30};
      const TestVolume flat = body_of({60, 60, 60}, [&](Point p) {
        return 0.5 - dot(p - top, up) / 2 + std::sqrt(3) * random.uniform(-noise, noise);
      });
      ContactRig<N> rig(tool, flat);
      const Axes axes = facing(1, -1, up, random);
      rig.field().orient(axes.orientation<N>());
      double turned = 0, beside = 0, steps = 0;
      Point last{};
      for (int i = 0; i < 200; ++i) {
        const Contacts<N> felt = rig.field().query(place_of<N>(top + 8.0 * up + 0.01 * i * axes.x));
        REQUIRE(felt.count == 1);
        const Point lever = axes.to_tool(point_of<N>(felt.plane[0].lever));
        turned = std::max(turned, degrees_between(normal_of(felt.plane[0]), up));
        beside = std::max(beside, length(lever - Point{0, -8, 0}));
        if (i > 0) steps = std::max(steps, length(lever - last));
        last = lever;
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

namespace {

constexpr VoxelGrid kGrid{50, 40, 45};

/// How far the sphere of `radius` about `p` is from where a voxel of `hot` is read: around it, but
/// for what is beyond the outermost voxels.
double gap(const std::vector<Point>& hot, const Point& p, double radius) {
  const double last[3] = {kGrid.nx - 1.0, kGrid.ny - 1.0, kGrid.nz - 1.0};
  double nearest = 1e9;
  for (const Point& v : hot) {
    Point out{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = std::max(v[axis] - 1, 0.0), high = std::min(v[axis] + 1, last[axis]);
      out[axis] = std::max({0.0, low - p[axis], p[axis] - high});
    }
    nearest = std::min(nearest, length(out));
  }
  return nearest - radius;
}

template <class N>
PointNumber<N> number(double x) {
  return static_cast<PointNumber<N>>(N::kIsFixed ? std::round(x * 65536) : x);
}

}  // namespace

TEST_CASE_TEMPLATE(
    "a sphere meets nothing on its free way, ends where something is, and looks as "
    "often as it enters bricks",
    N, FixedNumbers, DoubleNumbers) {
  RandomNumbers random(3);
  int whole = 0, none = 0, part = 0;
  for (int i = 0; i < cases(400); ++i) {
    std::vector<Density> density(kGrid.voxel_count(), 0);
    std::vector<Point> hot;
    for (int k = 0; k < i % 7 * 5; ++k) {
      const Point v{std::floor(random.uniform(0, 50)), std::floor(random.uniform(0, 40)),
                    std::floor(random.uniform(0, 45))};
      density[kGrid.index(int(v[0]), int(v[1]), int(v[2]))] = 9;
      hot.push_back(v);
    }
    const FreeBrickMap map(kGrid, density, 9);
    for (int k = 0; k < 10; ++k) {
      // Inside, outside, across; along an axis, not at all and far.
      const Point from{random.uniform(-20, 70), random.uniform(-20, 60), random.uniform(-20, 65)};
      Point move = (k == 0 ? 2000 : random.uniform(1, 90)) * random.direction();
      if (k == 1) move[0] = move[2] = 0;
      if (k == 2) move = {};
      const double radius = random.uniform(0, 6), size = std::max(1.0, length(move));
      const FreeSpaceMap bricks = map.bricks();
      const FreePath<N> way(bricks, {number<N>(move[0]), number<N>(move[1]), number<N>(move[2])},
                            number<N>(size + 0.001));
      const PointNumber<N> start[3] = {number<N>(from[0]), number<N>(from[1]), number<N>(from[2])};
      constexpr std::int64_t kMost = 10000;
      std::int64_t left = kMost;
      const auto all = kWholeMove<N>;
      const auto end = way.free_up_to(start, free_steps_for(radius + 0.001), 0, all, left);
      const double share = double(end) / double(all);
      CHECK(share <= 1);
      const double enters = (std::abs(move[0]) + std::abs(move[1]) + std::abs(move[2])) / 2 + 4;
      CHECK(double(kMost - left) <= enters);
      for (int at = 0; at <= 100; ++at) {
        const double found = gap(hot, from + at / 100.0 * share * move, radius);
        if (end > 0 && found < 0) REQUIRE(found >= 0);
      }
      // It stops for a brick, which is a box of two voxels, in steps of a quarter; a voxel at the
      // border is not read beyond it.
      const Point stop = from + share * move;
      const auto inside = [&](std::size_t axis, int n) {
        return stop[axis] >= 0 && stop[axis] <= n;
      };
      if (share < 1 && inside(0, 50) && inside(1, 40) && inside(2, 45)) {
        CHECK(gap(hot, stop, radius) < std::sqrt(12.0) + std::sqrt(3.0) + 0.26);
      }
      ++(share >= 1 ? whole : share <= 0 ? none : part);
      if (end <= 0) continue;
      // The same in two parts, and without enough looks.
      std::int64_t few = 1, more = kMost;
      const auto half = way.free_up_to(start, free_steps_for(radius + 0.001), 0, end / 2, more);
      CHECK(half == end / 2);
      CHECK(way.free_up_to(start, free_steps_for(radius + 0.001), 0, end, few) <= end);
      CHECK(few == 0);
    }
  }
  CHECK(whole > cases(400));
  CHECK(none > cases(400) / 40);
  CHECK(part > cases(400) / 8);
  const FreeSpaceMap unknown;
  std::int64_t left = 5;
  const FreePath<N> way(unknown, {number<N>(1), number<N>(1), number<N>(1)}, number<N>(2));
  CHECK(way.free_up_to({number<N>(5), number<N>(5), number<N>(5)}, 1, 0, kWholeMove<N>, left) == 0);
}

TEST_CASE_TEMPLATE("from outside no way is free for a sphere that the map cannot tell", N,
                   FixedNumbers, DoubleNumbers) {
  std::vector<Density> density(kGrid.voxel_count(), 0);
  density[kGrid.index(25, 20, 22)] = 9;
  const FreeBrickMap map(kGrid, density, 9);
  const FreeSpaceMap bricks = map.bricks();
  const FreePath<N> way(bricks, {number<N>(0), number<N>(0), number<N>(-10)}, number<N>(10.001));
  // 70 voxels above the volume: 92 from where the voxel is read.
  const PointNumber<N> start[3] = {number<N>(25), number<N>(20), number<N>(115)};
  for (const double radius : {40.0, 63.0, 64.0, 90.0, 91.9, 92.1, 200.0}) {
    CAPTURE(radius);
    std::int64_t left = 100;
    const auto free = way.free_up_to(start, free_steps_for(radius), 0, kWholeMove<N>, left);
    const double voxels = 10 * double(free) / double(kWholeMove<N>);
    CHECK(voxels <= std::max(0.0, 92 - radius));
    if (radius < 60) CHECK(voxels == doctest::Approx(10));
  }
}

}  // namespace kerf::contact_query_test
