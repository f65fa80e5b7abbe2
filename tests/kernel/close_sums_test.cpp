// SPDX-License-Identifier: Apache-2.0
// A closer look at a contact: which samples it takes, and their sums in every instruction set.
#include "controller/kernel/point_shell/close_sums.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/proxy/contact_closeup.hpp"
#include "controller/plan/tables/close_cells.hpp"
#include "tests/case_count.hpp"
#include "tests/kernel/contact_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Samples = CloseSamples<FixedNumbers>;

bool same(const PowerSums<FixedNumbers>& a, const PowerSums<FixedNumbers>& b) {
  return a.weight == b.weight && a.density == b.density && std::ranges::equal(a.offset, b.offset);
}

/// Samples `pitch` apart on both faces of a plate across z.
std::vector<Point> plate(double half, double thick, double pitch) {
  std::vector<Point> points;
  for (double x = -half; x <= half; x += pitch) {
    for (double y = -half; y <= half; y += pitch) {
      points.push_back({x, y, -thick / 2});
      points.push_back({x, y, thick / 2});
    }
  }
  return points;
}

double reach_of(const std::vector<Point>& points) {
  double reach = 0;
  for (const Point& p : points) reach = std::max(reach, length(p));
  return reach;
}

std::unique_ptr<Samples> taken(const CloseCells<FixedNumbers>& cells, double reach,
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
  Dice dice(1);
  auto samples = std::make_unique<Samples>();
  int felt = 0;
  for (int i = 0; i < cases(20000); ++i) {
    samples->count = static_cast<std::int32_t>(dice.uniform(0, kMostClose + 1));
    const double most = i % 5 == 0 ? 32767 : dice.uniform(0, 40000);  // of 2048 and less all faint
    const double least = i % 2 == 0 ? 0 : 0.9 * most;
    for (std::size_t k = 0; k < kMostClose; ++k) {
      samples->density[k] = static_cast<std::int32_t>(std::min(32767.0, dice.uniform(least, most)));
      for (auto& offset : samples->offset) {
        offset[k] = i % 7 == 0 ? -32768 : static_cast<std::int32_t>(dice.uniform(-32768, 32768));
      }
    }
    const PointTable<FixedNumbers> table = samples->table();
    samples->fade(table);
    const auto truth = close_sums<FixedNumbers>(table, samples->density.data());
    felt += truth.low.weight > 0 ? 1 : 0;
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      CloseSums<FixedNumbers> sums;
      sums.top = -1;  // left over from before
      sums.low.weight = sums.high.density = -1;
      (*set)->sum_close(table, samples->density.data(), sums);
      if (sums.top != truth.top || !same(sums.low, truth.low) || !same(sums.high, truth.high)) {
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
    const PointTable<N> table = samples.table();
    samples.fade(table);
    const Closeup<N> seen = peak_of(close_sums<N>(table, samples.density.data()));
    CAPTURE(off);
    CHECK(double(seen.height) == doctest::Approx(0.5).epsilon(0.003));
    CHECK(std::abs(8 * double(seen.offset[0]) - off) < 0.01);
    CHECK(8 * double(seen.offset[1]) == doctest::Approx(0.5).epsilon(0.001));
    CHECK(std::abs(8 * double(seen.offset[2])) < 0.01);
  }
}

TEST_CASE("a closer look takes all samples around a place, and of too many a part of each side") {
  const double thin = 1.5;
  for (const double pitch : {0.5, kClosePitch, 0.2, 0.1}) {
    const std::vector<Point> points = plate(8, thin, pitch);
    const double reach = reach_of(points);
    const CloseCells<FixedNumbers> cells(points, reach);
    for (const Point& at : {Point{0.2, 0.1, thin / 2}, Point{8, 8, -thin / 2}, Point{-8, 3, 0},
                            Point{30, -30, 30}}) {  // beside the plate too
      const auto samples = taken(cells, reach, at);
      CAPTURE(pitch);
      CAPTURE(at[0]);
      CHECK(samples->count > 0);
      CHECK(samples->count <= kMostClose);
      const auto offsets =
          std::span(samples->offset[2]).first(static_cast<std::size_t>(samples->count));
      const auto above = std::ranges::count_if(offsets, [](std::int32_t z) { return z > 0; });
      CHECK(std::abs(double(above) / samples->count - 0.5) < 0.02);
    }
  }
  // Few enough: all within kCloseRadius, and none beyond it by more than a cell.
  const std::vector<Point> points = plate(8, thin, 0.5);
  const double reach = reach_of(points);
  const CloseCells<FixedNumbers> cells(points, reach);
  const Point at{1.3, -2.2, 0};
  const auto samples = taken(cells, reach, at);
  int within = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(samples->count); ++k) {
    const double x = samples->offset[0][k] * reach / 32768,
                 y = samples->offset[1][k] * reach / 32768;
    const double far = std::max(std::abs(x - at[0]), std::abs(y - at[1]));
    CHECK(far < kCloseRadius + kCloseCell + 0.01);
    within += far < kCloseRadius - 0.01 ? 1 : 0;
  }
  CHECK(within == 2 * 8 * 8);
}
