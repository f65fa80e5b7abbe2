// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/monkey/monkey.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/temporary_folder.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::monkey_test {

namespace fs = std::filesystem;

namespace {

#ifdef KERF_FEWER_CASES
constexpr std::uint64_t kEvents = 15;
#else
constexpr std::uint64_t kEvents = 60;
#endif

std::unique_ptr<GlContext> context_or_none() {
  try {
    return make_headless_context();
  } catch (const VisualizerError&) {
    MESSAGE("skipped: there is no OpenGL 4.5 context here");
    return nullptr;
  }
}

}  // namespace

TEST_CASE("whatever a monkey does, the window shows what a picture drawn anew shows") {
  const test::RuntimeFolder folder;
  const auto context = context_or_none();
  if (!context) return;
  for (const std::uint32_t seed : {1U, 2U}) {
    CAPTURE(seed);
    Monkey monkey(*context, {.seed = seed, .folder = folder / "files"});
    while (monkey.count().events < kEvents) {
      try {
        monkey.act();
      } catch (const VisualizerError& problem) {
        FAIL(monkey.event() << ": " << problem.what());
      }
    }
    CHECK(monkey.count().compared > kEvents / 2);
  }
}

TEST_CASE("a monkey with the same seed does the same, and sees the same") {
  const test::RuntimeFolder folder;
  const auto context = context_or_none();
  if (!context) return;
  std::vector<std::string> events[2];
  std::vector<std::uint8_t> seen[2];
  for (int run = 0; run < 2; ++run) {
    fs::remove_all(folder / "files");  // their names are told in the picture
    Monkey monkey(*context, {.seed = 3, .folder = folder / "files"});
    for (int event = 0; event < 10; ++event) {
      monkey.act();
      events[run].push_back(monkey.event());
      seen[run].insert(seen[run].end(), monkey.shown().rgb.begin(), monkey.shown().rgb.end());
    }
  }
  CHECK(events[0] == events[1]);
  const bool same = seen[0] == seen[1];
  CHECK(same);
}

}  // namespace kerf::monkey_test
