// SPDX-License-Identifier: Apache-2.0
// A hand in free air feels nothing: docs/theory.md 2.3, 4.2.
#include <algorithm>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/plan/air_speed.hpp"
#include "tests/case_count.hpp"
#include "tests/rig/contact_motions.hpp"
#include "tests/rig/contact_rig.hpp"

namespace kerf::air_test {

using namespace kerf::extremes;
using kerf::test::cases;

namespace {

std::vector<AirWall> tilted_walls() {
  RandomNumbers random(17);
  std::vector<AirWall> walls;
  const int count = cases(3);
  for (int i = 0; i < count; ++i) walls.emplace_back(random);
  return walls;
}

const SceneTool kTools[] = {tool_of_units("ball", 8, 16),     tool_of_units("ball", 20, 40),
                            tool_of_units("cylinder", 5, 16), tool_of_units("cylinder", 12, 60),
                            tool_of_units("cone", 12, 36),    tool_of_units("wheel", 16, 8)};

template <class N>
Flown flown_at(const SampledTool& tool, const std::vector<AirWall>& walls, const AirFlight& flight,
               int ticks) {
  Flown flown;
  RandomNumbers random(5);
  for (const AirWall& wall : walls) fly<N>(tool, wall, flight, ticks, random, flown);
  return flown;
}

/// In double a sum of steps misses its end by a rounding.
constexpr double kNothing = 1e-9;

}  // namespace

TEST_CASE_TEMPLATE("no tool is dragged through soft tissue, however fast", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(5);
  const Body soft = body_of({120, 120, 120}, [&](Point) { return random.uniform(0.38, 0.48); });
  for (const SceneTool& made :
       {kTools[0], kTools[2], tool_with("ball", 5.6, 11.2, {.radius_mm = 3.6, .length_mm = 72})}) {
    ShaftRig<N> rig(made, {&soft});
    CAPTURE(made.name);
    for (int i = 0; i < 50; ++i) {
      const Point hand = {random.uniform(20, 100), random.uniform(20, 100),
                          random.uniform(20, 100)};
      rig.tick(hand);
      CAPTURE(i);
      CHECK(length(rig.proxy() - hand) < SweepRules::kArrived);
    }
  }
}

TEST_CASE_TEMPLATE("the speed that a scene is told to be free of drag up to is so, and hardly shy",
                   N, FixedNumbers, DoubleNumbers) {
  const auto walls = tilted_walls();
  for (const SceneTool& made : kTools) {
    const SampledTool tool(made);
    const PointShellTable<N> points(tool.samples, tool.round, tool.close);
    SweptTool<N> swept;
    swept.point_shell = points.point_shell();
    if (!tool.round) {
      swept.proxy.rotation_step =
          typename N::Unit(rotation_step_of(double(swept.point_shell.reach)));
    }
    CAPTURE(made.name);
    CAPTURE(made.radius_mm);
    for (const double turn_rad : {0.0, 0.03, 0.12}) {
      const double units = least_air_move(swept, 1, turn_rad);
      // From where nothing is felt any more to where all is proven free.
      for (const double gap : {1.3, 2.5, 4.0, 5.5, 7.0, 8.5, 10.0, 12.0}) {
        CAPTURE(gap);
        CHECK(flown_at<N>(tool, walls, {units, gap, turn_rad}, cases(25)).longest_spring <
              kNothing);
      }
      if (turn_rad > 0 || !tool.round) continue;  // others are told for their worst pose
      double bold = 1.1;
      while (flown_at<N>(tool, walls, {bold * units, 1.3, 0}, 12).longest_spring < kNothing) {
        bold += 0.1;
        REQUIRE(bold < 1.5);
      }
      MESSAGE(std::string(N::kName)
              << ", " << made.name << " of " << made.radius_mm << ": told " << units
              << " units a tick, dragged from " << bold << " times that");
    }
  }
}

TEST_CASE_TEMPLATE(
    "in air the damper has nothing to multiply, whatever the wrist does over a plane", N,
    FixedNumbers, DoubleNumbers) {
  // Voxels of 0.25 mm, 600 mm/s, 1 kHz.
  const auto walls = tilted_walls();
  for (const SceneTool& made : kTools) {
    const SampledTool tool(made);
    CAPTURE(made.name);
    CAPTURE(made.radius_mm);
    for (const double turn_rad : {0.0, 0.01, 0.03, 0.1}) {
      for (const double gap : {0.3, 1.0, 2.0, 4.0, 8.0}) {
        CAPTURE(turn_rad);
        CAPTURE(gap);
        const Flown flown = flown_at<N>(tool, walls, {2.4, gap, turn_rad, 0.25, 0.001}, cases(200));
        CHECK(flown.longest_spring == 0);
        CHECK(flown.force_n == 0);
      }
    }
  }
}

}  // namespace kerf::air_test
