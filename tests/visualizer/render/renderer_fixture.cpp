// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/render/renderer_fixture.hpp"

#include <algorithm>
#include <cstdlib>
#include <random>

namespace kerf::test {

SceneView scene_of(std::initializer_list<const TestVolume*> volumes) {
  SceneView scene;
  for (const TestVolume* volume : volumes) scene.volumes.push_back(volume->view);
  return scene;
}

TestVolume heap_of_balls(unsigned seed) {
  const VoxelGrid grid{61, 44, 37};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  std::vector<glm::dvec3> centres(25);
  for (glm::dvec3& centre : centres) {
    for (int axis = 0; axis < 3; ++axis) centre[axis] = place(random);
  }
  return {grid, centred(grid, glm::dvec3(0.2)), [&](glm::dvec3 at) {
            double most = 0.0;
            for (const glm::dvec3& centre : centres) {
              most = std::max(most, ball(centre, 0.7, 0.4)(at));
            }
            return most;
          }};
}

Difference difference(const Drawn& a, const Drawn& b) {
  Difference difference;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const int off = std::abs(static_cast<int>(a.rgb[i]) - static_cast<int>(b.rgb[i]));
    difference.mean += off;
    difference.most = std::max(difference.most, off);
  }
  difference.mean /= static_cast<double>(a.rgb.size());
  return difference;
}

}  // namespace kerf::test
