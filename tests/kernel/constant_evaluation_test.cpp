// SPDX-License-Identifier: Apache-2.0
// The kernels in a constant expression: the compiler itself proves that they need no heap, throw
// nothing and overflow nowhere, and that they give the same bits as at run time.

#include <doctest/doctest.h>

#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/kernel/preston.hpp"
#include "controller/kernel/sampling.hpp"

using namespace kerf;

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
  const auto drive = cut_drive<N>(Q16(32767), Q16(0), Q30(1.99));
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
