// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <set>

#include <doctest/doctest.h>

#include "tests/support/process.hpp"
#include "tests/visualizer/render/golden_picture.hpp"
#include "tests/visualizer/render/teeth.hpp"
#include "visualizer/app/headless.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/visualizer_error.hpp"

using namespace kerf;
using namespace kerf::test;

TEST_CASE("a contact sheet has a tile for every renderer, and each shows its own picture") {
  if (!have_gl()) return;
  const TemporaryFolder folder;
  const auto file = folder / "sheet.png";
  Tooth tooth = phantom({128, 128, 80}, true);
  tooth.scene.tools = {{"ball", {{-1.0, 0.0}, {0.0, 1.0}, {1.0, 0.0}}, 1.0}};
  const VolumeContent content = tooth.content();
  const auto tiles = [&](const std::optional<Hand>& hand) {
    write_contact_sheet(file, tooth.scene, {&content, 1}, hand);
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
