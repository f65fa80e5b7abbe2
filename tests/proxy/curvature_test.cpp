// SPDX-License-Identifier: Apache-2.0
// What steps tell of a bowl, against hollows whose bottom is known.
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/constraint_set.hpp"
#include "tests/proxy/support.hpp"

namespace kerf::curvature_test {

using namespace kerf::test;

namespace {

/// A tool in the hollow that leaves its centre a ball of `play` about the origin.
template <class N>
auto hollow(double play) {
  const auto face = [](Point p) { return std::pair(-length(p), -1 / length(p) * p); };
  return SolidField<N, decltype(face)>(-play, face);
}

Point on(double play, double angle) {
  return {play * std::sin(angle), -play * std::cos(angle), 0};
}

/// What is known after steps from each place to the next.
template <class N, class Field>
CurvatureEstimate<N> learned(Field field, const std::vector<Point>& places) {
  CurvatureEstimate<N> curvature;
  for (std::size_t i = 1; i < places.size(); ++i) {
    curvature.learn(field.query(place_of<N>(places[i - 1])), field.query(place_of<N>(places[i])),
                    place_of<N>(places[i] - places[i - 1]));
  }
  return curvature;
}

template <class N>
bool eases(const CurvatureEstimate<N>& curvature) {
  const auto step = place_of<N>({0.3, 0.2, -0.1});
  return curvature.eased(step, typename N::Real(2)) != step;
}

/// Where a step ends from `from` under a load of 2 straight down.
template <class N, class Field>
Point end_of_step(Field field, const CurvatureEstimate<N>& curvature, double play, Point from) {
  const auto slide = constrained_move(constraints_of(field.query(place_of<N>(from))),
                                      place_of<N>(Point{0, -play - 2, 0} - from));
  return from + point_of<N>(curvature.eased(slide.move, slide.load[0]));
}

}  // namespace

// Under the plane alone a step is 2 sin(0.1) = 0.2 long, in the narrowest 20 times too far.
TEST_CASE_TEMPLATE("an eased step ends at the bottom of its bowl", N, FixedNumbers, DoubleNumbers) {
  for (const double play : {0.1, 0.5, 3.0}) {
    CAPTURE(play);
    const Point from = on(play, 0.1);
    const auto curvature = learned<N>(hollow<N>(play), {on(play, 0.4), from});
    CHECK(std::abs(end_of_step(hollow<N>(play), curvature, play, from)[0]) < 0.1 * 0.2);
  }
}

TEST_CASE_TEMPLATE("a head's plane and a shaft's tell of no bowl", N, FixedNumbers, DoubleNumbers) {
  auto field = hollow<N>(0.5);
  const Point from = on(0.5, 0.4), to = on(0.5, 0.1);
  const auto before = field.query(place_of<N>(from));
  auto after = field.query(place_of<N>(to));
  CurvatureEstimate<N> curvature;
  curvature.learn(before, after, place_of<N>(to - from));
  CHECK(eases(curvature));
  after.plane[0].on_shaft = true;
  curvature.learn(before, after, place_of<N>(to - from));
  CHECK_FALSE(eases(curvature));
}

TEST_CASE_TEMPLATE("two steps tell of both directions", N, FixedNumbers, DoubleNumbers) {
  constexpr double kPlay = 0.5;
  const Point begin = on(kPlay, 0.4);
  const auto across = [&](double x, double z) {
    return Point{x, -std::sqrt(kPlay * kPlay - x * x - z * z), z};
  };
  const Point from = across(0.05, 0.05);
  const auto both = learned<N>(hollow<N>(kPlay), {begin, across(0.05, 0), from});
  const Point end = end_of_step(hollow<N>(kPlay), both, kPlay, from);
  CHECK(std::abs(end[0]) < 0.01);
  CHECK(std::abs(end[2]) < 0.01);
  // The first alone leaves the swing of the other: 2 sin(0.1) past the bottom.
  const auto one = learned<N>(hollow<N>(kPlay), {begin, across(0.05, 0)});
  CHECK(std::abs(end_of_step(hollow<N>(kPlay), one, kPlay, from)[2]) > 0.1);
}

// The normal turns by 0.0005, 30 steps of Q15.16.
TEST_CASE("short steps in a wide bowl tell fixed point what they tell double") {
  constexpr double kPlay = 32, kLoad = 28, kTurn = 0.0005;
  const auto eased = [&]<class N>(N) {
    const auto curvature = learned<N>(hollow<N>(kPlay), {on(kPlay, 0.1 + kTurn), on(kPlay, 0.1)});
    return point_of<N>(curvature.eased(place_of<N>({0.3, 0.2, -0.1}), typename N::Real(kLoad)));
  };
  CHECK(length(eased(FixedNumbers{}) - eased(DoubleNumbers{})) < 1e-3);
}

TEST_CASE_TEMPLATE("a slot leaves the way along it", N, FixedNumbers, DoubleNumbers) {
  constexpr double kPlay = 0.5;
  const auto face = [](Point p) {
    p[2] = 0;
    return std::pair(-length(p), -1 / length(p) * p);
  };
  const SolidField<N, decltype(face)> slot(-kPlay, face);
  const auto along = [&](double angle, double z) {
    Point p = on(kPlay, angle);
    p[2] = z;
    return p;
  };
  const auto curvature = learned<N>(slot, {along(0.4, 0), along(0.2, 0.2), along(0.1, 0.3)});
  const auto step = place_of<N>({0, 0, 0.4});
  CHECK(norm(curvature.eased(step, typename N::Real(2)) - step) < typename N::Real(0.01));
}

TEST_CASE_TEMPLATE("bumps, two walls, air and no step are no bowls", N, FixedNumbers,
                   DoubleNumbers) {
  const auto field = hollow<N>(0.5);
  CHECK(eases(learned<N>(field, {on(0.5, -0.2), on(0.5, 0.3)})));
  CHECK_FALSE(eases(learned<N>(field, {on(0.5, -0.4), on(0.5, 0.4)})));  // 46 degrees
  CHECK_FALSE(eases(learned<N>(field, {on(0.5, 0.2), on(0.5, 0.215)})));
  auto looks = field;
  const auto left = looks.query(place_of<N>(on(0.5, -0.2)));
  const auto right = looks.query(place_of<N>(on(0.5, 0.2)));
  const auto told = [&](const Contacts<N>& before, const Contacts<N>& after) {
    CurvatureEstimate<N> curvature;
    curvature.learn(before, after, place_of<N>({0.1, 0, 0}));
    return eases(curvature);
  };
  CHECK(told(left, right));
  CHECK_FALSE(told(right, left));  // the normals turn apart
  CHECK_FALSE(told(left, left));
  CHECK_FALSE(told(left, Contacts<N>{}));
}

TEST_CASE_TEMPLATE("a curvature outlives its tick unless noise may have feigned it", N,
                   FixedNumbers, DoubleNumbers) {
  for (const auto& [turn_rad, kept] : {std::pair{0.1, true}, {0.025, true}, {0.015, false}}) {
    CAPTURE(turn_rad);
    auto curvature = learned<N>(hollow<N>(1), {on(1, 0.1), on(1, 0.1 + turn_rad)});
    REQUIRE(eases(curvature));
    curvature.forget_noise();
    CHECK(eases(curvature) == kept);
  }
}

}  // namespace kerf::curvature_test
