// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/milling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "tests/kernel/support.hpp"
#include "tests/support/property.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::milling_test {

using namespace kerf::test;

namespace {

constexpr double kPi = std::numbers::pi;

/// Volume in voxels that a ball of `radius_vox` takes out of full material by stamps along x.
template <class N>
double swept(int radius_vox, double pitch_vox, double y, double length_vox, double step_vox) {
  TestVolume volume = filled({100, 48, 48}, 65535);
  const auto ball = odd_ball(static_cast<int>(radius_vox / pitch_vox));
  Cutter<N> cutter(32);
  const auto rate = removal_rate<N>(1.0, false);
  const auto ratio = step_from<N>(pitch_vox * pitch_vox * pitch_vox);
  std::uint64_t steps = 0;
  for (double x = 0; x <= length_vox; x += step_vox) {
    const auto pose = pose_at<N>({30 + x, y, 24}, pitch_vox);
    steps += cut<N>(volume, ball, pose, rate, cutter, ratio).density_steps;
  }
  return double(steps) / kDensityMax;
}

double capsule(double radius, double length) {
  return 4.0 / 3.0 * kPi * radius * radius * radius + kPi * radius * radius * length;
}

/// The stages of one tick, as the servo step calls them.
template <class N>
struct Tick {
  SumVec<N> contact, modification;
  Removed removed;
};

template <class N>
struct LoadedScene {
  explicit LoadedScene(TestVolume start)
      : volume(std::move(start)), field(gradients<N>(GradientKernel::farid, volume)) {}

  Tick<N> tick(std::span<const ToolOffset> tool, const ToolPose<N>& pose,
               const RemovalRate<N>& rate) {
    Tick<N> now;
    now.contact = contact_sum<N>(volume.grid, field, tool, pose);
    overlap<N>(volume.grid, tool, pose, N::kStepOne, cutter.overlap);
    now.modification = modification_sum<N>(volume.grid, field, volume.density, cutter.overlap);
    now.removed = remove<N>(volume.grid, volume.density, cutter.overlap, rate, cutter.carry);
    refresh_gradients<N>(GradientKernel::farid, volume.grid, volume.density, now.removed.changed,
                         field, scratch);
    return now;
  }

  TestVolume volume;
  std::vector<Gradient<N>> field;
  Cutter<N> cutter{24};
  GradientScratch scratch;
};

TestVolume flat() {
  return solid({60, 24, 24}, [](double, double, double z) { return z - 12.0; });
}

}  // namespace

// F14
TEST_CASE_TEMPLATE("one stamp of a ball removes the volume of the ball", N, FixedNumbers,
                   DoubleNumbers) {
  for (const double y : {24.0, 24.5, 24.3}) {
    CHECK(swept<N>(5, 0.25, y, 0, 1) == doctest::Approx(capsule(5, 0)).epsilon(0.01));
  }
  // A turned tool loses a little where its samples crowd and the ratio is held at 1.
  TestVolume volume = filled({60, 24, 24}, 65535);
  Cutter<N> cutter(32);
  const auto removed =
      cut<N>(volume, odd_ball(20), turned_pose<N>({30.2, 12.1, 11.8}, {.3, .2, -.4, .8}, 0.25),
             removal_rate<N>(1.0, false), cutter, step_from<N>(1.0 / 64));
  CHECK(double(removed.density_steps) / kDensityMax ==
        doctest::Approx(capsule(5, 0)).epsilon(0.01));
}

// F14
TEST_CASE_TEMPLATE("a stamp that is sunk to a depth removes the cap", N, FixedNumbers,
                   DoubleNumbers) {
  TestVolume volume = solid({60, 48, 48}, [](double, double, double z) { return z - 24.0; });
  Cutter<N> cutter(32);
  constexpr double kRadius = 10, kDepth = 6;
  const auto removed =
      cut<N>(volume, odd_ball(40), pose_at<N>({30, 24, 24 + kRadius - kDepth}, 0.25),
             removal_rate<N>(1.0, false), cutter, step_from<N>(1.0 / 64));
  CHECK(double(removed.density_steps) / kDensityMax ==
        doctest::Approx(kPi * kDepth * kDepth * (3 * kRadius - kDepth) / 3).epsilon(0.01));
}

// F14
TEST_CASE_TEMPLATE("a straight sweep removes the capsule, and off the lattice half a voxel more", N,
                   FixedNumbers, DoubleNumbers) {
  // Stamps on the lattice cover voxels whole or not at all.
  CHECK(swept<N>(10, 1.0, 24, 40, 1) == doctest::Approx(capsule(10, 40)).epsilon(0.01));
  // In between, voxels at the rim are partly covered by many stamps in a row, and each takes its
  // share of what is left: the paper's rule widens a groove, but only within the trilinear reach.
  for (const int radius : {5, 10}) {
    for (const double step : {1.0, 0.5, 0.25}) {
      const double removed = swept<N>(radius, 0.5, 24.3, 40, step);
      CHECK(removed > capsule(radius, 40));
      CHECK(removed < capsule(radius + 0.55, 40));
    }
  }
}

TEST_CASE_TEMPLATE("the forces of a tick come from the volume before its cut", N, FixedNumbers,
                   DoubleNumbers) {
  const auto tool = odd_ball(4);
  const auto pose = turned_pose<N>({30.2, 12.1, 14.2}, {0.2, 0.1, -0.3, 0.9});
  LoadedScene<N> gentle(flat()), greedy(flat());
  const auto slow = removal_rate<N>(1e-6, false), fast = removal_rate<N>(1.0, false);
  const Tick<N> a = gentle.tick(tool, pose, slow);
  const Tick<N> b = greedy.tick(tool, pose, fast);
  CHECK(double(a.contact.z) < 0);
  CHECK(a.contact == b.contact);
  CHECK(a.modification == b.modification);
  CHECK(a.removed.density_steps < b.removed.density_steps);
  // The cut is felt from the next tick on.
  const Tick<N> next = greedy.tick(tool, pose, fast);
  CHECK(std::abs(double(next.contact.z)) < std::abs(double(b.contact.z)));
  CHECK(std::abs(double(gentle.tick(tool, pose, slow).contact.z)) >
        std::abs(double(next.contact.z)));
}

TEST_CASE("the modification force is the ratio-weighted sum of the stored gradients") {
  LoadedScene<FixedNumbers> fixed(flat());
  LoadedScene<DoubleNumbers> exact(flat());
  const auto tool = odd_ball(4);
  for (const double z : {9.5, 11.3, 13.7, 15.1}) {
    const std::array<double, 3> centre{30.4, 12.2, z};
    const std::array<double, 4> q{0.2, -0.4, 0.3, 0.9};
    overlap(fixed.volume.grid, tool, turned_pose(centre, q), FixedNumbers::kStepOne,
            fixed.cutter.overlap);
    const VoxelBox box = overlap(exact.volume.grid, tool, turned_pose<DoubleNumbers>(centre, q),
                                 1.0, exact.cutter.overlap);
    double truth = 0;
    for (std::int32_t k = box.lo.z; k < box.hi.z; ++k) {
      for (std::int32_t j = box.lo.y; j < box.hi.y; ++j) {
        const auto ratios = exact.cutter.overlap.row(j, k);
        for (std::size_t i = 0; i < ratios.size(); ++i) {
          const auto at = exact.volume.grid.index(
              exact.cutter.overlap.box.lo.x + static_cast<std::int32_t>(i), j, k);
          if (exact.volume.density[at] != 0) truth += ratios[i] * exact.field[at].z;
        }
      }
    }
    const auto sum = modification_sum<FixedNumbers>(fixed.volume.grid, fixed.field,
                                                    fixed.volume.density, fixed.cutter.overlap);
    const double scale = 257 * kDensityMax;  // every sample of the tool on a full step
    CHECK(std::abs(double(sum.z) / FixedNumbers::kWeightOne - truth) / scale <= 1.7e-4);
    CHECK(modification_sum<DoubleNumbers>(exact.volume.grid, exact.field, exact.volume.density,
                                          exact.cutter.overlap)
              .z == doctest::Approx(truth).epsilon(1e-12));
  }
}

TEST_CASE("air gives no modification force even where gradients reach into it") {
  LoadedScene<FixedNumbers> scene(flat());
  const auto tool = odd_ball(2);
  // The gradient of the face reaches 13 + 2; the tool covers the empty layers 14 and up only.
  overlap(scene.volume.grid, tool, pose_at({30, 12, 16}), FixedNumbers::kStepOne,
          scene.cutter.overlap);
  CHECK(scene.field[scene.volume.grid.index(30, 12, 14)].z != 0);
  CHECK(modification_sum<FixedNumbers>(scene.volume.grid, scene.field, scene.volume.density,
                                       scene.cutter.overlap) == SumVec<FixedNumbers>{});
}

TEST_CASE("after many cuts the refreshed field is the field of the volume as it is") {
  LoadedScene<FixedNumbers> scene(random_volume({70, 20, 18}, 9));
  const auto tool = paper_ball(6);
  for (int n = 0; n < 60; ++n) {
    const double t = n * 0.9;
    scene.tick(
        tool,
        turned_pose({t + 5, 10 + 8 * std::sin(t), 9 + 9 * std::cos(t)}, {0.1, 0.2 * n, 0.3, 1.0}),
        removal_rate<FixedNumbers>(0.4, n % 2 == 0));
  }
  CHECK(scene.field == gradients(GradientKernel::farid, scene.volume));
}

namespace {

/// The fraction of a voxel with overlap `ratio` (0..1) that one tick removes.
template <class N>
double fraction(const RemovalRate<N>& rate, double ratio) {
  const auto weight = static_cast<typename N::Weight>(ratio * double(N::kWeightOne));
  const double scale = std::ldexp(1.0, -rate.exponent) / double(N::kWeightOne);
  return double(bent_ratio(rate, weight)) / double(N::kWeightOne) * double(rate.mantissa) * scale;
}

}  // namespace

TEST_CASE_TEMPLATE("the linear rate removes r kT, at most everything", N, FixedNumbers,
                   DoubleNumbers) {
  for (const double kt : {1e-6, 1e-5, 0.02, 0.25, 0.5, 0.75, 1.0}) {
    const auto rate = removal_rate<N>(kt, false);
    for (const double r : {0.0, 0.25, 0.5, 1.0}) {
      CHECK(fraction(rate, r) == doctest::Approx(r * kt).epsilon(3.1e-5));
    }
  }
  CHECK(fraction(removal_rate<N>(7.0, false), 1.0) == 1.0);
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(fraction(removal_rate<N>(inf, false), 1.0) == 1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double nothing : {0.0, -1.0, nan}) {
    CHECK(fraction(removal_rate<N>(nothing, false), 1.0) == 0.0);
    CHECK(fraction(removal_rate<N>(nothing, true), 1.0) == 0.0);
  }
}

TEST_CASE_TEMPLATE(
    "the exact rate removes 1 - exp(-r kT) within its stated bound, never less for "
    "more overlap",
    N, FixedNumbers, DoubleNumbers) {
  for (const double kt : {1e-6, 0.001, 0.02, 0.5, 1.0, 3.0, 10.0, 42.0, 1e9}) {
    const auto rate = removal_rate<N>(kt, true);
    const double whole = -std::expm1(-kt);
    const double used = std::min(kt, kMaxRateTimesTick);
    const double bound = used * used / (8 * 256.0 * 256.0) + 3.5 / 32768 * whole;
    double before = 0;
    for (int n = 0; n <= 32768; n += 11) {
      const double r = n / 32768.0;
      const double removed = fraction(rate, r);
      CHECK(std::abs(removed + std::expm1(-r * used)) <= bound);
      CHECK(removed >= before);
      before = removed;
    }
    CHECK(fraction(rate, 1.0) == doctest::Approx(whole).epsilon(3.1e-5));
  }
}

TEST_CASE_TEMPLATE("kT = 1 with whole overlap removes everything at once", N, FixedNumbers,
                   DoubleNumbers) {
  TestVolume volume = random_volume({64, 20, 20}, 4);
  const auto tool = odd_ball(4);
  Cutter<N> cutter(16);
  for (auto& owed : cutter.carry) {
    owed = N::kIsFixed ? static_cast<RemovalCarry<N>>(65535)
                       : std::nextafter(static_cast<RemovalCarry<N>>(1), RemovalCarry<N>{});
  }
  cut<N>(volume, tool, pose_at<N>({20, 10, 10}), removal_rate<N>(1.0, false), cutter);
  for (const ToolOffset& offset : tool) {
    CHECK(volume.density[volume.grid.index(20 + offset[0] / 2, 10 + offset[1] / 2,
                                           10 + offset[2] / 2)] == 0);
  }
}

TEST_CASE_TEMPLATE("what remove reports is what the volume lost, and its box holds every change", N,
                   FixedNumbers, DoubleNumbers) {
  CHECK(property([] {
    const auto seed = any<std::uint32_t>();
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    TestVolume volume = random_volume({52, 14, 13}, seed);
    const auto tool = odd_ball(3);
    Cutter<N> cutter(16);
    const bool exact = random() % 2 == 0;
    const auto rate = removal_rate<N>(std::pow(10.0, within(-5, 0.5)), exact);
    for (int n = 0; n < 5; ++n) {
      const TestVolume before = volume;
      const auto pose = turned_pose<N>({within(-4, 56), within(-4, 18), within(-4, 17)},
                                       {within(-1, 1), within(-1, 1), within(-1, 1), 1.5});
      const Removed removed = cut<N>(volume, tool, pose, rate, cutter);
      HOLDS(total_density(before) - total_density(volume) == removed.density_steps);
      VoxelBox changed;
      for (const auto& [x, y, z] : voxels(volume.grid)) {
        const std::size_t at = volume.grid.index(x, y, z);
        HOLDS(volume.density[at] <= before.density[at]);
        if (volume.density[at] == before.density[at]) continue;
        changed = changed.united({{x, y, z}, {x + 1, y + 1, z + 1}});
      }
      HOLDS(changed == removed.changed);
    }
  }));
}

TEST_CASE("a tool with too little carry removes nothing, and the border keeps its lanes") {
  TestVolume volume = filled({64, 12, 12}, 65535);
  const auto tool = odd_ball(3);
  Cutter<> cutter(16);
  const auto rate = removal_rate<FixedNumbers>(1.0, false);
  // Seven tool voxels and one more from the cell of the last: x 17..24, lanes 2..9.
  overlap(volume.grid, tool, pose_at({20.3, 6, 6}), FixedNumbers::kStepOne, cutter.overlap);
  CHECK(cutter.overlap.lane_zero_vox == 15);
  const std::span<RemovalCarry<FixedNumbers>> carry = cutter.carry;
  const auto removed = [&](std::size_t lanes) {
    return remove<FixedNumbers>(volume.grid, volume.density, cutter.overlap, rate,
                                carry.first(lanes))
        .density_steps;
  };
  CHECK(removed(9) == 0);
  CHECK(removed(10) > 0);
  // Half outside: lanes still count from the tool's own lowest cell.
  overlap(volume.grid, tool, pose_at({-0.7, 6, 6}), FixedNumbers::kStepOne, cutter.overlap);
  CHECK(cutter.overlap.lane_zero_vox == -6);
}

// Cutting that takes less than a density step a tick: it must neither stall nor lose fractions.

namespace {

/// A tool held still in full material, a ball of 10 voxels or a row of 7; the volume is wider than
/// the tool by more than 32 voxels.
class HeldStill {
 public:
  explicit HeldStill(std::array<double, 3> centre_vox,
                     std::span<const ToolOffset> tool = paper_ball(10)) {
    overlap(volume_.grid, tool, pose_at(centre_vox), FixedNumbers::kStepOne, cutter_.overlap);
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
  Cutter<> cutter_{16};
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

TEST_CASE("what leaves the volume and what the carry holds are together all that was computed") {
  std::mt19937 random(13);
  const auto tool = odd_ball(4);
  for (int n = 0; n < 200; ++n) {
    TestVolume volume = random_volume({50, 16, 15}, static_cast<std::uint32_t>(n));
    Cutter<> cutter(16);
    RemovalRate<FixedNumbers> rate = removal_rate<FixedNumbers>(n % 4 == 0 ? 1.0 : 0.7, n % 2 == 0);
    rate.exponent = n % 4 == 0 ? 0 : n % 33;
    std::uniform_real_distribution<double> at(0, 14), turn(-1, 1);
    overlap(volume.grid, tool,
            turned_pose({at(random), at(random), at(random)},
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

}  // namespace kerf::milling_test
