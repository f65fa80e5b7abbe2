// SPDX-License-Identifier: Apache-2.0
// State that lasts, by what it does: the heat of the motors, the velocity over a calibration, the
// position of the proxy over a change of tool. Each in two cycles.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy.hpp"
#include "tests/proxy/support.hpp"
#include "tests/servo/two_arms_support.hpp"

namespace kerf::state_by_behaviour_test {

using namespace kerf::test;

namespace {

/// Heat of the winding of an arm, N^2.
double heat_n2(const CompiledScene& servo, std::size_t arm) {
  const auto parts = servo.parts();
  if (const auto* fixed = std::get_if<Arms<FixedNumbers>>(&parts)) {
    return static_cast<double>((*fixed)[arm].state->thermal.heat_n2) / 4294967296.0;
  }
  return std::get<Arms<DoubleNumbers>>(parts)[arm].state->thermal.heat_n2;
}

/// One hand above a slab of 0.75 mm whose upper face is y = 0.
LoadedScene slab_scene() {
  LoadedScene scene = alone(two_armed(kCutKinds[0], 0), 0);
  scene.cut.model = CutModel::none;
  scene.volumes[0] =
      volume_of(96, kVoxelMm, [](double, double y, double) { return std::max(y, -0.75 - y); });
  scene.tools = {ball(16), ball(10), ball(18), ball(16)};
  return scene;
}

}  // namespace

TEST_CASE("the heat of each arm is that of the force that was sent, and it cools without one") {
  for (const char* const stabiliser : {"", "passivity"}) {
    for (const CutKind& kind : kCutKinds) {
      CAPTURE(std::string(kind.name));
      CAPTURE(std::string(stabiliser));
      LoadedScene scene = two_armed(kind);
      scene.force.stiffness_n_per_mm = 3;
      scene.force.stabiliser = {LawKind::stabiliser, stabiliser, {}};
      scene.limits.slew_n_per_ms = 0.02;  // the wish is far from what is sent
      Bench bench(scene);
      bench.dock();
      std::array<double, kMaxArms> expected_n2{};
      double hottest_n2 = 0;
      for (int tick = 0; tick < 2400; ++tick) {
        const int at = tick % 1200;
        Hand hand = stroke(at);
        hand.silent = at >= 380 && at < 410;                 // held, faded, and a fault
        if (at >= 500 && at < 570) hand = {.parked = true};  // which parking clears
        if (tick == 1500 || tick == 1540) {                  // and no force by command
          const std::uint32_t on = tick == 1500 ? 1 : 0;
          REQUIRE(bench.servo->apply({.kind = ServoCommand::Kind::hold, .argument = on}));
        }
        bench.step(hand, stroke(at + 40));
        for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
          const double force_n = length(bench.out[arm].commanded_force_n);
          expected_n2[arm] += (force_n * force_n - expected_n2[arm]) / 10'000;  // 10 s at 1 kHz
          CAPTURE(tick);
          CAPTURE(arm);
          REQUIRE(heat_n2(*bench.servo, arm) ==
                  doctest::Approx(expected_n2[arm]).epsilon(0.01).scale(0.001));
          hottest_n2 = std::max(hottest_n2, expected_n2[arm]);
        }
      }
      CHECK(hottest_n2 > 1e-4);
      CHECK(bench.out[0].phase == Phase::active);
    }
  }
}

TEST_CASE("a calibration moves the tip and is no velocity, in the first rest and in a later one") {
  for (const LawChoice& estimator :
       {LawChoice{LawKind::velocity, "foaw", {}},
        LawChoice{LawKind::velocity, "difference", {{"tau_ms", 20.0}}}}) {
    CAPTURE(estimator.name);
    for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
      LoadedScene scene = half_space_scene();
      scene.servo.velocity = estimator;
      scene.servo.numeric = numeric;
      const auto servo = compile(scene);
      KinematicOmni arm;
      std::int16_t off = 0;  // counts that were lost under way
      int jumps = 0;
      std::array<double, 3> last_mm{};
      const auto step = [&](DeviceReport report) {
        report.counts[1] = static_cast<std::int16_t>(report.counts[1] + off);
        const ServoOutput out = servo->step(report);
        jumps += std::abs(out.position_mm[1] - last_mm[1]) > 0.2 ? 1 : 0;
        last_mm = out.position_mm;
        return out;
      };
      const auto rest = [&](int from) {
        for (int tick = 0; tick < 3 * kDockTicks; ++tick) {
          CAPTURE(tick);
          const ServoOutput out = step(arm.docked());
          if (tick >= from) REQUIRE(length(out.velocity_mm_per_s) < 1);
        }
      };
      rest(0);
      CHECK(jumps > 0);
      const OmniArm geometry;
      const auto& d = omni::kDockRad;
      const auto dock = geometry.tip_mm({d[0], d[1], d[2]});
      // The same pose with ten counts less, as after a knock: the next rest calibrates anew.
      for (int tick = 0; tick < 500; ++tick) {
        const double up = 20 * std::sin(tick * 0.00628);
        static_cast<void>(step(arm.at(dock.x, dock.y + up, dock.z)));
      }
      off = 10;
      jumps = 0;
      for (int tick = 0; tick < 20; ++tick) static_cast<void>(step(arm.docked()));
      const int before = jumps;
      rest(kDockTicks);
      CHECK(jumps > before);
      for (int tick = 0; tick < 100; ++tick) {
        REQUIRE(length(step(arm.at(dock.x, dock.y, dock.z)).velocity_mm_per_s) < 20);
      }
    }
  }
}

TEST_CASE("a tool that takes over stays on its side of a wall, and its force grows from nothing") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    LoadedScene scene = slab_scene();
    scene.servo.numeric = numeric;
    Bench bench(scene);
    bench.dock();
    const Hand below{.at = {0, -2.5, 0}};  // wholly below the slab, and held above it
    const ServoOutput& out = bench.out[0];
    for (int tick = 0; tick < 150; ++tick) bench.step({.at = {0, 5 - 0.05 * tick, 0}});
    for (int tick = 0; tick < 20; ++tick) bench.step(below);
    REQUIRE(out.contact_force_n[1] > 0.5);
    for (const std::uint32_t tool : {1U, 2U, 3U, 0U, 2U, 1U, 0U}) {
      CAPTURE(tool);
      REQUIRE(bench.servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = tool}));
      for (int tick = 0; tick < 200; ++tick) {
        CAPTURE(tick);
        bench.step(below);
        REQUIRE(length(out.contact_force_n) <= 0.1 * tick + 0.05);  // 0.1 N a ms, from nothing on
      }
      CHECK(out.active_tool == tool);
      CHECK(out.contact_force_n[1] > 0.5);
    }
    // The tool that is used already changes nothing.
    const double before_n = length(out.contact_force_n);
    REQUIRE(bench.servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = 0}));
    bench.step(below);
    CHECK(length(out.contact_force_n) == doctest::Approx(before_n).epsilon(0.01));
  }
}

namespace {

/// A point in a bowl about the origin, solid beyond 5 units.
template <class N>
auto bowl() {
  const auto face = [](extremes::Point at) {
    return std::pair(5 - extremes::length(at), -1 * extremes::unit(at));
  };
  return SolidField<N, decltype(face)>(0, face);
}

template <class N>
ProxyContact<N> led(ProxyState<N>& state, auto& field, const extremes::Point& goal) {
  return follow({.rotation_step = {}, .ramp_per_tick = typename N::Real(1)}, state, field,
                {extremes::place_of<N>(goal), {}});
}

}  // namespace

TEST_CASE_TEMPLATE("a proxy that is sought anew has forgotten the solid that it slid on", N,
                   FixedNumbers, DoubleNumbers) {
  auto field = bowl<N>();
  ProxyState<N> slid;
  for (int tick = 0; tick < 200; ++tick) {
    static_cast<void>(led(slid, field, {9 * std::sin(0.1 * tick), -9 * std::cos(0.1 * tick), 0}));
    if (tick % 10 != 9) continue;
    ProxyState<N> again = slid, fresh;
    fresh.pose = slid.pose;
    fresh.valid = true;
    for (ProxyState<N>* state : {&again, &fresh}) state->search_again();
    for (int more = 1; more < 10; ++more) {
      const double angle = 0.1 * (tick + more);
      const extremes::Point goal{9 * std::sin(angle), -9 * std::cos(angle), 0.2 * more};
      CAPTURE(tick);
      CAPTURE(more);
      REQUIRE(led(again, field, goal).spring == led(fresh, field, goal).spring);
      REQUIRE(again.pose == fresh.pose);
    }
  }
}

// Out of a slanted face the pushes of that tick lead aside; the search goes in 26 directions.
TEST_CASE_TEMPLATE("where the solid grows over a tool it is sought from the place that it had", N,
                   FixedNumbers, DoubleNumbers) {
  FlatField<N> floor({0, 1, 0});
  ProxyState<N> state;
  for (int tick = 0; tick < 20; ++tick) static_cast<void>(led(state, floor, {0, -1, 0}));
  REQUIRE(state.valid);
  const extremes::Point slanted = extremes::unit(extremes::Point{1, 2, 0});
  FlatField<N> grown(slanted, -40 * slanted);
  static_cast<void>(led(state, grown, {4, -1, 1}));
  REQUIRE_FALSE(state.valid);
  for (int tick = 0; tick < 200 && !state.valid; ++tick) {
    static_cast<void>(led(state, grown, {4, -1, 1}));
  }
  REQUIRE(state.valid);
  const extremes::Point at = extremes::point_of<N>(state.pose.centre);
  CHECK(at[0] > 25);
  CHECK(std::abs(at[1] - at[0]) < 0.1);
}

TEST_CASE("what a proxy has learned of a bowl is forgotten when its device rests parked") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    LoadedScene scene = alone(two_armed(kCutKinds[0], 0), 0);
    scene.servo.numeric = numeric;
    scene.cut.model = CutModel::none;
    scene.volumes[0] = volume_of(48, kVoxelMm, [](double x, double y, double z) {
      return 2 - length(Place{x, y, z});
    });
    scene.tools = {ball(16)};
    const Hand dock{.at = {0, -0.99, 0}, .parked = true}, taken{.at = dock.at};
    Bench wandered(scene), rested(scene);
    const auto step = [&](const Hand& one, const Hand& other) {
      wandered.step(one);
      rested.step(other);
    };
    for (int tick = 0; tick < kDockTicks; ++tick) step(dock, dock);
    for (int cycle = 0; cycle < 2; ++cycle) {
      for (double angle = 0.8; angle > 0; angle -= 0.1) {
        step({.at = {1.4 * std::sin(angle), -1.4 * std::cos(angle), 0}}, taken);
      }
      for (int tick = 0; tick < 2 * kDockTicks; ++tick) step(dock, dock);
      for (int tick = 0; tick < 20; ++tick) {
        const Hand presses{.at = {0.05 * tick, -1.2, 0.02 * tick}};
        step(presses, presses);
        CAPTURE(tick);
        REQUIRE(wandered.out[0].proxy_offset_mm == rested.out[0].proxy_offset_mm);
      }
      CHECK(length(rested.out[0].proxy_offset_mm) > 0.1);
    }
  }
}

TEST_CASE("the torques do the work of the force in the pose of each tick, not of an earlier one") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    LoadedScene scene = half_space_scene(96);
    scene.servo.numeric = numeric;
    ArmedServo armed(scene, {-4, 5, 4});
    const OmniArm arm;
    for (int at = -4; at <= 4; ++at) {
      CAPTURE(at);
      const ServoOutput out = armed.settled(at, 0.5, -at);
      REQUIRE(length(out.commanded_force_n) > 0.2);
      // Of 1 mm along the force: its length, and the torques times the turns of the joints.
      const auto end = [&](double mm) {
        const double part = mm / length(out.commanded_force_n);
        return arm.joints_rad({at + part * out.commanded_force_n[0],
                               0.5 + part * out.commanded_force_n[1],
                               -at + part * out.commanded_force_n[2]});
      };
      const JointVec<double> turned = end(0.5) - end(-0.5);
      const double work_mj = turned.x * out.torque_n_mm[0] + turned.y * out.torque_n_mm[1] +
                             turned.z * out.torque_n_mm[2];
      CHECK(work_mj == doctest::Approx(length(out.commanded_force_n)).epsilon(0.005));
    }
  }
}

TEST_CASE("a tool that has left the solid is no longer in it, whichever arm") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    LoadedScene scene = two_armed(kind);
    scene.cut.model = CutModel::none;
    Bench bench(scene);
    bench.dock();
    for (int cycle = 0; cycle < 2; ++cycle) {
      for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
        CAPTURE(arm);
        for (int tick = 0; tick < 181; ++tick) bench.step(stroke(tick), stroke(tick));
        for (std::size_t a = 0; a < kMaxArms; ++a) REQUIRE(bench.servo->penetration_mm(a) > 0.1);
        for (int tick = 0; tick < 30; ++tick) {
          bench.step(arm == 0 ? Hand{} : stroke(180), arm == 1 ? Hand{} : stroke(180));
        }
        CHECK(bench.servo->penetration_mm(arm) < 1e-6);
        CHECK(bench.servo->penetration_mm(1 - arm) > 0.1);
      }
    }
  }
}

}  // namespace kerf::state_by_behaviour_test
