// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/proxy/constraint_set.hpp"

#include <doctest/doctest.h>

#include "tests/rig/geometry.hpp"

namespace kerf::constraint_set_test {

using namespace kerf::extremes;

namespace {

template <class N>
constexpr double kStep = N::kIsFixed                     ? 0x1p-16
                         : sizeof(typename N::Real) == 4 ? 1e-5
                                                         : 1e-9;

/// One to three planes, no two closer than 15 degrees, that leave room at some place near.
template <class N>
ConstraintSet<N> random_constraints(RandomNumbers& random) {
  ConstraintSet<N> constraints;
  const auto wanted = static_cast<std::size_t>(random.uniform(1, 4));
  const Point room = random.uniform(0, 0.5) * random.direction();
  while (constraints.count < wanted) {
    const Point normal = random.direction();
    const double depth = dot(normal, room) - random.uniform(0, 0.3);
    const ConstraintPlane<N> plane{normal_of<N>(normal), typename N::Real(depth), {}};
    if (!has_plane_like(constraints, plane)) constraints.plane[constraints.count++] = plane;
  }
  return constraints;
}

/// Dykstra's projections: slow, and in no way like the closed form.
template <class N>
Point projected(const ConstraintSet<N>& planes, Point displacement) {
  std::array<Point, kMaxPlanes> correction{};
  Point x = displacement;
  for (int round = 0; round < 20'000; ++round) {
    for (std::size_t i = 0; i < planes.count; ++i) {
      const auto& n = planes.plane[i].normal;
      const Point normal{double(n.x), double(n.y), double(n.z)};
      const Point from = x + correction[i];
      const double lack = double(planes.plane[i].depth) - dot(normal, from);
      x = lack > 0 ? from + lack * normal : from;
      correction[i] = from - x;
    }
  }
  return x;
}

template <class N>
ConstraintPlane<N> plane(Point normal, double depth) {
  return {normal_of<N>(unit(normal)), typename N::Real(depth), {}};
}

template <class N>
Contacts<N> felt(ConstraintPlane<N> one) {
  Contacts<N> found;
  found.depth = one.depth;
  found.count = 1;
  found.plane[0] = one;
  return found;
}

}  // namespace

TEST_CASE_TEMPLATE("a slide ends at the nearest place that its planes allow", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(1);
  int checked = 0;
  for (int i = 0; i < 300; ++i) {
    const auto constraints = random_constraints<N>(random);
    const Point displacement = random.uniform(0, 3) * random.direction();
    const ConstrainedMove<N> slide = constrained_move(constraints, place_of<N>(displacement));
    const Point truth = projected(constraints, displacement);
    if (length(truth) > 10) continue;  // a cone too narrow for Dykstra
    CHECK(length(point_of<N>(slide.move) - truth) < 2e-3);
    ++checked;
  }
  CHECK(checked > 250);
}

TEST_CASE_TEMPLATE("planes push and never pull, and only where they are touched", N, FixedNumbers,
                   DoubleNumbers) {
  using Real = typename N::Real;
  RandomNumbers random(2);
  for (int i = 0; i < 20'000; ++i) {
    const auto constraints = random_constraints<N>(random);
    const Point displacement = random.uniform(0, 3) * random.direction();
    const ConstrainedMove<N> slide = constrained_move(constraints, place_of<N>(displacement));
    Point pushed = point_of<N>(slide.move) - displacement;
    for (std::size_t k = 0; k < constraints.count; ++k) {
      const ConstraintPlane<N>& plane = constraints.plane[k];
      const double gap = double(along<N>(plane.normal, slide.move) - plane.depth);
      CHECK(gap >= -1e-4);
      CHECK(slide.load[k] >= Real(0));
      // Where normals are nearly parallel, a step of load is a long way along the crease.
      if (slide.load[k] > Real(0)) CHECK(gap < 300 * kStep<N>);
      pushed = pushed - double(slide.load[k]) * normal_of(plane);
    }
    CHECK(length(pushed) < 16 * kStep<N>);
  }
}

TEST_CASE_TEMPLATE("a goal at the end of the range saturates nothing", N, FixedNumbers,
                   DoubleNumbers) {
  ConstraintSet<N> floor;
  floor.plane[floor.count++] = plane<N>({0, 1, 0}, 0);
  const ConstrainedMove<N> slide = constrained_move(floor, place_of<N>({16384, -16384, 16384}));
  CHECK(length(point_of<N>(slide.move) - Point{16384, 0, 16384}) < 1e-3);
  CHECK(double(slide.load[0]) == doctest::Approx(16384));
}

TEST_CASE_TEMPLATE("where planes leave no room the oldest gives way", N, FixedNumbers,
                   DoubleNumbers) {
  ConstraintSet<N> slot;
  slot.plane[slot.count++] = plane<N>({1, 0, 0}, 0.125);
  slot.plane[slot.count++] = plane<N>({0, 1, 0}, 0);
  slot.plane[slot.count++] = plane<N>({-1, 0, 0}, 0.125);
  CHECK(point_of<N>(constrained_move(slot, place_of<N>({-3, -4, 5})).move) == Point{0.125, 0, 5});
  CHECK(point_of<N>(constrained_move(slot, place_of<N>({3, -4, 5})).move) == Point{3, 0, 5});
}

TEST_CASE_TEMPLATE("a plane seen before is kept while it is near and unlike the new ones", N,
                   FixedNumbers, DoubleNumbers) {
  const auto merged = [](ConstraintSet<N> older, Point moved) {
    auto constraints = constraints_of(felt<N>(plane<N>({0, 1, 0}, 0)));
    keep(constraints, older, place_of<N>(moved));
    return constraints;
  };
  const auto older = [](Point normal, double depth) {
    ConstraintSet<N> constraints;
    constraints.plane[constraints.count++] = plane<N>(normal, depth);
    return constraints;
  };
  CHECK(merged(older({1, 0, 0}, 0), {}).count == 2);
  CHECK(merged(older({std::sin(0.77), std::cos(0.77), 0}, 0), {}).count == 1);
  CHECK(merged(older({std::sin(0.8), std::cos(0.8), 0}, 0), {}).count == 2);
  CHECK(merged(older({1, 0, 0}, -0.6), {}).count == 1);
  CHECK(merged(older({1, 0, 0}, 4), {}).count == 2);  // however deep
  // Carried along: 0.25 nearer.
  const auto carried = merged(older({1, 0, 0}, -0.6), {-0.25, 0, 0});
  REQUIRE(carried.count == 2);
  CHECK(double(carried.plane[1].depth) == doctest::Approx(-0.35));
}

TEST_CASE_TEMPLATE("a place that was too deep teaches the plane that it met", N, FixedNumbers,
                   DoubleNumbers) {
  ConstraintSet<N> known;
  known.plane[known.count++] = plane<N>({0, 1, 0}, 0);
  const auto met = felt<N>(plane<N>({1, 0, 0}, 0.5));
  CHECK(add_blocking_planes(known, met, place_of<N>({-0.5, 0, 0})));
  REQUIRE(known.count == 2);
  CHECK(std::abs(double(known.plane[1].depth)) < 1e-4);
  CHECK_FALSE(add_blocking_planes(known, met, place_of<N>({-0.5, 0, 0})));  // known by now
}

}  // namespace kerf::constraint_set_test
