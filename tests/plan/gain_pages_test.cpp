// SPDX-License-Identifier: Apache-2.0
// The figures of gains on the pages are those of the check: docs/gains.md, docs/stability.md.

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/gain_margin.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "tests/servo/support.hpp"

namespace kerf::gain_pages_test {

using namespace kerf::test;

namespace {

const std::map<std::string, Personality> kNames{
    {"Omni", Personality::omni},         {"Falcon", Personality::falcon},
    {"Touch", Personality::touch},       {"WoodenHaptics", Personality::woodenhaptics},
    {"Inverse3", Personality::inverse3}, {"omega.3", Personality::omega}};

/// Cells of a page's table rows that begin with a device, without the stars of bold text.
std::vector<std::vector<std::string>> device_rows(const std::string& file, std::size_t cells) {
  std::ifstream page(std::string(KERF_DOCS) + "/" + file);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| ")) continue;
    std::vector<std::string> row;
    std::istringstream parts(line.substr(2));
    for (std::string cell; std::getline(parts, cell, '|');) {
      const std::size_t first = cell.find_first_not_of(" *"), last = cell.find_last_not_of(" *");
      row.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
    }
    if (row.size() == cells && kNames.contains(row[0])) rows.push_back(std::move(row));
  }
  return rows;
}

std::string three_digits(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// Whether --check takes these gains without a word.
bool is_accepted(Personality device, double stiffness, double damping) {
  LoadedScene scene = half_space_scene(8);
  scene.tools.push_back(ball(8));
  scene.device.personality = device;
  scene.force.stiffness_n_per_mm = stiffness;
  scene.force.damping_ns_per_mm = damping;
  scene.servo.rate_hz = 1000;
  const GainMargin margin = gain_margin(scene, PlayFriction::where_it_decides);
  return device_limit_error(scene).empty() && gain_error(scene, margin).empty() &&
         gain_warning(scene, margin).empty();
}

}  // namespace

TEST_CASE("docs/gains.md has the figures of each device and its boundary at each rate") {
  const auto figures = device_rows("gains.md", 9);
  CHECK(figures.size() == kNames.size());
  for (const auto& row : figures) {
    CAPTURE(row[0]);
    const DeviceFigures device = device_figures(kNames.at(row[0]));
    CHECK(std::stod(row[1]) == device.mass_kg);
    CHECK(std::stod(row[2]) == device.viscous_ns_per_mm);
    CHECK(std::stod(row[3]) == device.coulomb_n);
    CHECK(std::stod(row[4]) == device.quantum_mm);
    CHECK(std::stod(row[5]) == 1000 * device.delay_s);
    CHECK(std::stod(row[6]) == device.highest_stiffness_n_per_mm);
    CHECK(std::stod(row[7]) == device.highest_damping_ns_per_mm);
  }
  const auto boundaries = device_rows("gains.md", 7);
  CHECK(boundaries.size() == kNames.size());
  for (const auto& row : boundaries) {
    CAPTURE(row[0]);
    std::size_t column = 1;
    for (const double rate_hz : {250, 500, 1000, 2000, 4000, 8000}) {
      const double highest = highest_stiffness(unheld_loop(kNames.at(row[0]), rate_hz), 0.002);
      CHECK(three_digits(std::stod(row[column++])) == three_digits(highest));
    }
  }
}

TEST_CASE("docs/stability.md has the highest stiffness that --check accepts without a warning") {
  const auto rows = device_rows("stability.md", 9);
  CHECK(rows.size() == 18);
  for (const auto& row : rows) {
    CAPTURE(row[0]);
    CAPTURE(row[2]);
    const Personality device = kNames.at(row[0]);
    const double damping = std::stod(row[2]);
    if (row[8] == "none") {
      CHECK_FALSE(is_accepted(device, 0.01, damping));
      continue;
    }
    const double highest = std::stod(row[8]);  // two digits, rounded down
    CHECK(is_accepted(device, highest, damping));
    const double step = std::pow(10, std::floor(std::log10(highest)) - 1);
    CHECK_FALSE(is_accepted(device, highest + 1.001 * step, damping));
  }
}

}  // namespace kerf::gain_pages_test
