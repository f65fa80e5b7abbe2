// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <doctest/doctest.h>

#include "shared/posix/atomic_file.hpp"
#include "tests/json.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/bench/bench_tooth.hpp"
#include "visualizer/bench/picture_bench.hpp"
#include "visualizer/cast/cast_kernels.hpp"

namespace kerf::bench_test {
namespace {

std::size_t solid_voxels(const BenchTooth& tooth) {
  return static_cast<std::size_t>(
      std::count_if(tooth.density().begin(), tooth.density().end(),
                    [&](Density density) { return density >= tooth.view().iso; }));
}

}  // namespace

TEST_CASE("the made-up tooth is as large as the paper's, and a crop takes only air away") {
  for (const VoxelGrid& padded : {VoxelGrid{128, 128, 80}, VoxelGrid{256, 256, 161}}) {
    const BenchTooth tooth(padded, false);
    const BenchTooth cropped(padded, true);
    CHECK(solid_voxels(cropped) == solid_voxels(tooth));
    CHECK(cropped.looked_at() == tooth.looked_at());
    CHECK(cropped.looked_at() == cropped.view().corners());
    // The paper's crops are 47x42x80 and 93x82x159.
    const VoxelGrid& grid = cropped.view().bricks.grid;
    CHECK(grid.nx == doctest::Approx(0.365 * padded.nx).epsilon(0.05));
    CHECK(grid.ny == doctest::Approx(0.325 * padded.ny).epsilon(0.05));
    CHECK(grid.nz == doctest::Approx(padded.nz).epsilon(0.03));
  }
}

TEST_CASE("each cut takes material away, within the bricks that it names") {
  constexpr int kCuts = 12;  // a subject of the bench takes 11 at most
  for (const int diameter : {10, 16}) {
    BenchTooth tooth({128, 128, 80}, true);
    for (int i = 0; i < kCuts; ++i) {
      CAPTURE(i);
      const std::vector<Density> before = tooth.density();
      const ChangedBricks cut = tooth.cut(diameter);
      const ChangedBricks found = changed_between(tooth.view().bricks, before, tooth.density());
      CHECK_FALSE(found.empty());
      for (const ChangedBrick& brick : found) {
        CHECK(std::find(cut.begin(), cut.end(), brick) != cut.end());
      }
    }
  }
}

TEST_CASE("the bench's report has a row for each kind of frame") {
  const VoxelGrid large{256, 256, 161};
  const auto row = [&](const char* renderer, int tool, bool partial, double wall_ms) {
    return PictureRow{.renderer = renderer,
                      .volume = large,
                      .tool = tool,
                      .partial = partial,
                      .cpu_ms = 2.0 * wall_ms,
                      .wall_ms_p50 = wall_ms,
                      .wall_ms_p99 = wall_ms};
  };
  const std::vector<PictureRow> rows{row("iso", 0, false, 50.0), row("iso", 16, true, 4.0),
                                     row("cast", 0, false, 8.0)};
  const PictureFigures figures{
      .rows = rows,
      .gradients = {{GradientFilter::corners, 0.5, 1.25, 2.5, 3.0, 4.5, 5.0, 5.5, 6.5}},
      .gl_renderer = "a driver",
      .size = {512, 512},
      .cores = 2};
  const auto report = test::read_json(picture_report(figures));
  CHECK(report["gl_renderer"] == "a driver");
  CHECK(report["cast_set"] == cast_kernels()[0]->name);
  CHECK(report["rows"].size() == 3);
  CHECK(report["rows"][1]["volume"] == "256x256x161");
  CHECK(report["rows"][1]["gradient"] == "adaptive");
  CHECK(report["rows"][1]["modifying"] == true);
  CHECK(report["rows"][1]["partial"] == true);
  CHECK(report["rows"][1]["fps"].get<double>() == doctest::Approx(250.0));
  CHECK(report["gradients"][0]["noisy_angle_deg"] == 1.25);
  CHECK(report["gradients"][0]["milled_p99_deg"] == 4.5);
  CHECK(report["gradients"][0]["thick_2_p99_deg"] == 5.0);
  CHECK(report["gradients"][0]["thick_5_p99_deg"] == 5.5);
  CHECK(report["gradients"][0]["thick_10_p99_deg"] == 6.5);
}

TEST_CASE("each program replaces its own part of a page and leaves the others") {
  const std::string first = with_part("", "a", "one\n");
  const std::string both = with_part(first, "b", "two\n");
  CHECK(first == "<!-- begin a -->\none\n<!-- end a -->\n");
  CHECK(both.starts_with(first));
  CHECK(with_part(both, "a", "one\n") == both);
  CHECK(with_part(with_part(both, "a", "more\n"), "a", "one\n") == both);
  CHECK(with_part("by hand\n", "a", "") == "by hand\n\n<!-- begin a -->\n<!-- end a -->\n");
}

TEST_CASE("the default gradient shades balls and milled hollows within 3 degrees at 99 of 100") {
  if (!kerf::test::have_gl()) return;
  const std::vector<GradientRow> rows = measure_gradients();
  REQUIRE(rows.size() == kGradientNames.size());
  for (const GradientRow& row : rows) {
    CAPTURE(name_of(row.gradient));
    CAPTURE(row.p99_deg);
    CAPTURE(row.milled_p99_deg);
    CHECK(row.noisy_angle_deg > row.angle_deg);
    const bool is_default = row.gradient == kDefaultGradient;
    CHECK((row.p99_deg < 1.0) == (is_default || row.gradient == GradientFilter::farid5));
    CHECK((row.milled_p99_deg < 3.0) == is_default);
    CAPTURE(row.thick_10_p99_deg);
    CHECK((row.thick_10_p99_deg < 3.0) == is_default);
    if (is_default) CHECK(row.thick_5_p99_deg < 1.5);
    if (is_default) CHECK(row.thick_2_p99_deg < 1.0);
    CHECK((row.noisy_angle_deg < 0.5) == (is_default || row.gradient == GradientFilter::farid5));
  }
}

}  // namespace kerf::bench_test
