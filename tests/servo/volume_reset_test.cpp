// SPDX-License-Identifier: Apache-2.0
// The command `reset`: the volumes go back to their first content, and the hand notices only that
// its force is gone and comes back slowly.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
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

constexpr ServoCommand kReset{.kind = ServoCommand::Kind::reset};
constexpr double kSlewN = 0.5 + 2e-3;  ///< in a tick of 1 ms, and the motors' steps

/// A servo that cut a groove into the solid, its hand still in it, 0.9 mm below the first surface.
struct Groove : ArmedServo {
  static constexpr std::array<double, 3> kEnd{0.5, -0.9, 0};

  /// `held`: it goes the same way, and cuts nothing.
  explicit Groove(LoadedScene scene, bool held = false)
      : ArmedServo(scene, {0, 5, 0}, std::max(1, scene.servo.rate_hz / 1000)),
        per_ms(std::max(1, scene.servo.rate_hz / 1000)),
        volumes(scene.volumes.size()),
        first(hash()) {
    if (held) servo->apply({ServoCommand::Kind::hold, 1});
    cut();
  }
  [[nodiscard]] std::uint64_t hash(std::size_t v = 0) const {
    return density_hash(servo->density(v));
  }
  void cut() {
    lead({0, 5, 0}, {-0.5, 1, 0}, 200);
    lead({-0.5, 1, 0}, kEnd, 500);
  }
  ServoOutput lead(const std::array<double, 3>& from, const std::array<double, 3>& to, int ms) {
    ServoOutput out;
    for (int i = 1; i <= ms * per_ms; ++i) {
      const double s = double(i) / (ms * per_ms);
      out = step(from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]),
                 from[2] + s * (to[2] - from[2]));
    }
    return out;
  }
  ServoOutput rest(int ms) { return lead(kEnd, kEnd, ms); }
  /// Ticks that a reset takes with the hand at rest, and the volumes at its end: a tool that lies
  /// in the solid cuts in the next tick again.
  int reset() {
    CHECK(servo->apply(kReset));
    int ticks = 0;
    std::array<std::uint64_t, kMaxVolumes> now{};
    while (step(kEnd[0], kEnd[1], kEnd[2]).resetting) {
      REQUIRE(++ticks < 10000);
      for (std::size_t v = 0; v < volumes; ++v) now[v] = hash(v);
    }
    after_reset = now;
    return ticks;
  }
  std::array<std::uint64_t, kMaxVolumes> after_reset{};
  int per_ms;
  std::size_t volumes;
  std::uint64_t first;
};

}  // namespace

TEST_CASE("after a reset every volume is its first content, whatever feels and cuts") {
  for (const CutKind& kind : kCutKinds) {
    for (const int rate_hz : {250, 1000, 8000}) {
      if (rate_hz != 1000 && &kind != &kCutKinds[0]) continue;  // the time of a test
      CAPTURE(std::string(kind.name));
      CAPTURE(rate_hz);
      LoadedScene scene = cut_scene(kind);
      scene.servo.rate_hz = rate_hz;
      Groove groove(scene);
      REQUIRE(groove.hash() != groove.first);
      for (int time = 0; time < 2; ++time) {
        CHECK(groove.reset() > 0);
        CHECK(groove.after_reset[0] == groove.first);
        groove.lead(groove.kEnd, {0, 5, 0}, 100);
        groove.cut();
        CHECK(groove.hash() != groove.first);
      }
    }
  }
}

TEST_CASE("a tick of a reset copies at most 64 bricks of one block, and tells their box") {
  for (const int rate_hz : {250, 1000, 8000}) {
    LoadedScene scene = cut_scene(kCutKinds[0]);
    scene.servo.rate_hz = rate_hz;
    Groove groove(scene);
    const auto before =
        std::vector(groove.servo->density(0).begin(), groove.servo->density(0).end());
    const VoxelGrid grid = groove.servo->grid(0);
    CHECK(groove.servo->apply(kReset));
    std::vector<Density> seen = before;
    ServoOutput out;
    do {
      out = groove.step(groove.kEnd[0], groove.kEnd[1], groove.kEnd[2]);
      const VoxelBox& box = out.changed[0];
      CHECK(out.removed_steps == 0);
      if (box.empty()) continue;
      const VoxelIndex extent = box.extent();
      CHECK(std::max({extent.x, extent.y, extent.z}) <= 32);
      CHECK(box.lo.x / 32 == (box.hi.x - 1) / 32);
      for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
        for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
          for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
            seen[grid.index(x, y, z)] = groove.servo->density(0)[grid.index(x, y, z)];
          }
        }
      }
    } while (out.resetting);
    CHECK(density_hash(seen) == groove.first);  // what a reader has that follows the boxes
  }
}

// Gradients, accounts and fractions that are owed follow: the same hand cuts the same once more.
TEST_CASE("after a reset the same hand cuts the same as if nothing had been cut before") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    std::array<std::vector<Density>, 2> left;
    for (const bool cut_before : {false, true}) {
      Groove groove(cut_scene(kind), !cut_before);
      REQUIRE((groove.hash() != groove.first) == cut_before);
      groove.servo->apply({ServoCommand::Kind::hold, 0});
      groove.lead(groove.kEnd, {0, 5, 0}, 200);
      CHECK(groove.servo->apply(kReset));
      groove.lead({0, 5, 0}, {0, 5, 0}, 1000);  // past the fade and the spindle's run
      REQUIRE(groove.hash() == groove.first);
      groove.cut();
      const auto density = groove.servo->density(0);
      left[cut_before ? 1 : 0].assign(density.begin(), density.end());
    }
    CHECK(left[0] == left[1]);
  }
}

TEST_CASE("inside of the restored solid the force comes slowly, and a hand at rest does no work") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    Groove groove(cut_scene(kind));
    ServoOutput last = groove.rest(1);
    const double work_mj = last.absorbed_mj;
    CHECK(groove.servo->apply(kReset));
    double after_ms = 0;
    for (int ms = 0; ms < 1500; ++ms) {
      const ServoOutput out = groove.rest(1);
      std::array<double, 3> step_n{};
      for (std::size_t i = 0; i < 3; ++i) step_n[i] = out.force_n[i] - last.force_n[i];
      CHECK(length(step_n) <= kSlewN);
      CHECK(length(out.force_n) <= 2.01);
      after_ms = out.resetting ? 0 : after_ms + 1;
      // It fades in over 100 ms, and a spring that ramps grows by 0.1 N/ms at most.
      if (after_ms > 0 && after_ms < 20) CHECK(length(out.force_n) < 0.02 * after_ms + 0.02);
      CHECK(out.absorbed_mj == doctest::Approx(work_mj));  // at rest
      const auto& energy = out.energy_steps;
      CHECK(std::abs(
                energy_mj_of_steps(std::accumulate(energy.begin(), energy.end(), std::int64_t{0})) -
                out.absorbed_mj) < 1e-6);
      last = out;
    }
    if (kind.cut == CutModel::preston)
      CHECK(last.force_n[1] > 0.2);  // the solid pushes the tool out again
  }
}

TEST_CASE("no force is felt and nothing is cut while a reset runs, whoever asks again") {
  LoadedScene scene = cut_scene(kCutKinds[0]);
  scene.servo.rate_hz = 8000;
  scene.tools.push_back(ball(8));
  Groove once(scene), often(scene);
  CHECK(once.servo->apply(kReset));
  ServoOutput a, b;
  std::uint64_t last = 0;
  int ticks = 0;
  do {
    CHECK(often.servo->apply(kReset));
    a = once.step(once.kEnd[0], once.kEnd[1], once.kEnd[2]);
    b = often.step(often.kEnd[0], often.kEnd[1], often.kEnd[2]);
    CHECK(a.removed_steps == 0);
    CHECK(length(a.contact_n) == 0);
    CHECK(a.press_n == 0);
    CHECK(b.output_hash == a.output_hash);
    if (++ticks == 3) {  // another tool takes over half-way
      for (Groove* at : {&once, &often}) {
        CHECK(at->servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = 1}));
      }
    }
    if (a.resetting) last = often.hash();
  } while (a.resetting);
  CHECK(last == often.first);
  CHECK(ticks > 3);
}

TEST_CASE("a reset goes on through a fault, through missing reports and through a hold") {
  for (const int disturbance : {0, 1, 2, 3}) {
    CAPTURE(disturbance);
    Groove groove(cut_scene(kCutKinds[1]));
    if (disturbance == 2) groove.servo->apply({ServoCommand::Kind::hold, 1});
    if (disturbance == 3) {  // latched before
      static_cast<void>(groove.step(0, 40, 40));
      REQUIRE(groove.step(0, 40, 40).fault == Fault::overspeed);
    }
    CHECK(groove.servo->apply(kReset));
    ServoOutput out;
    for (int tick = 0; tick < 100; ++tick) {
      if (disturbance == 0) out = groove.servo->step({});
      if (disturbance == 1) out = groove.step(0, tick == 0 ? 40 : 41, 40);
      if (disturbance >= 2) out = groove.rest(1);
      if (tick > 30) CHECK(length(out.force_n) == 0);
    }
    CHECK_FALSE(out.resetting);
    CHECK(groove.hash() == groove.first);
    const std::array faults{Fault::stale_input, Fault::overspeed, Fault::none, Fault::overspeed};
    CHECK(out.fault == faults[static_cast<std::size_t>(disturbance)]);
    if (disturbance != 2) continue;
    groove.servo->apply({ServoCommand::Kind::hold, 0});
    CHECK(length(groove.rest(500).force_n) > 0.2);
  }
}

TEST_CASE("of several volumes each is restored, and what is no solid stays") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    LoadedScene scene = cut_scene({"", numeric, CutModel::preston});
    SceneVolume beside = volume_of(40, kVoxelMm, [](double, double y, double) { return y; });
    beside.name = "picture";
    beside.solid = false;
    scene.volumes.insert(scene.volumes.begin(), beside);
    SceneVolume second = volume_of(70, kVoxelMm / 2, [](double, double y, double) { return y; });
    second.name = "second";
    scene.volumes.push_back(second);
    Groove groove(scene);
    LoadedScene fresh_scene = scene;
    const ArmedServo fresh(fresh_scene);
    for (const std::size_t v : {std::size_t{1}, std::size_t{2}})
      CHECK(groove.hash(v) != density_hash(fresh.servo->density(v)));
    CHECK(groove.reset() > 1);
    for (std::size_t v = 0; v < 3; ++v) {
      CHECK(groove.after_reset[v] == density_hash(fresh.servo->density(v)));
    }
  }
}

TEST_CASE("where nothing is cut a reset changes no bit; where nothing was cut it is soon over") {
  LoadedScene scene = half_space_scene(), same = scene;
  ArmedServo told(scene), untold(same);
  CHECK(told.servo->apply(kReset));
  for (int ms = 0; ms < 200; ++ms) {
    const double y_mm = 1 - 0.01 * ms;
    CHECK(told.step(0, y_mm, 0).output_hash == untold.step(0, y_mm, 0).output_hash);
  }
  LoadedScene cuts = cut_scene(kCutKinds[0]);
  ArmedServo idle(cuts);
  CHECK(idle.servo->apply(kReset));
  CHECK(idle.step(0, 5, 0).resetting);
  CHECK_FALSE(idle.step(0, 5, 0).resetting);
}

TEST_CASE("a run with a reset repeats bit by bit, also from a snapshot in the middle of it") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    std::array<std::uint64_t, 2> output{};
    std::unique_ptr<ServoSnapshot> kept;
    for (std::uint64_t& hash : output) {
      Groove groove(cut_scene(kind));
      CHECK(groove.servo->apply(kReset));
      static_cast<void>(groove.step(groove.kEnd[0], groove.kEnd[1], groove.kEnd[2]));
      auto& compiled = dynamic_cast<CompiledScene&>(*groove.servo);
      if (kept == nullptr) {
        kept = compiled.keep();
      } else {
        groove.rest(100);  // elsewhere
        compiled.restore(*kept);
      }
      hash = groove.rest(300).output_hash;
    }
    CHECK(output[0] == output[1]);
  }
}

TEST_CASE("a reset never touches the heap") {
  for (const CutKind& kind : kCutKinds) {
    Groove groove(cut_scene(kind));
    const CountedAllocations counted;
    const std::uint64_t before = CountedAllocations::total();
    CHECK(groove.servo->apply(kReset));
    CHECK(groove.rest(50).resetting == false);
    CHECK(CountedAllocations::total() == before);
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
