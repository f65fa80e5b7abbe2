// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "visualizer/scene/appearance.hpp"

using namespace kerf;

TEST_CASE("a density takes the colour of the densest material it reaches, a label its own") {
  const std::vector<MaterialView> materials{{"none", 0.0, {0, 0, 0}},
                                            {"enamel", 0.8, {1, 1, 1}},
                                            {"dentin", 0.4, {0, 1, 0}},
                                            {"pulp", 0.1, {1, 0, 0}}};
  const auto palette = make_palette(materials);
  const auto by_density = [&](double density) {
    return glm::vec3(palette[0][static_cast<std::size_t>(density * 255.0 + 0.5)]);
  };
  CHECK(by_density(0.0) == glm::vec3(1, 0, 0));
  CHECK(by_density(0.2) == glm::vec3(1, 0, 0));
  CHECK(by_density(0.6) == glm::vec3(0, 1, 0));
  CHECK(by_density(1.0) == glm::vec3(1, 1, 1));
  const glm::vec3 border = by_density(0.4);
  CHECK(border.x == doctest::Approx(0.5).epsilon(0.2));  // half pulp, half dentin
  CHECK(glm::vec3(palette[1][2]) == glm::vec3(0, 1, 0));
}

TEST_CASE("without materials everything has one colour that is seen") {
  const auto palette = make_palette({});
  for (const auto& row : palette) {
    for (const glm::vec4& colour : row) CHECK(colour == palette[0][0]);
  }
  CHECK(palette[0][0].g > 0.3F);
}
