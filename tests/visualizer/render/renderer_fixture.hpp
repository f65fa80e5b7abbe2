// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/appearance.hpp"

namespace kerf::test {

inline constexpr PictureSize kTestSize{96, 96};

/// The pixel in the middle of a picture of `kTestSize`.
inline constexpr std::size_t kMiddle = 48 * 96 + 48;

/// Calls `take(index, ray)` for each pixel of a picture of `kTestSize`.
template <class Take>
void for_each_pixel(const View& view, const Take& take) {
  for (int y = 0; y < kTestSize.height; ++y) {
    for (int x = 0; x < kTestSize.width; ++x) {
      take(static_cast<std::size_t>(y * kTestSize.width + x), pixel_ray(view, kTestSize, x, y));
    }
  }
}

[[nodiscard]] SceneView scene_of(std::initializer_list<const TestVolume*> volumes);

/// Silhouettes, gaps and self-occlusion within 5 mm around the origin.
[[nodiscard]] TestVolume heap_of_balls(unsigned seed = 7);

struct Difference {
  double mean = 0.0;  ///< of the channels, in steps of 1/255
  int most = 0;
};
[[nodiscard]] Difference difference(const Drawn& a, const Drawn& b);

}  // namespace kerf::test
