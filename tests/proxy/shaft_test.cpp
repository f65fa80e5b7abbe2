// SPDX-License-Identifier: Apache-2.0
// A tool with a shaft among bodies: the same contact, with planes that are marked.
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "tests/rig/contact_rig.hpp"
#include "tests/rig/geometry.hpp"

namespace kerf::shaft_test {

using namespace kerf::extremes;

namespace {

constexpr ShaftSize kShaft{.radius_mm = 3, .length_mm = 45};
const VoxelGrid kGrid{80, 80, 64};

/// Solid at x < 30 between the heights 44 and 50.
Body ledge() {
  return blurred(kGrid, [](Point p) { return std::max(p[0] - 30, std::abs(p[1] - 47) - 3); });
}
/// Solid below the height 20.
Body floor_body() {
  return blurred(kGrid, [](Point p) { return p[1] - 20; });
}

template <class Unit>
Point point_from(ContactVec<Unit> v) {
  return {double(v.x), double(v.y), double(v.z)};
}

template <class N>
Orientation<N> leaning(double angle_rad) {  // about z: the shaft leans to -x
  return {typename N::Unit(0), typename N::Unit(0), typename N::Unit(std::sin(angle_rad / 2)),
          typename N::Unit(std::cos(angle_rad / 2))};
}

}  // namespace

TEST_CASE_TEMPLATE("a shaft at an edge stops the tool while its head is in air, and by its lever",
                   N, FixedNumbers, DoubleNumbers) {
  const Body body = ledge();
  for (const char* shape : {"ball", "cylinder"}) {
    CAPTURE(shape);
    ShaftRig<N> rig(tool_with(shape, 5, 10, kShaft), {&body});
    rig.lead({60, 28, 32}, {36, 28, 32}, 100);
    const ProxyContact<N> air = rig.tick({36, 28, 32});
    CHECK(air.spring == decltype(air.spring){});
    CHECK(air.shaft_fraction == typename N::Unit(0));
    rig.lead({36, 28, 32}, {25, 28, 32}, 50);
    const ProxyContact<N> held = rig.tick({25, 28, 32});
    // The shaft's flank is at x = 30, so the axis 3 units from it; the ledge's middle is 19 above
    // the tool's centre.
    CHECK(rig.proxy()[0] == doctest::Approx(33).epsilon(0.002));
    CHECK(rig.proxy()[1] == doctest::Approx(28).epsilon(0.002));
    CHECK(double(held.shaft_fraction) == doctest::Approx(1).epsilon(0.001));
    CHECK(held.normal == decltype(held.normal){});  // the head presses on nothing
    CHECK(double(held.moment_arm.z) == doctest::Approx(-19).epsilon(0.02));
    CHECK(std::abs(double(held.moment_arm.y)) < 0.2);
    // Up to where the shaft ends, and not beyond.
    rig.lead({25, 28, 32}, {25, 7, 32}, 100);
    CHECK(rig.proxy()[0] == doctest::Approx(33).epsilon(0.003));
    rig.lead({25, 7, 32}, {25, 1, 32}, 100);  // it ends at 40 above the centre
    CHECK(rig.proxy()[0] == doctest::Approx(25).epsilon(0.003));
  }
}

TEST_CASE_TEMPLATE("a head feels the same bits as without its shaft while that is in air", N,
                   FixedNumbers, DoubleNumbers) {
  const Body body = floor_body();
  for (const char* shape : {"ball", "cone"}) {
    CAPTURE(shape);
    const SceneTool tool = tool_with(shape, 5, 10, kShaft);
    ShaftRig<N> with(tool, {&body});
    ContactRig<N> without(tool, body);
    ProxyState<N> state;
    RandomNumbers random(7);
    Point hand{40, 28, 32};
    for (int tick = 0; tick < 400; ++tick) {
      hand = hand + Point{random.uniform(-0.3, 0.3), tick < 100 ? -0.1 : random.uniform(-0.3, 0.3),
                          random.uniform(-0.3, 0.3)};
      const ProxyContact<N> felt = with.tick(hand);
      without.field().begin_tick();
      const ProxyContact<N> alone = without.follow(
          {.rotation_step = without.rotation_step(), .ramp_per_tick = typename N::Real(1)}, state,
          {place_of<N>(hand), {}});
      REQUIRE(felt.pose == alone.pose);
      REQUIRE(felt.spring == alone.spring);
      REQUIRE(felt.normal == alone.normal);
      REQUIRE(felt.moment_arm == alone.moment_arm);
      REQUIRE(felt.queries == alone.queries);
      REQUIRE(felt.head_fraction == typename N::Unit(1));
      REQUIRE(felt.shaft_fraction == typename N::Unit(0));
    }
  }
}

TEST_CASE_TEMPLATE("a ball on a floor feels the same while its shaft turns above it", N,
                   FixedNumbers, DoubleNumbers) {
  const Body body = floor_body();
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&body});
  const Point hand{40, 22, 32};
  rig.lead({40, 30, 32}, hand, 100);
  const Point rest = point_of<N>(rig.tick(hand).spring);
  CHECK(rest[1] == doctest::Approx(3).epsilon(0.005));
  for (int tick = 0; tick < 400; ++tick) {  // up to 4 rad/s at 1 kHz
    const ProxyContact<N> felt = rig.tick(hand, leaning<N>(0.8 * std::sin(0.005 * tick)));
    REQUIRE(felt.turned);
    REQUIRE(length(point_of<N>(felt.spring) - rest) < 0.015);
    REQUIRE(felt.shaft_fraction == typename N::Unit(0));
  }
}

TEST_CASE_TEMPLATE("on a floor and a ledge of two volumes head and shaft each bear their own part",
                   N, FixedNumbers, DoubleNumbers) {
  const Body wall = ledge(), ground = floor_body();
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&wall, &ground});
  rig.lead({45, 30, 32}, {29, 22, 32}, 100);
  const ProxyContact<N> held = rig.tick({29, 22, 32});
  CHECK(rig.proxy()[0] == doctest::Approx(33).epsilon(0.002));
  CHECK(rig.proxy()[1] == doctest::Approx(25).epsilon(0.002));
  // 4 units to the side and 3 up.
  CHECK(double(held.shaft_fraction) == doctest::Approx(0.8).epsilon(0.01));
  CHECK(double(held.head_fraction) == doctest::Approx(0.6).epsilon(0.01));
  CHECK(double(held.normal.y) == doctest::Approx(1).epsilon(0.001));
  // The ball's part has no moment; the ledge is 22 above.
  CHECK(double(held.moment_arm.z) == doctest::Approx(-22 * 0.8).epsilon(0.02));
}

TEST_CASE_TEMPLATE("where head and shaft press alike, in part, the head's part is what it bears", N,
                   FixedNumbers, DoubleNumbers) {
  // A ramp of 45 degrees below the ball when that is at (33, 25).
  const Body wall = ledge(), ramp = blurred(kGrid, [](Point p) {
                               return (p[0] + p[1] - 58) / std::numbers::sqrt2 + 5;
                             });
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&wall, &ramp});
  rig.lead({45, 30, 32}, {29, 22, 32}, 100);
  const ProxyContact<N> held = rig.tick({29, 22, 32});
  CHECK(rig.proxy()[0] == doctest::Approx(33).epsilon(0.002));
  CHECK(rig.proxy()[1] == doctest::Approx(25).epsilon(0.002));
  // The spring (4, 3) is 3 sqrt 2 along (1, 1) / sqrt 2 and 1 along (1, 0).
  CHECK(double(held.normal.x) == doctest::Approx(std::sqrt(0.5)).epsilon(0.005));
  CHECK(double(held.normal.y) == doctest::Approx(std::sqrt(0.5)).epsilon(0.005));
  CHECK(double(held.shaft_fraction) == doctest::Approx(1.0 / 5).epsilon(0.05));
  CHECK(double(held.head_fraction) == doctest::Approx(std::sqrt(18.0) / 5).epsilon(0.01));
}

TEST_CASE_TEMPLATE("a head bears its part where its face stands across the force", N, FixedNumbers,
                   DoubleNumbers) {
  // The face of normal (-1/2, sqrt(3)/2) is below the ball when that is at (33, 25).
  const Point face{-0.5, std::numbers::sqrt3 / 2, 0};
  const Body wall = ledge(), ramp = blurred(kGrid, [&](Point p) {
                               return dot(face, p - Point{33, 25, 32}) + 5;
                             });
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&wall, &ramp});
  // The spring is 2 along the face's normal and 4 along that of the ledge, (1, 0): no part of it is
  // along the face's.
  const Point spring = 2 * face + Point{4, 0, 0}, hand = Point{33, 25, 32} - spring;
  rig.lead({48, 45, 32}, hand, 200);
  const ProxyContact<N> held = rig.tick(hand);
  CHECK(length(rig.proxy() - Point{33, 25, 32}) < 0.1);
  const double force = dot(point_of<N>(held.spring), point_from(held.press));
  CHECK(force * double(held.head_fraction) == doctest::Approx(2).epsilon(0.03));
  CHECK(dot(point_from(held.normal), face) == doctest::Approx(1).epsilon(0.001));
}

TEST_CASE_TEMPLATE("a shaft as wide as its head lies beside it on a wall, neither deeper", N,
                   FixedNumbers, DoubleNumbers) {
  const Body wall = blurred(kGrid, [](Point p) { return p[0] - 30; });
  ShaftRig<N> rig(tool_with("cylinder", 5, 10, {.radius_mm = 5, .length_mm = 30}), {&wall});
  rig.lead({50, 28, 32}, {33, 28, 32}, 60);
  const ProxyContact<N> held = rig.tick({33, 28, 32});
  CHECK(rig.proxy()[0] == doctest::Approx(35).epsilon(0.002));
  const double head = double(held.normal.x) * double(held.head_fraction);
  CHECK(head + double(held.shaft_fraction) == doctest::Approx(1).epsilon(0.02));
  // It slides along the wall freely.
  rig.lead({33, 28, 32}, {33, 31, 35}, 30);
  CHECK(rig.proxy()[1] == doctest::Approx(31).epsilon(0.002));
  CHECK(rig.proxy()[2] == doctest::Approx(35).epsilon(0.002));
}

TEST_CASE_TEMPLATE("in the bore that a ball has cut its shaft has play, and leans on the rim", N,
                   FixedNumbers, DoubleNumbers) {
  // As wide as the ball and its advance; its rim is at the height 60.
  const Body bored = blurred(
      kGrid, [](Point p) { return std::max(p[1] - 60, 5.25 - std::hypot(p[0] - 40, p[2] - 32)); });
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&bored});
  rig.tick({40, 72, 32});
  for (int tick = 0; tick <= 520; ++tick) {
    const ProxyContact<N> held = rig.tick({40, 72 - 0.1 * tick, 32});
    REQUIRE(held.shaft_fraction == typename N::Unit(0));
    REQUIRE(length(point_of<N>(held.spring)) < 0.05);
  }
  const Point bottom{40, 40, 32};
  rig.lead({40, 20, 32}, bottom, 200);
  // 20 units below the rim: the shaft leans on it where 20 tan a + 3 / cos a = 5.25 + 0.25.
  const double rim_rad = 6.93 * std::numbers::pi / 180;
  ProxyContact<N> held;
  for (int tick = 0; tick < 100; ++tick) held = rig.tick(bottom, leaning<N>(0.8 * rim_rad));
  CHECK(held.turned);
  CHECK(held.shaft_fraction == typename N::Unit(0));
  for (int tick = 0; tick < 100; ++tick) held = rig.tick(bottom, leaning<N>(2 * rim_rad));
  CHECK_FALSE(held.turned);
  const double leant_rad = 2 * std::asin(double(held.pose.orientation.z));
  CHECK(leant_rad == doctest::Approx(rim_rad).epsilon(0.05));
  CHECK(length(rig.proxy() - bottom) < 0.4);
}

TEST_CASE_TEMPLATE("a handpiece that meets the rim of a pit ends the descent", N, FixedNumbers,
                   DoubleNumbers) {
  const Body pit = blurred(
      kGrid, [](Point p) { return std::max(p[1] - 50, 8 - std::hypot(p[0] - 40, p[2] - 32)); });
  const SceneTool tool = tool_with(
      "ball", 5, 10,
      {.radius_mm = 3, .length_mm = 30, .handpiece_radius_mm = 14, .handpiece_length_mm = 10});
  ShaftRig<N> rig(tool, {&pit});
  rig.lead({40, 62, 32}, {40, 15, 32}, 300);
  const ProxyContact<N> held = rig.tick({40, 15, 32});
  CHECK(rig.proxy()[1] == doctest::Approx(25).epsilon(0.004));  // its face is 25 above the centre
  CHECK(double(held.shaft_fraction) == doctest::Approx(1).epsilon(0.01));
  CHECK(held.normal == decltype(held.normal){});
}

TEST_CASE_TEMPLATE("no random motion takes a shaft through a ledge of two units", N, FixedNumbers,
                   DoubleNumbers) {
  // A blade that stands on a far wall and reaches to z = 31; the shaft passes beside it.
  const Body blade =
      blurred(kGrid, [](Point p) { return std::max(std::abs(p[0] - 30) - 1, p[2] - 40); });
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&blade});
  RandomNumbers random(11);
  rig.tick({50, 28, 32});
  for (int tick = 0; tick < 3000; ++tick) {
    const Point hand{30 + random.uniform(-25, 25), random.uniform(15, 40), random.uniform(10, 32)};
    const double lean_rad = random.uniform(-0.2, 0.2);
    rig.tick(hand, leaning<N>(lean_rad));
    // It stays on its side, ball and shaft.
    REQUIRE(rig.proxy()[0] > 36 - 0.1);
  }
}

TEST_CASE_TEMPLATE("a start with the shaft inside of the solid finds a place for all of it", N,
                   FixedNumbers, DoubleNumbers) {
  const Body body = ledge();
  ShaftRig<N> rig(tool_with("ball", 5, 10, kShaft), {&body});
  const Point hand{28, 28, 32};
  for (int tick = 0; tick < 300 && !rig.state().valid; ++tick) rig.tick(hand);
  REQUIRE(rig.state().valid);
  rig.field().begin_tick();
  const Contacts<N> felt = rig.field().query(rig.state().pose.centre);
  CHECK_FALSE(felt.no_normal);
  CHECK(double(felt.depth) < 0.06);
}

TEST_CASE_TEMPLATE("askew in a hole with a play of half a unit a shaft sinks into neither rim", N,
                   FixedNumbers, DoubleNumbers) {
  // A plate 16 units thick, its middle at the height 40.
  const auto plate = [](Point p) {
    return std::max(std::abs(p[1] - 40) - 8, 3.5 - std::hypot(p[0] - 40, p[2] - 32));
  };
  const Body body = blurred(kGrid, plate);
  const SceneTool tool = tool_with("ball", 3, 6, {.radius_mm = 3, .length_mm = 50});
  ShaftRig<N> rig(tool, {&body});
  const ToolPart part = shaft_parts(tool)[0];
  const PartSamples surface = part_samples(tool, part, 1);
  rig.lead({40, 70, 32}, {40, 20, 32}, 500);
  RandomNumbers random(5);
  double deepest = 0, most_lean = 0;
  for (int tick = 0; tick < 600; ++tick) {
    const double lean_rad = 0.25 * std::sin(0.02 * tick);
    const Point hand{40 + random.uniform(-2, 2), 20, 32 + random.uniform(-2, 2)};
    const ProxyContact<N> held = rig.tick(hand, leaning<N>(lean_rad));
    const RotationRows<N> rows = rows_of(held.pose.orientation);
    most_lean = std::max(most_lean, std::abs(2 * std::asin(double(held.pose.orientation.z))));
    for (const Point& at : surface.samples) {
      Point in_world = rig.proxy();
      const Point offset{at[0], at[1] + part.middle_mm, at[2]};
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) in_world[i] += double(rows[i][j]) * offset[j];
      }
      deepest = std::max(deepest, -plate(in_world));
    }
  }
  // Both rims hold it at 1 unit of play over 16 of height.
  CHECK(deepest < 0.12);
  CHECK(most_lean < 0.075);
  CHECK(most_lean > 0.05);
}

TEST_CASE_TEMPLATE("no tick costs more than its bound, whatever there is to feel", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers noise(3);
  const Body body = body_of(kGrid, [&](Point) { return noise.uniform(0, 0.6); });
  const SceneTool tool = tool_with(
      "ball", 5, 10,
      {.radius_mm = 3, .length_mm = 30, .handpiece_radius_mm = 14, .handpiece_length_mm = 10});
  ShaftRig<N> rig(tool, {&body});
  RandomNumbers random(4);
  std::int64_t most = 0;
  rig.tick({40, 120, 32});
  for (int tick = 0; tick < 300; ++tick) {
    const ProxyContact<N> held =
        rig.tick({random.uniform(20, 60), random.uniform(20, 90), random.uniform(10, 50)},
                 random.template rotation<N>(random.uniform(0, 0.5)));
    REQUIRE(held.queries <= SweepRules::kMaxQueries);
    most = std::max(most, rig.field().spent());
  }
  CHECK(most <= rig.field().work().most());
  CHECK(most > rig.field().work().budget() / 2);  // the bound is none that nothing meets
}

}  // namespace kerf::shaft_test
