// SPDX-License-Identifier: Apache-2.0
// The commands `reset`, `undo` and `redo`: the volumes go back to their first content, or to that
// of before a stroke, or after it. The hand notices only that its force is gone and comes back
// slowly. The pedal: without it nothing is cut, and a press of it is a stroke.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "controller/servo/volume_restore.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/servo/support.hpp"
#include "tests/support/property.hpp"

namespace kerf::restore_test {

using namespace kerf::test;

namespace {

constexpr ServoCommand kReset{.kind = ServoCommand::Kind::reset};
constexpr ServoCommand kUndo{.kind = ServoCommand::Kind::undo};
constexpr ServoCommand kRedo{.kind = ServoCommand::Kind::redo};
constexpr std::array kBoth{kReset, kUndo};
using Place = std::array<double, 3>;
constexpr Place kAbove{0, 5, 0}, kGrooveEnd{0.5, -0.9, 0};

/// A way of cutting, in one type of numbers.
struct CutKind {
  const char* name;
  NumericKind numeric;
  CutModel cut;
  bool round = true;
};
constexpr std::array kCutKinds{
    CutKind{"preston, fixed", NumericKind::fixed, CutModel::preston},
    CutKind{"preston, double", NumericKind::float64, CutModel::preston},
    CutKind{"paper, fixed, aligned", NumericKind::fixed, CutModel::overlap},
    CutKind{"paper, fixed, splat", NumericKind::fixed, CutModel::overlap, false},
    CutKind{"paper, double, gradients", NumericKind::float64, CutModel::overlap}};

/// Solid below y = 0, in 44^3 voxels: the far bricks of a block are missing.
LoadedScene cut_scene(const CutKind& kind, int rate_hz = 1000) {
  const bool force = kind.cut == CutModel::preston;
  LoadedScene scene = force ? half_space_scene(44) : paper_scene(44);
  scene.servo.numeric = kind.numeric;
  scene.servo.rate_hz = rate_hz;
  scene.cut.model = kind.cut;
  scene.tools[0].round = kind.round;
  if (force) scene.cut.machinability_mm3_per_s_n = 8;
  return scene;
}

/// A hand that cuts grooves, and what is gone of the volumes.
struct CuttingHand : ArmedServo {
  explicit CuttingHand(LoadedScene scene)
      : ArmedServo(scene, kAbove, std::max(1, scene.servo.rate_hz / 1000)),
        per_ms(std::max(1, scene.servo.rate_hz / 1000)),
        volumes(scene.volumes.size()),
        first(hash()) {}

  [[nodiscard]] std::uint64_t hash(std::size_t v = 0) const {
    return density_hash(servo->density(v));
  }
  ServoOutput step_to(const Place& at) {
    DeviceReport report = arm.at(at[0], at[1], at[2]);
    report.button1 = pedal;
    const ServoOutput out = servo->step(report);
    for (std::size_t v = 0; v < kMaxVolumes; ++v) {
      removed += out.removed_by_volume[v] - out.returned_by_volume[v];
    }
    return out;
  }
  ServoOutput lead(const Place& from, const Place& to, int ms) {
    ServoOutput out;
    for (int i = 1; i <= ms * per_ms; ++i) {
      const double s = double(i) / (ms * per_ms);
      out = step_to({from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]),
                     from[2] + s * (to[2] - from[2])});
    }
    return out;
  }
  ServoOutput rest(const Place& at, int ms) { return lead(at, at, ms); }
  /// To `kGrooveEnd`, 0.9 mm below the first surface, where the hand stays.
  void groove() {
    lead(kAbove, {-0.5, 1, 0}, 200);
    lead({-0.5, 1, 0}, kGrooveEnd, 500);
  }
  /// Down at `x_mm`; returns where the hand is then.
  Place press(double x_mm) {
    const Place end{x_mm + 0.4, -0.7, 0};
    lead(kAbove, {x_mm, 0.8, 0}, 150);
    lead({x_mm, 0.8, 0}, end, 300);
    return end;
  }
  void stroke(double x_mm) { lead(press(x_mm), kAbove, 150); }
  /// Ticks of a command with the hand at rest. `restored`: the volumes at its end, since a tool
  /// that lies in the solid cuts in the next tick again.
  int restore(const ServoCommand& command, const Place& hand = kAbove) {
    REQUIRE(servo->apply(command));
    int ticks = 0;
    for (ServoOutput out; (out = step_to(hand)).resetting || out.undoing || out.redoing;) {
      REQUIRE(++ticks < 20000);
      for (std::size_t v = 0; v < volumes; ++v) restored[v] = hash(v);
    }
    return ticks;
  }

  std::array<std::uint64_t, kMaxVolumes> restored{};
  bool pedal = false;
  int per_ms;
  std::size_t volumes;
  std::uint64_t first;
  std::uint64_t removed = 0;  ///< steps that are gone now
};

}  // namespace

TEST_CASE("after a reset every volume is its first content, whatever feels and cuts") {
  for (const CutKind& kind : kCutKinds) {
    for (const int rate_hz : {250, 1000, 8000}) {
      if (rate_hz != 1000 && &kind != &kCutKinds[0]) continue;  // the time of a test
      CAPTURE(std::string(kind.name));
      CAPTURE(rate_hz);
      CuttingHand hand(cut_scene(kind, rate_hz));
      for (int time = 0; time < 2; ++time) {
        hand.groove();
        REQUIRE(hand.hash() != hand.first);
        CHECK(hand.restore(kReset, kGrooveEnd) > 0);
        CHECK(hand.restored[0] == hand.first);
        hand.lead(kGrooveEnd, kAbove, 100);
      }
    }
  }
}

TEST_CASE("an undo brings back the bits of before the last stroke, and only of that") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    CuttingHand hand(cut_scene(kind));
    hand.stroke(-0.8);
    CHECK(hand.rest(kAbove, 300).undoable);
    const std::uint64_t once = hand.hash(), removed_once = hand.removed;
    REQUIRE(once != hand.first);
    hand.stroke(0.6);
    hand.rest(kAbove, 300);
    REQUIRE(hand.hash() != once);
    hand.restore(kUndo);
    CHECK(hand.hash() == once);
    CHECK(hand.removed == removed_once);
    CHECK(hand.rest(kAbove, 1).undoable);  // the one before
  }
}

// Gradients, accounts and fractions that are owed follow: the same hand feels and cuts the same.
TEST_CASE("after a reset or an undo the tool feels and cuts as if nothing had been cut") {
  for (const CutKind& kind : kCutKinds) {
    for (const ServoCommand& command : kBoth) {
      CAPTURE(std::string(kind.name));
      CuttingHand fresh(cut_scene(kind)), restored(cut_scene(kind));
      restored.stroke(0.0);
      restored.restore(command);
      REQUIRE(restored.hash() == fresh.first);
      for (CuttingHand* hand : {&fresh, &restored})
        hand->rest(kAbove, 2000);  // the spindle runs up
      double most_n = 0;
      for (int ms = 0; ms < 300; ++ms) {
        const Place at{0, 2 - 0.008 * ms, 0};
        const ServoOutput before = fresh.step_to(at), after = restored.step_to(at);
        most_n = std::max(most_n, length(before.contact_force_n));
        REQUIRE(before.contact_force_n == after.contact_force_n);
        REQUIRE(before.removed_steps == after.removed_steps);
      }
      CHECK(most_n > 0.1);
      CHECK(restored.hash() == fresh.hash());
    }
  }
}

TEST_CASE("a stroke goes on while its tool lifts for less than the pause, and ends after it") {
  for (const int away_ms : {20, 130, 600}) {
    CAPTURE(away_ms);
    CuttingHand hand(cut_scene(kCutKinds[0]));
    const Place end = hand.press(-0.6), lifted{end[0], end[1] + 3, end[2]};
    const Place beside{end[0] + 0.6, end[1], end[2]};
    hand.lead(end, lifted, 20);
    hand.rest(lifted, away_ms);
    hand.lead(lifted, beside, 200);
    hand.lead(beside, lifted, 20);  // and a second time
    hand.rest(lifted, away_ms);
    hand.lead(lifted, beside, 200);
    hand.lead(beside, kAbove, 100);
    hand.restore(kUndo);
    CHECK((hand.hash() == hand.first) == (away_ms < 250));
  }
}

TEST_CASE("no force is felt and nothing is cut while volumes are restored, whoever asks again") {
  for (const CutKind& kind : kCutKinds) {
    for (const ServoCommand& command : kBoth) {
      CAPTURE(std::string(kind.name));
      LoadedScene scene = cut_scene(kind, 8000);  // eight bricks a tick
      scene.tools.push_back(ball(8));
      CuttingHand once(scene), often(scene);
      for (CuttingHand* hand : {&once, &often}) {
        hand->groove();
        REQUIRE(hand->removed > 0);
        CHECK(hand->servo->apply(command));
      }
      int ticks = 0;
      std::uint64_t last = 0;  // a tool that lies in the solid cuts in the next tick again
      for (ServoOutput out; (out = once.step_to(kGrooveEnd)).resetting || out.undoing;) {
        last = once.hash();
        CHECK(length(out.contact_force_n) == 0);
        CHECK(out.removed_steps == 0);
        CHECK(out.press_n == 0);
        CHECK(often.step_to(kGrooveEnd).output_hash == out.output_hash);
        static_cast<void>(often.servo->apply(command));  // an undo that runs is refused
        if (++ticks != 3) continue;                      // another tool takes over half-way
        for (CuttingHand* hand : {&once, &often}) {
          CHECK(hand->servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = 1}));
        }
      }
      CHECK(ticks > 2);
      CHECK(last == once.first);
    }
  }
}

TEST_CASE("inside of the restored solid the force comes slowly, and a hand at rest does no work") {
  constexpr double kSlewN = 0.5 + 2e-3;  // in a tick of 1 ms, and the motors' steps
  for (const CutKind& kind : kCutKinds) {
    for (const ServoCommand& command : kBoth) {
      CAPTURE(std::string(kind.name));
      CuttingHand hand(cut_scene(kind));
      hand.groove();
      ServoOutput last = hand.rest(kGrooveEnd, 1);
      const double work_mj = last.absorbed_mj;
      CHECK(hand.servo->apply(command));
      double after_ms = 0;
      for (int ms = 0; ms < 1500; ++ms) {
        const ServoOutput out = hand.rest(kGrooveEnd, 1);
        CHECK(length(vec3::operator-(out.commanded_force_n, last.commanded_force_n)) <= kSlewN);
        CHECK(length(out.commanded_force_n) <= 2.01);
        after_ms = out.resetting || out.undoing ? 0 : after_ms + 1;
        // It fades in over 100 ms, and a spring that ramps grows by 0.1 N/ms at most.
        if (after_ms > 0 && after_ms < 20)
          CHECK(length(out.commanded_force_n) < 0.02 * after_ms + 0.02);
        CHECK(out.absorbed_mj == doctest::Approx(work_mj));  // at rest
        const auto& energy = out.energy_steps;
        const auto steps = std::accumulate(energy.begin(), energy.end(), std::int64_t{0});
        CHECK(std::abs(energy_mj_of_steps(steps) - out.absorbed_mj) < 1e-6);
        last = out;
      }
      if (kind.cut == CutModel::preston)
        CHECK(last.commanded_force_n[1] > 0.2);  // it is pushed out again
    }
  }
}

TEST_CASE("a tick of a reset or an undo copies at most 64 bricks, and tells their box") {
  for (const ServoCommand& command : kBoth) {
    const bool resets = command.kind == ServoCommand::Kind::reset;
    for (const int rate_hz : {250, 1000, 8000}) {
      CAPTURE(resets);
      CuttingHand hand(cut_scene(kCutKinds[0], rate_hz));
      hand.stroke(-1.0);
      hand.rest(kAbove, 300);
      const std::uint64_t before = resets ? hand.first : hand.hash();
      const Place end = hand.press(0.9);  // in another block
      const auto density = hand.servo->density(0);
      std::vector<Density> seen(density.begin(), density.end());
      const VoxelGrid grid = hand.servo->grid(0);
      CHECK(hand.servo->apply(command));
      ServoOutput out;
      int ticks = 0;
      do {
        out = hand.step_to(end);
        const VoxelBox& box = out.changed[0];
        if (box.empty() || !(out.resetting || out.undoing)) continue;
        ++ticks;
        CHECK(out.removed_steps == 0);
        const VoxelIndex extent = box.extent();
        CHECK(std::max({extent.x, extent.y, extent.z}) <= 32);
        if (resets) CHECK(box.lo.x / 32 == (box.hi.x - 1) / 32);  // of one block
        for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
          for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
            for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
              seen[grid.index(x, y, z)] = hand.servo->density(0)[grid.index(x, y, z)];
            }
          }
        }
      } while (out.resetting || out.undoing);
      CHECK(ticks > (resets ? 1 : 0));
      CHECK(density_hash(seen) == before);  // of a reader that follows the boxes
    }
  }
}

TEST_CASE("a stroke that is longer than the pool is told, and the next one can be undone") {
  StrokeState stroke;
  std::vector<KeptBrick> pool(8);
  stroke.pool = pool;
  stroke.end = 1;
  follow_stroke(1, true, true, stroke);
  close_stroke(stroke);
  CHECK(stroke.can_undo());
  stroke.end += stroke_room(pool.size());
  follow_stroke(1, true, true, stroke);
  lose_stroke(stroke);  // as `keep_bricks` does if the pool is full
  CHECK_FALSE(stroke.can_undo());
  CHECK_FALSE(begin_undo(stroke));
  follow_stroke(1, false, false, stroke);
  CHECK_FALSE(stroke.open);
  CHECK_FALSE(stroke.can_undo());  // one before it would bring back half of it
  ++stroke.end;
  follow_stroke(1, true, true, stroke);
  CHECK(stroke.can_undo());
}

TEST_CASE("what was saved for a stroke that an undo came before is no part of the next one") {
  StrokeState stroke;
  std::vector<KeptBrick> pool(8);
  stroke.pool = pool;
  const auto stroke_of = [&](std::size_t bricks) {
    for (std::size_t i = 0; i < bricks; ++i) REQUIRE(entry_for_brick(stroke) != nullptr);
    follow_stroke(1, true, true, stroke);
    close_stroke(stroke);
  };
  stroke_of(1);
  // A tool that touches and does not cut: two bricks wait, then more than there is room for.
  for (const int waiting : {2, 20}) {
    for (int i = 0; i < waiting; ++i) static_cast<void>(entry_for_brick(stroke));
    REQUIRE(begin_undo(stroke));
    stroke.motion = StrokeState::Motion::none;  // the bricks are back
    stroke_of(1);
    // They had the content from before the undo, which an undo of this stroke would bring back.
    CHECK(stroke.strokes[0].end - stroke.strokes[0].begin == 1);
    CHECK(stroke.can_undo());
  }
}

TEST_CASE("twenty strokes are undone and cut again bit by bit; the next cut drops what is undone") {
  for (const CutKind& kind : {kCutKinds[0], kCutKinds[2], kCutKinds[4]}) {
    CAPTURE(std::string(kind.name));
    CuttingHand hand(cut_scene(kind));
    struct Seen {
      std::uint64_t hash, removed;
    };
    std::vector<Seen> seen;
    const auto stroke = [&](int i) {
      hand.stroke(-1.2 + 0.12 * (i % 20));
      hand.rest(kAbove, 300);
      seen.push_back({hand.hash(), hand.removed});
    };
    const auto is = [&](std::size_t i) {
      return hand.hash() == seen[i].hash && hand.removed == seen[i].removed;
    };
    for (int i = 0; i < 23; ++i) stroke(i);
    CHECK_FALSE(hand.servo->apply(kRedo));
    for (std::size_t i = 22; i-- > 2;) {
      hand.restore(kUndo);
      CHECK(is(i));
    }
    const ServoOutput oldest = hand.rest(kAbove, 1);
    CHECK_FALSE(oldest.undoable);
    CHECK(oldest.redoable);
    CHECK_FALSE(hand.servo->apply(kUndo));
    for (std::size_t i = 3; i < 23; ++i) {
      hand.restore(kRedo);
      CHECK(is(i));
    }
    CHECK_FALSE(hand.servo->apply(kRedo));
    for (int i = 0; i < 3; ++i) hand.restore(kUndo);
    CHECK(is(19));
    seen.resize(20);
    hand.stroke(-1.2 + 0.12 * 7);
    CHECK_FALSE(hand.servo->apply(kRedo));  // while it is cut,
    hand.rest(kAbove, 300);
    seen.push_back({hand.hash(), hand.removed});
    CHECK_FALSE(hand.servo->apply(kRedo));  // and after it
    hand.restore(kUndo);
    CHECK(is(19));
    hand.restore(kRedo);
    CHECK(is(20));
  }
}

// Strokes, undos and redos in any order against a list of all contents; a brick is one number.
TEST_CASE("of a full pool the oldest strokes go, and what is left comes back whole") {
  CHECK(property([] {
    StrokeState stroke;
    std::vector<KeptBrick> pool(16);
    stroke.pool = pool;
    std::vector<Density> volume(14);
    std::vector<std::vector<Density>> contents{volume};
    std::size_t now = 0, lost_before = 0;
    Density next = 0;
    const auto swap_all = [&] {
      for (; stroke.moving.begin != stroke.moving.end; --stroke.moving.end) {
        KeptBrick& kept = pool[(stroke.moving.end - 1) % pool.size()];
        std::swap(kept.density[0], volume[kept.id]);
      }
      stroke.motion = StrokeState::Motion::none;
    };
    for (int step = 0; step < 60; ++step) {
      const int what = in_range(0, 4);
      if (what < 2) {
        const auto bricks = in_range<std::uint32_t>(1, 15);
        for (std::uint32_t id = 0; id < bricks; ++id) {
          if (KeptBrick* const kept = entry_for_brick(stroke)) {
            kept->id = id;
            kept->density[0] = volume[id];
          }
          volume[id] = ++next;
          follow_stroke(1, true, true, stroke);
        }
        HOLDS(stroke.can_undo() == (bricks <= stroke_room(pool.size())));
        contents.resize(++now);
        contents.push_back(volume);
        if (!stroke.can_undo()) lost_before = now;
        close_stroke(stroke);
      } else if (what == 2 && begin_undo(stroke)) {
        swap_all();
        HOLDS(now > lost_before);
        HOLDS(volume == contents[--now]);
      } else if (what == 3) {
        const bool could = begin_redo(stroke);
        HOLDS(could == (now + 1 < contents.size()));
        if (!could) continue;
        swap_all();
        HOLDS(volume == contents[++now]);
      }
      HOLDS(stroke.all == 0 || stroke.end - stroke.strokes[0].begin <= stroke_room(pool.size()));
    }
  }));
}

namespace {

LoadedScene pedal_scene(const CutKind& kind) {
  LoadedScene scene = cut_scene(kind);
  scene.cut.pedal = CutPedal::button;
  return scene;
}

}  // namespace

TEST_CASE("without the pedal nothing is cut, however the tool came to press") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    CuttingHand hand(pedal_scene(kind)), held(pedal_scene(kind)), always(cut_scene(kind));
    hand.groove();
    hand.rest(kGrooveEnd, 1000);
    const ServoOutput up = hand.rest(kGrooveEnd, 1);
    CHECK(hand.hash() == hand.first);
    CHECK(up.pedalled);
    CHECK(up.spindle_ratio == 0);
    CHECK(length(up.modification_n) == 0);
    CHECK(length(up.contact_force_n) > 0.01);  // it is felt all the same
    CHECK_FALSE(up.undoable);
    hand.pedal = true;
    hand.rest(kGrooveEnd, 500);
    const std::uint64_t pressed = hand.hash();
    CHECK(pressed != hand.first);
    hand.pedal = false;
    hand.rest(kGrooveEnd, 300);
    CHECK(hand.hash() == pressed);  // in the very tick, though the spindle runs down
    held.pedal = true;              // a script that holds it cuts as one that needs none
    for (CuttingHand* const one : {&held, &always}) {
      one->rest(kAbove, 2000);  // the spindle runs up
      one->groove();
    }
    CHECK(held.hash() == always.hash());
    CHECK_FALSE(always.rest(kGrooveEnd, 1).pedalled);
  }
}

TEST_CASE("a press of the pedal is a stroke, though the tool never lifts") {
  CuttingHand hand(pedal_scene(kCutKinds[0]));
  const Place middle{0, -0.9, 0}, end{0.8, -0.9, 0};
  hand.lead(kAbove, {0, 0.5, 0}, 200);
  hand.pedal = true;
  hand.lead({0, 0.5, 0}, middle, 300);
  hand.pedal = false;
  hand.rest(middle, 10);  // a bounce of the switch
  hand.pedal = true;
  hand.rest(middle, 50);
  hand.pedal = false;
  hand.rest(middle, 60);
  const std::uint64_t once = hand.hash();
  hand.pedal = true;
  hand.lead(middle, end, 400);
  hand.pedal = false;
  hand.rest(end, 60);
  REQUIRE(hand.hash() != once);
  hand.restore(kUndo, end);
  CHECK(hand.restored[0] == once);
  hand.rest(end, 200);  // in the solid
  CHECK(hand.hash() == once);
  hand.restore(kUndo, end);
  CHECK(hand.restored[0] == hand.first);
  CHECK_FALSE(hand.servo->apply(kUndo));
}

TEST_CASE("a reset forgets the last stroke, and ends an undo that runs") {
  CuttingHand hand(cut_scene(kCutKinds[0]));
  hand.stroke(0.0);
  REQUIRE(hand.servo->apply(kUndo));
  hand.rest(kAbove, 1);
  hand.restore(kReset);
  CHECK_FALSE(hand.servo->apply(kUndo));
  CHECK(hand.hash() == hand.first);
  // Nor does an undo go on that has not begun: it would bring back what is below an older stroke.
  hand.stroke(0.0);
  hand.stroke(0.0);
  REQUIRE(hand.servo->apply(kUndo));
  hand.restore(kReset);
  CHECK_FALSE(hand.servo->apply(kUndo));
  hand.rest(kAbove, 50);
  CHECK(hand.hash() == hand.first);
}

TEST_CASE("a reset goes on through a fault, through missing reports and through a hold") {
  for (const int disturbance : {0, 1, 2, 3}) {
    CAPTURE(disturbance);
    CuttingHand hand(cut_scene(kCutKinds[1]));
    hand.groove();
    if (disturbance == 2) hand.servo->apply({ServoCommand::Kind::hold, 1});
    if (disturbance == 3) {  // latched before
      static_cast<void>(hand.step(0, 40, 40));
      REQUIRE(hand.step(0, 40, 40).fault == Fault::overspeed);
    }
    CHECK(hand.servo->apply(kReset));
    ServoOutput out;
    for (int tick = 0; tick < 100; ++tick) {
      if (disturbance == 0) out = hand.servo->step({});
      if (disturbance == 1) out = hand.step(0, tick == 0 ? 40 : 41, 40);
      if (disturbance >= 2) out = hand.rest(kGrooveEnd, 1);
      if (tick > 30) CHECK(length(out.commanded_force_n) == 0);
    }
    CHECK_FALSE(out.resetting);
    CHECK(hand.hash() == hand.first);
    const std::array faults{Fault::stale_input, Fault::overspeed, Fault::none, Fault::overspeed};
    CHECK(out.fault == faults[static_cast<std::size_t>(disturbance)]);
    if (disturbance != 2) continue;
    hand.servo->apply({ServoCommand::Kind::hold, 0});
    CHECK(length(hand.rest(kGrooveEnd, 500).commanded_force_n) > 0.2);
  }
}

TEST_CASE("of several volumes each is restored, and what is no solid stays") {
  for (const CutKind& kind : {kCutKinds[0], kCutKinds[1]}) {
    LoadedScene scene = cut_scene(kind);
    SceneVolume beside = volume_of(40, kVoxelMm, [](double, double y, double) { return y; });
    beside.solid = false;
    scene.volumes.insert(scene.volumes.begin(), beside);
    scene.volumes.push_back(
        volume_of(70, kVoxelMm / 2, [](double, double y, double) { return y; }));
    CuttingHand hand(scene);
    const std::array before{hand.hash(0), hand.hash(1), hand.hash(2)};
    hand.groove();
    CHECK(hand.hash(1) != before[1]);
    CHECK(hand.hash(2) != before[2]);
    CHECK(hand.restore(kReset, kGrooveEnd) > 1);
    for (std::size_t v = 0; v < 3; ++v) CHECK(hand.restored[v] == before[v]);
  }
}

TEST_CASE(
    "where nothing is cut neither changes a bit; where nothing was cut a reset is soon over") {
  for (const ServoCommand& command : kBoth) {
    LoadedScene scene = half_space_scene(), same = scene;
    ArmedServo told(scene), untold(same);
    CHECK(told.servo->apply(command) == (command.kind == ServoCommand::Kind::reset));
    for (int ms = 0; ms < 200; ++ms) {
      const double y_mm = 1 - 0.01 * ms;
      CHECK(told.step(0, y_mm, 0).output_hash == untold.step(0, y_mm, 0).output_hash);
    }
  }
  CHECK(CuttingHand(cut_scene(kCutKinds[0])).restore(kReset) == 1);
}

TEST_CASE("all repeat bit by bit from a snapshot in the middle, without the heap") {
  for (const CutKind& kind : kCutKinds) {
    for (const ServoCommand& command : {kReset, kUndo, kRedo}) {
      CAPTURE(std::string(kind.name));
      CuttingHand hand(cut_scene(kind));
      hand.groove();
      const bool again =
          command.kind == kRedo.kind;  // a tool in the solid would cut something else
      if (again) hand.lead(kGrooveEnd, kAbove, 100);
      if (again) hand.restore(kUndo);
      const Place at = again ? kAbove : kGrooveEnd;
      const auto without_heap = [&](const auto& work) {
        const CountedAllocations counted;
        const std::uint64_t before = CountedAllocations::total();
        work();
        CHECK(CountedAllocations::total() == before);
      };
      without_heap([&] {
        CHECK(hand.servo->apply(command));
        hand.rest(at, 1);
      });
      auto& compiled = dynamic_cast<CompiledScene&>(*hand.servo);
      const std::unique_ptr<ServoSnapshot> kept = compiled.keep();
      CHECK(kept->bytes() > compiled.density(0).size_bytes());
      std::uint64_t output = 0;
      without_heap([&] { output = hand.rest(at, 300).output_hash; });
      const std::uint64_t volume = hand.hash();
      hand.rest(kAbove, 100);  // elsewhere
      compiled.restore(*kept);
      CHECK(hand.rest(at, 300).output_hash == output);
      CHECK(hand.hash() == volume);
    }
  }
}

TEST_CASE("every brick has one bit of one block, and comes back from it") {
  for (const VoxelGrid grid : {VoxelGrid{1, 1, 1}, {8, 8, 8}, {33, 9, 64}, {257, 65, 31}}) {
    const BrickBlocks blocks = BrickBlocks::of(grid);
    std::vector<std::uint64_t> bits(blocks.count());
    for (std::uint32_t id = 0; id < blocks.bricks.count(); ++id) {
      const VoxelIndex brick = blocks.bricks.brick(id);
      const std::size_t block = blocks.block(brick);
      REQUIRE(block < bits.size());
      CHECK(blocks.brick_id(block, BrickBlocks::bit(brick)) == id);
      mark_cut(grid, blocks.bricks.voxels(id), bits);
      CHECK(std::accumulate(bits.begin(), bits.end(), 0, [](int sum, std::uint64_t word) {
              return sum + std::popcount(word);
            }) == static_cast<int>(id) + 1);
    }
  }
}

}  // namespace kerf::restore_test
