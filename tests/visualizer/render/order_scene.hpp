// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "tests/visualizer/gl/gl_fixture.hpp"

namespace kerf::test {

/// A body by its exact signed distance in world mm, negative inside.
using Distance = std::function<double(glm::dvec3)>;

/// Where a ray first comes within `reach_mm` of a body, in mm along the view axis: by steps of the
/// distance itself, which never pass a surface, to 1e-6 mm. None up to `far_mm`.
[[nodiscard]] std::optional<double> first_hit_mm(const PixelRay& ray, const Distance& body,
                                                 double reach_mm, double far_mm);

[[nodiscard]] Distance distance_to_ball(glm::dvec3 centre_mm, double radius_mm);

/// A red ball and a green torus that go through one another, each in a volume that is turned and
/// scaled in its own way. Colours are by label.
struct TwoBodies {
  static constexpr double kRampMm = 0.8;  ///< from full density to none; half of it at the surface
  static constexpr double kShortestMm = 0.15;  ///< edge of a voxel; the longest has 0.24
  std::vector<Distance> bodies;
  std::vector<TestVolume> volumes;
  std::vector<std::vector<Label>> labels;
  SceneView scene;

  /// `swapped`: the torus is the first volume.
  explicit TwoBodies(bool swapped);
  [[nodiscard]] std::vector<VolumeContent> contents() const;
  /// Volume `v` alone.
  [[nodiscard]] std::unique_ptr<Renderer> renderer_of(std::string_view kind, std::size_t v) const;
  /// The channel in which body `v` is bright.
  [[nodiscard]] std::size_t channel(std::size_t v) const { return labels[v].front() - 1U; }

  /// How far before its surface a body begins to be seen: 0 for the opaque renderers.
  [[nodiscard]] double reach_mm(bool translucent) const;
  /// What body `v` alone lets through between two places of a ray, by the transfer function.
  [[nodiscard]] double transparency(std::size_t v, const PixelRay& ray, double from_mm,
                                    double to_mm) const;
};

/// The nearest of several bodies in a pixel.
struct Nearest {
  int body = -1;  ///< none
  double mm = 0.0;
  double next_mm = 0.0;  ///< the next body's surface; far away where there is none
};

/// The analytic picture of `bodies`, each with its reach.
[[nodiscard]] std::vector<Nearest> nearest_bodies(const std::vector<Distance>& bodies,
                                                  const std::vector<double>& reach_mm,
                                                  const View& view, PictureSize size);

/// Pixels where a fraction of a voxel cannot change the order: within a pixel of it nothing else is
/// nearest, nor has the body itself an edge, and the next body is `margin_mm` farther away.
[[nodiscard]] std::vector<bool> clear_pixels(const std::vector<Nearest>& picture, PictureSize size,
                                             double margin_mm);

}  // namespace kerf::test
