// SPDX-License-Identifier: Apache-2.0
// The contact's normal at any iso: against planes and balls, whose densities rise over two voxels.
#include <algorithm>
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "tests/case_count.hpp"
#include "tests/rig/contact_motions.hpp"

namespace kerf::iso_test {

using namespace kerf::extremes;

TEST_CASE_TEMPLATE("a low or high iso tells the normal as well as one half of full density does", N,
                   FixedNumbers, DoubleNumbers) {
  // 1.5 times the largest angle of 100 rests at an iso of 0.45, degrees.
  struct Subject {
    std::string name;
    SceneTool shape;
    double allowed;
  };
  for (const auto& [name, shape, allowed] :
       {Subject{"ball", tool_of_units("ball", 8, 16), 0.7},
        Subject{"cylinder", tool_of_units("cylinder", 5, 16), 1.8},
        Subject{"cone", tool_of_units("cone", 5, 16), 1.25}}) {
    const SampledTool tool(shape);
    for (const double bump : {0.0, 14.0}) {
      const auto degrees_at = [&](double iso, double full) {
        return rest_at_iso<N>(shape, tool, iso, bump, 8, full).degrees;
      };
      INFO(name, " on ", bump);
      for (const double iso : {0.05, 0.1, 0.2, 0.3, 0.7, 0.8, 0.95}) {
        INFO("iso ", iso);
        CHECK(degrees_at(iso, 1) < allowed);
      }
      // The face's own middle counts, not that of full density.
      CHECK(degrees_at(0.05, 0.1) < allowed);
      CHECK(degrees_at(0.3, 0.35) < allowed);
    }
  }
}

TEST_CASE_TEMPLATE("walls of low iso hold a ball and a turning cylinder", N, FixedNumbers,
                   DoubleNumbers) {
  const ShakenTool ball, cylinder{.round = false, .radius = 5, .half = 8};
  for (const ShakenTool& tool : {ball, cylinder}) {
    const SampledTool made(tool.made());
    for (const double iso : {0.02, 0.05, 0.3}) {
      RandomNumbers random(3);
      Shaken seen;
      for (int wall = 0; wall < test::cases(8); ++wall) {
        const auto level = static_cast<Density>(std::lround(iso * kDensityMax));
        shake<N>(2, tool, made, 250, random, seen, level);
      }
      INFO("iso ", iso, ", round ", tool.round);
      CHECK(seen.crossed == 0);
      CHECK(seen.unfelt == 0);
    }
  }
}

TEST_CASE_TEMPLATE("a tool deep in solid is at no allowed place, however faint and noisy it is", N,
                   FixedNumbers, DoubleNumbers) {
  for (const std::string shape : {"ball", "cylinder", "cone", "inverted_cone", "flame", "wheel"}) {
    const SampledTool tool(tool_of_units(shape.c_str(), 5, 10));
    RandomNumbers random(5);
    for (const double level : {1.03, 1.2, 1.9, 2.0}) {
      for (const double noise : {0.0, 0.02, 0.2}) {
        const Body solid = body_of({44, 44, 44}, [&](Point) {
          return std::min(0.5 * (level + random.uniform(0, noise)), 1.0);
        });
        ContactRig<N> rig(tool, solid);
        for (int i = 0; i < 30; ++i) {
          rig.field().orient(random.rotation<N>(random.uniform(0, 3)));
          const Contacts<N> felt = rig.field().query(place_of<N>(
              {random.uniform(18, 26), random.uniform(18, 26), random.uniform(18, 26)}));
          INFO(shape, ", level ", level, ", noise ", noise, ", place ", i);
          CHECK((felt.no_normal || double(felt.depth) > SweepRules::kTolerance));
        }
      }
    }
  }
}

TEST_CASE_TEMPLATE("matter of 0.97 of the iso holds no tool, wherever and however it is pressed in",
                   N, FixedNumbers, DoubleNumbers) {
  for (const std::string shape : {"ball", "cylinder", "cone", "inverted_cone", "flame", "wheel"}) {
    const SampledTool tool(tool_of_units(shape.c_str(), 5, 10));
    RandomNumbers random(4);
    for (const int faces : {1, 2, 3}) {  // a flat, an edge, a corner
      for (const double noise : {0.0, 0.15, 0.6}) {
        const Frame frame(random, {21, 21, 21});
        const Body soft = body_of({44, 44, 44}, [&](Point p) {
          const Point at = frame.of(p);
          double deepest = at[1];
          if (faces > 1) deepest = std::max(deepest, at[0]);
          if (faces > 2) deepest = std::max(deepest, at[2]);
          return (0.97 - random.uniform(0, noise)) * 0.5 * std::clamp(0.5 - deepest / 2, 0.0, 1.0);
        });
        // Solid that was cut away since: the map of what bears nothing does not know.
        Body cut = soft;
        for (std::size_t i = 0; i < cut.density.size(); i += 5)
          cut.density[i] = static_cast<Density>(kDensityMax);
        ContactRig<N> rig(tool, cut);
        std::ranges::copy(soft.density, cut.density.begin());
        for (int i = 0; i < 100; ++i) {
          rig.field().orient(random.rotation<N>(random.uniform(0, 3)));
          const Point at =
              frame.at(random.uniform(-14, 8), random.uniform(-14, 8), random.uniform(-14, 8));
          const Contacts<N> felt = rig.field().query(place_of<N>(at));
          INFO(shape, ", faces ", faces, ", noise ", noise, ", place ", i);
          CHECK(double(felt.depth) <= SweepRules::kTolerance);
          CHECK(!felt.no_normal);
        }
      }
    }
  }
}

}  // namespace kerf::iso_test
