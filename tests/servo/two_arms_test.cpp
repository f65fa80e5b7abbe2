// SPDX-License-Identifier: Apache-2.0
// Two arms in the same volumes: what each feels is what it would feel alone, each faults alone, and
// what is cut, undone and reset belongs to both.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/servo/support.hpp"

using namespace kerf;
using namespace kerf::test;
using ranges::KinematicHand;

namespace {

using Place = std::array<double, 3>;
constexpr Place kAbove{0, 5, 0};
constexpr double kApartMm = 3;  // of the middle, each

struct CutKind {
  const char* name;
  NumericKind numeric;
  CutModel cut;
};
constexpr std::array kCutKinds{CutKind{"preston, fixed", NumericKind::fixed, CutModel::preston},
                               CutKind{"preston, double", NumericKind::float64, CutModel::preston},
                               CutKind{"paper, fixed", NumericKind::fixed, CutModel::overlap},
                               CutKind{"paper, double", NumericKind::float64, CutModel::overlap}};

/// Solid below y = 0, wide enough for two hands, each above its own half: an omega with a ball of
/// 16 voxels, and a Touch with one of 10.
LoadedScene two_armed(const CutKind& kind, double apart_mm = kApartMm) {
  const bool force = kind.cut == CutModel::preston;
  LoadedScene scene = force ? half_space_scene(96) : paper_scene(96);
  scene.servo.numeric = kind.numeric;
  scene.cut.model = kind.cut;
  if (force) scene.cut.machinability_mm3_per_s_n = 8;
  scene.tools.push_back(ball(10));
  scene.device.personality = Personality::omega;
  scene.device.torque_scale = std::array{1.0, 1.0, 1.0};
  scene.device.offset_mm = {-apart_mm, 0, 0};
  scene.second = SecondArm{.device = scene.device,
                           .offset_given = true,
                           .limits = scene.limits,
                           .hand_script = {},
                           .hand_place = {}};
  scene.second->device.personality = Personality::touch;
  scene.second->device.offset_mm = {apart_mm, 0, 0};
  scene.second_tool = 1;
  return scene;
}

/// The same with one arm: the first, or the second.
LoadedScene alone(LoadedScene scene, std::size_t arm) {
  if (arm == 1) {
    scene.device = scene.second->device;
    scene.limits = scene.second->limits;
    scene.active_tool = scene.second_tool;
  }
  scene.second.reset();
  return scene;
}

/// What a hand does in a tick: nothing is sent, it rests parked, or it holds its tool at a place.
struct Hand {
  Place at = kAbove;
  bool parked = false, silent = false;
};

/// A servo under one or two hands.
class Bench {
 public:
  explicit Bench(LoadedScene scene) : servo(compile(scene)) {
    hands_[0].emplace(scene.device);
    if (scene.second) hands_[1].emplace(scene.second->device);
    first = hash();
  }
  void dock() {
    for (int tick = 0; tick < kDockTicks; ++tick) {
      step({.parked = true}, {.parked = true});
    }
    for (int tick = 0; tick < 200; ++tick) step({}, {});
  }
  void step(const Hand& a, const Hand& b = {}) {
    const std::array both{report(a, 0), report(b, servo->arms() - 1)};
    servo->step(std::span(both).first(servo->arms()), std::span(out).first(servo->arms()));
  }
  [[nodiscard]] std::uint64_t hash() const { return density_hash(servo->density(0)); }

  std::unique_ptr<CompiledScene> servo;
  std::array<ServoOutput, kMaxArms> out;
  std::uint64_t first = 0;

 private:
  [[nodiscard]] DeviceReport report(const Hand& hand, std::size_t arm) {
    if (hand.silent) return {};
    KinematicHand& of = *hands_[arm];
    return of.report(of.counts_at({hand.at[0], hand.at[1], hand.at[2]}), hand.parked);
  }

  std::array<std::optional<KinematicHand>, kMaxArms> hands_;
};

/// Presses 0.9 mm below the first surface and draws a groove, from the air and back.
Hand stroke(int tick) {
  const double s = std::min(tick / 200.0, 1.0), along = std::clamp((tick - 200) / 400.0, 0.0, 1.0),
               up = std::clamp((tick - 600) / 100.0, 0.0, 1.0);
  return {{-0.5 + along, 5 - 5.9 * s + 5.9 * up, 0}};
}
constexpr int kStrokeTicks = 800;

}  // namespace

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
  CHECK(bench.out[1].force_n[1] < 0.05);  // the groove of the larger ball: nothing is left to feel
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
    REQUIRE(both.out[1].motor_counts == std::array<std::int16_t, 3>{});
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
        CHECK(length(bench.out[0].force_n) <= 0.51);  // within the slew of its first tick
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
  CHECK(bench.out[0].force_n == Place{});
  CHECK(bench.out[1].force_n == Place{});
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
      work_us(compile(*std::make_unique<LoadedScene>(alone(scene, 0)))->costs(), 0);
  scene.servo.rate_hz = static_cast<int>(0.75e6 * kBudgetRatio / one_us);
  REQUIRE(scene.servo.rate_hz <= kMaxRateHz);
  const auto single = plan_scene(alone(scene, 0));
  CHECK(budget_error(alone(scene, 0), single->costs()).empty());
  const auto both = plan_scene(scene);
  const std::string error = budget_error(scene, both->costs());
  CHECK(error.find("in both hands") != std::string::npos);
}
