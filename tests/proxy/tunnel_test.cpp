// SPDX-License-Identifier: Apache-2.0
// F7: no hand is fast enough to bring a tool through a wall, and no wall that it is behind lets it
// feel nothing.
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "tests/kernel/case_count.hpp"
#include "tests/kernel/shell_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr double kBallRadius = 8, kCylinderRadius = 5, kCylinderHalf = 8;

/// How far a turned tool reaches down along `up`, from its centre.
template <class N>
double reach_below(const ToolTurn<N>& turn, Point up, bool round) {
  if (round) return kBallRadius;
  const auto rows = rows_of(turn);
  const double axis = std::abs(double(rows[0][1]) * up[0] + double(rows[1][1]) * up[1] +
                               double(rows[2][1]) * up[2]);
  return kCylinderHalf * axis + kCylinderRadius * std::sqrt(std::max(0.0, 1 - axis * axis));
}

struct Tally {
  long ticks = 0, behind = 0, unfelt = 0, crossed = 0, turned_late = 0;
  int most_probes = 0;
  double deepest = 0, longest_jump = 0;
};

/// Random steps of 0.1 to 10 m/s at 0.1 mm a unit and 1 kHz, turning a little or at random.
template <class N>
void shake(double wall, bool round, int ticks, Dice& dice, Tally& tally) {
  const Frame frame(dice, {32, 32, 32});
  const TestVolume volume = body({66, 66, 66}, 2, [&](Point p) {
    const double height = frame.of(p)[1];
    return wall > 40 ? height : std::abs(height + wall / 2) - wall / 2;
  });
  const double reach = round ? kBallRadius : std::hypot(kCylinderRadius, kCylinderHalf);
  ShellRig<N> rig(round ? tool_of_units("ball", kBallRadius, 2 * kBallRadius)
                        : tool_of_units("cylinder", kCylinderRadius, 2 * kCylinderHalf),
                  volume);
  const typename N::Unit turn_step(round ? 0 : turn_step_of(reach));
  Point hand = frame.at(0, reach + 3, 0);
  ProxyPose<N> pose{place_of<N>(hand), {}}, goal = pose;
  for (int i = 0; i < ticks; ++i) {
    hand = hand + std::pow(10.0, dice.uniform(0, 2)) * dice.direction();
    const Point h = frame.of(hand);
    const double aside = std::max(1.0, std::hypot(h[0], h[2]) / 10);  // stay inside of the volume
    hand = frame.at(h[0] / aside, std::clamp(h[1], -14.0, 14.0), h[2] / aside);
    goal.centre = place_of<N>(hand);
    goal.turn = compose(dice.turn<N>(i % 3 == 0 ? 3 : dice.uniform(0, 0.2)), goal.turn);
    const Point before = point_of<N>(pose.centre);

    const Swept<N> swept =
        ProxySweep<N, ShellProbe<N>>(rig.field(), pose, {}, turn_step).tick(goal);
    const Point place = point_of<N>(pose.centre);
    const double below = reach_below(pose.turn, frame.up, round);
    ++tally.ticks;
    tally.most_probes = std::max(tally.most_probes, swept.probes);
    tally.deepest = std::max(tally.deepest, below - frame.of(place)[1]);
    tally.longest_jump = std::max(tally.longest_jump, length(place - before));
    tally.crossed += frame.of(place)[1] < 0 ? 1 : 0;
    tally.turned_late += swept.turned ? 0 : 1;
    if (frame.of(hand)[1] < below - 0.1) {
      ++tally.behind;
      tally.unfelt += length(hand - place) < 0.05 ? 1 : 0;
    }
  }
}

template <class N>
Tally shaken(double wall, bool round) {
  Tally tally;
  Dice dice(11);
  constexpr int kTicksPerWall = 500;
  const int walls = cases(round ? 10 : 5);  // KERF_CASES=34: a million ticks in all
  for (int k = 0; k < walls; ++k) shake<N>(wall, round, kTicksPerWall, dice, tally);
  MESSAGE(std::string(N::kName) << ", wall of " << wall
                                << std::string(round ? ", ball: " : ", turning cylinder: ")
                                << tally.ticks << " ticks, " << tally.behind << " behind the face, "
                                << tally.crossed << " crossings, " << tally.unfelt
                                << " without force, " << tally.deepest << " units sunk at most, "
                                << tally.most_probes << " probes at most");
  return tally;
}

}  // namespace

TEST_CASE_TEMPLATE("no ball goes through a wall at any speed, or behind it without force", N,
                   FixedNumbers, DoubleNumbers) {
  for (const double wall : {50.0, 2.0}) {
    const Tally tally = shaken<N>(wall, true);
    CHECK(tally.crossed == 0);
    CHECK(tally.unfelt == 0);
    CHECK(2 * tally.behind > tally.ticks);
    CHECK(tally.deepest < 0.05);
    CHECK(tally.most_probes <= SweepRules::kMaxProbes);
    CHECK(tally.longest_jump < SweepRules::kMaxProbes * SweepRules::kStep);
  }
}

TEST_CASE_TEMPLATE("no turning cylinder goes through a wall at any speed, or is unfelt behind it",
                   N, FixedNumbers, DoubleNumbers) {
  for (const double wall : {50.0, 2.0}) {
    const Tally tally = shaken<N>(wall, false);
    CHECK(tally.crossed == 0);
    CHECK(tally.unfelt == 0);
    CHECK(2 * tally.behind > tally.ticks);
    CHECK(tally.deepest < 0.1);
    CHECK(tally.most_probes <= SweepRules::kMaxProbes);
    CHECK(tally.turned_late > 0);
  }
}
