// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/fault_pairs.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "hil/device/falcon.hpp"
#include "lab/safety/fault_run.hpp"
#include "tests/servo/support.hpp"

namespace kerf::fault_pairs_test {

using kerf::faults::NamedScript;
using kerf::faults::pair_share_of;
using kerf::faults::pairs_of;

namespace {

NamedScript named(const char* name, FaultKind kind, const char* latches) {
  return {.name = name,
          .script = FaultScript{.faults = {{.kind = kind, .at_s = 0.2, .for_s = 0.03, .ms = 30}},
                                .latches = latches}};
}

const std::vector<NamedScript> kScripts{
    {.name = "all_well", .script = FaultScript{.faults = {}, .latches = "none", .seconds = 14}},
    named("lost", FaultKind::lose, "stale_input"),
    named("parked", FaultKind::park, "none"),
    named("late", FaultKind::host_late, "none")};

/// A Falcon above a half space, whose hand comes down in 0.4 s and presses on.
struct PressedFalcon {
  PressedFalcon() {
    scene.device.personality = kerf::Personality::falcon;
    scene.device.torque_scale = kerf::FalconParams().torque_scale();
    hand.start = {0, 4, 0};
    hand.steps = {kerf::hand_move({0, -1, 0}, 0.4), kerf::hand_move({0, -1, 0}, 10)};
  }
  [[nodiscard]] kerf::faults::FaultOutcome run(const FaultScript& script,
                                               std::optional<double> stop_s = {}) const {
    auto outcome =
        kerf::faults::run_faults({.scene = scene, .hand = hand, .stop_s = stop_s}, script);
    for (const std::string& violation : outcome.violations) MESSAGE(violation);
    return outcome;
  }

  kerf::LoadedScene scene = kerf::test::half_space_scene();
  kerf::HandScript hand;
};

}  // namespace

TEST_CASE("every pair of scripts with faults is in one part, and each script with the signal") {
  for (const std::size_t parts : {1U, 2U, 3U, 7U, 40U}) {
    std::map<std::string, int> count;
    for (std::size_t part = 1; part <= parts; ++part) {
      for (const NamedScript& pair : pairs_of(kScripts, {part, parts})) ++count[pair.name];
    }
    const std::map<std::string, int> wanted{{"all_well+asked_to_end", 1},
                                            {"lost+asked_to_end", 1},
                                            {"parked+asked_to_end", 1},
                                            {"late+asked_to_end", 1},
                                            {"lost+parked", 1},
                                            {"lost+late", 1},
                                            {"parked+late", 1}};
    CHECK(count == wanted);
  }
}

TEST_CASE("a pair has both scripts' faults, and demands that it goes on only where both do") {
  for (const NamedScript& pair : pairs_of(kScripts, {1, 1})) {
    CAPTURE(pair.name);
    const FaultScript& script = *pair.script;
    CHECK(pair.stop_s.has_value() == pair.name.ends_with("+asked_to_end"));
    CHECK(script.latches == (pair.name == "parked+late" ? "none" : ""));
    if (pair.stop_s) continue;
    REQUIRE(script.faults.size() == 2);
    bool is_earlier = false, is_later = false;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const FaultScript seen = played(pair, seed);
      CHECK(seen.faults[0].at_s == 0.2);
      is_earlier = is_earlier || seen.faults[1].at_s < 0.2;
      is_later = is_later || seen.faults[1].at_s > 0.2;
    }
    CHECK((is_earlier && is_later));
  }
}

TEST_CASE("the signal comes when a fault has begun, however late that is") {
  const PressedFalcon falcon;
  for (const double at_s : {0.05, 0.3, 0.8}) {
    const NamedScript hung{
        .name = "hung_up",
        .script = FaultScript{.faults = {{.kind = FaultKind::hang_up, .at_s = at_s}}}};
    const NamedScript pair = pairs_of({hung}, {1, 1}).at(0);
    CHECK(pair.stop_s.value() == doctest::Approx(at_s + 0.01));
    const auto outcome = falcon.run(played(pair, 1), pair.stop_s);
    CHECK(outcome.inconclusive.empty());
    CHECK(outcome.violation_count == 0);
    // Without a fault before the end it shows nothing.
    const auto early = falcon.run(played(pair, 1), at_s - 0.01);
    CHECK_FALSE(early.inconclusive.empty());
  }
}

TEST_CASE("a silence is no longer for a host that is late in it") {
  const PressedFalcon falcon;
  for (const double late_ms : {1, 3, 7, 12, 19, 30}) {
    CAPTURE(late_ms);
    const FaultScript script{
        .faults = {{.kind = FaultKind::unplug, .at_s = 0.2, .for_s = 3600},
                   {.kind = FaultKind::host_late, .at_s = 0.202, .ms = late_ms}},
        .latches = "stale_input"};
    const auto outcome = falcon.run(script);
    CHECK(outcome.violation_count == 0);
    CHECK(outcome.inconclusive.empty());
  }
}

TEST_CASE("counts that no Falcon has are a fault also when they begin while it is parked") {
  PressedFalcon falcon;
  for (const auto numeric : {kerf::NumericKind::fixed, kerf::NumericKind::float64}) {
    falcon.scene.servo.numeric = numeric;
    for (const int counts : {28000, 12000, 9881, -9881}) {  // the last ones: a whole turn
      CAPTURE(counts);
      const FaultScript script{
          .faults = {{.kind = FaultKind::park, .at_s = 0.2, .for_s = 0.03},
                     {.kind = FaultKind::jump, .at_s = 0.21, .for_s = 0.3, .counts = counts}},
          .hides = true};
      const auto outcome = falcon.run(script);
      CHECK(outcome.latched == "not_finite");
      CHECK(outcome.violation_count == 0);
    }
  }
}

TEST_CASE("a share is PART/PARTS, from the first to the last part") {
  const auto share = pair_share_of("3/40");
  REQUIRE(share);
  CHECK((share->part == 3 && share->parts == 40));
  for (const char* const wrong :
       {"", "3", "3/", "/40", "0/40", "41/40", "3/40 ", "-1/4", "a/b", "3/4/5"}) {
    CAPTURE(wrong);
    CHECK_FALSE(pair_share_of(wrong));
  }
}

TEST_CASE("a signal that asks for the end ends all force, whatever else goes wrong") {
  PressedFalcon falcon;
  falcon.scene.servo.numeric = kerf::NumericKind::float64;
  for (const NamedScript& pair : pairs_of(kScripts, {1, 1})) {
    if (!pair.stop_s) continue;
    CAPTURE(pair.name);
    const auto outcome = falcon.run(played(pair, 2), pair.stop_s);
    CHECK(outcome.violation_count == 0);
    CHECK(outcome.pushed);
    if (!pair.script->faults.empty())
      CHECK_FALSE(outcome.pushed_again);  // else it counts from 0.05 s
  }
}

}  // namespace kerf::fault_pairs_test
