// SPDX-License-Identifier: Apache-2.0
// The rates that docs/scenes.md promises of each shipped scene, against what the budget takes.
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/work_budget.hpp"

using namespace kerf;

namespace {

namespace fs = std::filesystem;

const fs::path kScenes = KERF_SCENES_DIR;

/// Cells of a row of a Markdown table, without blanks and backquotes; none of another line.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  if (!line.starts_with("|")) return cells;
  for (const char c : line) {
    if (c == '|') cells.emplace_back();
    if (c != '|' && c != ' ' && c != '`') cells.back() += c;
  }
  cells.pop_back();  // behind the last bar
  return cells;
}

/// kHz by scene, then by name of a kernel set.
using Promises = std::map<std::string, std::map<std::string, double>>;

Promises read_promises() {
  std::ifstream file(kScenes.parent_path() / "docs" / "scenes.md");
  std::vector<std::string> sets;
  Promises promises;
  for (std::string line; std::getline(file, line);) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() < 2) {
      sets.clear();
    } else if (cells[0] == "kHz") {
      sets = cells;
    } else if (!sets.empty() && cells[0].ends_with(".toml")) {
      REQUIRE(cells.size() == sets.size());
      for (std::size_t i = 1; i < cells.size(); ++i) {
        promises[cells[0]][sets[i]] = std::stod(cells[i]);
      }
    }
  }
  return promises;
}

}  // namespace

TEST_CASE(
    "each shipped scene is taken at the rates that docs/scenes.md says, refused at the next") {
  const Promises promises = read_promises();
  std::size_t scenes = 0;
  for (const auto& entry : fs::directory_iterator(kScenes)) {
    if (entry.path().extension() != ".toml") continue;
    ++scenes;
    const std::string name = "scenes/" + entry.path().filename().string();
    CAPTURE(name);
    REQUIRE(promises.contains(name));
    LoadedScene scene = load_scene(entry.path());
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      const auto promised = promises.at(name).find((*set)->name);
      if (promised == promises.at(name).end()) continue;  // NEON's prices are guesses
      CAPTURE(promised->first);
      const auto servo = plan_scene(scene, **set);
      for (const double khz : {0.5, 1.0, 2.0, 4.0, 8.0}) {
        CAPTURE(khz);
        scene.servo.rate_hz = static_cast<int>(1000 * khz);
        CHECK(budget_error(scene, servo->costs()).empty() == (khz <= promised->second));
      }
    }
  }
  CHECK(promises.size() == scenes);
}

TEST_CASE("the costliest tool of each shipped scene is the known work") {
  // us on the reference machine; a price or a count that changes shows here, rates are too coarse.
  const std::map<std::string, std::map<std::string, double>> known{
      {"fast.toml", {{"avx512", 48.48}, {"avx2", 54.39}, {"scalar", 321.76}}},
      {"fluted_bur.toml", {{"avx512", 103.68}, {"avx2", 122.91}, {"scalar", 546.18}}},
      {"paper.toml", {{"avx512", 7.48}, {"avx2", 13.96}, {"scalar", 151.57}}},
      {"phantom.toml", {{"avx512", 76.25}, {"avx2", 89.48}, {"scalar", 435.57}}},
      {"shaft.toml", {{"avx512", 46.45}, {"avx2", 50.74}, {"scalar", 345.18}}},
      {"touch.toml", {{"avx512", 38.90}, {"avx2", 42.14}, {"scalar", 291.73}}},
      {"two_teeth.toml", {{"avx512", 39.42}, {"avx2", 43.67}, {"scalar", 290.84}}}};
  for (const auto& [name, works] : known) {
    CAPTURE(name);
    const LoadedScene scene = load_scene(kScenes / name);
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      const auto work = works.find((*set)->name);
      if (work == works.end()) continue;
      CAPTURE(work->first);
      const SceneCosts costs = plan_scene(scene, **set)->costs();
      CHECK(work_us(costs, costliest_tool(costs)) == doctest::Approx(work->second).epsilon(0.001));
    }
  }
}

TEST_CASE("the fast scene cuts at 8 kHz, the default scene's tools run at 4 kHz") {
  const Promises promises = read_promises();
  for (const char* set : {"avx512", "avx2"}) {
    CHECK(promises.at("scenes/fast.toml").at(set) == 8);
    CHECK(promises.at("scenes/phantom.toml").at(set) == 4);
  }
  CHECK(load_scene(kScenes / "fast.toml", {.phantom_size = VoxelGrid{64, 64, 40}}).servo.rate_hz ==
        8000);
}
