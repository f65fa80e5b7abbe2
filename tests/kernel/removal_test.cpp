// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/kernel/milling.hpp"
#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// The fraction of a voxel with overlap `ratio` (0..1) that one tick removes.
template <class N>
double fraction(const RemovalRate<N>& rate, double ratio) {
  const auto weight = static_cast<typename N::Weight>(ratio * double(N::kWeightOne));
  const double scale = std::ldexp(1.0, -rate.exponent) / double(N::kWeightOne);
  return double(bent_ratio(rate, weight)) / double(N::kWeightOne) * double(rate.mantissa) * scale;
}

}  // namespace

TEST_CASE_TEMPLATE("the linear rate removes r kT, at most everything", N, FixedNumbers,
                   DoubleNumbers) {
  for (const double kt : {1e-6, 1e-5, 0.02, 0.25, 0.5, 0.75, 1.0}) {
    const auto rate = removal_rate<N>(kt, false);
    for (const double r : {0.0, 0.25, 0.5, 1.0}) {
      CHECK(fraction(rate, r) == doctest::Approx(r * kt).epsilon(3.1e-5));
    }
  }
  CHECK(fraction(removal_rate<N>(7.0, false), 1.0) == 1.0);
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(fraction(removal_rate<N>(inf, false), 1.0) == 1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double nothing : {0.0, -1.0, nan}) {
    CHECK(fraction(removal_rate<N>(nothing, false), 1.0) == 0.0);
    CHECK(fraction(removal_rate<N>(nothing, true), 1.0) == 0.0);
  }
}

TEST_CASE_TEMPLATE(
    "the exact rate removes 1 - exp(-r kT) within its stated bound, never less for "
    "more overlap",
    N, FixedNumbers, DoubleNumbers) {
  for (const double kt : {1e-6, 0.001, 0.02, 0.5, 1.0, 3.0, 10.0, 42.0, 1e9}) {
    const auto rate = removal_rate<N>(kt, true);
    const double whole = -std::expm1(-kt);
    const double used = std::min(kt, kMaxRateTimesTick);
    const double bound = used * used / (8 * 256.0 * 256.0) + 3.5 / 32768 * whole;
    double before = 0;
    for (int n = 0; n <= 32768; n += 11) {
      const double r = n / 32768.0;
      const double removed = fraction(rate, r);
      CHECK(std::abs(removed + std::expm1(-r * used)) <= bound);
      CHECK(removed >= before);
      before = removed;
    }
    CHECK(fraction(rate, 1.0) == doctest::Approx(whole).epsilon(3.1e-5));
  }
}

TEST_CASE("with the exact form two half ticks remove what one tick does") {
  const TestVolume full = filled({64, 12, 12}, 65535);
  const auto tool = odd_ball(3);
  const auto pose = pose_at<FixedNumbers>({20.3, 6.2, 6.4});
  for (const double kt : {0.05, 0.5, 2.0}) {
    std::array<double, 2> left{};
    for (const int pieces : {1, 2}) {
      TestVolume volume = full;
      Cutter<FixedNumbers> cutter(16);
      const auto rate = removal_rate<FixedNumbers>(kt / pieces, true);
      std::uint64_t gone = 0;
      for (int n = 0; n < pieces; ++n) {
        gone += cut<FixedNumbers>(volume, tool, pose, rate, cutter).density_steps;
      }
      left[static_cast<std::size_t>(pieces - 1)] = double(gone);
    }
    CHECK(left[1] == doctest::Approx(left[0]).epsilon(1e-4));
  }
}

TEST_CASE_TEMPLATE("kT = 1 with whole overlap removes everything at once", N, FixedNumbers,
                   DoubleNumbers) {
  TestVolume volume = random_volume({64, 20, 20}, 4);
  const auto tool = odd_ball(4);
  Cutter<N> cutter(16);
  for (auto& owed : cutter.carry) {
    owed = N::kIsFixed ? static_cast<RemovalCarry<N>>(65535)
                       : std::nextafter(static_cast<RemovalCarry<N>>(1), RemovalCarry<N>{});
  }
  cut<N>(volume, tool, pose_at<N>({20, 10, 10}), removal_rate<N>(1.0, false), cutter);
  for (const ToolOffset& offset : tool) {
    CHECK(volume.density[volume.grid.index(20 + offset[0] / 2, 10 + offset[1] / 2,
                                           10 + offset[2] / 2)] == 0);
  }
}

TEST_CASE_TEMPLATE("what remove reports is what the volume lost, and its box holds every change", N,
                   FixedNumbers, DoubleNumbers) {
  CHECK(rc::check([](std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    TestVolume volume = random_volume({52, 14, 13}, seed);
    const auto tool = odd_ball(3);
    Cutter<N> cutter(16);
    const bool exact = random() % 2 == 0;
    const auto rate = removal_rate<N>(std::pow(10.0, within(-5, 0.5)), exact);
    for (int n = 0; n < 5; ++n) {
      const TestVolume before = volume;
      const auto pose = turned_pose<N>({within(-4, 56), within(-4, 18), within(-4, 17)},
                                       {within(-1, 1), within(-1, 1), within(-1, 1), 1.5});
      const Removed removed = cut<N>(volume, tool, pose, rate, cutter);
      RC_ASSERT(total_density(before) - total_density(volume) == removed.density_steps);
      VoxelBox changed;
      for (std::int32_t z = 0; z < volume.grid.nz; ++z) {
        for (std::int32_t y = 0; y < volume.grid.ny; ++y) {
          for (std::int32_t x = 0; x < volume.grid.nx; ++x) {
            const std::size_t at = volume.grid.index(x, y, z);
            RC_ASSERT(volume.density[at] <= before.density[at]);
            if (volume.density[at] == before.density[at]) continue;
            changed = changed.united({{x, y, z}, {x + 1, y + 1, z + 1}});
          }
        }
      }
      RC_ASSERT(changed == removed.changed);
    }
  }));
}

TEST_CASE("a tool with too little carry removes nothing, and the border keeps its lanes") {
  TestVolume volume = filled({64, 12, 12}, 65535);
  const auto tool = odd_ball(3);
  Cutter<FixedNumbers> cutter(16);
  const auto rate = removal_rate<FixedNumbers>(1.0, false);
  // Seven tool voxels and one more from the cell of the last: x 17..24, lanes 2..9.
  overlap<FixedNumbers>(volume.grid, tool, pose_at<FixedNumbers>({20.3, 6, 6}),
                        FixedNumbers::kStepOne, cutter.overlap);
  CHECK(cutter.overlap.lane_zero_vox == 15);
  const std::span<RemovalCarry<FixedNumbers>> carry = cutter.carry;
  const auto removed = [&](std::size_t lanes) {
    return remove<FixedNumbers>(volume.grid, volume.density, cutter.overlap, rate,
                                carry.first(lanes))
        .density_steps;
  };
  CHECK(removed(9) == 0);
  CHECK(removed(10) > 0);
  // Half outside: lanes still count from the tool's own lowest cell.
  overlap<FixedNumbers>(volume.grid, tool, pose_at<FixedNumbers>({-0.7, 6, 6}),
                        FixedNumbers::kStepOne, cutter.overlap);
  CHECK(cutter.overlap.lane_zero_vox == -6);
}
