// SPDX-License-Identifier: Apache-2.0
// Pictures on a schedule, and the contact sheet.
#include "visualizer/app/headless.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/process.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/rgb_picture.hpp"
#include "tests/visualizer/render/teeth.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::headless_test {

using namespace kerf::test;

namespace {

/// Ticks at which pictures are taken when the state is seen at `seen`, the last one at the end.
std::vector<std::uint64_t> taken_at(std::uint32_t frames, std::uint64_t every,
                                    const std::vector<std::uint64_t>& seen) {
  FrameSchedule schedule(frames, every);
  std::vector<std::uint64_t> taken;
  for (const std::uint64_t ticks : seen) {
    if (!schedule.due(ticks)) continue;
    schedule.take(ticks);
    taken.push_back(ticks);
  }
  while (schedule.final_due(seen.back())) {
    schedule.take(seen.back());
    taken.push_back(seen.back());
  }
  return taken;
}

}  // namespace

TEST_CASE("pictures are evenly spread, and the end of the run is the last one") {
  CHECK(taken_at(4, 10, {1, 5, 10, 15, 21, 29, 33, 37}) ==
        std::vector<std::uint64_t>{10, 21, 33, 37});
  CHECK(taken_at(3, 10, {10, 20, 30, 40, 50}) == std::vector<std::uint64_t>{10, 20, 30});
}

TEST_CASE("pictures missed because drawing was slow are taken late, not left out") {
  CHECK(taken_at(4, 10, {9, 35, 36, 37, 48}) == std::vector<std::uint64_t>{35, 36, 37, 48});
  CHECK(taken_at(5, 10, {9, 50}) == std::vector<std::uint64_t>{50, 50, 50, 50, 50});
}

TEST_CASE("a run that ends before the first picture is due still has one") {
  CHECK(taken_at(5, 100, {3}) == std::vector<std::uint64_t>{3});
}

TEST_CASE("nothing is due before the device is armed, but the end is drawn") {
  FrameSchedule schedule(3, 10);
  CHECK_FALSE(schedule.due(std::nullopt));
  CHECK(schedule.final_due(std::nullopt));
  CHECK(schedule.take(std::nullopt) == 1);
  CHECK_FALSE(schedule.final_due(std::nullopt));
}

TEST_CASE("pictures are spread over the time, else a second apart, also where there are none") {
  constexpr std::uint32_t kTickNs = 1'000'000;
  CHECK(ticks_between(4, 2.0, kTickNs) == 500);
  CHECK(ticks_between(4, std::nullopt, kTickNs) == 1000);
  // In a constant expression a division by zero does not compile.
  static_assert(ticks_between(0, 2.0, kTickNs) == 1000);
  static_assert(ticks_between(9999, 0.0, kTickNs) == 1);
}

TEST_CASE("a contact sheet has a tile for every renderer, and each shows its own picture") {
  if (!have_gl()) return;
  const TemporaryFolder folder;
  const auto file = folder / "sheet.png";
  Tooth tooth = phantom({128, 128, 80}, true);
  tooth.scene.tools = {{"ball", {{-1.0, 0.0}, {0.0, 1.0}, {1.0, 0.0}}, 1.0}};
  const VolumeContent content = tooth.content();
  const auto tiles = [&](const std::optional<Hand>& hand) {
    write_contact_sheet(file, tooth.scene, {&content, 1}, {hand});
    const RgbPicture sheet = read_png(file).value();
    std::vector<std::vector<std::uint8_t>> all;
    constexpr int kColumns = 3;
    const int rows = (static_cast<int>(renderer_kinds().size()) + kColumns - 1) / kColumns;
    const int width = sheet.size.width / kColumns;
    const int height = sheet.size.height / rows;
    for (std::size_t i = 0; i < renderer_kinds().size(); ++i) {
      auto& tile = all.emplace_back();
      for (int y = 0; y < height * 3 / 4; ++y) {  // above the name
        const int row = static_cast<int>(i) / kColumns * height + y;
        const auto from = sheet.rgb.begin() +
                          3 * (row * sheet.size.width + static_cast<int>(i) % kColumns * width);
        tile.insert(tile.end(), from, from + 3 * width);
      }
    }
    return all;
  };
  const auto without = tiles({});
  CHECK(std::set(without.begin(), without.end()).size() == renderer_kinds().size());
  const auto with = tiles(Hand{.tip_mm = {0.0, 11.0, 3.0}});
  for (std::size_t i = 0; i < with.size(); ++i) CHECK(with[i] != without[i]);
}

TEST_CASE("a contact sheet is of the end of a headless run") {
  const auto parse = [](std::vector<const char*> words) {
    words.insert(words.begin(), "kerf-visualizer");
    return parse_options(static_cast<int>(words.size()), words.data());
  };
  CHECK(parse({"--headless", "--sheet", "all.png"})->sheet == "all.png");
  CHECK_THROWS_WITH_AS(parse({"--sheet", "all.png"}), doctest::Contains("--headless"),
                       VisualizerError);
}

TEST_CASE("the stopwatch counts processor time while the process works") {
  const Stopwatch watch;
  volatile double sum = 0.0;
  while (watch.cpu_ms() < 5.0) sum = sum + 1.0;
  CHECK(watch.wall_ms() > 0.0);
  CHECK(watch.cpu_ms() >= 5.0);
}

}  // namespace kerf::headless_test
