// SPDX-License-Identifier: Apache-2.0
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/load/load_scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "tests/scene/support.hpp"

namespace {

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// One to eight bytes changed, removed, doubled or added; or the end cut off.
std::string mutated(std::string text) {
  const int changes = *rc::gen::inRange(1, 9);
  for (int i = 0; i < changes && !text.empty(); ++i) {
    const std::size_t at = *rc::gen::inRange<std::size_t>(0, text.size());
    const char byte = *rc::gen::oneOf(
        rc::gen::arbitrary<char>(), rc::gen::elementOf(std::string("[]{}=.,\"'\n#-+_e0123456789")));
    switch (*rc::gen::inRange(0, 5)) {
      case 0:
        text[at] = byte;
        break;
      case 1:
        text.erase(at, 1);
        break;
      case 2:
        text.insert(at, 1, byte);
        break;
      case 3:
        text.insert(at, text.substr(at, *rc::gen::inRange<std::size_t>(1, 40)));
        break;
      default:
        if (i == 0) text.resize(at);
    }
  }
  return text;
}

/// Either a result or a LoadError with one line; anything else escapes and fails the test.
template <class Action>
void must_work_or_explain(Action&& action) {
  const std::string error = kerf::test::error_of(action);
  RC_ASSERT(error.find('\n') == std::string::npos);
  RC_ASSERT(error.size() < 500);
}

}  // namespace

TEST_CASE("a damaged scene file is explained or still a scene, never a crash") {
  const std::string scene = contents(std::filesystem::path(KERF_SCENES_DIR) / "two_teeth.toml");
  REQUIRE_FALSE(scene.empty());
  CHECK(rc::check("parsing", [&] {
    for (int i = 0; i < 20; ++i) {
      const std::string text = mutated(scene);
      must_work_or_explain([&] { static_cast<void>(kerf::parse_scene(text, "x.toml")); });
    }
  }));
}

TEST_CASE("a damaged scene file is loaded whole or explained") {
  const kerf::test::TempFolder folder;
  const kerf::VoxelGrid grid{12, 12, 12};
  static_cast<void>(folder.write(
      "a.nrrd", kerf::test::nrrd(grid, {0.5, 0.5, 0.5},
                                 kerf::test::block(grid, {{3, 3, 3}, {9, 9, 9}}, 700))));
  const std::string scene =
      "[[volume]]\nfile=\"a.nrrd\"\nspacing_mm=[0.5,0.4,0.3]\nwindow=[0,900]\niso=0.4\n"
      "pose={position_mm=[1,2,3]}\n[[tool]]\nshape=\"flame\"\nradius_mm=0.6\nlength_mm=2.5\n"
      "[device]\nworkspace_scale=2\n[limits]\nforce_n=2.5\n[servo]\nrate_hz=2000\n";
  kerf::LoadedScene valid = kerf::load_scene(folder.write("valid.toml", scene));
  REQUIRE_FALSE(valid.tools.at(0).offsets.empty());
  CHECK(rc::check("loading", [&] {
    const auto path = folder.write("damaged.toml", mutated(scene));
    must_work_or_explain([&] { static_cast<void>(kerf::load_scene(path)); });
  }));
}
