// SPDX-License-Identifier: Apache-2.0
// F7: no hand is fast enough to bring a tool through a wall, and no wall that it is behind lets it
// feel nothing.
#include <string>

#include <doctest/doctest.h>

#include "lab/rig/contact_motions.hpp"
#include "tests/case_count.hpp"

using namespace kerf;
using namespace kerf::extremes;

namespace {

constexpr ShakenTool kBall{}, kCylinder{.round = false, .radius = 5, .half = 8};

template <class N>
Shaken shaken(double wall, const ShakenTool& tool) {
  Shaken tally;
  Dice dice(11);
  constexpr int kTicksPerWall = 500;
  const int walls = test::cases(tool.round ? 10 : 5);  // KERF_CASES=34: a million ticks in all
  const SampledTool made(tool.made());
  for (int k = 0; k < walls; ++k) shake<N>(wall, tool, made, kTicksPerWall, dice, tally);
  MESSAGE(std::string(N::kName) << ", wall of " << wall
                                << std::string(tool.round ? ", ball: " : ", turning cylinder: ")
                                << tally.ticks << " ticks, " << tally.behind << " behind the face, "
                                << tally.crossed << " crossings, " << tally.unfelt
                                << " without force, " << tally.deepest << " units sunk at most, "
                                << tally.most_queries << " queries at most");
  return tally;
}

}  // namespace

TEST_CASE_TEMPLATE("no ball goes through a wall at any speed, or behind it without force", N,
                   FixedNumbers, DoubleNumbers) {
  for (const double wall : {50.0, 2.0}) {
    const Shaken tally = shaken<N>(wall, kBall);
    CHECK(tally.crossed == 0);
    CHECK(tally.unfelt == 0);
    CHECK(2 * tally.behind > tally.ticks);
    CHECK(tally.deepest < 0.05);
    CHECK(tally.most_queries <= SweepRules::kMaxQueries);
    CHECK(tally.longest_jump < SweepRules::kMaxQueries * SweepRules::kStep);
  }
}

TEST_CASE_TEMPLATE("no turning cylinder goes through a wall at any speed, or is unfelt behind it",
                   N, FixedNumbers, DoubleNumbers) {
  for (const double wall : {50.0, 2.0}) {
    const Shaken tally = shaken<N>(wall, kCylinder);
    CHECK(tally.crossed == 0);
    CHECK(tally.unfelt == 0);
    CHECK(2 * tally.behind > tally.ticks);
    CHECK(tally.deepest < 0.1);
    CHECK(tally.most_queries <= SweepRules::kMaxQueries);
    CHECK(tally.turned_late > 0);
  }
}
