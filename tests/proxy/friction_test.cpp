// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "tests/proxy/support.hpp"

namespace kerf::friction_test {

using namespace kerf::test;

namespace {

template <class N>
struct Rubbing {
  explicit Rubbing(double coefficient) : friction(static_cast<typename N::Unit>(coefficient)) {}
  /// Where the proxy goes that is pulled to `hand`, the floor being at height 0.
  Point tick(Point hand) {
    ProxySweep<N, FlatField<N>>(field, pose, memory, friction, {}).tick({place_of<N>(hand), {}});
    return point_of<N>(pose.centre);
  }

  FlatField<N> field{{0, 1, 0}};
  ProxyPose<N> pose{place_of<N>({0, 0.5, 0}), {}};
  SweepMemory<N> memory;
  typename N::Unit friction;
};

}  // namespace

TEST_CASE_TEMPLATE("a proxy sticks within the cone of friction, and slips behind the hand beyond",
                   N, FixedNumbers, DoubleNumbers) {
  Rubbing<N> rubbing(0.25);
  const double x0 = rubbing.tick({0, -2, 0})[0];
  double stuck = 0;
  for (double x = 0; x < 0.49; x += 0.01) stuck = rubbing.tick({x, -2, 0})[0];
  CHECK(stuck == x0);  // not by a step
  for (double x = 0.5; x < 6; x += 0.01) {
    const Point place = rubbing.tick({x, -2, 0});
    CHECK(x - place[0] == doctest::Approx(0.5).epsilon(0.02));
    CHECK(std::abs(place[1]) < 0.011);
  }
  // Towards the floor nothing rubs: the tool does not stick above it.
  Rubbing<N> falling(1);
  CHECK(std::abs(falling.tick({0, -2, 0})[1]) < 0.011);
  // Back: a whole cone of nothing, then the same the other way.
  const double turned = rubbing.tick({6, -2, 0})[0];
  for (double x = 6; x > 5.02; x -= 0.01) CHECK(rubbing.tick({x, -2, 0})[0] == turned);
  for (double x = 4.9; x > 0; x -= 0.01) {
    CHECK(rubbing.tick({x, -2, 0})[0] - x == doctest::Approx(0.5).epsilon(0.02));
  }
}

TEST_CASE_TEMPLATE("friction follows the load", N, FixedNumbers, DoubleNumbers) {
  for (const double load : {0.5, 1.0, 4.0}) {
    Rubbing<N> rubbing(0.5);
    Point place{};
    for (int i = 0; i <= 160; ++i) place = rubbing.tick({0.05 * i, -load, 0});
    CHECK(8 - place[0] == doctest::Approx(0.5 * load).epsilon(0.02));
  }
}

TEST_CASE_TEMPLATE("no friction in the air, and none at 0", N, FixedNumbers, DoubleNumbers) {
  Rubbing<N> air(1);
  CHECK(length(air.tick({3, 1, 2}) - Point{3, 1, 2}) < 0.01);
  Rubbing<N> ice(0);
  CHECK(length(ice.tick({3, -2, 2}) - Point{3, 0, 2}) < 0.02);
}

}  // namespace kerf::friction_test
