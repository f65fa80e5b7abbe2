// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/wait_state.hpp"

using kerf::DeviceReport;
using kerf::Personality;
using kerf::Phase;
using kerf::Waiting;

namespace {

constexpr std::int64_t kMs = 1'000'000;

Waiting waiting_in(Phase phase, const DeviceReport& report) {
  kerf::ServoOutput output;
  output.phase = phase;
  return kerf::waiting_for(report, output);
}

}  // namespace

TEST_CASE("what a device waits for follows from its phase and its report") {
  const DeviceReport unhomed{.fresh = true, .parked = true, .homed = false};
  const DeviceReport in_hand{.fresh = true};
  const DeviceReport parked{.fresh = true, .parked = true};
  CHECK(waiting_in(Phase::off, {}) == Waiting::report);
  for (const Phase phase : {Phase::calibrating, Phase::fault}) {
    CHECK(waiting_in(phase, unhomed) == Waiting::homing);
    CHECK(waiting_in(phase, in_hand) == Waiting::parked);
    CHECK(waiting_in(phase, parked) == Waiting::rest);
  }
  CHECK(waiting_in(Phase::armed, parked) == Waiting::hand);
  CHECK(waiting_in(Phase::ramping, in_hand) == Waiting::nothing);
  CHECK(waiting_in(Phase::active, in_hand) == Waiting::nothing);
}

TEST_CASE("each device says what its user does") {
  CHECK(kerf::text_of(Personality::omni, Waiting::parked) ==
        "waiting until parked: rest the stylus in the inkwell");
  CHECK(kerf::text_of(Personality::falcon, Waiting::homing) ==
        "waiting until homed: pull the grip all the way out, then push it in");
  CHECK(kerf::text_of(Personality::woodenhaptics, Waiting::hand) ==
        "waiting to be taken: move the arm away from its home pose");
  CHECK(kerf::text_of(Personality::omni, Waiting::nothing).empty());
}

TEST_CASE("a wait of a second is told, each kind once until the force comes on") {
  kerf::WaitNotice teller;
  std::vector<std::string> told;
  std::int64_t now_ns = 0, servo_ns = 0;
  const auto wait = [&](Waiting waiting, int ms) {
    for (int i = 0; i < ms; i += 50, now_ns += 50 * kMs, servo_ns += 50 * kMs) {
      if (!teller.look(waiting, now_ns, servo_ns)) continue;
      told.push_back(kerf::text_of(Personality::omni, waiting));
      told.back() += " @" + std::to_string(now_ns / kMs);
    }
  };
  wait(Waiting::parked, 950);  // a hand that goes about it
  wait(Waiting::rest, 50);
  CHECK(told.empty());
  wait(Waiting::parked, 60'000);
  REQUIRE(told.size() == 1);
  CHECK(told[0] == "waiting until parked: rest the stylus in the inkwell @2000");
  wait(Waiting::hand, 5000);
  CHECK(told.size() == 2);
  wait(Waiting::parked, 5000);  // again, without force in between
  CHECK(told.size() == 2);
  wait(Waiting::nothing, 5000);
  CHECK(told.size() == 2);
  wait(Waiting::parked, 5000);  // after a fault
  CHECK(told.size() == 3);
}

TEST_CASE("while no tick comes in lock-step nothing is told: it is the machine that is busy") {
  kerf::WaitNotice teller;
  for (std::int64_t now_ns = 0; now_ns < 60'000 * kMs; now_ns += 50 * kMs) {
    CHECK_FALSE(teller.look(Waiting::report, now_ns, 0));
  }
  // Ticks without a word of the device, as fast as they can.
  CHECK(teller.look(Waiting::report, 60'000 * kMs, 1000 * kMs));
}
