// SPDX-License-Identifier: Apache-2.0
// How a cut by force goes on in time: a flat tool against a flat face, always resting on what is
// highest under it. Truth is Preston's law for a contact of area A.
#include <array>
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include "tests/kernel/preston_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr double kPi = std::numbers::pi;
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
