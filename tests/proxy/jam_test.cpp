// SPDX-License-Identifier: Apache-2.0
// What holds a tool that the hand turns about, in a slot that lets it turn no farther, lets it out.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <doctest/doctest.h>

#include "tests/case_count.hpp"
#include "tests/rig/contact_rig.hpp"

namespace kerf::jam_test {

using namespace kerf::extremes;

namespace {

constexpr double kTop = 50, kBottom = 30;

enum class Hollow { well, slot };

/// A hole along y at `middle` through a block whose top is at kTop.
Body block_with(Hollow hollow, double radius, double middle) {
  return blurred({60, 100, 60}, [=](Point p) {
    const double x = p[0] - middle, z = p[2] - middle;
    const double inside = hollow == Hollow::slot ? std::abs(z) : std::hypot(x, z);
    return std::max(radius - inside, p[1] - kTop);
  });
}

template <class N>
Orientation<N> about(std::size_t axis, double angle_rad) {
  using Unit = typename N::Unit;
  Unit half[3] = {};
  half[axis] = Unit(std::sin(angle_rad / 2));
  return {half[0], half[1], half[2], Unit(std::cos(angle_rad / 2))};
}

/// How the hand turns a tool at `middle`: tilted, and about its axis by so much a tick.
struct Twist {
  double middle, tilt_rad, spin_rad;
};

/// Ticks until the tool is out: it is held there for 50 ticks and then pulled up by 0.2 units a
/// tick.
template <class N>
int ticks_out(const SampledTool& tool, const Body& body, double half, const Twist& twist,
              int at_most) {
  GuidedTool<N> guided(tool, body, {twist.middle, kBottom, twist.middle});
  int tick = 0, out = 0;
  const auto pull = [&](double height) {
    const auto spin = about<N>(1, std::remainder(twist.spin_rad * tick++, 4 * std::numbers::pi));
    guided.tick({twist.middle, height, twist.middle}, compose(about<N>(0, twist.tilt_rad), spin));
  };
  while (tick < 50) pull(kBottom);
  while (out < at_most && guided.proxy()[1] - half < kTop + 3) {
    pull(std::min(kBottom + 0.2 * ++out, 90.0));
  }
  return out;
}

}  // namespace

TEST_CASE_TEMPLATE("a tool that turns on and on askew in a tight hollow is pulled out", N,
                   FixedNumbers, DoubleNumbers) {
  struct Cylinder {
    double radius, length;
  };
  RandomNumbers random(1);
  const int rounds = test::cases(N::kIsFixed ? 40 : 5);
  for (const auto [radius, length] : {Cylinder{7, 20}, Cylinder{8, 24}, Cylinder{10, 30}}) {
    const SampledTool tool(tool_of_units("cylinder", radius, length));
    const int lifted = static_cast<int>((kTop + 3 + length / 2 - kBottom) / 0.2);
    for (int round = 0; round < rounds; ++round) {
      for (const Hollow hollow : {Hollow::well, Hollow::slot}) {
        const double play = random.uniform(0.12, 0.6);
        const bool fast = random.uniform(0, 1) < 0.5;
        const Twist twist{random.uniform(29.5, 30.5), random.uniform(0.03, 0.2),
                          fast ? random.uniform(0.3, 3) : random.uniform(0.02, 0.3)};
        const Body body = block_with(hollow, radius + play, twist.middle);
        CAPTURE(length);
        CAPTURE((hollow == Hollow::slot));
        CAPTURE(play);
        CAPTURE(twist.tilt_rad);
        CAPTURE(twist.spin_rad);
        CHECK(ticks_out<N>(tool, body, length / 2, twist, 2 * lifted) < 2 * lifted);
      }
    }
  }
}

// The close look sees one of two sides at a time. Where it came to see the other, the depth rose
// from 0 to 0.18 units within 0.01, and no way led on, though most of the well was open.
TEST_CASE_TEMPLATE("a tool between two sides of a well goes on when its look finds the other", N,
                   FixedNumbers, DoubleNumbers) {
  struct Jam {
    double play;
    Twist twist;
  };
  const SampledTool tool(tool_of_units("cylinder", 7, 20));
  for (const auto& [play, twist] : {Jam{0.183966, {29.928934, 0.189929, 0.0933202}},
                                    Jam{0.153145, {29.622621, 0.166233, 0.214833}},
                                    Jam{0.174887, {30.322524, 0.166975, 0.222478}},
                                    Jam{0.120628, {29.709777, 0.168487, 1.3526}}}) {
    CAPTURE(play);
    const Body body = block_with(Hollow::well, 7 + play, twist.middle);
    CHECK(ticks_out<N>(tool, body, 10, twist, 330) < 330);
  }
}

}  // namespace kerf::jam_test
