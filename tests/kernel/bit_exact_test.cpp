// SPDX-License-Identifier: Apache-2.0
// One scripted cut, hashed: the same bits from every compiler, optimisation level and machine.
#include <cstdint>
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/cut_law.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/kernel/preston.hpp"
#include "controller/kernel/sampling.hpp"
#include "tests/kernel/hash.hpp"
#include "tests/kernel/support.hpp"

namespace kerf::bit_exact_test {

using namespace kerf::test;

namespace {

/// A ball in a cloud of noise, from integers only.
TestVolume blob() {
  std::uint32_t noise = 1;
  return made_of({48, 26, 22}, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    noise = noise * 1664525u + 1013904223u;
    const std::int32_t square = (x - 24) * (x - 24) + (y - 13) * (y - 13) + (z - 11) * (z - 11);
    return static_cast<Density>(square < 81 ? 60000 + (noise >> 20) : noise >> 24);
  });
}

/// A turned 8 voxel ball through the blob in 80 ticks; every result of every stage is hashed.
template <class N>
std::string scripted_cut(GradientKernel kernel, bool exact_exponential) {
  TestVolume volume = blob();
  auto field = gradients<N>(kernel, volume);
  const auto tool = paper_ball(8);
  const auto rate = removal_rate<N>(0.125, exact_exponential);
  Cutter<N> cutter(24);
  GradientScratch scratch;
  Hash hash;
  for (int tick = 0; tick < 80; ++tick) {
    // Rational quaternions and positions: no libm decides about a bit.
    const auto pose = turned_pose<N>({tick * 0.625 - 2, 13 + tick * 0.03125, 20 - tick * 0.1875},
                                     {1, 2, tick * 0.125, 3}, 0.875);
    hash.add(contact_sum<N>(volume.grid, field, tool, pose));
    overlap<N>(volume.grid, tool, pose, step_from<N>(0.669921875), cutter.overlap);
    hash.add(modification_sum<N>(volume.grid, field, volume.density, cutter.overlap));
    using Unit = typename N::Unit;
    hash.add(static_cast<double>(penetration_extent<N>(volume.grid, volume.density, tool, pose,
                                                       32768, {Unit(0.6), Unit(0.0), Unit(0.8)})));
    const Removed removed =
        remove<N>(volume.grid, volume.density, cutter.overlap, rate, cutter.carry);
    hash.add(removed.density_steps);
    refresh_gradients<N>(kernel, volume.grid, volume.density, removed.changed, field, scratch);
  }
  for (const Density rho : volume.density) hash.add(std::uint64_t{rho});
  for (const auto& g : field) {
    for (const auto part : {g.x, g.y, g.z}) hash.add(static_cast<double>(part));
  }
  for (const auto owed : cutter.carry) hash.add(static_cast<double>(owed));
  return hash.hex();
}

}  // namespace

TEST_CASE("a scripted cut ends in the known hash: fixed") {
  CHECK(scripted_cut<FixedNumbers>(GradientKernel::farid, false) == "691a8bb5e4ce8e6e");
  CHECK(scripted_cut<FixedNumbers>(GradientKernel::sobel5, true) == "5bea33a96e22c8ce");
  CHECK(scripted_cut<FixedNumbers>(GradientKernel::central, false) == "bb3cdf22bf9dabe5");
}

TEST_CASE("a scripted cut ends in the known hash: double") {
  CHECK(scripted_cut<DoubleNumbers>(GradientKernel::farid, true) == "572e4679cfb43462");
}

// The kernels in a constant expression: the compiler itself proves that they need no heap, throw
// nothing and overflow nowhere, and that they give the same bits as at run time.

namespace {

struct Outcome {
  SumVec<FixedNumbers> contact, modification;
  std::uint64_t removed_steps = 0;
  Q16 depth;
  friend constexpr bool operator==(const Outcome&, const Outcome&) = default;
};

/// A tool of two voxels at the end of a range, in a volume of six by five by five.
constexpr Outcome small_cut() {
  using N = FixedNumbers;
  constexpr VoxelGrid kGrid{6, 5, 5};
  std::array<Density, kGrid.voxel_count()> density{};
  for (std::size_t i = 0; i < density.size(); ++i) {
    density[i] = static_cast<Density>(i % 6 < 3 ? 65535 : 300 * i);
  }
  std::array<Gradient<N>, kGrid.voxel_count()> field{};
  GradientScratch scratch{};
  refresh_gradients<N>(GradientKernel::farid, kGrid, density, kGrid.box(), field, scratch);

  const std::array<ToolOffset, 2> tool = {ToolOffset{-1, 0, 0}, ToolOffset{1, 0, 0}};
  ToolPose<N> pose;
  pose.centre_vox = {Q16(2.25), Q16(2.5), Q16(1.75)};
  for (std::size_t axis = 0; axis < 3; ++axis) pose.step[axis][axis] = N::kStepOne;

  std::array<N::Weight, 64> memory{};
  std::array<RemovalCarry<N>, 16> carry{};
  OverlapBox<N> covered{memory, {}, 0};
  Outcome outcome;
  outcome.contact = contact_sum<N>(kGrid, field, tool, pose);
  overlap<N>(kGrid, tool, pose, N::kStepOne, covered);
  outcome.modification = modification_sum<N>(kGrid, field, density, covered);
  outcome.depth =
      penetration_extent<N>(kGrid, density, tool, pose, 1, {Q30(1.0), Q30(0.0), Q30(0.0)});
  outcome.removed_steps =
      remove<N>(kGrid, density, covered, removal_rate<N>(0.5, true), carry).density_steps;
  return outcome;
}

constexpr Outcome kAtCompileTime = small_cut();
static_assert(kAtCompileTime.contact.x < 0 && kAtCompileTime.removed_steps > 0);

/// Two voxels of a tool cut by the largest force and rate, so that one pass is not enough.
constexpr std::uint64_t cut_by_largest_force() {
  using N = FixedNumbers;
  constexpr VoxelGrid kGrid{6, 5, 5};
  std::array<Density, kGrid.voxel_count()> density{};
  for (Density& rho : density) rho = 65535;
  const std::array<ToolOffset, 2> tool = {ToolOffset{-1, 0, 0}, ToolOffset{1, 0, 0}};
  ToolPose<N> pose;
  pose.centre_vox = {Q16(2.25), Q16(2.5), Q16(1.75)};
  for (std::size_t axis = 0; axis < 3; ++axis) pose.step[axis][axis] = N::kStepOne;
  std::array<N::Weight, 64> ratios{};
  OverlapBox<N> covered{ratios, {}, 0};
  overlap<N>(kGrid, tool, pose, N::kStepOne, covered);

  PrestonPlan<N> plan;
  plan.rate.fill(force_rate<N>(1e30));
  Transform<Fixed<24>, WorldSpace, VoxelSpace> rims;
  Transform<Q30, WorldSpace, ToolSpace> upright;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    rims.row[axis][axis] = Fixed<24>(0.9);
    upright.row[axis][axis] = Q30(1);
  }
  PrestonState<N> state;
  std::array<CoveredVoxel<N>, 64> memory{};
  const auto drive = cut_drive<N>({}, Q16(32767), Q30(1.99));
  std::uint64_t steps = 0;
  for (int tick = 0; tick < 3; ++tick) {
    auto voxels =
        covered_voxels<N>(kGrid, std::span<const Density>(density), {}, covered,
                          {pose.centre_vox, rims, upright}, std::span<CoveredVoxel<N>>(memory));
    steps +=
        cut_by_force(plan, drive, std::span<Density>(density), state, voxels).removed.density_steps;
  }
  return steps;
}

constexpr std::uint64_t kForceAtCompileTime = cut_by_largest_force();

}  // namespace

TEST_CASE("a constant expression and the running program give the same bits") {
  CHECK(small_cut() == kAtCompileTime);
  CHECK(double(kAtCompileTime.depth) == 1.0);
  CHECK(cut_by_largest_force() == kForceAtCompileTime);
  CHECK(kForceAtCompileTime > 2 * 65534);  // the two voxels of the tool, and more of their rims
}

}  // namespace kerf::bit_exact_test
