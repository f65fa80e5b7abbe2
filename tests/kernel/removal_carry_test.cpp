// SPDX-License-Identifier: Apache-2.0
// Cutting that takes less than a density step a tick: it must neither stall nor lose fractions.
#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include <doctest/doctest.h>

#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// A tool held still in full material, a ball of 10 voxels or a row of 7; the volume is wider than
/// the tool by more than 32 voxels.
class HeldStill {
 public:
  explicit HeldStill(std::array<double, 3> centre_vox,
                     std::span<const ToolOffset> tool = paper_ball(10)) {
    overlap<FixedNumbers>(volume_.grid, tool, pose_at<FixedNumbers>(centre_vox),
                          FixedNumbers::kStepOne, cutter_.overlap);
  }
  /// Density steps that `ticks` ticks take.
  double removed(double k_times_t, int ticks, bool keeps_carry) {
    const auto rate = removal_rate<FixedNumbers>(k_times_t, false);
    std::uint64_t steps = 0;
    for (int n = 0; n < ticks; ++n) {
      if (!keeps_carry) cutter_.carry.assign(cutter_.carry.size(), 0);
      steps +=
          remove<FixedNumbers>(volume_.grid, volume_.density, cutter_.overlap, rate, cutter_.carry)
              .density_steps;
    }
    return double(steps);
  }
  /// SUM of `value(r)` over the voxels that the tool covers by r.
  template <class Value>
  double sum_over_ratios(Value&& value) const {
    double sum = 0;
    const VoxelBox& box = cutter_.overlap.box;
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        for (const double w : cutter_.overlap.row(y, z)) sum += value(w / FixedNumbers::kWeightOne);
      }
    }
    return sum;
  }
  /// What the rate says that `ticks` ticks take.
  double truth(double k_times_t, int ticks) const {
    return sum_over_ratios(
        [&](double r) { return kDensityMax * (1 - std::pow(1 - r * k_times_t, ticks)); });
  }

 private:
  TestVolume volume_ = filled({60, 16, 16}, 65535);
  Cutter<FixedNumbers> cutter_{16};
};

constexpr std::array<double, 3> kOnLattice{12.5, 7.5, 7.5}, kBetween{12.3, 7.4, 7.6};

}  // namespace

// F13
TEST_CASE("20 000 slow ticks remove what they should, though each is less than a density step") {
  constexpr int kTicks = 20'000;
  const auto relative_error = [&](const std::array<double, 3>& centre, double kt) {
    HeldStill held(centre);
    return std::abs(held.removed(kt, kTicks, true) / held.truth(kt, kTicks) - 1);
  };
  // On the lattice only the carry and the rate's 15 bits err. In between, the fractions of barely
  // covered voxels are cut to 15 bits as well, always below.
  for (const double kt : {1e-3, 1e-4, 1e-5}) {
    CHECK(relative_error(kOnLattice, kt) <= 3e-5);
    CHECK(relative_error(kBetween, kt) <= 1e-4);
  }
}

// F13
TEST_CASE("without the carry slow cutting stalls: nothing at all leaves") {
  // One voxel of the tool in each lane, so no lane owes a whole step within a tick.
  // Barely covered voxels weigh more in a row than in a ball, and their fractions are cut to 15
  // bits.
  std::vector<ToolOffset> row;
  for (std::int16_t x = -6; x <= 6; x += 2) row.push_back({x, 0, 0});
  constexpr double kSlow = 1e-5;  // 0.66 of a step a tick at most
  constexpr int kTicks = 20'000;
  for (const std::array<double, 3>& centre : {std::array{12.0, 7.0, 7.0}, kBetween}) {
    CHECK(HeldStill(centre, row).removed(kSlow, kTicks, false) == 0.0);
    HeldStill held(centre, row);
    CHECK(held.removed(kSlow, kTicks, true) ==
          doctest::Approx(held.truth(kSlow, kTicks)).epsilon(3e-4));
  }
}

// F13
TEST_CASE("densities of 8 bits stall at a newton on the bur, 16 bits with the carry do not") {
  constexpr double kNewton = 0.27 / 255;  // what enamel loses in a tick, as a fraction
  constexpr int kTicks = 1000;
  HeldStill held(kBetween);
  const double stalled = held.sum_over_ratios([&](double r) {
    double density = 255;
    for (int n = 0; n < kTicks; ++n) density -= std::round(density * r * kNewton);
    return 255 - density;
  });
  CHECK(stalled == 0.0);
  CHECK(held.removed(kNewton, kTicks, true) ==
        doctest::Approx(held.truth(kNewton, kTicks)).epsilon(1e-4));
}

TEST_CASE("what leaves the volume and what the carry holds are together all that was computed") {
  std::mt19937 random(13);
  const auto tool = odd_ball(4);
  for (int n = 0; n < 200; ++n) {
    TestVolume volume = random_volume({50, 16, 15}, static_cast<std::uint32_t>(n));
    Cutter<FixedNumbers> cutter(16);
    RemovalRate<FixedNumbers> rate = removal_rate<FixedNumbers>(n % 4 == 0 ? 1.0 : 0.7, n % 2 == 0);
    rate.exponent = n % 4 == 0 ? 0 : n % 33;
    std::uniform_real_distribution<double> at(0, 14), turn(-1, 1);
    overlap<FixedNumbers>(
        volume.grid, tool,
        turned_pose<FixedNumbers>({at(random), at(random), at(random)},
                                  {turn(random), turn(random), turn(random), 1.5}),
        FixedNumbers::kStepOne, cutter.overlap);
    std::uint64_t owed = 0;
    for (auto& fraction : cutter.carry) owed += fraction = static_cast<std::uint16_t>(random());
    // 2^-16 of a step: rho times the 15 bits of r m, times two, over 2^exponent.
    const VoxelBox box = cutter.overlap.box.clipped(volume.grid.box());
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
          const auto r = static_cast<std::uint64_t>(
              bent_ratio(rate, cutter.overlap.memory[cutter.overlap.at({x, y, z})]));
          const std::uint64_t w = r * static_cast<std::uint64_t>(rate.mantissa) / 32768;
          owed += 2 * volume.density[volume.grid.index(x, y, z)] * w /
                  (std::uint64_t{1} << rate.exponent);
        }
      }
    }
    const Removed removed =
        remove<FixedNumbers>(volume.grid, volume.density, cutter.overlap, rate, cutter.carry);
    std::uint64_t kept = 0;
    for (const std::uint16_t fraction : cutter.carry) kept += fraction;
    CHECK(removed.density_steps * 65536 + kept == owed);
  }
}
