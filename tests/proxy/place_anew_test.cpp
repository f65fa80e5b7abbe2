// SPDX-License-Identifier: Apache-2.0
// A tool that takes another's place, among bodies.
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "tests/proxy/support.hpp"
#include "tests/rig/contact_rig.hpp"

namespace kerf::place_anew_test {

using namespace kerf::test;

namespace {

template <class N>
ProxyPlan<N> plan() {
  return {.rotation_step = {}, .ramp_per_tick = typename N::Real(1)};
}

/// The state of a proxy that is sought anew around `at`, 600 ticks later; the hand is at `hand`.
template <class N>
ProxyState<N> placed_anew(ContactRig<N>& rig, Point at, Point hand) {
  ProxyState<N> state;
  state.pose.centre = place_of<N>(at);
  state.valid = true;
  state.search_again();
  for (int tick = 0; tick < 600; ++tick) {
    rig.field().begin_tick();
    rig.follow(plan<N>(), state, {place_of<N>(hand), {}});
  }
  return state;
}

constexpr double kRadius = 8;
const Point kMiddle{32, 32, 32};

}  // namespace

TEST_CASE_TEMPLATE("in a cavity with a play of 0.1 units a tool stays, wherever the hand is", N,
                   FixedNumbers, DoubleNumbers) {
  const SampledTool ball = tool_of_units("ball", kRadius, 2 * kRadius);
  const Body body =
      blurred({65, 65, 65}, [&](Point p) { return kRadius + 0.1 - length(p - kMiddle); });
  ContactRig<N> rig(ball, body);
  const ProxyState<N> state = placed_anew<N>(rig, kMiddle, {32, 90, 32});
  REQUIRE(state.valid);
  CHECK(length(point_of<N>(state.pose.centre) - kMiddle) < 0.3);
}

TEST_CASE_TEMPLATE("a larger tool comes off the wall on its own side", N, FixedNumbers,
                   DoubleNumbers) {
  const SampledTool ball = tool_of_units("ball", kRadius, 2 * kRadius);
  const Body wall = blurred({65, 65, 65}, [&](Point p) { return std::abs(p[1] - 32) - 1; });
  ContactRig<N> rig(ball, wall);
  for (const double above : {2.0, 4.0, 6.0, 7.5}) {  // where a smaller tool's centre was
    CAPTURE(above);
    const ProxyState<N> state = placed_anew<N>(rig, {32, 33 + above, 32}, {32, 10, 32});
    REQUIRE(state.valid);
    CHECK(point_of<N>(state.pose.centre)[1] == doctest::Approx(33 + kRadius).epsilon(0.005));
  }
}

TEST_CASE_TEMPLATE("a larger tool that has no room in its cavity is not put outside of the wall", N,
                   FixedNumbers, DoubleNumbers) {
  const SampledTool ball = tool_of_units("ball", kRadius, 2 * kRadius);
  for (const double wall : {3.0, 5.0}) {
    CAPTURE(wall);
    const Body shell = blurred({65, 65, 65}, [&](Point p) {
      const double from_middle = length(p - kMiddle);
      return std::max(7 - from_middle, from_middle - 7 - wall);
    });
    ContactRig<N> rig(ball, shell);
    for (const Point at : {kMiddle, kMiddle + Point{3, -2, 1}, kMiddle + Point{0, 0, 5.5}}) {
      const ProxyState<N> state = placed_anew<N>(rig, at, kMiddle);
      CHECK_FALSE(state.valid);
      CHECK(state.search.refused());
    }
  }
}

TEST_CASE_TEMPLATE("a tool that fits nowhere is refused until its goal is free", N, FixedNumbers,
                   DoubleNumbers) {
  const SampledTool ball = tool_of_units("ball", kRadius, 2 * kRadius);
  const Body solid = blurred({160, 160, 160}, [&](Point p) {
    return 4 - length(p - Point{80, 80, 80});
  });
  ContactRig<N> rig(ball, solid);
  ProxyState<N> state = placed_anew<N>(rig, {80, 80, 80}, {80, 80, 80});
  CHECK_FALSE(state.valid);
  CHECK(state.search.refused());
  rig.field().begin_tick();
  rig.follow(plan<N>(), state, {place_of<N>({80, 260, 80}), {}});
  CHECK(state.valid);
}

namespace {

/// Solid everywhere but 3 units out in one direction; allows so many queries a tick.
template <class N>
struct OneWayField : PlainField<N> {
  using typename PlainField<N>::Real;

  Contacts<N> query(ContactVec<Real> q) {
    --left;
    Contacts<N> felt;
    felt.no_normal = length(point_of<N>(q) - way_out) > 0.01;
    return felt;
  }
  [[nodiscard]] bool is_solid(ContactVec<Real>) const { return true; }
  [[nodiscard]] bool may_query() const { return left > 0; }
  void orient(const Orientation<N>&) { left = 5; }

  explicit OneWayField(Point out) : way_out(out) {}

  Point way_out;
  int left = 0;
};

}  // namespace

TEST_CASE_TEMPLATE("each of the 26 directions is looked at, however few queries a tick allows", N,
                   FixedNumbers, DoubleNumbers) {
  for (int direction = 0; direction < 27; ++direction) {
    const Point towards{double(direction % 3 - 1), double(direction / 3 % 3 - 1),
                        double(direction / 9 - 1)};
    if (length(towards) == 0) continue;
    OneWayField<N> field{3.0 * unit(towards)};
    StartSearch<N> search;
    ProxyPose<N> pose;
    int ticks = 0;
    while (search.tick(field, {}, pose) == ProxyStatus::searching) ++ticks;
    CHECK(ticks <= 26);  // of 4 directions each
    CHECK(length(point_of<N>(pose.centre) - field.way_out) < 0.01);
  }
}

}  // namespace kerf::place_anew_test
