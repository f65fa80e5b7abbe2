// SPDX-License-Identifier: Apache-2.0
// A tool with a shaft in the whole servo step: what it feels, cuts and tells.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::shaft_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

constexpr ShaftSize kShaft{.radius_mm = 0.5, .length_mm = 6.0};

/// A ball of radius 1 mm that stands upright, with this shaft.
LoadedScene upright_scene(const std::function<double(double, double, double)>& signed_distance_mm,
                          const ShaftSize& shaft = kShaft) {
  LoadedScene scene = half_space_scene(8);
  scene.volumes[0] = volume_of(
      64, kVoxelMm, [&](double x, double y, double z) { return signed_distance_mm(x, y, z) / 2; });
  scene.tools[0].turns = false;
  scene.tools[0].shaft = tool_shaft(shaft, 2);
  scene.cut.model = CutModel::preston;
  scene.cut.threshold_n = 0.0625;
  return scene;
}

/// Solid at x < 0 between the heights 2 and 3.
double ledge(double x, double y, double) {
  return std::max(x, std::abs(y - 2.5) - 0.5);
}
double ledge_and_floor(double x, double y, double z) {
  return std::min(ledge(x, y, z), y + 2);
}

}  // namespace

TEST_CASE("what the shaft presses on is felt, told and never cut, in every kind of numbers") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const int rate_hz : {250, 1000, 8000}) {
      CAPTURE(static_cast<int>(numeric));
      CAPTURE(rate_hz);
      LoadedScene scene = upright_scene(ledge);
      scene.servo.numeric = numeric;
      scene.servo.rate_hz = rate_hz;
      CuttingHand miller(scene, {2, 0, 0});
      miller.hold({1.4, 0, 0}, 0.05);
      CHECK_FALSE(miller.hold({0.7, 0, 0}, 0.05).shaft);
      miller.hold({-0.3, 0, 0}, 0.05);  // in steps below the limit of speed
      const ServoOutput out = miller.hold({-1.3, 0, 0}, 0.3);
      const double depth_mm = 0.5 - out.position_mm[0];  // of the axis
      CHECK(out.commanded_force_n[0] == doctest::Approx(0.4 * depth_mm).epsilon(0.02));
      CHECK(std::hypot(out.commanded_force_n[1], out.commanded_force_n[2]) <
            0.02 * out.commanded_force_n[0]);
      // At the ledge's middle, 2.5 above the tip.
      CHECK(out.tip_torque_n_mm[2] ==
            doctest::Approx(-(2.5 - out.position_mm[1]) * out.commanded_force_n[0]).epsilon(0.03));
      CHECK(out.shaft);
      CHECK(out.press_n == 0);
      CHECK(out.spindle_load == 0);
      CHECK(length(out.modification_n) == 0);
      CHECK(miller.removed_mm3() == 0);
    }
  }
}

TEST_CASE("a handpiece behind the shaft is felt as the shaft is, in every kind of numbers") {
  constexpr ShaftSize kBoth{.radius_mm = 0.3,
                            .length_mm = 2.5,
                            .handpiece_radius_mm = 0.8,
                            .handpiece_length_mm = 3.0};  // from 1.5 above the centre on
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = upright_scene(ledge, kBoth);
    scene.servo.numeric = numeric;
    CuttingHand miller(scene, {2, 0, 0});
    CHECK_FALSE(miller.hold({1, 0, 0}, 0.05).shaft);
    miller.hold({0, 0, 0}, 0.05);
    const ServoOutput out = miller.hold({-0.8, 0, 0}, 0.3);
    CHECK(out.commanded_force_n[0] ==
          doctest::Approx(0.4 * (0.8 - out.position_mm[0])).epsilon(0.02));
    CHECK(out.shaft);
    CHECK(out.press_n == 0);
    CHECK(miller.removed_mm3() == 0);
  }
}

TEST_CASE("the flag is set while the shaft bears more than 0.01 N, and at no other time") {
  LoadedScene scene = upright_scene(ledge_and_floor);
  scene.cut.model = CutModel::none;
  ArmedServo armed(scene, {3, 3, -3});
  for (const std::array<double, 3>& at : {std::array{3.0, 1.0, 0.0}, {3.0, -1.5, 0.0}}) {
    CHECK_FALSE(armed.settled(at[0], at[1], at[2]).shaft);  // in air, and on the head
  }
  int touching = 0;
  for (int tick = 0; tick < 400; ++tick) {
    const ServoOutput out = armed.step(1.5 - 1.6 * std::sin(0.02 * tick), 0, 0);
    CHECK(out.shaft == (length(out.contact_force_n) > 0.01));  // nothing else is touched here
    touching += out.shaft ? 1 : 0;
  }
  CHECK(touching > 50);
  CHECK(touching < 350);
}

TEST_CASE("a head that is pressed beside its shaft cuts by its own part of the force") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = upright_scene(ledge_and_floor);
    scene.servo.numeric = numeric;
    scene.cut.friction = 0;
    scene.cut.machinability_mm3_per_s_n = 0.1;
    CuttingHand miller(scene, {2, 0, 0});
    miller.hold({1, -0.9, 0}, 0.1);
    const ServoOutput out = miller.hold({-1.5, -2.2, 0}, 0.3);
    CHECK(out.shaft);
    CHECK(out.commanded_force_n[0] ==
          doctest::Approx(0.4 * (0.5 - out.position_mm[0])).epsilon(0.02));
    CHECK(out.press_n == doctest::Approx(out.commanded_force_n[1]).epsilon(0.02));
    CHECK(miller.removed_mm3() > 0.001);
    CHECK(miller.removed_mm3() == doctest::Approx(miller.fed_mm3()).epsilon(0.001));
  }
}

TEST_CASE("a ball that cuts its own bore is not held by its shaft, neither in nor out") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    const auto bored_mm3 = [&](const ShaftSize& shaft) {
      LoadedScene scene = upright_scene([](double, double y, double) { return y - 2; }, shaft);
      scene.servo.numeric = numeric;
      scene.cut.machinability_mm3_per_s_n = 40;
      CuttingHand miller(scene, {0, 3.2, 0});
      double proxy_mm = 3;
      for (int ticks = 0; proxy_mm > -2 && ticks < 3000; ++ticks) {
        const ServoOutput out = miller.step({0, proxy_mm - 1.5, 0});  // presses with 0.6 N
        proxy_mm = out.position_mm[1] + out.proxy_offset_mm[1];
        REQUIRE_FALSE(out.shaft);
      }
      CHECK(proxy_mm <= -2);
      for (int tick = 0; tick < 500; ++tick) {
        REQUIRE(length(miller.step({0, -2 + 0.01 * tick, 0}).commanded_force_n) < 0.05);
      }
      return miller.removed_mm3();
    };
    CHECK(bored_mm3({.radius_mm = 0.6, .length_mm = 6.0}) ==
          doctest::Approx(bored_mm3({})).epsilon(0.01));
  }
}

TEST_CASE("a ball with a shaft turns with the stylus: it is told and drawn turned") {
  LoadedScene bare = upright_scene(ledge), shafted = upright_scene(ledge);
  bare.tools[0].shaft = {};
  bare.tools[0].turns = shafted.tools[0].turns = true;
  ArmedServo without(bare, {3, 5, -10}), with(shafted, {3, 5, -10});
  for (const std::array<double, 3>& at : {std::array{3.0, 5.0, -10.0}, {20.0, 10.0, -5.0}}) {
    const ServoOutput a = without.settled(at[0], at[1], at[2]);
    const ServoOutput b = with.settled(at[0], at[1], at[2]);
    for (std::size_t i = 0; i < 9; ++i) CHECK(std::abs(a.rotation[i] - b.rotation[i]) < 1e-6);
    CHECK(std::abs(a.rotation[4]) < 0.999);  // it leans
  }
}

TEST_CASE("a shaft in a slot does not turn with the stylus: its own orientation is told") {
  LoadedScene shafted = upright_scene([](double, double y, double z) {
    return std::max(1 - std::abs(z), std::abs(y - 2.5) - 0.5);
  });
  shafted.tools[0].turns = true;
  shafted.cut.model = CutModel::none;
  LoadedScene bare = shafted;
  bare.tools[0].shaft = {};
  ArmedServo with(shafted, {12, 0, 0}), without(bare, {12, 0, 0});
  /// Largest difference of an element of the orientations that are told.
  const auto lag = [&](double x) {
    const auto a = with.settled(x, 0, 0).rotation, b = without.settled(x, 0, 0).rotation;
    double most = 0;
    for (std::size_t i = 0; i < 9; ++i) most = std::max(most, std::abs(a[i] - b[i]));
    return most;
  };
  const auto turn = [&](const std::array<double, 3>& rad) {
    for (ArmedServo* servo : {&with, &without}) servo->arm.turn_wrist(rad);
  };
  constexpr std::array kUpright{0.0, 0.85, 0.0};
  for (int cycle = 0; cycle < 2; ++cycle) {
    turn(kUpright);
    CHECK(lag(12) < 1e-4);  // in air both follow the stylus
    for (double x = 12; x > -1; x -= 0.5) static_cast<void>(lag(x));
    double held = 0;
    for (const auto& rad : {std::array{0.0, 0.0, 0.0}, {0.0, 1.4, 0.0}}) {
      turn(rad);
      held = std::max(held, lag(0));
    }
    CHECK(held > 0.05);
    turn(kUpright);
    for (double x = 0; x < 12; x += 0.5) static_cast<void>(lag(x));
  }
}

TEST_CASE("a shaft comes and goes with its tool, and is pushed out with a ramp") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = upright_scene(ledge);
    scene.servo.numeric = numeric;
    scene.cut.model = CutModel::none;
    scene.tools.push_back(scene.tools[0]);
    scene.tools[1].shaft = {};
    ArmedServo armed(scene, {3, 3, -3});
    armed.settled(2, 0, 0);
    const ServoOutput held = armed.settled(-1.3, 0, 0);
    CHECK(held.shaft);
    CHECK(held.commanded_force_n[0] > 0.6);
    for (int time = 0; time < 2; ++time) {
      CHECK(armed.servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = 1}));
      const ServoOutput bare = armed.settled(-1.3, 0, 0);
      CHECK(length(bare.commanded_force_n) <
            1e-12);  // in double the proxy rests within a rounding of the hand
      CHECK_FALSE(bare.shaft);
      CHECK(armed.servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = 0}));
      double last_n = 0;
      for (int tick = 0; tick < 100; ++tick) {
        const ServoOutput out = armed.step(-1.3, 0, 0);
        CHECK(length(out.contact_force_n) <= last_n + 0.1 + 1e-3);
        last_n = length(out.contact_force_n);
      }
      CHECK(last_n == doctest::Approx(held.commanded_force_n[0]).epsilon(0.02));
    }
  }
}

TEST_CASE("ticks with a shaft and a handpiece never touch the heap") {
  LoadedScene scene = upright_scene(
      ledge_and_floor,
      {.radius_mm = 0.5, .length_mm = 5.0, .handpiece_radius_mm = 2.0, .handpiece_length_mm = 2.0});
  scene.tools[0].turns = true;
  CuttingHand miller(scene, {2, 0, 0});
  const CountedAllocations counted;
  const auto before = CountedAllocations::total();
  double sum_n = 0;
  for (int tick = 0; tick < 500; ++tick) {
    sum_n += length(miller.step({1 - 2 * std::sin(0.02 * tick), -1.5, 0}).commanded_force_n);
  }
  CHECK(sum_n > 1);
  CHECK(CountedAllocations::total() == before);
}

}  // namespace kerf::shaft_test
