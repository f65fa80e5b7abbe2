// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/fault_run.hpp"

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "tests/servo/support.hpp"

namespace kerf::fault_run_test {
namespace {

kerf::LoadedScene falcon_scene(int rate_hz = 1000) {
  kerf::LoadedScene scene = kerf::test::half_space_scene();
  scene.device.personality = Personality::falcon;
  scene.device.torque_scale = kerf::FalconParams().torque_scale();
  scene.servo.numeric = kerf::NumericKind::float64;
  scene.servo.rate_hz = rate_hz;
  return scene;
}

/// A Falcon whose hand comes down on a half-space and presses on; a servo in double.
kerf::faults::FaultOutcome pressing_falcon(const DeviceFault& fault,
                                           const char* latches = "not_finite", int rate_hz = 1000) {
  const kerf::LoadedScene scene = falcon_scene(rate_hz);
  kerf::HandScript hand;
  hand.start = {0, 4, 0};
  hand.steps = {kerf::hand_move({0, -1, 0}, 0.4), kerf::hand_move({0, -1, 0}, 10)};
  return kerf::faults::run_faults({.scene = scene, .hand = hand},
                                  {.faults = {fault}, .latches = latches});
}

/// The same hand, and it stays above.
kerf::faults::FaultOutcome run_in_air() {
  const kerf::LoadedScene scene = falcon_scene();
  kerf::HandScript hand;
  hand.start = {0, 10, 0};
  return kerf::faults::run_faults({.scene = scene, .hand = hand},
                                  {.faults = {}, .latches = "none"});
}

/// An Inverse3 behind its emulated service, whose hand comes down on a half-space and presses on.
kerf::faults::FaultOutcome pressing_inverse3(std::vector<DeviceFault> faults, const char* latches) {
  kerf::LoadedScene scene = kerf::test::half_space_scene();
  scene.device.personality = Personality::inverse3;
  scene.device.torque_scale = {1, 1, 1};
  kerf::HandScript hand;
  hand.start = {0, 4, 0};
  hand.steps = {kerf::hand_move({0, -1, 0}, 0.4), kerf::hand_move({0, -1, 0}, 10)};
  return kerf::faults::run_faults({.scene = scene, .hand = hand, .by_service = true},
                                  {.faults = std::move(faults), .latches = latches});
}

}  // namespace

TEST_CASE(
    "legs that cannot meet: the motors go off as for a pose that is no number, and stay off") {
  const DeviceFault jump{
      .kind = FaultKind::jump, .at_s = 0.2, .for_s = 0.1, .axis = 1, .counts = 28'672};
  const auto outcome = pressing_falcon(jump);
  for (const std::string& violation : outcome.violations) MESSAGE(violation);
  CHECK(outcome.violation_count == 0);
  CHECK(outcome.faults_begun == 1);
  CHECK(outcome.pushed);
  CHECK(outcome.latched == "not_finite");
  CHECK(outcome.inconclusive.empty());
  CHECK_FALSE(outcome.pushed_again);
}

TEST_CASE("a jump through the solid that no speed limit sees is pulled back the way it came") {
  // At 250 Hz 40 mm are below 10 m/s, and the half-space is 16 mm thick.
  for (const int counts : {200, 300, 400, 500}) {
    CAPTURE(counts);
    const DeviceFault jump{
        .kind = FaultKind::jump, .at_s = 0.2, .for_s = 0.1, .axis = 0, .counts = counts};
    const auto outcome = pressing_falcon(jump, "", 250);
    for (const std::string& violation : outcome.violations) MESSAGE(violation);
    CHECK(outcome.violation_count == 0);
    CHECK(outcome.inconclusive.empty());
  }
}

TEST_CASE("a run without contact, or whose fault never was, shows nothing and says so") {
  const auto away = run_in_air();
  CHECK(away.inconclusive == "the motors never pushed at the tip");
  const auto never = pressing_falcon({.kind = FaultKind::silence, .at_s = 100, .for_s = 1});
  CHECK(never.inconclusive == "0 of 1 faults changed anything");
  const auto nothing_to_break = pressing_falcon({.kind = FaultKind::noise, .at_s = 0, .for_s = 1});
  CHECK(nothing_to_break.inconclusive.empty());  // a Falcon has no pots: the matrix leaves it out
}

TEST_CASE("a service passes a jump on as it is, and takes a lost reply for a lost connection" *
          doctest::skip(!kerf::faults::kHasService)) {
  const auto well = pressing_inverse3({}, "none");
  CHECK(well.violation_count == 0);
  CHECK(well.peak_n > 0.1);
  CHECK(well.device_peak_n < well.peak_n + 0.02);  // steps of 14 mN

  const auto jump = pressing_inverse3(
      {{.kind = FaultKind::jump, .at_s = 0.2, .for_s = 0.1, .axis = 1, .counts = 2000}},
      "overspeed");
  CHECK(jump.violation_count == 0);
  CHECK(jump.pushed);
  CHECK(jump.latched == "overspeed");
  CHECK(jump.inconclusive.empty());

  // 10 ms on a plain link are a force held and let down; here the reply never comes.
  const auto lost =
      pressing_inverse3({{.kind = FaultKind::lose, .at_s = 0.2, .for_s = 0.01}}, "none");
  CHECK(lost.violation_count == 0);
  CHECK(lost.pushed);
  CHECK(lost.latched == "stale_input");
  CHECK(lost.demanded.empty());
  CHECK_FALSE(lost.pushed_again);  // not parked again
}

TEST_CASE("whatever a service does to its link, what kerf has sent ends the force within 20 ms" *
          doctest::skip(!kerf::faults::kHasService)) {
  for (const FaultKind kind :
       {FaultKind::unreadable, FaultKind::closing, FaultKind::half_close, FaultKind::both_closed}) {
    for (const double at_s : {0.2, 0.2001, 0.7}) {
      CAPTURE(static_cast<int>(kind));
      const auto outcome = pressing_inverse3({{.kind = kind, .at_s = at_s, .for_s = 0.5}}, "");
      for (const std::string& violation : outcome.violations) MESSAGE(violation);
      CHECK(outcome.violation_count == 0);
      CHECK(outcome.pushed);
      CHECK(outcome.inconclusive.empty());
      CHECK_FALSE(outcome.pushed_again);  // not parked again
    }
  }
}

TEST_CASE("whatever a program with the force does, no rule is broken, and its force ends with it") {
  using kerf::faults::ProgramWay;
  for (const Personality device : {Personality::omni, Personality::omega}) {
    for (const ProgramWay way : {ProgramWay::steady, ProgramWay::stops, ProgramWay::dies,
                                 ProgramWay::no_numbers, ProgramWay::floods}) {
      CAPTURE(kerf::word_of(device));
      CAPTURE(kerf::faults::kProgramWords[static_cast<std::size_t>(way)]);
      kerf::LoadedScene scene = kerf::test::half_space_scene();
      scene.force.model = kerf::ForceModel::external;
      scene.device.personality = device;
      scene.device.offset_mm = {};
      scene.device.torque_scale = kerf::torque_scale_of(device);
      scene.limits.force_n = 1.5;
      kerf::HandScript hand;
      hand.start = {0, 4, 0};
      hand.steps = {kerf::hand_move({0, -2, 0}, 0.4), kerf::hand_move({0, -2, 0}, 10)};
      const auto outcome =
          kerf::faults::run_faults({.scene = scene, .hand = hand, .program = way}, {.faults = {}});
      for (const std::string& violation : outcome.violations) MESSAGE(violation);
      CHECK(outcome.violation_count == 0);
      CHECK(outcome.inconclusive.empty());
      CHECK(outcome.latched == "none");  // without torque an arm may stand still for long
      CHECK((outcome.pushed_again || way == ProgramWay::dies));
    }
  }
}

}  // namespace kerf::fault_run_test
