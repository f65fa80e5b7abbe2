// SPDX-License-Identifier: Apache-2.0
// The point shell's sums: every instruction set against their definition, bit for bit.
#include "controller/kernel/point_shell/point_sums.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/proxy/closeup.hpp"
#include "controller/plan/tables/point_shell_table.hpp"
#include "tests/case_count.hpp"
#include "tests/kernel/contact_support.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::point_sums_test {

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
  RandomNumbers random(static_cast<std::uint32_t>(count));
  std::vector<Point> samples;
  for (int i = 0; i < count; ++i) samples.push_back(radius * random.direction());
  return PointShellTable<FixedNumbers>(samples, round);
}

/// Any densities, or walls of them between air.
TestVolume hard_field(const VoxelGrid& grid, int kind, RandomNumbers& random) {
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) -> Density {
    switch (kind) {
      case 0:
        return static_cast<Density>(random.uniform(0, 65536));
      case 1:
        return random.uniform(0, 1) < 0.5 ? 0 : 65535;
      case 2:
        return 65535;
      case 3:
        return (x + y + z) % 2 == 0 ? 65535 : 0;
      default:
        return x < grid.nx / 3 ? static_cast<Density>(random.uniform(0, 65536)) : Density{0};
    }
  });
}

PointStep<FixedNumbers> any_step(const PointShell<FixedNumbers>& point_shell,
                                 RandomNumbers& random) {
  const std::array<Point, 3> rotation = turned_to(random.direction(), random);
  const double stretch =
      std::ldexp(double(point_shell.reach), point_shell.step_bits) * random.uniform(0.2, 1);
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
  RandomNumbers random(1);
  int felt = 0, skipped = 0;
  for (const VoxelGrid grid : {VoxelGrid{33, 20, 18}, {2, 2, 2}, {9, 40, 3}, {60, 12, 12}}) {
    for (int kind = 0; kind < 5; ++kind) {
      const TestVolume volume = hard_field(grid, kind, random);
      for (const int count : {1, 16, 47, 96}) {
        const bool round = count % 2 == 0;
        const PointShellTable<FixedNumbers> tool = some_shell(count, count == 1 ? 0.5 : 4.5, round);
        const PointShell<FixedNumbers> point_shell = tool.point_shell();
        TransformedShell<FixedNumbers> memory, truth_memory;
        memory.hold(point_shell);
        truth_memory.hold(point_shell);
        const std::int32_t whole = count / kPointGroup * kPointGroup;  // groups to be read
        const auto room = static_cast<std::size_t>(whole);
        const Density iso = kind == 2 ? 65535 : static_cast<Density>(random.uniform(1, 65536));
        const DensityField all{grid, volume.density.data(), density_scale(iso), {}};
        const FreeBrickMap map(grid, volume.density, 1);
        DensityField field = all;
        field.free = map.bricks();
        for (int i = 0; i < cases(1250); ++i) {
          const PointStep<FixedNumbers> step = any_step(point_shell, random);
          transform_points<FixedNumbers>(point_shell.table, step, truth_memory.places());
          const double out = i % 3 == 0 ? 7 : -1;  // across the border, or inside
          const Q16 at[3] = {Q16(random.uniform(-out, grid.nx + out)),
                             Q16(random.uniform(-out, grid.ny + out)),
                             Q16(random.uniform(-out, grid.nz + out))};
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
          for (auto set = sets_to_run(); *set != nullptr; ++set) {
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
    for (auto set = sets_to_run(); *set != nullptr; ++set) {
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
    for (auto set = sets_to_run(); *set != nullptr; ++set) {
      TransformedShell<FixedNumbers> memory;
      memory.hold(point_shell);
      RandomNumbers random(1);
      (*set)->transform_points(point_shell.table, any_step(point_shell, random), memory.places());
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
  RandomNumbers random(6);
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    TransformedShell<FixedNumbers> memory;
    memory.hold(point_shell);
    (*set)->transform_points(point_shell.table, any_step(point_shell, random), memory.places());
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
    for (auto set = sets_to_run(); *set != nullptr; ++set) {
      TransformedShell<FixedNumbers> memory;
      memory.hold(point_shell);
      RandomNumbers random(1);
      (*set)->transform_points(point_shell.table, any_step(point_shell, random), memory.places());
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

// A closer look at a contact: which samples it takes, and their sums in every instruction set.

namespace {

using Samples = CloseSamples<FixedNumbers>;

bool same(const PowerSums<FixedNumbers>& a, const PowerSums<FixedNumbers>& b) {
  return a.weight == b.weight && a.density == b.density && std::ranges::equal(a.offset, b.offset);
}
bool same(const NormalSums<FixedNumbers>& a, const NormalSums<FixedNumbers>& b) {
  return a.weight == b.weight && std::ranges::equal(a.normal, b.normal);
}
bool same(const CloseSums<FixedNumbers>& a, const CloseSums<FixedNumbers>& b) {
  return a.top == b.top && same(a.facing, b.facing) && same(a.low, b.low) && same(a.high, b.high);
}

/// Samples `pitch` apart on both faces of a plate across z.
std::vector<SurfaceSample> plate(double half, double thick, double pitch) {
  std::vector<SurfaceSample> samples;
  for (double x = -half; x <= half; x += pitch) {
    for (double y = -half; y <= half; y += pitch) {
      samples.push_back({{x, y, -thick / 2}, {0, 0, -1}});
      samples.push_back({{x, y, thick / 2}, {0, 0, 1}});
    }
  }
  return samples;
}

double reach_of(const std::vector<SurfaceSample>& samples) {
  double reach = 0;
  for (const SurfaceSample& sample : samples) reach = std::max(reach, length(sample.at));
  return reach;
}

double far(const Point& a, const Point& b) {
  return length(a - b);
}

/// Of the sample `k`, units.
Point place(const Samples& samples, std::size_t k, double reach) {
  return {samples.offset[0][k] * reach / 32768, samples.offset[1][k] * reach / 32768,
          samples.offset[2][k] * reach / 32768};
}

std::unique_ptr<Samples> taken(const DenseSamples<FixedNumbers>& cells, double reach,
                               const Point& at) {
  auto samples = std::make_unique<Samples>();
  std::int32_t offset[3] = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    offset[axis] = static_cast<std::int32_t>(std::lround(32768 * at[axis] / reach));
  }
  samples->take(cells.table(), offset);
  return samples;
}

}  // namespace

TEST_CASE("every instruction set sums close samples to the bit") {
  RandomNumbers random(1);
  auto samples = std::make_unique<Samples>();
  int felt = 0;
  for (int i = 0; i < cases(20000); ++i) {
    samples->count = static_cast<std::int32_t>(random.uniform(0, kMostClose + 1));
    const double most =
        i % 5 == 0 ? 32767 : random.uniform(0, 40000);  // of 2048 and less all faint
    const double least = i % 2 == 0 ? 0 : 0.9 * most;
    for (std::size_t k = 0; k < kMostClose; ++k) {
      samples->density[k] =
          static_cast<std::int32_t>(std::min(32767.0, random.uniform(least, most)));
      for (auto* vector : {&samples->offset, &samples->normal}) {
        for (auto& part : *vector)
          part[k] = i % 7 == 0 ? -32768 : static_cast<std::int32_t>(random.uniform(-32768, 32768));
      }
    }
    for (auto& middle : samples->middle) {
      middle = static_cast<std::int32_t>(random.uniform(-40000, 40000));
    }
    samples->radius = static_cast<std::int32_t>(random.uniform(i % 4 == 0 ? 96 : 20000, 200000));
    const auto look = samples->fade(samples->table());
    const auto truth = close_sums<FixedNumbers>(look);
    felt += truth.low.weight > 0 ? 1 : 0;
    for (auto set = sets_to_run(); *set != nullptr; ++set) {
      CloseSums<FixedNumbers> sums;
      sums.top = -1;  // left over from before
      sums.low.weight = sums.high.density = -1;
      sums.facing.weight = sums.facing.normal[1] = -1;
      (*set)->sum_close(look, sums);
      if (!same(sums, truth)) {
        FAIL(std::string((*set)->name), ", case ", i);
      }
    }
  }
  CHECK(felt > cases(20000) / 2);
}

TEST_CASE_TEMPLATE("the sums tell height and place of a peak between the samples", N, FixedNumbers,
                   DoubleNumbers) {
  using Number = PointNumber<N>;
  const double one = N::kIsFixed ? 32768 : 1;
  CloseSamples<N> samples;
  samples.radius = static_cast<Number>(100 * one);
  for (const double off : {0.0, 0.1, 0.17}) {
    samples.count = 0;
    for (int x = -7; x < 8; ++x) {
      for (int z = -7; z < 8; ++z, ++samples.count) {
        const auto k = static_cast<std::size_t>(samples.count);
        const double at[3] = {0.35 * x, 0.5, 0.35 * z};
        // Over a reach of 8 units a tip that falls by 0.05 a unit squared.
        const double fall = 0.05 * ((at[0] - off) * (at[0] - off) + at[2] * at[2]);
        samples.density[k] = static_cast<Number>(one * std::max(0.0, 0.5 - fall));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          samples.offset[axis][k] = static_cast<Number>(one * at[axis] / 8);
        }
      }
    }
    const Closeup<N> seen = peak_of(close_sums<N>(samples.fade(samples.table())));
    CAPTURE(off);
    CHECK(double(seen.height) == doctest::Approx(0.5).epsilon(0.003));
    CHECK(std::abs(8 * double(seen.offset[0]) - off) < 0.01);
    CHECK(8 * double(seen.offset[1]) == doctest::Approx(0.5).epsilon(0.001));
    CHECK(std::abs(8 * double(seen.offset[2])) < 0.01);
  }
}

TEST_CASE_TEMPLATE("they tell the tool's normal at the peak, and how far its normals spread", N,
                   FixedNumbers, DoubleNumbers) {
  using Number = PointNumber<N>;
  const double one = N::kIsFixed ? 32768 : 1;
  // A cylinder of 5 units across an edge along z, which it touches at an angle; and a rim there,
  // with faces 45 degrees to each side and samples on it that have no normal.
  for (const bool rim : {false, true}) {
    for (const double off : {0.0, 0.1, -0.25}) {
      CloseSamples<N> samples;
      samples.radius = static_cast<Number>(100 * one);
      for (int k = 0; k < 15 * 15; ++k, ++samples.count) {
        const int x = k % 15 - 7, z = k / 15 - 7;
        const double angle = 0.07 * x, near = angle - off;
        const auto slot = static_cast<std::size_t>(k);
        const double facing = rim ? (x > 0 ? 0.7854 : -0.7854) : angle;
        const double smooth = rim && x == 0 ? 0 : one;
        const double at[3] = {5 * std::sin(angle), 0.35 * z, 5 * std::cos(angle)};
        const double normal[3] = {smooth * std::sin(facing), 0, smooth * std::cos(facing)};
        samples.density[slot] = static_cast<Number>(one * std::max(0.5 - 1.25 * near * near, 0.0));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          samples.offset[axis][slot] = static_cast<Number>(one * at[axis] / 8);
          samples.normal[axis][slot] = static_cast<Number>(normal[axis]);
        }
      }
      const Closeup<N> seen = peak_of(close_sums<N>(samples.fade(samples.table())));
      CAPTURE(off);
      if (rim) {  // that the look's middle is on
        if (std::abs(off) < 0.2) CHECK(double(seen.spread) > 0.4);
      } else {
        CHECK(std::abs(std::atan2(double(seen.normal[0]), double(seen.normal[2])) - off) < 0.01);
        CHECK(double(seen.spread) < 0.06);
        CHECK(double(seen.spread) > 0.01);
      }
    }
  }
}

TEST_CASE("a closer look takes all samples around a place, and of too many a part of each side") {
  const double thin = 1.5;
  for (const double pitch : {0.5, kClosePitch, 0.2, 0.1}) {
    const auto surface = plate(8, thin, pitch);
    const double reach = reach_of(surface);
    const DenseSamples<FixedNumbers> cells(surface, reach);
    for (const Point& at : {Point{0.2, 0.1, 0}, Point{8, 8, 0}, Point{-8, 3, 0}}) {
      const auto samples = taken(cells, reach, at);
      CAPTURE(pitch);
      CAPTURE(at[0]);
      CHECK(samples->count > 0);
      CHECK(samples->count <= kMostClose);
      const auto offsets =
          std::span(samples->offset[2]).first(static_cast<std::size_t>(samples->count));
      const auto above = std::ranges::count_if(offsets, [](std::int32_t z) { return z > 0; });
      CHECK(std::abs(double(above) / samples->count - 0.5) < 0.02);
      for (std::size_t k = 0; k < offsets.size(); ++k) {  // each has its own normal
        CHECK(samples->normal[2][k] == (offsets[k] > 0 ? 32768 : -32768));
      }
    }
  }
  // Few enough: all within kCloseRadius, and of the others those of cells that it reaches.
  const auto surface = plate(8, thin, 0.5);
  const double reach = reach_of(surface);
  const DenseSamples<FixedNumbers> cells(surface, reach);
  const Point at{1.3, -2.2, 0};
  const auto samples = taken(cells, reach, at);
  const auto within = std::ranges::count_if(surface, [&](const SurfaceSample& sample) {
    return far(sample.at, at) < kCloseRadius - 0.01;
  });
  CHECK(within > 200);
  samples->density.fill(16384);
  static_cast<void>(close_sums<FixedNumbers>(samples->fade(samples->table())));
  int taken_within = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(samples->count); ++k) {
    const double share = far(place(*samples, k, reach), at) / kCloseRadius;
    CHECK(share * kCloseRadius < kCloseRadius + std::sqrt(3.0));
    taken_within += share * kCloseRadius < kCloseRadius - 0.01 ? 1 : 0;
    const double rest = std::max(1 - share * share, 0.0);
    CHECK(samples->window[k] / 32768.0 == doctest::Approx(rest * rest).epsilon(0.001).scale(1));
  }
  CHECK(taken_within == within);
  CHECK(taken(cells, reach, {8, 8, 6})->count == 0);
  CHECK(taken(cells, reach, {30, -30, 30})->count == 0);
}

TEST_CASE("the peak of a closeup moves continuously with its centre") {
  // A row of two bumps, 4 units apart and 0.01 different in height, under a thick plate: the centre
  // of the closeup goes from one to the other.
  const auto surface = plate(10, 8, kClosePitch);
  const double reach = reach_of(surface);
  const DenseSamples<FixedNumbers> cells(surface, reach);
  const auto height_at = [&](double x) {
    const auto samples = taken(cells, reach, {x, 0, 4});
    const PointTable<FixedNumbers> table = samples->table();
    for (std::size_t k = 0; k < static_cast<std::size_t>(samples->count); ++k) {
      const Point at = place(*samples, k, reach);
      const double from_left = far(at, {-2, 0, 4}), from_right = far(at, {2, 0, 4});
      const double density =
          std::max(0.5 - 0.05 * from_left * from_left, 0.51 - 0.05 * from_right * from_right);
      samples->density[k] = static_cast<std::int32_t>(32768 * std::max(density, 0.0));
    }
    return double(peak_of(close_sums<FixedNumbers>(samples->fade(table))).height);
  };
  CHECK(height_at(-2) == doctest::Approx(0.5).epsilon(0.003));
  CHECK(height_at(2) == doctest::Approx(0.51).epsilon(0.003));
  // 0.0025 of density are 0.005 units, the half of what a proxy may be in the solid.
  double last = height_at(-2);
  for (double x = -2; x <= 2; x += 0.05) {
    const double height = height_at(x);
    CAPTURE(x);
    CHECK(std::abs(height - last) < 0.0025);
    last = height;
  }
}

}  // namespace kerf::point_sums_test
