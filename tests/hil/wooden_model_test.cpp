// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/wooden.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::DeviceVec;
using kerf::HandGoal;
using kerf::JointVec;
using kerf::WoodenCommand;
using kerf::WoodenModel;
using kerf::WoodenParams;
using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::run;

const WoodenCommand kNeutral{};

WoodenCommand set_home() {
  const auto& home = kerf::wooden::kHomeCounts;
  return {{}, std::array<std::int16_t, 6>{home[0], home[1], home[2], 0, 0, 0}};
}

WoodenCommand currents(std::array<std::int16_t, 3> milliamps) {
  return {milliamps, std::nullopt};
}

HandGoal pressing() {
  HandGoal goal;
  goal.calibrate = true;
  return goal;
}

}  // namespace

TEST_CASE("the calibration button shows until the host sets the encoders") {
  WoodenModel model;
  CHECK(model.calibration() == kerf::Calibration::not_begun);
  model.command(kNeutral);
  CHECK(model.calibration() == kerf::Calibration::needs_hand);
  CHECK_FALSE(model.report().calibrate);
  CHECK(model.report().encoder[0] != 0);  // counts of power-up mean nothing
  run(model, pressing(), 10);
  CHECK(model.report().calibrate);
  run(model, {}, 10);
  CHECK(model.report().calibrate);
  run(model, pressing(), 10);
  model.command(set_home());
  run(model, pressing(), 10);  // still held down: no second press
  const auto report = model.report();
  CHECK_FALSE(report.calibrate);
  CHECK(report.encoder == std::array<std::int16_t, 6>{0, 0, 6000, 0, 0, 0});
  CHECK(model.calibration() == kerf::Calibration::done);
}

TEST_CASE("a calibrated WoodenHaptics arm counts from home by its capstans") {
  WoodenModel model;
  model.command(set_home());
  run(model, at({30, 10, -20}), kSecond);
  const auto report = model.report();
  const auto q = model.joints_rad();
  const std::array<double, 3> angles{q.x, q.y, q.z};
  for (std::size_t i = 0; i < 3; ++i) {
    // 2000 counts a turn of the motor, whose capstan of 10 mm turns 160, 120 and 120 mm.
    const double ratio = i == 0 ? 16.0 : 12.0;
    const double angle = 2 * std::numbers::pi / 2000 / ratio * report.encoder[i];
    CHECK(std::abs(angle - angles[i]) < 2 * 2 * std::numbers::pi / 2000 / ratio);
  }
}

TEST_CASE("WoodenHaptics reports once per millisecond from the host's first packet on") {
  WoodenModel model;
  run(model, {}, kSecond / 10);
  CHECK(model.next_packet().empty());
  model.command(kNeutral);
  int reports = 0;
  for (int cycle = 0; cycle < kSecond; ++cycle) {
    model.step({});
    reports += model.next_packet().empty() ? 0 : 1;
  }
  CHECK(reports == 1000);
}

TEST_CASE("half a second without a packet switches the amplifiers off, the next one on again") {
  WoodenModel model;
  CHECK_FALSE(model.motors_on());
  model.command(currents({500, 500, 500}));
  run(model, {}, kSecond / 2);
  CHECK(model.motors_on());
  CHECK(norm(model.motor_force_n()) > 0);
  run(model, {}, 2);
  CHECK_FALSE(model.motors_on());
  CHECK(norm(model.motor_force_n()) == 0);
  model.command(currents({500, 500, 500}));
  run(model, {}, 1);
  CHECK(model.motors_on());
  CHECK(norm(model.motor_force_n()) > 0);
}

TEST_CASE("WoodenHaptics currents give the commanded force within half a mA") {
  const WoodenParams params;
  CHECK(rc::check([&] {
    WoodenModel model(params);
    const DeviceVec<double> place = kerf::test::any_in_ball(60);
    run(model, at(place), 2 * kSecond);
    const auto newtons = [] { return *rc::gen::inRange(-15, 16) * 0.1; };
    const DeviceVec<double> wanted{newtons(), newtons(), newtons()};
    const JointVec<double> torque =
        kerf::test::torque_by_differences(model.arm(), model.joints_rad(), wanted);
    // kt of 25.9 N mm/A, capstans of 16 and 12.
    const auto milliamps = [](double nmm, double ratio) {
      return static_cast<std::int16_t>(std::lround(nmm / (0.0259 * ratio)));
    };
    model.command(
        currents({milliamps(torque.x, 16), milliamps(torque.y, 12), milliamps(torque.z, 12)}));
    model.step(at(place));
    RC_ASSERT(norm(model.motor_force_n() - wanted) < 0.01);
  }));
}

TEST_CASE("setting the encoders commands no current for that tick") {
  WoodenModel model;
  model.command(currents({500, 0, 0}));
  run(model, {}, 8);
  CHECK(norm(model.motor_force_n()) > 0);
  model.command(set_home());
  run(model, {}, 8);
  CHECK(norm(model.motor_force_n()) == 0);
  CHECK(model.motors_on());
}

TEST_CASE("packets have the length of the firmware, and the other length is refused") {
  for (const std::size_t bytes : {kerf::wooden::kPacketBytes, kerf::wooden::kLongPacketBytes}) {
    WoodenParams params;
    params.packet_bytes = bytes;
    WoodenModel model(params);
    const auto packet = encode(kNeutral);
    const std::span<const std::uint8_t> all(packet);
    CHECK(model.receive(all.first(bytes)));
    CHECK_FALSE(model.receive(all.first(78 - bytes)));
    run(model, {}, kerf::kCyclesPerUsbFrame);
    CHECK(model.next_packet().size() == bytes);
  }
}

TEST_CASE("the wireless button adds 10000 to encoder d where there is one") {
  for (const bool there : {false, true}) {
    WoodenParams params;
    params.wireless_button = there;
    WoodenModel model(params);
    HandGoal goal;
    goal.button1 = true;
    model.step(goal);
    CHECK(kerf::wooden::wireless_button(model.report().encoder[3]) == there);
    model.step({});
    CHECK(model.report().encoder[3] == 0);
  }
}
