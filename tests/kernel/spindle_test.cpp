// SPDX-License-Identifier: Apache-2.0
// The spindle, where the tool's surface is how fast, and what its friction gives back.
#include "controller/kernel/spindle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "tests/kernel/preston_support.hpp"

namespace kerf::spindle_test {

using namespace kerf::test;

namespace {

constexpr double kStallNMm = 3.0, kRunUpS = 0.048;  // whole ticks at every rate

template <class N>
SpindleState<N> after(double seconds, double torque_n_mm, SpindleState<N> state = {},
                      double free_ratio = 1, int rate_hz = 1000, bool on = true) {
  const auto plan = spindle_plan<N>(free_ratio, kStallNMm, kRunUpS, 1.0 / rate_hz);
  const auto ticks = std::lround(seconds * rate_hz);
  for (int i = 0; i < ticks; ++i) {
    turn_spindle(plan, on, typename N::Real(torque_n_mm), state);
  }
  return state;
}

template <class N>
using Force = Vec<typename N::Real, ToolSpace>;

}  // namespace

TEST_CASE("the decay needs no libm and is as good") {
  for (const double x : {0.0, 1e-9, 0.01, 0.25, 1.0, 2.0, 10.0, 41.9, 50.0}) {
    CHECK(std::abs(decay(x) + std::expm1(-x)) < 1e-13);
  }
}

TEST_CASE_TEMPLATE("the spindle runs up, slows down under load and stalls", N, FixedNumbers,
                   DoubleNumbers) {
  for (const int rate_hz : {250, 1000, 8000}) {
    const auto ratio = [&](double seconds, double torque_n_mm) {
      return double(after<N>(seconds, torque_n_mm, {}, 1, rate_hz).ratio);
    };
    CHECK(std::abs(ratio(kRunUpS, 0) - (1 - std::exp(-1))) < 1e-4);
    CHECK(std::abs(ratio(1, 0) - 1) < 1e-4);
    CHECK(std::abs(ratio(1, 0.6) - 0.8) < 1e-4);  // a fifth of the stall torque
    CHECK(ratio(1, 3) < 1e-4);
    CHECK(ratio(1, 3) >= 0);
  }
  const auto running = after<N>(1, 0.6);
  CHECK(std::abs(double(running.load) - 0.2) < 1e-4);
  const auto stalled = after<N>(1, 30, running);
  CHECK(double(stalled.ratio) < 1e-4);
  CHECK(std::abs(double(stalled.load) - 10) < 1e-2);
  CHECK(std::abs(double(after<N>(1, 0, stalled).ratio) - 1) < 1e-4);    // turns again
  CHECK(std::abs(double(after<N>(1, 0, {}, 0.5).ratio) - 0.5) < 1e-4);  // at half the speed
  const auto braked = after<N>(kRunUpS, 0, running, 1, 1000, false);
  CHECK(std::abs(double(braked.ratio) - 0.8 * std::exp(-1)) < 1e-4);
  CHECK(double(after<N>(1, 32767, running).load) == kMaxSpindleLoad);
}

TEST_CASE("the surface's speed is the distance from the axis, down to the floor") {
  std::mt19937 random(2);
  const auto within = [&](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
  };
  double worst = 0;
  for (int n = 0; n < 20'000; ++n) {
    const std::array<double, 3> centre{within(20, 60), within(20, 60), within(20, 60)};
    const double rim = within(2, 12);
    const Axis axis = static_cast<Axis>(n % 3);
    const auto frame = frame_at(centre, rim, axis);
    const VoxelIndex first{static_cast<std::int32_t>(centre[0]) - 14,
                           static_cast<std::int32_t>(centre[1] + within(-14, 14)),
                           static_cast<std::int32_t>(centre[2] + within(-14, 14))};
    const auto i = static_cast<std::int32_t>(within(0, 28));
    std::array<double, 3> from_axis{first.x + i - centre[0], first.y - centre[1],
                                    first.z - centre[2]};
    from_axis[static_cast<std::size_t>(axis)] = 0;
    const double distance = std::hypot(from_axis[0], from_axis[1], from_axis[2]) / rim;
    auto place = frame.at(first);
    for (std::int32_t n_x = 0; n_x < i; ++n_x) place = place + frame.step();
    const double speed = double(frame.speed(place)) / 32768;
    worst = std::max(worst, std::abs(speed - std::clamp(distance, kSpeedFloor, 1.0)));
  }
  CHECK(worst < 2e-4);
  const auto at_pole = frame_at({20, 20, 20}, 8).at({20, 3, 20});
  CHECK(std::abs(double(SpindleFrame<FixedNumbers>::speed(at_pole)) / 32768 - 0.08) < 1e-4);
}

TEST_CASE_TEMPLATE("friction pulls against the surface's motion, and not at the pole", N,
                   FixedNumbers, DoubleNumbers) {
  const auto outcome = [](Axis axis, std::array<double, 3> centre) {
    PrestonRig<N> rig(solid({40, 40, 40}, [](double x, double, double) { return x - 20; }),
                      odd_ball(8), 8);
    rig.axis = axis;
    return rig.press(centre, 1).drag;
  };
  const auto plan = friction_plan<N>(0.5, 0.001);
  const auto friction = [&](const SurfaceDrag<N>& drag) {
    CuttingFriction<N> sum;
    sum.add(plan, typename N::Real(2), drag);
    return sum;
  };
  // A ball that touches the wall on its low-x side, at (-1, 0, 0) of its frame, and turns about -y:
  // -y x (-x) = -z, so the surface moves along -z there and the wall pulls the tool along +z. Seen
  // from the shaft, at +y with x to the right, z points down: the surface goes up on the left side,
  // clockwise.
  const auto side = outcome(Axis::y, {27.3, 20, 20});
  CHECK(std::abs(double(side.x)) < 0.01);
  CHECK(double(side.z) < -0.95);
  CHECK(double(side.lever_ratio) > 0.9);
  const auto at_side = friction(side);
  CHECK(std::abs(double(at_side.force_n().z) + 0.5 * 2 * double(side.z)) < 1e-4);
  CHECK(std::abs(double(at_side.torque_n_mm(typename N::Real(0.5))) -
                 0.5 * double(side.lever_ratio)) < 1e-4);
  // With the axis along x the pole touches: the surface moves all ways around, slowly.
  const auto pole = outcome(Axis::x, {27.3, 20, 20});
  CHECK(std::hypot(double(pole.x), double(pole.z)) < 0.01);
  CHECK(double(pole.lever_ratio) < 0.5);
  // What a ball covers agrees with what its load alone tells.
  using Unit = typename N::Unit;
  const auto by_load = [](double x, double y, Unit lever_ratio) {
    return ball_drag<N>({Unit(x), Unit(y), Unit(0)}, lever_ratio);
  };
  CHECK(std::abs(double(by_load(1, 0, side.lever_ratio).x)) < 1e-6);
  CHECK(std::abs(double(by_load(1, 0, side.lever_ratio).z - side.z)) < 0.05);
  CHECK(by_load(0, 1, pole.lever_ratio).z == Unit(0));
  CHECK(std::abs(double(by_load(-0.6, 0.8, Unit(0.6)).z) - 1) < 1e-6);
  CHECK(std::abs(double(by_load(-0.6, 0.8, Unit(0.8)).z) - 0.75) < 1e-6);  // all round its bore
}

TEST_CASE_TEMPLATE("friction is bounded and follows within its time constant at every rate", N,
                   FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  for (const int rate_hz : {250, 1000, 8000}) {
    const auto plan = friction_plan<N>(0.5, 1.0 / rate_hz);
    CuttingFriction<N> wanted;
    wanted.add(plan, Real(2), {Unit(1), Unit(1), Unit(1)});  // as long as no drag can be
    CHECK(std::hypot(double(wanted.force_n().x), double(wanted.force_n().z)) < 1 + 1e-4);
    Force<N> felt;
    const int ticks = rate_hz * 8 / 1000;
    for (int i = 0; i < ticks; ++i) follow_friction<N>(plan, wanted.force_n(), felt);
    const double part = 1 - std::exp(-0.008 / kFrictionSmoothingS);
    CHECK(std::abs(double(felt.x) - part * double(wanted.force_n().x)) < 3e-4);
    for (int i = 0; i < rate_hz; ++i) follow_friction<N>(plan, {}, felt);
    const double rest_n = N::kIsFixed ? 0x1p-17 / double(plan.approach) : 1e-12;
    CHECK(std::abs(double(felt.x)) <= rest_n);
  }
}

}  // namespace kerf::spindle_test
