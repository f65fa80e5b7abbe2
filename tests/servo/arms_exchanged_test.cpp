// SPDX-License-Identifier: Apache-2.0
// No rule of the servo is one of the first arm alone: a run with the arms exchanged, and each arm
// by itself, publish the same bits, whatever happens to either.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/publisher.hpp"
#include "shared/segment/layout.hpp"
#include "tests/servo/two_arms_support.hpp"

namespace kerf::arms_exchanged_test {

using namespace kerf::test;

namespace {

constexpr int kTicks = 1700;
constexpr int kResetTick = 1450;
constexpr int kWorkTicks = 850;

/// Docks, takes the tool, and draws a groove again and again.
Hand works(int tick) {
  if (tick < kDockTicks) return {.parked = true};
  return stroke((tick - 200) % kWorkTicks);
}
bool within(int tick, int from, int ticks) {
  return tick >= from && tick < from + ticks;
}

struct Course {
  const char* name;
  Hand (*at)(int tick);
};

const std::array kCourses{
    Course{"works", works},
    Course{"stays in the air", [](int tick) { return Hand{.parked = tick < kDockTicks}; }},
    Course{"never reports", [](int) { return Hand{.silent = true}; }},
    Course{"stays parked", [](int) { return Hand{.parked = true}; }},
    Course{"is never homed",
           [](int tick) { return Hand{.parked = tick % 200 < 100, .homed = false}; }},
    Course{"comes late",
           [](int tick) { return tick < 900 ? Hand{.silent = true} : works(tick - 900); }},
    Course{"is lost for good",
           [](int tick) {
             Hand hand = works(tick);
             hand.silent = tick >= 600;
             return hand;
           }},
    Course{"is lost twice and parked after each",
           [](int tick) {
             Hand hand = works(tick);
             hand.silent = within(tick, 600, 30) || within(tick, 1250, 25);
             if (within(tick, 700, 70) || within(tick, 1300, 70)) hand = {.parked = true};
             return hand;
           }},
    Course{"reports with gaps",
           [](int tick) {
             Hand hand = works(tick);
             hand.silent = tick > 500 && tick < 800 && tick % 24 < 12;
             if (within(tick, 1000, 70)) hand = {.parked = true};
             return hand;
           }},
    Course{"jumps, and is parked",
           [](int tick) {
             if (within(tick, 900, 70)) return Hand{.parked = true};
             Hand hand = works(tick);
             if (tick == 650) hand.at[0] += 40;
             return hand;
           }},
    Course{"is parked at work",
           [](int tick) {
             Hand hand = works(tick);
             hand.parked = hand.parked || tick % 97 == 0;
             return hand;
           }},
    Course{"is parked elsewhere, then at its dock",
           [](int tick) {
             if (within(tick, 700, 70)) return Hand{.at = {0, 25, 0}, .parked = true};
             if (within(tick, 1000, 70)) return Hand{.parked = true};
             return works(tick);
           }},
    Course{"loses its home at work",
           [](int tick) {
             Hand hand = works(tick);
             hand.homed = !within(tick, 650, 20);
             if (within(tick, 800, 70)) hand = {.parked = true};
             return hand;
           }},
    Course{"treads its pedal now and then",
           [](int tick) {
             Hand hand = works(tick);
             hand.pedal = tick / 60 % 2 == 0;
             return hand;
           }},
};

/// The command before a tick, for arms of which `first` comes first.
ServoCommand command_at(int tick, std::size_t first) {
  using enum ServoCommand::Kind;
  const auto arm = [&](std::uint32_t of) { return first == 0 ? of : 1 - of; };
  switch (tick) {
    case 640:
    case 1240:
      return {.kind = fade_in};
    case 760:
      return {.kind = hold, .argument = 1};
    case 790:
      return {.kind = hold, .argument = 0};
    case 950:
      return {.kind = select_tool, .argument = 1, .arm = arm(0)};
    case 1000:
      return {.kind = select_tool, .argument = 0, .arm = arm(1)};
    case kResetTick:
      return {.kind = reset};
    default:
      return {};
  }
}

/// All that is published of an arm after a tick, but for what both have done together.
TickRecord columns(const Bench& bench, const ServoCommand& command, std::size_t arm, bool shared) {
  const TickCommands commands{.command = command};
  TickRecord record = record_of(bench.reports[arm], commands_for(arm, commands), bench.out[arm]);
  record.command_argument = 0;
  record.penetration_mm = static_cast<float>(bench.servo->penetration_mm(arm));
  if (!shared) record.flags &= ~(kFlagUndoable | kFlagRedoable);
  return record;
}

bool equal(const TickRecord& a, const TickRecord& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

LoadedScene scene_of(NumericKind numeric, CutModel cut, Personality first, Personality second) {
  LoadedScene scene = two_armed({"", numeric, cut});
  scene.device.personality = first;
  scene.second->device.personality = second;
  scene.limits.force_n = 2.5;
  scene.limits.speed_mm_per_s = 9000;
  scene.second->limits.continuous_force_n = 0.4;
  scene.second->limits.slew_n_per_ms = 0.3;
  if (cut == CutModel::preston) {
    scene.cut.pedal = CutPedal::button;
    scene.force.stabiliser = {LawKind::stabiliser, "passivity", {}};
  }
  return scene;
}

/// An arm by itself; a command for the other is none.
struct Alone {
  Alone(const LoadedScene& scene, std::size_t arm) : bench(alone(scene, arm)), arm(arm) {}
  TickRecord step(int tick, const Hand& hand) {
    ServoCommand command = command_at(tick, 0);
    const bool for_other = command.kind == ServoCommand::Kind::select_tool && command.arm != arm;
    if (for_other) command = {};
    command.arm = 0;
    static_cast<void>(bench.servo->apply(command));
    bench.step(hand);
    return columns(bench, command, 0, false);
  }
  Bench bench;
  std::size_t arm;
};

/// Runs two courses, once with the arms exchanged; each arm must publish the same, and until the
/// volumes are reset what it publishes by itself. `records`: of each course and arm by itself.
using Records = std::vector<TickRecord>;
void compare(const LoadedScene& scene, const Course& one, const Course& other,
             const std::array<const Records*, kMaxArms>& records) {
  CAPTURE(std::string(one.name));
  CAPTURE(std::string(other.name));
  Bench ahead(scene), behind(exchanged(scene));
  for (int tick = 0; tick < kTicks; ++tick) {
    CAPTURE(tick);
    const ServoCommand command = command_at(tick, 0), crossed = command_at(tick, 1);
    REQUIRE(ahead.servo->apply(command) == behind.servo->apply(crossed));
    ahead.step(one.at(tick), other.at(tick));
    behind.step(other.at(tick), one.at(tick));
    for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
      CAPTURE(arm);
      REQUIRE(equal(columns(ahead, command, arm, true), columns(behind, crossed, 1 - arm, true)));
      REQUIRE(ahead.out[arm].removed_by_volume == behind.out[1 - arm].removed_by_volume);
      REQUIRE(ahead.out[arm].held == behind.out[1 - arm].held);
      if (tick >= kResetTick) continue;
      REQUIRE(equal(columns(ahead, command, arm, false),
                    (*records[arm])[static_cast<std::size_t>(tick)]));
    }
  }
  CHECK(ahead.hash() == behind.hash());
}

void compare_all(const LoadedScene& scene, bool (*chosen)(std::size_t one, std::size_t other)) {
  std::array<std::vector<Records>, kMaxArms> by_itself;
  std::array<bool, 9> faults{};
  std::uint64_t contact_ticks = 0;
  for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
    for (const Course& course : kCourses) {
      Alone single(scene, arm);
      Records& records = by_itself[arm].emplace_back();
      for (int tick = 0; tick < kResetTick; ++tick) {
        records.push_back(single.step(tick, course.at(tick)));
        faults.at(records.back().fault) = true;
        contact_ticks += (records.back().flags & kFlagContact) != 0 ? 1 : 0;
      }
    }
  }
  // The courses are worth running: both arms press, and each fault of a device latches.
  CHECK(contact_ticks > 2 * 5 * 400);
  for (const Fault fault : {Fault::stale_input, Fault::overspeed, Fault::sparse_input}) {
    CHECK(faults.at(static_cast<std::size_t>(fault)));
  }
  for (std::size_t one = 0; one < kCourses.size(); ++one) {
    for (std::size_t other = 0; other < kCourses.size(); ++other) {
      if (!chosen(one, other)) continue;
      compare(scene, kCourses[one], kCourses[other], {&by_itself[0][one], &by_itself[1][other]});
    }
  }
}

}  // namespace

TEST_CASE("arms that are exchanged publish the same bits, and each those of itself alone") {
  SUBCASE("cut by force, fixed: one of them at work") {
    compare_all(
        scene_of(NumericKind::fixed, CutModel::preston, Personality::omega, Personality::touch),
        [](std::size_t one, std::size_t other) { return one == 0 || other == 0; });
  }
  SUBCASE("cut by overlap, double: each course with another") {
    compare_all(scene_of(NumericKind::float64, CutModel::overlap, Personality::woodenhaptics,
                         Personality::falcon),
                [](std::size_t one, std::size_t other) {
                  return other == (5 * one + 3) % kCourses.size();
                });
  }
}

TEST_CASE("after a stall the force of each arm begins at nothing") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    Bench bench(two_armed(kind));
    bench.dock();
    for (int tick = 0; tick < 400; ++tick) bench.step(stroke(tick), stroke(tick));
    for (const ServoOutput& out : bench.out) REQUIRE(length(out.commanded_force_n) > 0.08);
    REQUIRE(bench.servo->apply({.kind = ServoCommand::Kind::fade_in}));
    for (int tick = 1; tick <= 100; ++tick) {
      bench.step(stroke(400), stroke(400));
      for (const ServoOutput& out : bench.out) {
        REQUIRE(length(out.commanded_force_n) <= 3.3 * tick / 100);
        REQUIRE(out.phase == (tick < 100 ? Phase::ramping : Phase::active));
      }
    }
  }
}

}  // namespace kerf::arms_exchanged_test
