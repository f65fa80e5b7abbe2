// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/fault_run.hpp"

#include <doctest/doctest.h>

#include "hil/devmodel/falcon_model.hpp"
#include "tests/servo/support.hpp"

using kerf::DeviceFault;
using kerf::FaultKind;
using kerf::Personality;

namespace {

/// A Falcon whose hand comes down on a half-space and presses on; a servo in float.
kerf::faults::Outcome pressing_falcon(const DeviceFault& fault) {
  kerf::LoadedScene scene = kerf::test::half_space_scene();
  scene.device.personality = Personality::falcon;
  scene.device.torque_scale = kerf::FalconParams().torque_scale();
  scene.servo.numeric = kerf::NumericKind::float32;
  kerf::HandScript hand;
  hand.start = {0, 4, 0};
  hand.steps = {kerf::hand_move({0, -1, 0}, 0.4), kerf::hand_move({0, -1, 0}, 10)};
  return kerf::faults::run_faults({.scene = scene, .hand = hand},
                                  {.faults = {fault}, .latches = "not_finite"});
}

}  // namespace

TEST_CASE("legs that cannot meet give NaN in float: the motors go off after 2 ms, and stay off") {
  const DeviceFault jump{
      .kind = FaultKind::jump, .at_s = 0.2, .for_s = 0.1, .axis = 1, .counts = 28'672};
  const auto outcome = pressing_falcon(jump);
  for (const std::string& violation : outcome.violations) MESSAGE(violation);
  CHECK(outcome.violation_count == 0);
  CHECK(outcome.faults_begun == 1);
  CHECK(outcome.pushed);
  CHECK(outcome.latched == "not_finite");
  CHECK_FALSE(outcome.pushed_again);
}
