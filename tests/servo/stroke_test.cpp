// SPDX-License-Identifier: Apache-2.0
// The command `undo`: the volumes go back to what they were before the last stroke, and the hand
// notices only that its force is gone and comes back slowly.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "controller/servo/volume_restore.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/servo/cut_kinds.hpp"
#include "tests/servo/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr ServoCommand kUndo{.kind = ServoCommand::Kind::undo};
using Place = std::array<double, 3>;
constexpr Place kAbove{0, 5, 0};

/// A hand that cuts one groove after another.
struct Strokes : ArmedServo {
  explicit Strokes(LoadedScene scene)
      : ArmedServo(scene, kAbove, std::max(1, scene.servo.rate_hz / 1000)),
        per_ms(std::max(1, scene.servo.rate_hz / 1000)) {}

  [[nodiscard]] std::uint64_t hash() const { return density_hash(servo->density(0)); }
  ServoOutput lead(const Place& from, const Place& to, int ms) {
    ServoOutput out;
    for (int i = 1; i <= ms * per_ms; ++i) {
      const double s = double(i) / (ms * per_ms);
      out = step(from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]),
                 from[2] + s * (to[2] - from[2]));
      for (std::size_t v = 0; v < kMaxVolumes; ++v) {
        removed += out.removed_by_volume[v] - out.returned_by_volume[v];
      }
    }
    return out;
  }
  /// Down at `x_mm`, and where the hand is then.
  Place press(double x_mm) {
    const Place end{x_mm + 0.4, -0.7, 0};
    lead(kAbove, {x_mm, 0.8, 0}, 150);
    lead({x_mm, 0.8, 0}, end, 300);
    return end;
  }
  void stroke(double x_mm) { lead(press(x_mm), kAbove, 150); }
  ServoOutput rest(int ms) { return lead(kAbove, kAbove, ms); }
  /// Until the undo is over.
  void undo(const Place& hand = kAbove) {
    REQUIRE(servo->apply(kUndo));
    for (int ticks = 0; lead(hand, hand, 1).undoing; ++ticks) REQUIRE(ticks < 20000);
  }

  int per_ms;
  std::uint64_t removed = 0;  ///< steps that are gone now
};

}  // namespace

TEST_CASE("an undo brings back the bits of before the last stroke, and only of that") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    Strokes hand(cut_scene(kind));
    const std::uint64_t first = hand.hash();
    hand.stroke(-0.8);
    CHECK(hand.rest(300).undoable);
    const std::uint64_t once = hand.hash(), removed_once = hand.removed;
    REQUIRE(once != first);
    hand.stroke(0.6);
    hand.rest(300);
    REQUIRE(hand.hash() != once);
    hand.undo();
    CHECK(hand.hash() == once);
    CHECK(hand.removed == removed_once);
    CHECK_FALSE(hand.rest(1).undoable);
    CHECK_FALSE(hand.servo->apply(kUndo));  // one stroke is kept
    hand.stroke(0.6);
    hand.undo();
    CHECK(hand.hash() == once);
  }
}

TEST_CASE("after an undo the tool feels what it felt before the stroke") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    Strokes fresh(cut_scene(kind)), undone(cut_scene(kind));
    undone.stroke(0.0);
    undone.undo();
    for (Strokes* hand : {&fresh, &undone}) hand->rest(2000);  // until the spindle has run up
    double most_n = 0;
    for (int ms = 0; ms < 300; ++ms) {
      const double y_mm = 2 - 0.008 * ms;
      const ServoOutput before = fresh.step(0, y_mm, 0), after = undone.step(0, y_mm, 0);
      most_n = std::max(most_n, length(before.contact_n));
      REQUIRE(before.contact_n == after.contact_n);
      REQUIRE(before.removed_steps == after.removed_steps);
    }
    CHECK(most_n > 0.1);
  }
}

TEST_CASE("a stroke goes on while its tool lifts for less than the pause, and ends after it") {
  for (const int away_ms : {20, 600}) {
    CAPTURE(away_ms);
    Strokes hand(cut_scene(kCutKinds[0]));
    const std::uint64_t first = hand.hash();
    const Place end = hand.press(-0.6);
    const Place lifted{end[0], end[1] + 3, end[2]};
    hand.lead(end, lifted, 20);
    hand.lead(lifted, lifted, away_ms);
    hand.lead(lifted, {end[0] + 0.6, end[1], end[2]}, 200);
    const bool one = away_ms < 250;
    hand.lead({end[0] + 0.6, end[1], end[2]}, kAbove, 100);
    hand.undo();
    CHECK((hand.hash() == first) == one);
  }
}

TEST_CASE("no force is felt and nothing is cut while a stroke is undone around the tool") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    LoadedScene scene = cut_scene(kind);
    scene.servo.rate_hz = 8000;  // eight bricks a tick
    Strokes hand(scene);
    const Place end = hand.press(0.2);
    REQUIRE(hand.removed > 0);
    REQUIRE(hand.servo->apply(kUndo));
    int ticks = 0;
    for (ServoOutput out; (out = hand.step(end[0], end[1], end[2])).undoing; ++ticks) {
      REQUIRE(ticks < 20000);
      CHECK(length(out.contact_n) == 0);
      CHECK(out.removed_steps == 0);
    }
    CHECK(ticks > 2);
  }
}

TEST_CASE("inside of the matter that came back the force comes slowly") {
  Strokes hand(cut_scene(kCutKinds[0]));
  const Place end = hand.press(0.2);
  hand.undo(end);
  for (int ms = 0; ms < 90; ++ms) {
    CHECK(length(hand.lead(end, end, 1).force_n) <= 3.3 * (ms + 2) / 100.0);
  }
}

TEST_CASE("a tick of an undo copies at most 64 bricks that lie within 32 voxels") {
  Strokes hand(cut_scene(kCutKinds[0]));
  hand.stroke(-1.0);
  REQUIRE(hand.servo->apply(kUndo));
  ServoOutput out;
  int ticks = 0;
  while ((out = hand.lead(kAbove, kAbove, 1)).undoing) {
    ++ticks;
    const VoxelIndex extent = out.changed[0].extent();
    CHECK(std::max({extent.x, extent.y, extent.z}) <= 32);
  }
  CHECK(ticks > 1);
}

TEST_CASE("a stroke that is longer than the pool is told, and the next one can be undone") {
  StrokeState stroke;
  std::vector<KeptBrick> pool(8);
  stroke.pool = pool;
  stroke.end = stroke_room(pool.size());
  stroke.open = true;
  stroke.lost = true;  // as `keep_bricks` says when it finds it full
  CHECK_FALSE(stroke.can_undo());
  CHECK_FALSE(begin_undo(stroke));
  follow_stroke(1, false, false, stroke);
  CHECK_FALSE(stroke.open);
  ++stroke.end;
  follow_stroke(1, true, true, stroke);
  CHECK(stroke.can_undo());
}

TEST_CASE("a reset forgets the last stroke, and ends an undo that runs") {
  Strokes hand(cut_scene(kCutKinds[0]));
  const std::uint64_t first = hand.hash();
  hand.stroke(0.0);
  REQUIRE(hand.servo->apply(kUndo));
  hand.rest(1);
  CHECK(hand.servo->apply({.kind = ServoCommand::Kind::reset}));
  CHECK_FALSE(hand.servo->apply(kUndo));
  CHECK_FALSE(hand.rest(300).resetting);
  CHECK(hand.hash() == first);
  CHECK_FALSE(hand.servo->apply(kUndo));
}

TEST_CASE("where nothing is cut there is nothing to undo, and asking changes no bit") {
  LoadedScene scene = half_space_scene(), same = scene;
  ArmedServo told(scene), untold(same);
  CHECK_FALSE(told.servo->apply(kUndo));
  for (int ms = 0; ms < 100; ++ms) {
    const double y_mm = 1 - 0.01 * ms;
    CHECK(told.step(0, y_mm, 0).output_hash == untold.step(0, y_mm, 0).output_hash);
  }
}

TEST_CASE("an undo repeats bit by bit from a snapshot in the middle of it, without the heap") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    Strokes hand(cut_scene(kind));
    hand.stroke(0.0);
    const std::uint64_t allocated = [&] {
      const CountedAllocations counted;
      const std::uint64_t before = CountedAllocations::total();
      CHECK(hand.servo->apply(kUndo));
      hand.rest(1);
      return CountedAllocations::total() - before;
    }();
    CHECK(allocated == 0);
    auto& compiled = dynamic_cast<CompiledScene&>(*hand.servo);
    const std::unique_ptr<ServoSnapshot> kept = compiled.keep();
    const std::uint64_t once = hand.rest(300).output_hash, volume = hand.hash();
    hand.stroke(0.5);
    compiled.restore(*kept);
    CHECK(hand.rest(300).output_hash == once);
    CHECK(hand.hash() == volume);
  }
}
