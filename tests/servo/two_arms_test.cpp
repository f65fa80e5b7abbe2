// SPDX-License-Identifier: Apache-2.0
// Two arms in the same volumes: what each feels is what it would feel alone, each faults alone, and
// what is cut, undone and reset belongs to both.
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "tests/servo/two_arms_support.hpp"

namespace kerf::two_arms_test {

using namespace kerf::test;

TEST_CASE("each arm feels and cuts as it would alone, to the bit, while the other is elsewhere") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    const LoadedScene scene = two_armed(kind);
    Bench both(scene), one(alone(scene, 0)), other(alone(scene, 1));
    for (Bench* bench : {&both, &one, &other}) bench->dock();
    std::uint64_t removed = 0, removed_alone = 0;
    int in_contact = 0;
    for (int tick = 0; tick < kStrokeTicks; ++tick) {
      const Hand a = stroke(tick), b = stroke(tick - 100);
      both.step(a, b);
      one.step(a);
      other.step(b);
      REQUIRE(both.out[0].output_hash == one.out[0].output_hash);
      REQUIRE(both.out[1].output_hash == other.out[0].output_hash);
      removed += both.out[0].removed_steps + both.out[1].removed_steps;
      removed_alone += one.out[0].removed_steps + other.out[0].removed_steps;
      in_contact += both.out[0].contact && both.out[1].contact ? 1 : 0;
    }
    CHECK(both.out[1].active_tool == 1);
    CHECK(in_contact > 200);
    CHECK(removed > 0);
    CHECK(removed == removed_alone);
  }
}

TEST_CASE("an arm meets the volume as the other has left it, in the same tick") {
  // Overlap cuts what is covered, whatever the force: of two hands at one place the first takes it.
  Bench bench(two_armed({"", NumericKind::fixed, CutModel::overlap}, 0));
  bench.dock();
  for (int tick = 0; tick < 200; ++tick) bench.step({{0, 3 - tick * 0.02, 0}}, {});
  const std::uint64_t by_first = bench.out[0].removed_steps;
  CHECK(by_first > 0);
  for (int tick = 0; tick < 400; ++tick) bench.step({}, {{0, 3 - std::min(tick, 150) * 0.02, 0}});
  CHECK(bench.out[1].commanded_force_n[1] <
        0.05);  // the groove of the larger ball: nothing is left to feel
}

TEST_CASE("each arm faults alone") {
  const LoadedScene scene = two_armed(kCutKinds[0]);
  for (const std::size_t silent : {0U, 1U}) {
    CAPTURE(silent);
    Bench both(scene), one(alone(scene, 1 - silent));
    both.dock();
    one.dock();
    for (int tick = 0; tick < kStrokeTicks; ++tick) {
      const Hand at_work = stroke(tick);
      Hand lost = stroke(tick);
      lost.silent = tick >= 300;
      both.step(silent == 0 ? lost : at_work, silent == 0 ? at_work : lost);
      one.step(at_work);
      const ServoOutput& works = both.out[1 - silent];
      REQUIRE(works.output_hash == one.out[0].output_hash);
      REQUIRE(works.fault == Fault::none);
      const bool gone = tick >= 319;  // the twentieth tick without a report
      REQUIRE(both.out[silent].motors_on == !gone);
    }
    CHECK(both.out[silent].fault == Fault::stale_input);
  }
}

TEST_CASE("an arm that is never docked costs the other nothing, and gets nothing") {
  const LoadedScene scene = two_armed(kCutKinds[0]);
  Bench both(scene), one(alone(scene, 0));
  one.dock();
  for (int tick = 0; tick < kDockTicks; ++tick) both.step({.parked = true}, {.silent = true});
  for (int tick = 0; tick < 200; ++tick) both.step({}, {.silent = true});
  for (int tick = 0; tick < kStrokeTicks; ++tick) {
    both.step(stroke(tick), {.silent = true});
    one.step(stroke(tick));
    REQUIRE(both.out[0].output_hash == one.out[0].output_hash);
    REQUIRE_FALSE(both.out[1].started);
    REQUIRE(both.out[1].dac_counts == std::array<std::int16_t, 3>{});
  }
}

TEST_CASE("a reset and an undo take back what both have cut, and hold both hands meanwhile") {
  for (const CutKind& kind : kCutKinds) {
    for (const auto what : {ServoCommand::Kind::reset, ServoCommand::Kind::undo}) {
      CAPTURE(std::string(kind.name));
      CAPTURE(static_cast<int>(what));
      Bench bench(two_armed(kind));
      bench.dock();
      for (int tick = 0; tick < 500; ++tick) bench.step(stroke(tick), stroke(tick));
      REQUIRE(bench.hash() != bench.first);
      REQUIRE(bench.out[1].undoable);
      REQUIRE(bench.servo->apply({.kind = what}));
      std::uint64_t restored = 0;
      int ticks = 0;
      for (bool runs = true; runs; ++ticks) {
        REQUIRE(ticks < 1000);
        bench.step(stroke(500), stroke(500));
        runs = bench.out[0].resetting || bench.out[0].undoing;
        CHECK((bench.out[1].resetting || bench.out[1].undoing) == runs);
        if (!runs) break;
        restored = bench.hash();
        CHECK(length(bench.out[0].commanded_force_n) <= 0.51);  // within the slew of its first tick
      }
      CHECK(ticks > 0);
      CHECK(restored == bench.first);
      CHECK(bench.out[0].phase == Phase::ramping);
      CHECK(bench.out[1].phase == Phase::ramping);
    }
  }
}

TEST_CASE("a stroke lasts as long as one of the hands cuts") {
  Bench bench(two_armed(kCutKinds[0]));
  bench.dock();
  // The first lifts its tool after 0.4 s; the second goes on for a second.
  for (int tick = 0; tick < 1400; ++tick) {
    bench.step(stroke(tick < 400 ? tick : 799), stroke(std::min(tick, 500)));
  }
  REQUIRE(bench.servo->apply({.kind = ServoCommand::Kind::undo}));
  std::uint64_t restored = 0;
  for (bool runs = true; runs; runs = bench.out[0].undoing) {
    bench.step({}, {});
    if (bench.out[0].undoing) restored = bench.hash();
  }
  CHECK(restored == bench.first);
  CHECK_FALSE(bench.servo->apply({.kind = ServoCommand::Kind::undo}));  // it was one stroke
}

TEST_CASE("a tool is chosen for one arm; a hold is for both") {
  Bench bench(two_armed(kCutKinds[0]));
  bench.dock();
  using enum ServoCommand::Kind;
  CHECK(bench.servo->apply({.kind = select_tool, .argument = 0, .arm = 1}));
  bench.step({}, {});
  CHECK(bench.out[0].active_tool == 0);
  CHECK(bench.out[1].active_tool == 0);
  CHECK(bench.servo->apply({.kind = select_tool, .argument = 1, .arm = 0}));
  bench.step({}, {});
  CHECK(bench.out[0].active_tool == 1);
  CHECK(bench.out[1].active_tool == 0);
  CHECK_FALSE(bench.servo->apply({.kind = select_tool, .argument = 2, .arm = 1}));
  CHECK_FALSE(bench.servo->apply({.kind = select_tool, .argument = 0, .arm = 2}));

  CHECK(bench.servo->apply({.kind = hold, .argument = 1}));
  for (int tick = 0; tick < 400; ++tick) bench.step(stroke(tick), stroke(tick));
  CHECK(bench.hash() == bench.first);
  CHECK(bench.out[0].commanded_force_n == Place{});
  CHECK(bench.out[1].commanded_force_n == Place{});
}

TEST_CASE("a snapshot of two arms continues to the bit, and does not fit one") {
  const LoadedScene scene = two_armed(kCutKinds[2]);
  Bench bench(scene);
  bench.dock();
  const auto lead = [&](int from, int to) {
    for (int tick = from; tick < to; ++tick) bench.step(stroke(tick), stroke(tick - 50));
    return std::array{bench.out[0].output_hash, bench.out[1].output_hash, bench.hash()};
  };
  lead(0, 400);
  const auto kept = bench.servo->keep();
  const auto once = lead(400, 700);
  bench.servo->restore(*kept);
  CHECK(lead(400, 700) == once);
  Bench single(alone(scene, 0));
  CHECK_THROWS_AS(single.servo->restore(*kept), std::invalid_argument);
}

TEST_CASE("each bur of each arm wears alone; a reset renews all, and snapshots keep them") {
  LoadedScene scene = two_armed(kCutKinds[0]);
  scene.tools[0].law.wear_half_n_s = 0.002;
  scene.tools[1].law.wear_half_n_s = 0.02;
  Bench bench(scene), other(alone(scene, 1));
  for (Bench* each : {&bench, &other}) each->dock();
  for (int tick = 0; tick < 170; ++tick) {  // the second is still above, the first again
    bench.step(tick < 150 ? stroke(tick) : Hand{}, stroke(tick - 100));
    other.step(stroke(tick - 100));
  }
  const double first = bench.out[0].sharpness;
  CHECK(first < 0.8);
  CHECK(bench.out[1].sharpness == 1);
  const auto kept = bench.servo->keep();
  for (int tick = 170; tick < 600; ++tick) {
    bench.step({}, stroke(tick - 100));
    other.step(stroke(tick - 100));
    REQUIRE(bench.out[1].output_hash == other.out[0].output_hash);
  }
  CHECK(bench.out[0].sharpness == first);
  CHECK(bench.out[1].sharpness < 0.8);
  CHECK(bench.out[1].sharpness == other.out[0].sharpness);
  // A bur that is put down keeps its wear; the second arm's are not the first one's.
  bench.servo->apply({ServoCommand::Kind::select_tool, 1, 0});
  bench.step({}, {});
  CHECK(bench.out[0].sharpness == 1);
  bench.servo->apply({ServoCommand::Kind::select_tool, 0, 0});
  bench.step({}, {});
  CHECK(bench.out[0].sharpness == first);
  bench.servo->apply({ServoCommand::Kind::reset, 0});
  for (int tick = 0; tick < 600; ++tick) bench.step({}, {});
  CHECK(bench.out[0].sharpness == 1);
  CHECK(bench.out[1].sharpness == 1);
  bench.servo->restore(*kept);
  bench.step({}, {});
  CHECK(bench.out[0].sharpness == first);
  CHECK(bench.out[1].sharpness == 1);
}

TEST_CASE("a tick of two arms allocates nothing") {
  Bench bench(two_armed(kCutKinds[0]));
  bench.dock();
  for (int tick = 0; tick < 10; ++tick) bench.step(stroke(tick), stroke(tick));
  const CountedAllocations counted;
  const std::uint64_t before = CountedAllocations::total();
  for (int tick = 10; tick < kStrokeTicks; ++tick) bench.step(stroke(tick), stroke(tick));
  CHECK(CountedAllocations::total() == before);
}

TEST_CASE("a scene whose tools fit the budget once and not twice is refused for two hands") {
  LoadedScene scene = two_armed(kCutKinds[0]);
  const double one_us =
      work_us(plan_scene(alone(scene, 0), kScalarSet)->costs(), 0);  // of every processor
  scene.servo.rate_hz = static_cast<int>(0.75e6 * kBudgetRatio / one_us);
  REQUIRE(scene.servo.rate_hz <= kMaxRateHz);
  const auto single = plan_scene(alone(scene, 0), kScalarSet);
  CHECK(budget_error(alone(scene, 0), single->costs()).empty());
  const auto both = plan_scene(scene, kScalarSet);
  const std::string error = budget_error(scene, both->costs());
  CHECK(error.find("in both hands") != std::string::npos);
}

}  // namespace kerf::two_arms_test
