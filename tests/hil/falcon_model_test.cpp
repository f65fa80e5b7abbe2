// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/falcon.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::DeviceVec;
using kerf::FalconCommand;
using kerf::FalconModel;
using kerf::FalconParams;
using kerf::JointVec;
using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::run;

constexpr FalconCommand kHome{{}, true, false, false, false};
constexpr std::array<bool, 3> kAll{true, true, true};

FalconCommand motors(std::array<std::int16_t, 3> counts) {
  return {counts, false, true, false, false};
}

/// A host that asks for homing once per frame while a hand moves to `target_mm`.
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

TEST_CASE("the Falcon is homed by pulling out and pushing in while the host asks for it") {
  FalconModel model;
  home_towards(model, kIn, kHome);
  CHECK(model.report().homed == std::array<bool, 3>{});  // it was not pulled out before
  home_towards(model, kOut, kHome);
  CHECK(model.report().homed == std::array<bool, 3>{});
  CHECK(model.calibration() == kerf::Calibration::needs_hand);
  home_towards(model, kIn, kHome);
  CHECK(model.report().homed == kAll);
  CHECK(model.calibration() == kerf::Calibration::done);
  home_towards(model, kOut, motors({}));
  CHECK(model.report().homed == kAll);  // a homed leg stays so
}

TEST_CASE("one packet without the homing bit begins all over") {
  FalconModel model;
  home_towards(model, kOut, kHome);
  home_towards(model, {0, 20, 0}, motors({}));
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

TEST_CASE("the Falcon's motor counts give the commanded force within half a count") {
  const FalconParams params;
  CHECK(rc::check([&] {
    FalconModel model(params);
    const DeviceVec<double> place = kerf::test::any_in_ball(40);
    run(model, at(place), kSecond / 2);
    const auto newtons = [] { return *rc::gen::inRange(-20, 21) * 0.1; };
    const DeviceVec<double> wanted{newtons(), newtons(), newtons()};
    const JointVec<double> torque =
        kerf::test::torque_by_differences(model.arm(), model.joints_rad(), wanted);
    const auto count = [&](double nmm) {
      return static_cast<std::int16_t>(std::lround(nmm / params.torque_nmm_per_count[0]));
    };
    model.command(motors({count(torque.x), count(torque.y), count(torque.z)}));
    model.step(at(place));
    // Half a count is 0.05 N mm, at a lever of 25 mm or more.
    RC_ASSERT(norm(model.motor_force_n() - wanted) < 0.01);
  }));
}

TEST_CASE("a positive Falcon count turns a thigh towards smaller angles: the grip goes in") {
  FalconParams params;
  params.hand_stiffness_n_per_mm = 0.05;
  FalconModel model(params);
  run(model, at({}), kSecond / 2);
  const double before = model.tip_mm().z;
  model.command(motors({500, 500, 500}));
  run(model, at({}), kSecond / 2);
  CHECK(model.tip_mm().z < before - 5);
}

TEST_CASE("counts beyond the cap give no more force") {
  FalconModel capped;
  FalconModel beyond;
  capped.command(motors({4096, -4096, 0}));
  beyond.command(motors({32767, -32768, 0}));
  run(capped, {}, 8);
  run(beyond, {}, 8);
  CHECK(norm(capped.motor_force_n()) > 1);
  CHECK(beyond.motor_force_n() == capped.motor_force_n());
}

TEST_CASE("a Falcon whose host falls silent holds its torque or drops it, as told") {
  for (const auto policy : {kerf::OnSilence::hold_torque, kerf::OnSilence::drop_torque}) {
    FalconParams params;
    params.on_silence = policy;
    FalconModel model(params);
    model.command(motors({100, 100, 100}));
    run(model, {}, 800);
    CHECK(norm(model.motor_force_n()) > 0);
    run(model, {}, 10);
    CHECK((norm(model.motor_force_n()) > 0) == (policy == kerf::OnSilence::hold_torque));
  }
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
