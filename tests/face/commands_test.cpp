// SPDX-License-Identifier: Apache-2.0
// Commands of `kerf::Servo`: in their order, refused or taken, logged and replayed.
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <kerf/hand.hpp>
#include <kerf/log.hpp>
#include <kerf/scene.hpp>
#include <kerf/servo.hpp>
#include <kerf/tick.hpp>

#include "tests/support/temporary_folder.hpp"

namespace kerf::commands_test {
namespace {

const std::string kScenes = KERF_SCENES;

}  // namespace

TEST_CASE("commands: one of a person a tick, then missed ticks, then a fade") {
  using Kind = kerf::ServoCommand::Kind;
  const kerf::Scene scene = kerf::Scene::load(kScenes + "/touch.toml");
  REQUIRE(scene.tools().size() > 1);
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, kScenes + "/hands/touch.toml");
  for (int i = 0; i < 300; ++i) servo.step(hand.next(servo.last()));
  CHECK_FALSE(servo.apply({Kind::none}));
  CHECK_FALSE(servo.apply({Kind::select_tool, 99}));
  CHECK_FALSE(servo.apply({Kind::undo}));
  CHECK(servo.apply({Kind::select_tool, 1}));
  CHECK_FALSE(servo.apply({Kind::hold, 1}));  // a second one
  CHECK_FALSE(servo.apply({Kind::missed, 0}));
  CHECK(servo.apply({Kind::missed, 3}));
  CHECK_FALSE(servo.apply({Kind::mark}));  // behind them
  CHECK(servo.apply({Kind::fade_in}));
  CHECK_FALSE(servo.apply({Kind::fade_in}));
  const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
  CHECK(tick.active_tool == 1);
  CHECK((tick.command & kerf::kCommandKind) == static_cast<std::uint32_t>(Kind::select_tool));
  CHECK((tick.command & kerf::kCommandFadeIn) != 0);
  CHECK((tick.command >> kerf::kCommandMissedShift) == 3);
  CHECK_FALSE(servo.apply({Kind::hold, 77}));
  CHECK_FALSE(servo.apply({Kind::reset, 1}));
  CHECK(servo.apply({Kind::hold, 1}));
  CHECK(servo.apply({Kind::missed, 70'000}));
  CHECK((servo.step(hand.next(servo.last())).command >> kerf::kCommandMissedShift) ==
        kerf::kMostMissed);
}

TEST_CASE("commands of two arms are in the log, and a replay applies them as the servo did") {
  using Kind = kerf::ServoCommand::Kind;
  const kerf::test::TemporaryFolder folder;
  const kerf::Scene scene = kerf::Scene::load(kScenes + "/two_arms.toml");
  kerf::Servo servo(scene);
  std::array<kerf::Hand, 2> hands{kerf::Hand(scene, 0), kerf::Hand(scene, 1)};
  kerf::LogWriter log(folder.path() / "run", scene);
  const std::map<int, std::vector<kerf::ServoCommand>> given{
      {1500, {{Kind::select_tool, 1, 1}}},
      {1600, {{Kind::missed, 5}, {Kind::fade_in}}},
      {1700, {{Kind::undo}}},
      {2000, {{Kind::select_tool, 0, 1}, {Kind::missed, 70'000}, {Kind::fade_in}}},
      {2300, {{Kind::reset}}}};
  std::vector<bool> taken;
  double before_n = 0, faded_n = 0;
  for (int i = 0; i < 2600; ++i) {
    const std::array reports{hands[0].next(servo.last(0)), hands[1].next(servo.last(1))};
    if (const auto now = given.find(i); now != given.end()) {
      for (const kerf::ServoCommand& command : now->second) taken.push_back(servo.apply(command));
    }
    log.add(servo.step(reports));
    if (i == 1599) before_n = servo.last(0).commanded_force_n[1];
    if (i == 1600) faded_n = servo.last(0).commanded_force_n[1];
  }
  log.close();
  CHECK(taken == std::vector<bool>{true, true, true, true, true, true, true, true});
  CHECK(std::abs(before_n) > 0.1);
  CHECK(std::abs(faded_n) < 0.05 * std::abs(before_n));  // a fade begins from 0
  const auto read = kerf::Log::open(folder.path() / "run");
  CHECK(read.check().empty());
  const kerf::ReplayOutcome outcome = read.replay();
  CHECK(outcome.ticks == 2600);
  CHECK_FALSE(outcome.difference.has_value());
}

}  // namespace kerf::commands_test
