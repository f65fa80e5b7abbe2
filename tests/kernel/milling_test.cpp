// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/milling.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include <doctest/doctest.h>

#include "tests/kernel/support.hpp"

using namespace kerf;
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
    overlap<FixedNumbers>(fixed.volume.grid, tool, turned_pose<FixedNumbers>(centre, q),
                          FixedNumbers::kStepOne, fixed.cutter.overlap);
    const VoxelBox box = overlap<DoubleNumbers>(
        exact.volume.grid, tool, turned_pose<DoubleNumbers>(centre, q), 1.0, exact.cutter.overlap);
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
  overlap<FixedNumbers>(scene.volume.grid, tool, pose_at<FixedNumbers>({30, 12, 16}),
                        FixedNumbers::kStepOne, scene.cutter.overlap);
  CHECK(scene.field[scene.volume.grid.index(30, 12, 14)].z != 0);
  CHECK(modification_sum<FixedNumbers>(scene.volume.grid, scene.field, scene.volume.density,
                                       scene.cutter.overlap) == SumVec<FixedNumbers>{});
}

TEST_CASE("after many cuts the refreshed field is the field of the volume as it is") {
  LoadedScene<FixedNumbers> scene(random_volume({70, 20, 18}, 9));
  const auto tool = paper_ball(6);
  for (int n = 0; n < 60; ++n) {
    const double t = n * 0.9;
    scene.tick(tool,
               turned_pose<FixedNumbers>({t + 5, 10 + 8 * std::sin(t), 9 + 9 * std::cos(t)},
                                         {0.1, 0.2 * n, 0.3, 1.0}),
               removal_rate<FixedNumbers>(0.4, n % 2 == 0));
  }
  CHECK(scene.field == gradients<FixedNumbers>(GradientKernel::farid, scene.volume));
}
