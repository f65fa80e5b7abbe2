// SPDX-License-Identifier: Apache-2.0
// Only the tool's surface feels, with samples 1 unit apart: how small a loose bit of material
// may be until it slips in between them, and what becomes of it then.
#include <algorithm>
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "tests/kernel/contact_support.hpp"

namespace kerf::debris_test {

using namespace kerf::test;

namespace {

constexpr double kRadius = 8;

struct Tally {
  int swallowed = 0, kept = 0;
  double pulled = 0;  ///< spring at most, on the way out
};

/// A ball pushed straight at a round bit, 5 units beyond the touch, and pulled back.
template <class N>
Tally pushed_at_bits(double bit_radius, int bits) {
  RandomNumbers random(5);
  Tally tally;
  for (int i = 0; i < bits; ++i) {
    const Point bit =
        Point{20, 20, 20} + Point{random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)};
    const Point direction = random.direction(), start = bit - 12 * direction;
    const TestVolume volume =
        blurred({41, 41, 41}, [&](Point p) { return length(p - bit) - bit_radius; });
    ContactRig<N> rig(tool_of_units("ball", kRadius, 2 * kRadius), volume);
    ProxyPose<N> pose{place_of<N>(start), {}};
    SweepMemory<N> memory;
    const auto spring = [&](double gone) {
      const Point hand = start + gone * direction;
      ProxySweep<N, ContactQuery<N>>(rig.field(), pose, memory, {}, {})
          .tick({place_of<N>(hand), {}});
      return length(point_of<N>(pose.centre) - hand);
    };
    for (double gone = 0; gone < 9; gone += 0.1) spring(gone);
    if (length(point_of<N>(pose.centre) - bit) > kRadius - bit_radius) continue;
    ++tally.swallowed;
    double last = 0;
    for (double gone = 9; gone > -3; gone -= 0.1) {
      last = spring(gone);
      tally.pulled = std::max(tally.pulled, last);
    }
    tally.kept += last > 0.01 ? 1 : 0;
  }
  return tally;
}

}  // namespace

TEST_CASE_TEMPLATE("a bit of 1.5 units stops a ball; one of 1.2 may slip in, and lets go again", N,
                   FixedNumbers, DoubleNumbers) {
  CHECK(pushed_at_bits<N>(0.75, 60).swallowed == 0);
  const Tally small = pushed_at_bits<N>(0.6, 60);
  MESSAGE(std::string(N::kName) << ": " << small.swallowed << " of 60 swallowed, " << small.kept
                                << " kept, a spring of " << small.pulled << " units at most");
  CHECK(small.swallowed < 40);
  CHECK(small.kept == 0);
  CHECK(small.pulled < 0.5);
}

}  // namespace kerf::debris_test
