// SPDX-License-Identifier: Apache-2.0
// The device models, each: inkwell, homing and calibration, and their reports.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

#include <doctest/doctest.h>

#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "tests/hil/model_runs.hpp"

namespace kerf::reports_test {
namespace {

using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::push;
using kerf::test::run;

}  // namespace

// ---- Omni ----

TEST_CASE("a docked stylus stays in the inkwell whatever the motors do") {
  OmniModel model;
  const auto before = model.next_report();
  push(model, {2048, -2047, 2048});
  run(model, {}, kSecond);
  const auto after = model.next_report();
  CHECK(after.docked);
  CHECK(after.encoder == before.encoder);
  CHECK(model.joints_rad() == JointVec<double>{0.0, 0.23, -0.37});
  CHECK(norm(model.motor_force_n()) > 1.0);
}

TEST_CASE("motors that are off exert nothing") {
  OmniModel model;
  run(model, at({0, 5, 0}), kSecond / 2);
  model.command({{2048, 2048, 2048}, false, OmniCommand::Light::steady});
  run(model, at({0, 5, 0}), 10);
  CHECK(norm(model.motor_force_n()) == 0);
}

TEST_CASE("the inkwell is left with the hand and found again to the same counts") {
  OmniModel model;
  const auto docked = model.next_report();
  run(model, at({0, 5, 0}), kSecond);
  CHECK_FALSE(model.next_report().docked);
  run(model, {}, 2 * kSecond);  // back: the inkwell catches within 2 mm
  const auto again = model.next_report();
  CHECK(again.docked);
  CHECK(again.encoder == docked.encoder);
}

TEST_CASE("encoders are the floor of the joint angle, and wrap at 16 bits") {
  OmniParams params;
  OmniModel model(params);
  std::array<int, 3> wraps{};
  auto last = model.next_report().encoder;
  for (int i = 0; i < 4 * kSecond; ++i) {
    const double t = static_cast<double>(i) / kSecond;
    model.step(at({20 * std::sin(6 * t), 20 * std::sin(5 * t), 20 * std::sin(4 * t)}));
    if (i % 8 != 0) continue;
    const auto now = model.next_report().encoder;
    const auto q = model.joints_rad();
    const std::array<double, 3> turned{q.x - params.dock_rad[0], -(q.y - params.dock_rad[1]),
                                       q.z - params.dock_rad[2]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double counts = turned[axis] * 15000 / (2 * kerf::omni::kPi);
      const int floor_count = params.encoder_offset[axis] + static_cast<int>(std::floor(counts));
      const int wrapped = ((floor_count + 32768) % 65536 + 65536) % 65536 - 32768;
      CHECK(now[axis] == wrapped);
      if (std::abs(now[axis] - last[axis]) > 32768) ++wraps[axis];
    }
    last = now;
  }
  for (const int count : wraps) CHECK(count >= 1);
}

TEST_CASE("gimbal pots carry the orientation, and an upright shaft stays upright") {
  OmniModel model;
  HandGoal goal = at({4, 5, -6});
  goal.orientation_rad = {0.3, -0.2, 1.1};
  run(model, goal, kSecond);
  const auto report = model.next_report();
  const auto angle = [&](std::size_t axis) {
    const double a = report.pot_a[axis], b = report.pot_b[axis];
    return kerf::omni::kGimbalSlopeRad[axis] * a / (a + b) + kerf::omni::kGimbalOffsetRad[axis];
  };
  constexpr double kPotStepRad = 5.48 / 65536;
  CHECK(std::abs(angle(0) - 0.3) < kPotStepRad);
  CHECK(std::abs(angle(1) - (model.joints_rad().z - 0.2)) < kPotStepRad);
  CHECK(std::abs(angle(2) - 1.1) < kPotStepRad);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    CHECK(report.pot_a[axis] + report.pot_b[axis] == 65536);
  }
}

TEST_CASE("angles beyond a pot stay at its end") {
  OmniModel model;
  HandGoal goal;
  goal.orientation_rad = {9.0, -9.0, -9.0};
  model.step(goal);
  const auto report = model.next_report();
  CHECK(report.pot_a[0] == 65535);
  CHECK(report.pot_a[1] == 65535);  // the pitch pot runs the other way
  CHECK(report.pot_a[2] == 1);
}

TEST_CASE("pot noise moves the low 5 bits only, by its seed") {
  OmniParams params;
  OmniModel clean(params);
  params.pot_noise = true;
  OmniModel noisy(params);
  OmniModel same(params);
  params.seed = 2;
  OmniModel other(params);
  bool changed = false;
  bool seeds_differ = false;
  for (int i = 0; i < 100; ++i) {
    const auto a = clean.next_report();
    const auto b = noisy.next_report();
    CHECK(b == same.next_report());
    seeds_differ |= !(b == other.next_report());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CHECK((a.pot_a[axis] >> 5) == (b.pot_a[axis] >> 5));
      CHECK((a.pot_b[axis] >> 5) == (b.pot_b[axis] >> 5));
      changed |= a.pot_a[axis] != b.pot_a[axis];
    }
  }
  CHECK(changed);
  CHECK(seeds_differ);
}

TEST_CASE("buttons and light pass through, and every report counts one packet") {
  OmniModel model;
  HandGoal goal;
  goal.button2 = true;
  model.step(goal);
  const auto first = model.next_report();
  CHECK_FALSE(first.button1);
  CHECK(first.button2);
  CHECK(first.counter == 1);
  CHECK(model.next_report().counter == 2);
  model.command({{}, false, OmniCommand::Light::slow_flash});
  CHECK(model.light() == OmniCommand::Light::slow_flash);
  CHECK_FALSE(model.motors_on());
}

// ---- Falcon ----

namespace {

constexpr FalconCommand kHome{{}, true, false, false, false};
constexpr std::array<bool, 3> kAll{true, true, true};

/// A host that requests homing once per frame while a hand moves to `target_mm`.
void home_towards(FalconModel& model, DeviceVec<double> target_mm, const FalconCommand& command) {
  for (int frame = 0; frame < 400; ++frame) {
    model.command(command);
    run(model, at(target_mm), kerf::kCyclesPerUsbFrame);
    static_cast<void>(model.next_packet());
  }
}

const DeviceVec<double> kOut{0, 20, 35};
const DeviceVec<double> kIn{0, 20, -35};

int true_count(double angle_rad) {
  return static_cast<int>(
      std::floor((angle_rad - kerf::falcon::kZeroRad) / kerf::falcon::kRadPerCount));
}

}  // namespace

TEST_CASE("the Falcon is homed by pulling out and pushing in while the host requests it") {
  FalconModel model;
  home_towards(model, kIn, kHome);
  CHECK(model.report().homed == std::array<bool, 3>{});  // it was not pulled out before
  home_towards(model, kOut, kHome);
  CHECK(model.report().homed == std::array<bool, 3>{});
  CHECK(model.calibration() == kerf::Calibration::needs_hand);
  home_towards(model, kIn, kHome);
  CHECK(model.report().homed == kAll);
  CHECK(model.calibration() == kerf::Calibration::done);
  home_towards(model, kOut, FalconCommand{.green = true});
  CHECK(model.report().homed == kAll);  // a homed leg stays so
}

TEST_CASE("one packet without the homing bit begins all over") {
  FalconModel model;
  home_towards(model, kOut, kHome);
  home_towards(model, {0, 20, 0}, FalconCommand{.green = true});
  CHECK(model.calibration() == kerf::Calibration::not_begun);
  home_towards(model, kIn, kHome);
  CHECK(model.report().homed == std::array<bool, 3>{});
}

TEST_CASE("counts begin at zero, are off before homing, and jump to the true ones by it") {
  FalconModel model;
  CHECK(model.report().encoder == std::array<std::int16_t, 3>{});
  home_towards(model, kOut, kHome);
  const auto before = model.report();
  const auto q = model.joints_rad();
  const auto off = static_cast<int>(before.encoder[0]) - true_count(q.x);
  CHECK(std::abs(off) > 100);
  home_towards(model, kIn, kHome);
  home_towards(model, kOut, kHome);
  const auto after = model.report();
  const auto now = model.joints_rad();
  CHECK(after.encoder[0] == true_count(now.x));
  CHECK(after.encoder[1] == true_count(now.y));
  CHECK(after.encoder[2] == true_count(now.z));
}

TEST_CASE("a Falcon answers each packet once, at most once per frame, and never by itself") {
  FalconModel model;
  run(model, {}, kSecond / 10);
  CHECK(model.next_packet().empty());

  model.command(kHome);
  CHECK(model.next_packet().empty());  // not before the next frame
  run(model, {}, kerf::kCyclesPerUsbFrame);
  CHECK(model.next_packet().size() == kerf::falcon::kPacketBytes);
  CHECK(model.next_packet().empty());
  run(model, {}, 10 * kerf::kCyclesPerUsbFrame);
  CHECK(model.next_packet().empty());

  // Three at once: three answers in three frames.
  for (int i = 0; i < 3; ++i) model.command(kHome);
  int answers = 0;
  for (int frame = 0; frame < 3; ++frame) {
    run(model, {}, kerf::kCyclesPerUsbFrame);
    answers += model.next_packet().empty() ? 0 : 1;
    CHECK(answers == frame + 1);
    CHECK(model.next_packet().empty());
  }
  run(model, {}, kerf::kCyclesPerUsbFrame);
  CHECK(model.next_packet().empty());
}

TEST_CASE("counts beyond the cap give no more force") {
  FalconModel capped;
  FalconModel beyond;
  push(capped, {4096, -4096, 0});
  push(beyond, {32767, -32768, 0});
  run(capped, {}, 8);
  run(beyond, {}, 8);
  CHECK(norm(capped.motor_force_n()) > 1);
  CHECK(beyond.motor_force_n() == capped.motor_force_n());
}

TEST_CASE("the hand's buttons are those of the grip's centre and front") {
  FalconModel model;
  kerf::HandGoal goal;
  goal.button1 = true;
  model.step(goal);
  CHECK(model.report().buttons == kerf::falcon::kButtonCentre);
  goal.button2 = true;
  model.step(goal);
  CHECK(model.report().buttons == (kerf::falcon::kButtonCentre | kerf::falcon::kButtonForward));
}

// ---- WoodenHaptics ----

namespace {

const WoodenCommand kNeutral{};

WoodenCommand set_home() {
  const auto& home = kerf::wooden::kHomeCounts;
  return {{}, std::array<std::int16_t, 6>{home[0], home[1], home[2], 0, 0, 0}};
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
  push(model, {500, 500, 500});
  run(model, {}, kSecond / 2);
  CHECK(model.motors_on());
  CHECK(norm(model.motor_force_n()) > 0);
  run(model, {}, 2);
  CHECK_FALSE(model.motors_on());
  CHECK(norm(model.motor_force_n()) == 0);
  push(model, {500, 500, 500});
  run(model, {}, 1);
  CHECK(model.motors_on());
  CHECK(norm(model.motor_force_n()) > 0);
}

TEST_CASE("setting the encoders commands no current for that tick") {
  WoodenModel model;
  push(model, {500, 0, 0});
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

TEST_CASE("the wireless button adds 10000 to encoder d if there is one") {
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

}  // namespace kerf::reports_test
