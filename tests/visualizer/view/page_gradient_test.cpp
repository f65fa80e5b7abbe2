// SPDX-License-Identifier: Apache-2.0
// What the page repeats in JavaScript of the gradient of voxels: here and in
// tests/web/script/cell_gradients.mjs filters and gradients are those of cell_gradients.json,
// which KERF_GOLDEN=renew in the environment makes anew.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "visualizer/scene/gradient_plan.hpp"

namespace kerf::page_gradient_test {

using namespace kerf::test;

namespace {

using Edges = std::array<double, 3>;

constexpr Edges kPlans[]{{1, 1, 1}, {1, 1, 1.5}, {1, 1, 2}, {1, 1, 3.7}, {1, 1, 5},  {1, 1, 10},
                         {1, 5, 5}, {1, 10, 10}, {1, 2, 8}, {1, 3, 10},  {1, 1, 100}};
/// With cells of an odd number of voxels: the middle one has the gradient of its cell, which
/// nothing in the body below turns.
constexpr Edges kVolumes[]{{1, 1, 1}, {1, 1, 1.5}, {1.7, 1, 1.2}, {1, 1, 3}, {3, 1, 3.2}};
constexpr VoxelGrid kGrid{15, 12, 9};

GradientPlan plan_of(const Edges& edges) {
  return GradientPlan(GradientFilter::adaptive, {edges[0], edges[1], edges[2]});
}

/// Of each filter and axis: its reach, then the taps from the middle on.
std::vector<double> numbers_of(const GradientPlan& plan) {
  std::vector<double> numbers;
  for (const FilterTaps* filter : {&plan.narrow, &plan.wide}) {
    for (const AxisTaps& taps : *filter) {
      numbers.push_back(taps.reach);
      for (const auto* of : {&taps.smooth, &taps.slope}) {
        const auto* const middle = of->begin() + AxisTaps::kMiddle;
        numbers.insert(numbers.end(), middle, middle + taps.reach + 1);
      }
    }
  }
  return numbers;
}

/// A body with a rough surface.
std::vector<Density> body() {
  std::vector<Density> density;
  for_each_voxel(kGrid.box(), [&](int x, int y, int z) {
    const int fall = 3 * (x - 7) * (x - 7) + 4 * (y - 6) * (y - 6) + 20 * (z - 4) * (z - 4);
    const int rough = 37 * ((7 * x + 11 * y + 13 * z) % 29);
    density.push_back(static_cast<Density>(std::max(0, 60000 - 90 * fall + rough)));
  });
  return density;
}

/// Of every 17th cell, that of its middle voxel.
std::vector<double> gradients_of(const GradientPlan& plan) {
  std::vector<glm::vec3> made;
  fill_gradients(plan, kGrid, body(), kGrid.box(), made);
  std::vector<double> numbers;
  const VoxelIndex& n = plan.cell;
  int count = 0;
  for (int z = n.z / 2; z < kGrid.nz; z += n.z) {
    for (int y = n.y / 2; y < kGrid.ny; y += n.y) {
      for (int x = n.x / 2; x < kGrid.nx; x += n.x) {
        if (count++ % 17 != 0) continue;
        const glm::vec3& one = made[kGrid.index(x, y, z)];
        numbers.insert(numbers.end(), {one.x, one.y, one.z});
      }
    }
  }
  return numbers;
}

std::string line(const Edges& edges, const VoxelIndex& cell, const std::vector<double>& numbers) {
  std::string text = "  {\"edges\": " + Json(edges).canonical() +
                     ", \"cell\": " + Json(std::array{cell.x, cell.y, cell.z}).canonical() +
                     ", \"numbers\": [";
  for (const double one : numbers) {
    char word[32];
    std::snprintf(word, sizeof word, "%s%.7g", text.back() == '[' ? "" : ", ", one);
    text += word;
  }
  return text + "]}";
}

template <class Numbers>
std::string lines(std::span<const Edges> all, const Numbers& numbers) {
  std::string text;
  for (const Edges& edges : all) {
    const GradientPlan plan = plan_of(edges);
    text += (text.empty() ? "" : ",\n") + line(edges, plan.cell, numbers(plan));
  }
  return text;
}

void check_like(const ReadJson& stored, const VoxelIndex& cell,
                const std::vector<double>& numbers) {
  CHECK(stored["cell"].get<std::array<int, 3>>() == std::array{cell.x, cell.y, cell.z});
  const auto wanted = stored["numbers"].get<std::vector<double>>();
  REQUIRE(wanted.size() == numbers.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    CHECK(numbers[i] == doctest::Approx(wanted[i]).epsilon(1e-5));
  }
}

}  // namespace

TEST_CASE("filters and gradients of voxels are those that the page is compared with") {
  const char* const file = KERF_TEST_PAGE_GRADIENTS;
  const char* const wish = std::getenv("KERF_GOLDEN");
  if (wish != nullptr && std::string_view(wish) == "renew") {
    std::ofstream(file) << "{\"plans\": [\n"
                        << lines(kPlans, numbers_of) << "\n], \"gradients\": [\n"
                        << lines(kVolumes, gradients_of) << "\n]}\n";
  }
  const ReadJson stored = read_json_file(file);
  REQUIRE(stored["plans"].size() == std::size(kPlans));
  for (std::size_t i = 0; i < std::size(kPlans); ++i) {
    const GradientPlan plan = plan_of(kPlans[i]);
    check_like(stored["plans"][i], plan.cell, numbers_of(plan));
  }
  REQUIRE(stored["gradients"].size() == std::size(kVolumes));
  for (std::size_t i = 0; i < std::size(kVolumes); ++i) {
    const GradientPlan plan = plan_of(kVolumes[i]);
    check_like(stored["gradients"][i], plan.cell, gradients_of(plan));
  }
}

}  // namespace kerf::page_gradient_test
