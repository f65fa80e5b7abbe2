// SPDX-License-Identifier: Apache-2.0
// The point shell's sums: every instruction set against their definition, bit for bit.
#include "controller/kernel/point_shell/point_sums.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/case_count.hpp"
#include "tests/kernel/contact_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Sums = PointSums<FixedNumbers>;

bool same(const Sums& a, const Sums& b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (a.gradient[axis] != b.gradient[axis] || a.offset[axis] != b.offset[axis] ||
        a.high_offset[axis] != b.high_offset[axis]) {
      return false;
    }
  }
  return a.weight == b.weight && a.density == b.density && a.square == b.square &&
         a.high == b.high && a.top == b.top && a.top_sample == b.top_sample;
}

/// Some samples of a sphere, the last group not full.
PointShellTable<FixedNumbers> some_shell(int count, double radius, bool round) {
  Dice dice(static_cast<std::uint32_t>(count));
  std::vector<Point> samples;
  for (int i = 0; i < count; ++i) samples.push_back(radius * dice.direction());
  return PointShellTable<FixedNumbers>(samples, round);
}

/// Any densities, or walls of them between air.
TestVolume hard_field(const VoxelGrid& grid, int kind, Dice& dice) {
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) -> Density {
    switch (kind) {
      case 0:
        return static_cast<Density>(dice.uniform(0, 65536));
      case 1:
        return dice.uniform(0, 1) < 0.5 ? 0 : 65535;
      case 2:
        return 65535;
      case 3:
        return (x + y + z) % 2 == 0 ? 65535 : 0;
      default:
        return x < grid.nx / 3 ? static_cast<Density>(dice.uniform(0, 65536)) : Density{0};
    }
  });
}

PointStep<FixedNumbers> any_step(const PointShell<FixedNumbers>& point_shell, Dice& dice) {
  const std::array<Point, 3> rotation = turned_to(dice.direction(), dice);
  const double stretch =
      std::ldexp(double(point_shell.reach), point_shell.step_bits) * dice.uniform(0.2, 1);
  PointStep<FixedNumbers> step;
  step.shift = point_shell.step_bits - 1;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      step.row[i][j] = static_cast<std::int32_t>(std::lround(stretch * rotation[i][j]));
    }
  }
  return step;
}

}  // namespace

TEST_CASE("every instruction set sums a point point_shell to the bit, wherever it is") {
  Dice dice(1);
  int felt = 0, skipped = 0;
  for (const VoxelGrid grid : {VoxelGrid{33, 20, 18}, {2, 2, 2}, {9, 40, 3}, {60, 12, 12}}) {
    for (int kind = 0; kind < 5; ++kind) {
      const TestVolume volume = hard_field(grid, kind, dice);
      for (const int count : {1, 16, 47, 96}) {
        const bool round = count % 2 == 0;
        const PointShellTable<FixedNumbers> tool = some_shell(count, count == 1 ? 0.5 : 4.5, round);
        const PointShell<FixedNumbers> point_shell = tool.point_shell();
        TransformedShell<FixedNumbers> memory, truth_memory;
        memory.hold(point_shell);
        truth_memory.hold(point_shell);
        const std::int32_t whole = count / kPointGroup * kPointGroup;  // groups to be read
        const auto room = static_cast<std::size_t>(whole);
        const Density iso = kind == 2 ? 65535 : static_cast<Density>(dice.uniform(1, 65536));
        const DensityField all{grid, volume.density.data(), density_scale(iso), {}};
        const FreeBrickMap map(grid, volume.density, 1);
        DensityField field = all;
        field.free = map.bricks();
        for (int i = 0; i < cases(1250); ++i) {
          const PointStep<FixedNumbers> step = any_step(point_shell, dice);
          transform_points<FixedNumbers>(point_shell.table, step, truth_memory.places());
          const double out = i % 3 == 0 ? 7 : -1;  // across the border, or inside
          const Q16 at[3] = {Q16(dice.uniform(-out, grid.nx + out)),
                             Q16(dice.uniform(-out, grid.ny + out)),
                             Q16(dice.uniform(-out, grid.nz + out))};
          std::int32_t centre[3] = {at[0].raw(), at[1].raw(), at[2].raw()};
          if (i % 4 == 1) centre[0] |= 0xffff;
          if (i % 4 == 2) centre[1] &= ~0xffff;
          // Every group read, against every set with groups left out.
          const Sums truth =
              point_sums<FixedNumbers>(point_shell.table, truth_memory.places(), centre, all);
          const std::int32_t looked_at =
              point_sums<FixedNumbers>(point_shell.table, truth_memory.places(), centre, field)
                  .read;
          felt += truth.weight != 0 ? 1 : 0;
          skipped += kind == 4 && truth.weight == 0 ? 1 : 0;
          for (auto set = kernel_sets(); *set != nullptr; ++set) {
            (*set)->transform_points(point_shell.table, step, memory.places());
            Sums sums;
            sums.weight = sums.square = sums.high = sums.top = -1;  // left over from before
            (*set)->sum_points(point_shell.table, memory.places(), centre, field, sums);
            const bool alike = same(sums, truth) && sums.read == looked_at;
            std::vector<std::int32_t> read(room), truly_read(room);
            (*set)->read_points(memory.places(), whole, centre, field, read.data());
            read_points<FixedNumbers>(truth_memory.places(), whole, centre, field,
                                      truly_read.data());
            if (!alike || read != truly_read) {
              INFO(std::string((*set)->name), ", ", count, " samples, kind ", kind, ", case ", i);
              REQUIRE(alike);
              REQUIRE(read == truly_read);
            }
          }
        }
      }
    }
  }
  CHECK(felt > cases(1250) * 25);
  CHECK(skipped > cases(1250));
}

TEST_CASE("the largest point point_shell deep in the densest volume stays within the sums' range") {
  const PointShellTable<FixedNumbers> tool = some_shell(kMaxShellPoints, 60, false);
  const PointShell<FixedNumbers> point_shell = tool.point_shell();
  // Full density in every second voxel of x: the steepest gradient and, at its voxels, r = 1.
  const VoxelGrid grid{130, 130, 130};
  for (const bool striped : {false, true}) {
    const TestVolume volume = made_of(grid, [&](std::int32_t x, auto, auto) -> Density {
      return striped && x % 2 == 0 ? 0 : 65535;
    });
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      TransformedShell<FixedNumbers> memory;
      memory.hold(point_shell);
      PointStep<FixedNumbers> step;
      step.shift = point_shell.step_bits - 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        step.row[axis][axis] = static_cast<std::int32_t>(
            std::lround(std::ldexp(double(point_shell.reach), point_shell.step_bits)));
      }
      (*set)->transform_points(point_shell.table, step, memory.places());
      const std::int32_t centre[3] = {65 << 16, 65 << 16, 65 << 16};
      const DensityField field{grid, volume.density.data(), density_scale(32768), {}};
      Sums sums;
      (*set)->sum_points(point_shell.table, memory.places(), centre, field, sums);
      CAPTURE(std::string((*set)->name));
      CHECK(sums.weight > 0);
      CHECK(sums.density > 0);
      CHECK(sums.square < std::int64_t{1} << 53);
      CHECK(sums.top <= 32767);
      if (!striped) CHECK(sums.top == 32767);
    }
  }
}

TEST_CASE("a volume without a cell is not felt") {
  const PointShellTable<FixedNumbers> tool = some_shell(40, 3, true);
  const PointShell<FixedNumbers> point_shell = tool.point_shell();
  for (const VoxelGrid grid : {VoxelGrid{1, 5, 5}, {5, 1, 5}, {5, 5, 1}}) {
    const TestVolume volume = filled(grid, 65535);
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      TransformedShell<FixedNumbers> memory;
      memory.hold(point_shell);
      Dice dice(1);
      (*set)->transform_points(point_shell.table, any_step(point_shell, dice), memory.places());
      const std::int32_t centre[3] = {0, 2 << 16, 2 << 16};
      Sums sums;
      (*set)->sum_points(point_shell.table, memory.places(), centre,
                         {grid, volume.density.data(), density_scale(32768), {}}, sums);
      CHECK(sums.weight == 0);
    }
  }
}

TEST_CASE("beside a volume that is solid to its border nothing is read") {
  const PointShellTable<FixedNumbers> tool = some_shell(512, 6, false);
  const PointShell<FixedNumbers> point_shell = tool.point_shell();
  const VoxelGrid grid{21, 20, 20};
  const TestVolume volume = filled(grid, 65535);
  const FreeBrickMap map(grid, volume.density, 1);
  const DensityField field{grid, volume.density.data(), density_scale(32768), map.bricks()};
  Dice dice(6);
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
    TransformedShell<FixedNumbers> memory;
    memory.hold(point_shell);
    (*set)->transform_points(point_shell.table, any_step(point_shell, dice), memory.places());
    // The sphere about a group of any samples is no wider than the tool.
    for (const int from_border : {-8, 0, 20, 60, 300, 6000}) {
      CAPTURE(from_border);
      for (const std::int32_t x : {20 + from_border, -from_border}) {
        const std::int32_t centre[3] = {x * 65536, 10 << 16, 10 << 16};
        Sums sums;
        (*set)->sum_points(point_shell.table, memory.places(), centre, field, sums);
        CHECK((sums.read > 0) == (from_border <= 0));
      }
    }
  }
}

TEST_CASE("at the end of the places that there are nothing is felt and nothing read") {
  const PointShellTable<FixedNumbers> tool = some_shell(40, 3, true);
  const PointShell<FixedNumbers> point_shell = tool.point_shell();
  const TestVolume volume = filled({9, 9, 9}, 65535);
  constexpr std::int32_t kEnd = std::numeric_limits<std::int32_t>::max();
  for (const std::int32_t x : {kEnd, kEnd - 65536, kEnd - point_shell.table.reach, -kEnd}) {
    CAPTURE(x);
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      TransformedShell<FixedNumbers> memory;
      memory.hold(point_shell);
      Dice dice(1);
      (*set)->transform_points(point_shell.table, any_step(point_shell, dice), memory.places());
      const std::int32_t centre[3] = {x, x, x};
      Sums sums;
      (*set)->sum_points(point_shell.table, memory.places(), centre,
                         {{9, 9, 9}, volume.density.data(), density_scale(32768), {}}, sums);
      CHECK(sums.weight == 0);
    }
  }
}

TEST_CASE("any iso becomes half of the scale") {
  for (std::uint32_t iso = 1; iso <= 65535; iso = iso * 5 / 4 + 1) {
    const DensityScale scale = density_scale(static_cast<Density>(iso));
    CHECK(scale.mantissa >= 32768);
    CHECK(scale.mantissa <= 65535);
    CHECK(scale_factor<double>(scale) * iso == doctest::Approx(32768).epsilon(3e-5));
  }
  CHECK(density_scale(0).mantissa == density_scale(1).mantissa);
}
