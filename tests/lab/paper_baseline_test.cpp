// SPDX-License-Identifier: Apache-2.0
// The baseline of all ratios is the paper's method indeed, computed right.
#include <array>
#include <cmath>

#include <doctest/doctest.h>

#include "lab/bench/kernel_bench.hpp"
#include "tests/kernel/support.hpp"

namespace kerf::paper_baseline_test {

using namespace kerf::test;

namespace {

TestVolume flat() {
  return solid({40, 30, 28}, [](double, double, double z) { return z - 14.0; });
}

PaperPose paper_pose(const ToolPose<DoubleNumbers>& pose) {
  PaperPose paper{};
  paper.centre_vox = {static_cast<float>(pose.centre_vox.x), static_cast<float>(pose.centre_vox.y),
                      static_cast<float>(pose.centre_vox.z)};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) paper.rotation[i][j] = static_cast<float>(pose.step[i][j]);
  }
  return paper;
}

bool near(float value, double truth, double full_scale) {
  return std::abs(double(value) - truth) <= 1e-4 * full_scale;
}

}  // namespace

TEST_CASE("the paper's form gives the forces and the removal of double precision, tick by tick") {
  TestVolume volume = flat();
  auto field = gradients<DoubleNumbers>(GradientKernel::farid, volume);
  PaperVolume paper(volume.grid, volume.density);
  const auto tool = paper_ball(8);
  // Full steps of 16 bits in double against floats: the cut must not round, so it is all or
  // nothing.
  const auto rate = removal_rate<DoubleNumbers>(1.0, false);
  Cutter<DoubleNumbers> cutter(24);
  GradientScratch scratch;
  const double unit = kDensityMax, full_scale = 50;
  for (int i = 0; i < 4; ++i) {
    const auto pose = pose_at<DoubleNumbers>({12.0 + 3 * i, 14, 16});
    const auto contact = contact_sum<DoubleNumbers>(volume.grid, field, tool, pose);
    overlap<DoubleNumbers>(volume.grid, tool, pose, 1.0, cutter.overlap);
    const auto modification =
        modification_sum<DoubleNumbers>(volume.grid, field, volume.density, cutter.overlap);
    const Removed removed =
        remove<DoubleNumbers>(volume.grid, volume.density, cutter.overlap, rate, cutter.carry);
    refresh_gradients<DoubleNumbers>(GradientKernel::farid, volume.grid, volume.density,
                                     removed.changed, field, scratch);
    const PaperTick tick = paper.mill(tool, paper_pose(pose), 1.0F);
    CHECK(contact.z / unit < -5);
    CHECK(near(tick.contact[0], -contact.x / unit, full_scale));
    CHECK(near(tick.contact[2], -contact.z / unit, full_scale));
    CHECK(near(tick.modification[0], -modification.x / unit, full_scale));
    CHECK(near(tick.modification[2], -modification.z / unit, full_scale));
    CHECK(tick.removed == doctest::Approx(double(removed.density_steps) / unit).epsilon(1e-3));
  }
}

TEST_CASE("a turned tool at the border is felt as in double precision") {
  const TestVolume volume = flat();
  const auto field = gradients<DoubleNumbers>(GradientKernel::farid, volume);
  PaperVolume paper(volume.grid, volume.density);
  const auto tool = paper_ball(8);
  // No sample on a cell's edge: float and double could disagree about the side.
  for (const auto& at :
       {std::array{20.2, 15.1, 14.7}, {1.57, 14.03, 15.51}, {38.06, 28.47, 13.02}}) {
    const auto pose = turned_pose<DoubleNumbers>(at, {0.2, -0.3, 0.1, 0.9});
    const auto truth = contact_sum<DoubleNumbers>(volume.grid, field, tool, pose);
    const PaperTick tick = paper.feel(tool, paper_pose(pose));
    CHECK(near(tick.contact[0], -truth.x / kDensityMax, 50));
    CHECK(near(tick.contact[1], -truth.y / kDensityMax, 50));
    CHECK(near(tick.contact[2], -truth.z / kDensityMax, 50));
    CHECK(std::abs(truth.z) > 1e5);
    CHECK(paper.mill(tool, paper_pose(pose), 0.0F).removed == 0);  // its box crosses the border
  }
}

}  // namespace kerf::paper_baseline_test
