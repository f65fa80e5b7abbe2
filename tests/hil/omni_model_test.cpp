// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/omni.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::DeviceVec;
using kerf::JointVec;
using kerf::OmniCommand;
using kerf::OmniModel;
using kerf::OmniParams;
using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::run;

OmniParams frictionless() {
  OmniParams params;
  params.viscous_ns_per_mm = 0;
  params.coulomb_n = 0;
  return params;
}

/// No hand at all: the tip is free once it is out of the inkwell.
OmniParams without_hand(OmniParams params) {
  params.hand_stiffness_n_per_mm = 0;
  params.hand_damping_ns_per_mm = 0;
  params.hand_mass_kg = 0;
  return params;
}

OmniCommand motors(std::array<std::int16_t, 3> counts) {
  return {counts, true, OmniCommand::Light::steady};
}

}  // namespace

TEST_CASE("a docked stylus stays in the inkwell whatever the motors do") {
  OmniModel model;
  const auto before = model.next_report();
  model.command(motors({2048, -2047, 2048}));
  run(model, {}, kSecond);
  const auto after = model.next_report();
  CHECK(after.docked);
  CHECK(after.encoder == before.encoder);
  CHECK(model.joints_rad() == JointVec<double>{0.0, 0.23, -0.37});
  CHECK(norm(model.motor_force_n()) > 1.0);
}

TEST_CASE("motor counts give the commanded force within half a DAC step") {
  const OmniParams params;
  CHECK(rc::check([&] {
    OmniModel model(params);
    const auto centimetres = [] { return *rc::gen::inRange(-30, 31) * 1.0; };
    const DeviceVec<double> place{centimetres(), centimetres(), centimetres()};
    run(model, at(place), kSecond);
    const auto newtons = [] { return *rc::gen::inRange(-15, 16) * 0.1; };
    const DeviceVec<double> wanted{newtons(), newtons(), newtons()};
    const auto jacobian_t = transposed(model.arm().jacobian(model.joints_rad()));
    const JointVec<double> torque = jacobian_t * wanted;
    const auto counts = [&](double nmm) {
      return static_cast<std::int16_t>(std::lround(nmm / params.torque_nmm_per_count[0]));
    };
    model.command(motors({counts(torque.x), counts(torque.y), counts(torque.z)}));
    model.step(at(place));
    // Half a count on each joint, and the little way that the tip moves in one bus cycle.
    const JointVec<double> error = jacobian_t * (model.motor_force_n() - wanted);
    const double half_step = params.torque_nmm_per_count[0] / 2 + 1e-2;
    RC_ASSERT(std::abs(error.x) <= half_step);
    RC_ASSERT(std::abs(error.y) <= half_step);
    RC_ASSERT(std::abs(error.z) <= half_step);
  }));
}

TEST_CASE("a free tip accelerates as force over mass") {
  OmniModel model(without_hand(frictionless()));
  model.command(motors({0, 200, 0}));
  const auto start = model.tip_mm();
  const int cycles = kSecond / 200;  // 5 ms: the arm hardly turns
  run(model, at({}), cycles);
  const double t = 0.005;
  const auto expected = model.motor_force_n() * (1000 / 0.045 * t * t / 2);
  const auto moved = model.tip_mm() - start;
  CHECK(norm(moved) > 0.1);
  CHECK(norm(moved - expected) < 0.01 * norm(expected));
}

TEST_CASE("hand spring and tip mass oscillate with their period and lose nothing") {
  OmniParams params = frictionless();
  params.hand_damping_ns_per_mm = 0;
  OmniModel model(params);
  const auto target = model.dock_tip_mm() + DeviceVec<double>{0, 10, 0};
  int crossings = 0;
  double first_s = 0;
  double last_s = 0;
  double highest = 0;
  double before = -10;
  for (int i = 1; i <= 10 * kSecond; ++i) {
    model.step(at(target));
    const double now = model.tip_mm().y - target.y;
    if (before < 0 && now >= 0) {
      last_s = (i - now / (now - before)) / kSecond;
      if (crossings++ == 0) first_s = last_s;
    }
    if (i > 9 * kSecond) highest = std::max(highest, now);
    before = now;
  }
  const double period = 2 * kerf::omni::kPi * std::sqrt(0.145 / 500.0);
  CHECK((last_s - first_s) / (crossings - 1) == doctest::Approx(period).epsilon(1e-4));
  CHECK(highest == doctest::Approx(10.0).epsilon(1e-3));
}

TEST_CASE("the hand gives way by force over stiffness") {
  OmniModel model(frictionless());
  const DeviceVec<double> target{3, -2, 5};
  run(model, at(target), 2 * kSecond);
  CHECK(norm(model.tip_mm() - target) < 1e-6);
  model.command(motors({150, -300, 220}));
  run(model, at(target), 3 * kSecond);
  CHECK(norm(model.velocity_mm_per_s()) < 1e-6);
  CHECK(norm(model.motor_force_n()) > 0.5);
  CHECK(norm((model.tip_mm() - target) * 0.5 - model.motor_force_n()) < 1e-6);
}

TEST_CASE("friction holds the tip against a pull below its limit") {
  OmniParams params;
  params.coulomb_n = 0.2;
  OmniModel model(params);
  run(model, at({0, 5, 0}), kSecond);
  const auto rest = model.tip_mm();
  CHECK(norm(model.velocity_mm_per_s()) == 0);
  CHECK(norm(rest - DeviceVec<double>{0, 5, 0}) * 0.5 <= 0.2);
  // Pull the other way with 0.19 N at most: not a bit.
  const auto direction = rest - DeviceVec<double>{0, 5, 0};
  const double pull_mm = 0.19 / 0.5;
  const auto pulled = rest + direction * (pull_mm / std::max(norm(direction), 1e-9));
  // Slowly, because the hand's damper pulls too.
  for (int i = 0; i <= kSecond; ++i) {
    model.step(at(DeviceVec<double>{0, 5, 0} +
                  (pulled - DeviceVec<double>{0, 5, 0}) * (static_cast<double>(i) / kSecond)));
  }
  CHECK(model.tip_mm() == rest);
  run(model, at(rest + DeviceVec<double>{0, 0, 2}), kSecond);
  CHECK(model.tip_mm().z > rest.z + 1);
}

TEST_CASE("the arm stays within its end stops wherever a hand jumps to") {
  CHECK(rc::check([] {
    OmniModel model;
    const auto far = [] { return *rc::gen::inRange(-500, 501) * 1.0; };
    for (int jump = 0; jump < 4; ++jump) {
      const auto goal = at({far(), far(), far()});
      for (int cycle = 0; cycle < kSecond / 4; ++cycle) {
        model.step(goal);
        const auto q = model.joints_rad();
        constexpr double kSlackRad = 1e-9;
        RC_ASSERT(std::abs(q.x) < 0.98 + kSlackRad);
        RC_ASSERT(q.y > -kSlackRad);
        RC_ASSERT(q.y < 1.75 + kSlackRad);
        RC_ASSERT(q.z - q.y > -0.81 - kSlackRad);
        RC_ASSERT(q.z - q.y < 1.25 + kSlackRad);
        // What a jump of 1.7 m gives at most through damper and spring: (b + sqrt(k m)) d / m.
        RC_ASSERT(norm(model.velocity_mm_per_s()) < 170'000);
      }
    }
  }));
}

TEST_CASE("motors that are off exert nothing") {
  OmniModel model;
  run(model, at({0, 5, 0}), kSecond / 2);
  model.command({{2048, 2048, 2048}, false, OmniCommand::Light::steady});
  run(model, at({0, 5, 0}), 10);
  CHECK(norm(model.motor_force_n()) == 0);
}

TEST_CASE("output delay counts bus cycles and the current loop is a first-order lag") {
  OmniParams params;
  params.output_delay_cycles = 3;
  OmniModel delayed(params);
  delayed.command(motors({0, 100, 0}));
  run(delayed, {}, 3);
  CHECK(norm(delayed.motor_force_n()) == 0);
  run(delayed, {}, 1);
  const double full = norm(delayed.motor_force_n());
  CHECK(full > 0);

  OmniParams lagging;
  lagging.current_lag_s = 0.001;
  OmniModel lag(lagging);
  lag.command(motors({0, 100, 0}));
  run(lag, {}, 8);
  CHECK(norm(lag.motor_force_n()) == doctest::Approx(full * (1 - std::exp(-1.0))).epsilon(1e-9));
}

TEST_CASE("input delay counts bus cycles: a report tells what the encoders were") {
  OmniParams params;
  params.input_delay_cycles = 5;
  OmniModel delayed(params), prompt;
  std::vector<std::array<std::uint16_t, 3>> told, was;
  for (int cycle = 0; cycle < 400; ++cycle) {
    for (OmniModel* model : {&delayed, &prompt}) {
      model->step(at({0, 5 + 0.05 * cycle, 0}));
      const auto& encoder = model->next_report().encoder;
      auto& list = model == &delayed ? told : was;
      list.push_back({static_cast<std::uint16_t>(encoder[0]),
                      static_cast<std::uint16_t>(encoder[1]),
                      static_cast<std::uint16_t>(encoder[2])});
    }
  }
  CHECK(was.front() != was.back());
  for (std::size_t i = 5; i < told.size(); ++i) CHECK(told[i] == was[i - 5]);
  for (std::size_t i = 0; i < 5; ++i) CHECK(told[i] == told[0]);
}

TEST_CASE("when host packets stop the last torque is held, or dropped after 100 ms") {
  for (const auto policy : {kerf::OnSilence::hold_torque, kerf::OnSilence::drop_torque}) {
    OmniParams params;
    params.on_silence = policy;
    OmniModel model(params);
    model.command(motors({100, 100, 100}));
    run(model, {}, 800);
    CHECK(norm(model.motor_force_n()) > 0);
    run(model, {}, 10);
    CHECK((norm(model.motor_force_n()) > 0) == (policy == kerf::OnSilence::hold_torque));
    model.command(motors({100, 100, 100}));
    run(model, {}, 1);
    CHECK(norm(model.motor_force_n()) > 0);
  }
}
