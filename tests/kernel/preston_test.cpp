// SPDX-License-Identifier: Apache-2.0
// Cutting by force, tick by tick: how a budget is kept and dealt out; then how a cut goes on in
// time.
#include "controller/kernel/preston.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "tests/kernel/preston_support.hpp"

namespace kerf::preston_test {

using namespace kerf::test;

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<double, 3> kCentre{16.3, 15.8, 16.1};

TestVolume block() {
  return filled({32, 32, 32}, 65535);
}

double uniform(std::mt19937& random, double from, double to) {
  return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
}

template <class N>
PrestonRig<N> ball_in_block(Scale scale = {}) {
  return {block(), odd_ball(6), 6, scale};
}

template <class N>
double carried(const PrestonState<N>& state) {
  double sum = 0;
  for (const auto carry : state.carry) sum += steps_of<N>(carry);
  return sum;
}

}  // namespace

// F11
TEST_CASE_TEMPLATE("what was removed and what is carried is the integral of G F", N, FixedNumbers,
                   DoubleNumbers) {
  for (const double tick_s : {1.0 / 250, 1.0 / 1000, 1.0 / 8000}) {
    CAPTURE(tick_s);
    auto rig = ball_in_block<N>({0.125, tick_s});
    std::mt19937 random(1);
    double fed = 0, removed = 0;
    for (int i = 0; i < 300; ++i) {
      const double force_n = std::floor(uniform(random, 0, 2) * 65536) / 65536;
      const auto out = rig.press(kCentre, force_n, 0.75);
      fed += rig.scale.steps_per_n(kEnamelG) * force_n * 0.75;
      removed += double(out.removed.density_steps);
      CHECK(out.lost == 0);
      CHECK(std::abs(carried<N>(rig.state)) < 100);  // a 600th of a voxel
    }
    CHECK(removed + carried<N>(rig.state) == doctest::Approx(fed).epsilon(1e-6));
    CHECK(double(total_density(block()) - total_density(rig.volume)) == removed);
  }
}

// F12
TEST_CASE_TEMPLATE("without force, below the threshold or with the spindle standing nothing leaves",
                   N, FixedNumbers, DoubleNumbers) {
  auto rig = ball_in_block<N>();
  rig.threshold_n = 0.05;
  rig.press(kCentre, 2);  // leaves a carry that nothing may spend
  const TestVolume before = rig.volume;
  const auto carry = rig.state.carry;
  for (const auto& [force_n, ratio] :
       {std::array{0.0, 1.0}, std::array{0.05, 1.0}, std::array{-1.0, 1.0}, std::array{3.0, 0.0}}) {
    CHECK(rig.press(kCentre, force_n, ratio).removed.density_steps == 0);
  }
  CHECK(rig.volume.density == before.density);
  CHECK(rig.state.carry == carry);
  // What is above the threshold cuts.
  auto above = ball_in_block<N>();
  above.threshold_n = 0.25;
  double removed = 0;
  for (int i = 0; i < 100; ++i) removed += double(above.press(kCentre, 0.75).removed.density_steps);
  CHECK(removed + carried<N>(above.state) ==
        doctest::Approx(100 * 0.5 * above.scale.steps_per_n(kEnamelG)).epsilon(1e-6));
}

// F13
TEST_CASE_TEMPLATE("a force whose part of a voxel rounds to nothing cuts all the same", N,
                   FixedNumbers, DoubleNumbers) {
  const Scale scale{0.125, 1.0 / 8000};
  auto rig = ball_in_block<N>(scale);
  constexpr double kForceN = 1;
  const double budget = scale.steps_per_n(kEnamelG) * kForceN;
  rig.cover(kCentre);
  double all = 0, largest = 0;  // weights without the speed, which only makes them more unequal
  for (const auto w : rig.cutter.overlap.memory) {
    all += double(w);
    largest = std::max(largest, double(w));
  }
  // With 8 bits, and with 16: no voxel's part of a tick reaches half a step.
  CHECK(budget / 257 * largest / all < 0.5);
  CHECK(budget * largest / all < 0.5);
  double removed = 0;
  constexpr int kTicks = 500;
  for (int i = 0; i < kTicks; ++i) {
    removed += double(rig.press(kCentre, kForceN).removed.density_steps);
  }
  CHECK(removed + carried<N>(rig.state) == doctest::Approx(kTicks * budget).epsilon(1e-6));
}

TEST_CASE("over many ticks every voxel loses its part of the budget, whatever the budget") {
  // 512.0 and 0.5 steps a tick: without a moving phase the same voxels would be rounded up always.
  for (const double steps : {512.0, 0.5, 333.3}) {
    CAPTURE(steps);
    auto rig = ball_in_block<FixedNumbers>();
    rig.plan.rate.fill(force_rate<FixedNumbers>(steps));
    rig.cover(kCentre);
    const auto frame = frame_at(kCentre, rig.rim_vox);
    std::vector<double> weight(rig.volume.density.size());
    double all = 0;
    for_each_row(rig.volume.grid, rig.cutter.overlap,
                 [&](VoxelIndex first, std::int32_t count, auto&& ratio) {
                   auto place = frame.at(first);
                   for (std::int32_t i = 0; i < count; ++i, place = place + frame.step()) {
                     const double w = double(ratio(i)) * double(frame.speed(place));
                     weight[rig.volume.grid.index(first.x + i, first.y, first.z)] = w;
                     all += w;
                   }
                 });
    constexpr int kTicks = 300;
    for (int i = 0; i < kTicks; ++i) rig.press(kCentre, 1);
    double worst = 0;
    for (std::size_t at = 0; at < weight.size(); ++at) {
      const double lost = 65535.0 - rig.volume.density[at];
      worst = std::max(worst, std::abs(lost - kTicks * steps * weight[at] / all));
    }
    CHECK(worst < 6);  // density steps; half a step a tick all one way would be 150
  }
}

TEST_CASE("in a mixture each material leaves at its own rate under its part of the force") {
  auto rig = ball_in_block<FixedNumbers>();
  std::vector<Label> labels(rig.volume.density.size());
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = i % 32 < 16 ? 1 : 2;
  rig.plan.labels = labels;
  rig.plan.rate[1] = force_rate<FixedNumbers>(1000);
  rig.plan.rate[2] = force_rate<FixedNumbers>(3000);
  rig.plan.rate[3] = force_rate<FixedNumbers>(70000);  // not there: nothing of it is fed
  const auto by_material = [&] {
    std::array<double, 4> lost{};
    for (std::size_t i = 0; i < labels.size(); ++i)
      lost[labels[i]] += 65535 - rig.volume.density[i];
    return lost;
  };
  // The plane between the materials runs through the ball's middle: half of the force each.
  constexpr int kTicks = 20;
  for (int i = 0; i < kTicks; ++i) rig.press({15.5, 16, 16}, 0.5);
  const auto lost = by_material();
  CHECK(lost[1] == doctest::Approx(kTicks * 0.5 * 0.5 * 1000).epsilon(0.005));
  CHECK(lost[2] == doctest::Approx(kTicks * 0.5 * 0.5 * 3000).epsilon(0.005));
  CHECK(rig.state.carry[3] == 0);
}

TEST_CASE_TEMPLATE("what waits of a material that is no longer there makes nothing starve", N,
                   FixedNumbers, DoubleNumbers) {
  auto rig = ball_in_block<N>();
  // Under the ball there is first some faint enamel alone, then dentin.
  std::vector<Label> labels(rig.volume.density.size(), 2);
  rig.plan.labels = labels;
  rig.plan.rate[1] = force_rate<N>(70000);
  rig.plan.rate[2] = force_rate<N>(100);
  const std::vector<Density> dentin = rig.volume.density;
  const std::size_t enamel = rig.volume.grid.index(16, 16, 16);
  std::ranges::fill(rig.volume.density, Density{0});
  rig.volume.density[enamel] = 2000;
  labels[enamel] = 1;
  CHECK(rig.press(kCentre, 1).starves);
  CHECK(double(rig.state.carry[1]) > 0);
  rig.volume.density = dentin;
  rig.volume.density[enamel] = 0;
  for (int tick = 0; tick < 20; ++tick) CHECK_FALSE(rig.press(kCentre, 1).starves);
}

TEST_CASE("a forbidden material is told, bears its part of the force and is never cut") {
  auto rig = ball_in_block<FixedNumbers>();
  std::vector<Label> labels(rig.volume.density.size(), 1);
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = i % 32 < 16 ? 1 : 3;
  rig.plan.labels = labels;
  rig.plan.forbidden[3] = true;
  rig.plan.rate[3] = {};
  double removed = 0;
  for (int i = 0; i < 20; ++i) {
    const auto out = rig.press({15.5, 16, 16}, 0.5);
    CHECK(out.forbidden);
    removed += double(out.removed.density_steps);
    CHECK(out.removed.changed.hi.x <= 16);
  }
  CHECK(removed == doctest::Approx(20 * 0.25 * rig.scale.steps_per_n(kEnamelG)).epsilon(0.005));
  CHECK_FALSE(rig.press({7, 16, 16}, 0.5).forbidden);   // clear of it
  CHECK(rig.press({15.5, 16, 16}, 0.01, 0).forbidden);  // told whether it turns or not
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == 3) REQUIRE(rig.volume.density[i] == 65535);
  }
}

TEST_CASE_TEMPLATE("a budget beyond the fullest voxels goes to the others, and at last is lost", N,
                   FixedNumbers, DoubleNumbers) {
  const auto after = [](double share) {
    auto rig = ball_in_block<N>();
    rig.cover(kCentre);
    double covered = 0;  // full density
    for (const auto w : rig.cutter.overlap.memory) covered += double(w) / double(N::kWeightOne);
    rig.plan.rate.fill(force_rate<N>(covered * kDensityMax));
    const auto out = rig.press(kCentre, share);
    return std::array{double(out.removed.density_steps) / (covered * kDensityMax),
                      carried<N>(rig.state) / kDensityMax, steps_of<N>(out.lost), covered};
  };
  // Speeds of 0.08 to 1 and 0.59 in the mean: beyond 0.6 the rim has nothing left.
  CHECK(after(0.5)[0] == doctest::Approx(0.5).epsilon(1e-4));
  CHECK(after(0.75)[0] == doctest::Approx(0.75).epsilon(0.002));
  const auto all = after(3);
  CHECK(all[0] == doctest::Approx(1).epsilon(1e-4));
  CHECK(all[1] == 1);  // one full voxel waits
  CHECK(all[2] == doctest::Approx((2 * all[3] - 1) * kDensityMax).epsilon(1e-3));
}

// F14
TEST_CASE_TEMPLATE("with force to spare a stamp removes the ball and a sweep the capsule", N,
                   FixedNumbers, DoubleNumbers) {
  const auto swept = [](double length_vox) {
    PrestonRig<N> rig(filled({64, 24, 24}, 65535), odd_ball(32), 8);
    rig.pitch_vox = 0.25;
    rig.plan.rate.fill(force_rate<N>(1e9));
    double steps = 0;
    for (double x = 0; x <= length_vox; x += 1) {
      steps += double(rig.press({12 + x, 12, 12}, 10).removed.density_steps);
    }
    return steps / kDensityMax;
  };
  const auto capsule = [](double radius, double length) {
    return 4.0 / 3 * kPi * radius * radius * radius + kPi * radius * radius * length;
  };
  CHECK(swept(0) == doctest::Approx(capsule(8, 0)).epsilon(0.01));
  // Each stamp takes the covered part of what is left at the rim, as the paper's rule does: the
  // groove is wider within the trilinear reach.
  const double groove = swept(30);
  CHECK(groove > capsule(8, 30));
  CHECK(groove < capsule(8.55, 30));
}

// F15
TEST_CASE_TEMPLATE("a cut depends on the force of its own tick and on none that comes later", N,
                   FixedNumbers, DoubleNumbers) {
  auto a = ball_in_block<N>(), b = ball_in_block<N>();
  for (int i = 0; i < 10; ++i) {
    a.press(kCentre, 1);
    b.press(kCentre, i < 6 ? 1 : 2);
    CHECK((a.volume.density == b.volume.density) == (i < 6));
  }
}

TEST_CASE("fixed point cuts what double cuts, to a step of the voxel and a millionth of the sum") {
  std::mt19937 random(3);
  for (int n = 0; n < 30; ++n) {
    const TestVolume start =
        n % 2 == 0 ? block() : random_volume({32, 32, 32}, static_cast<std::uint32_t>(n));
    PrestonRig<> fixed(start, odd_ball(5), 5);
    PrestonRig<DoubleNumbers> exact(start, odd_ball(5), 5);
    // Places, forces and rates that both can hold.
    const auto held = [&](double from, double to) {
      return std::floor(uniform(random, from, to) * 64) / 64;
    };
    const std::array<double, 3> centre{held(-2, 34), held(-2, 34), held(-2, 34)};
    const double force_n = held(0, 4), ratio = held(0, 1.5);
    const auto a = fixed.press(centre, force_n, ratio);
    const auto b = exact.press(centre, force_n, ratio);
    int worst = 0;
    for (std::size_t i = 0; i < start.density.size(); ++i) {
      worst = std::max(worst, std::abs(fixed.volume.density[i] - exact.volume.density[i]));
    }
    CHECK(worst <= 1);
    CHECK(double(a.removed.density_steps) + carried<FixedNumbers>(fixed.state) +
              steps_of<FixedNumbers>(a.lost) ==
          doctest::Approx(double(b.removed.density_steps) + carried<DoubleNumbers>(exact.state) +
                          b.lost)
              .epsilon(1e-6));
    CHECK(std::abs(double(a.drag.x) - b.drag.x) < 5e-4);
    CHECK(std::abs(double(a.drag.z) - b.drag.z) < 5e-4);
    CHECK(std::abs(double(a.drag.lever_ratio) - b.drag.lever_ratio) < 5e-4);
  }
}

TEST_CASE("extreme forces, rates and volumes stay in range") {
  for (const double force_n : {1e-4, 3.3, 32767.0}) {
    for (const double steps : {1e-9, 1.0, 1e6, 1e30}) {
      for (const Density rho : {Density{1}, Density{65535}}) {
        PrestonRig<> rig(filled({32, 32, 32}, rho), odd_ball(6), 6);
        rig.plan.rate.fill(force_rate<FixedNumbers>(steps));
        for (int i = 0; i < 3; ++i) {
          const auto out = rig.press(kCentre, force_n, 1.9);
          CHECK(std::abs(carried<FixedNumbers>(rig.state)) <= 65535);
          CHECK(out.lost >= 0);
        }
        CHECK(total_density(rig.volume) <= std::uint64_t{rho} * 32 * 32 * 32);
      }
    }
  }
  PrestonRig<> rig(block(), odd_ball(6), 6);
  rig.memory.resize(10);  // a tool that the scene did not size for
  CHECK(rig.press(kCentre, 1).removed.density_steps > 0);
  rig.memory.clear();
  CHECK(rig.press(kCentre, 1).removed.density_steps == 0);
}

// How a cut by force goes on in time: a flat tool against a flat face, always resting on what is
// highest under it. Truth is Preston's law for a contact of area A.

namespace {

constexpr double kRadiusMm = 0.5;
constexpr double kAreaMm2 = kPi * kRadiusMm * kRadiusMm;
constexpr double kAdvanceVox = 0.25;

/// A flat cylinder of 0.5 mm that presses down on a block; its axis is the y axis.
template <class N>
class FlatFeed {
 public:
  FlatFeed(Scale scale, int depth_vox)
      : radius_(static_cast<int>(std::lround(kRadiusMm / scale.voxel_mm))),
        middle_(radius_ + 2),
        rig_(solid({2 * middle_ + 1, depth_vox + 4, 2 * middle_ + 1},
                   [&](double, double y, double) { return y - depth_vox; }),
             flat_cylinder(radius_, 6), kRadiusMm / scale.voxel_mm, scale) {}

  /// Height of the face that the tool rests on: its samples stand for half a voxel below them.
  [[nodiscard]] double height_mm() const {
    double highest = 0;
    for (int z = -radius_; z <= radius_; ++z) {
      for (int x = -radius_; x <= radius_; ++x) {
        if (x * x + z * z <= radius_ * radius_) highest = std::max(highest, surface(x, z));
      }
    }
    return highest * rig_.scale.voxel_mm;
  }
  Pressed<N> press(double force_n) {
    const double y = height_mm() / rig_.scale.voxel_mm + 0.5 - kAdvanceVox;
    return rig_.press({double(middle_), y, double(middle_)}, force_n);
  }
  /// Seconds until the face has come down to a height, between two ticks by its speed there.
  double seconds_down_to(double height_vox, double force_n) {
    const double goal_mm = height_vox * rig_.scale.voxel_mm;
    double ticks = 0, before = height_mm();
    for (double now = before; now > goal_mm; ++ticks) {
      before = now;
      press(force_n);
      now = height_mm();
      if (now <= goal_mm) ticks -= (goal_mm - now) / (before - now);
    }
    return ticks * rig_.scale.tick_s;
  }
  /// Area of the tool's face on the lattice of voxels.
  [[nodiscard]] double area_mm2() const {
    return double(flat_cylinder(radius_, 1).size()) * rig_.scale.voxel_mm * rig_.scale.voxel_mm;
  }
  [[nodiscard]] PrestonRig<N>& rig() { return rig_; }

 private:
  /// Where the density of a column falls through one half, in voxels.
  [[nodiscard]] double surface(int x, int z) const {
    const auto rho = [&](int y) {
      return double(rig_.volume.density[rig_.volume.grid.index(middle_ + x, y, middle_ + z)]) /
             kDensityMax;
    };
    int y = rig_.volume.grid.ny - 1;
    while (y > 0 && rho(y) < 0.5) --y;
    const double below = rho(y), above = y + 1 < rig_.volume.grid.ny ? rho(y + 1) : 0;
    return y + (below - 0.5) / (below - above);
  }

  int radius_, middle_;
  PrestonRig<N> rig_;
};

}  // namespace

// F10
TEST_CASE_TEMPLATE("a flat tool feeds at G F / A", N, FixedNumbers, DoubleNumbers) {
  constexpr double kForceN = 1, kTickS = 0.004;
  FlatFeed<N> feed({0.05, kTickS}, 14);
  // Whole layers of voxels: within one, the height of the face ripples.
  static_cast<void>(feed.seconds_down_to(13, kForceN));
  constexpr int kLayers = 6;
  const double seconds = feed.seconds_down_to(13 - kLayers, kForceN);
  const double speed = kLayers * 0.05 / seconds;
  constexpr double kTruth = kEnamelG * kForceN / kAreaMm2;
  CHECK(std::abs(kTruth - 0.1052) < 1e-4);
  CHECK(std::abs(speed / kTruth - 1) < 0.02);
  // Most of that is the lattice's idea of a circle: by its own area the feed is exact.
  CHECK(std::abs(speed * feed.area_mm2() / (kEnamelG * kForceN) - 1) < 2e-3);
}

// S16
TEST_CASE_TEMPLATE("held at a depth the force decays as a Maxwell element's", N, FixedNumbers,
                   DoubleNumbers) {
  constexpr double kStiffness = 0.5, kDepthMm = 4, kTickS = 0.004, kSeconds = 5;
  constexpr double kTauS = kAreaMm2 / (kEnamelG * kStiffness);
  CHECK(std::abs(kTauS - 19.02) < 0.005);
  FlatFeed<N> feed({0.05, kTickS}, 26);
  static_cast<void>(feed.seconds_down_to(25, 1));  // to the profile that a cut has
  const double held_mm = feed.height_mm() - kDepthMm;
  double worst = 0;
  for (int i = 0; i < std::lround(kSeconds / kTickS); ++i) {
    const double force_n = kStiffness * (feed.height_mm() - held_mm);
    const double truth = kStiffness * kDepthMm * std::exp(-i * kTickS / kTauS);
    worst = std::max(worst, std::abs(force_n / truth - 1));
    feed.press(force_n);
  }
  CHECK(worst < 0.01);
}

// F11
TEST_CASE("the same force removes the same at 250 Hz to 8 kHz and 0.05 to 0.25 mm") {
  constexpr double kSeconds = 0.5;
  constexpr double kTruth = kEnamelG * 1.5 * kSeconds;  // mm^3
  for (const double voxel_mm : {0.05, 0.1, 0.125, 0.25}) {
    for (const int rate_hz : {250, 1000, 8000}) {
      CAPTURE(voxel_mm);
      CAPTURE(rate_hz);
      FlatFeed<FixedNumbers> feed({voxel_mm, 1.0 / rate_hz}, 6);
      double steps = 0;
      const int ticks = static_cast<int>(kSeconds * rate_hz);
      for (int i = 0; i < ticks; ++i) {
        const double phase = 2 * kPi * (i + 0.5) / ticks;
        const auto out = feed.press(1.5 - std::cos(phase));
        steps += double(out.removed.density_steps);
        CHECK(out.lost == 0);
      }
      const double off = feed.rig().scale.mm3(steps) / kTruth - 1;
      CHECK(std::abs(off) < 1e-4);
    }
  }
}

}  // namespace kerf::preston_test
