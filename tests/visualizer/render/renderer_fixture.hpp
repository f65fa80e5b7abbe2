// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/scene/appearance.hpp"

namespace kerf::test {

inline constexpr PictureSize kTestSize{96, 96};

[[nodiscard]] constexpr std::size_t pixel_at(int x, int y) {
  return static_cast<std::size_t>(y * kTestSize.width + x);
}

[[nodiscard]] SceneView scene_of(std::initializer_list<const TestVolume*> volumes);

/// Silhouettes, gaps and self-occlusion within 5 mm around the origin.
[[nodiscard]] TestVolume heap_of_balls();

/// A cube of 4 mm, full density up to its border.
[[nodiscard]] TestVolume solid_block(glm::dvec3 spacing_mm, glm::dvec3 centre_mm);

/// What a `solid_block` leaves of a light on the z axis at `light_mm`, seen from +z, by the
/// transfer function: (1 - a)^(length / s0), the fading border with its exact integral.
[[nodiscard]] double transparency(const TestVolume& block, double light_mm);

/// The share of the light behind that a picture shows: from 98 % on, opacity counts as all.
[[nodiscard]] double shown(double transparency);

/// The share of a white wall that is seen in the middle of the picture, `wall_mm` from the eye.
[[nodiscard]] double seen_through(Renderer& renderer, const View& view, double wall_mm);

struct Difference {
  double mean = 0.0;  ///< of the channels, in steps of 1/255
  int most = 0;
};
[[nodiscard]] Difference difference(const Drawn& a, const Drawn& b);

using MakeRenderer =
    std::function<std::unique_ptr<Renderer>(const SceneView&, std::span<const VolumeContent>)>;

/// A renderer that skips empty cells against one that does not: from outside, from the middle of
/// the heap, and with the far plane inside the box.
void check_skipping(const MakeRenderer& skipping, const MakeRenderer& plain);
/// Random cuts: a renderer that is told the changed bricks against one that is made anew.
void check_updates(const MakeRenderer& make);
/// A wall at several depths in a block dims as the transfer function says.
void check_opaque_inside(const MakeRenderer& make);

}  // namespace kerf::test
