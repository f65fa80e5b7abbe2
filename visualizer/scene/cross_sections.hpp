// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// Three sections through one point, square to the world's axes, as a radiologist looks at them:
/// from above, from in front, from the side. One scale for all of them.
struct SliceViews {
  int side = 0;  ///< of each picture, in pixels
  /// Where the point is in each: to the right and down, in fractions of `side`; it may lie outside.
  std::array<std::array<double, 2>, 3> tip{};
  std::vector<std::uint8_t> rgb{};  ///< one picture below the other
  friend bool operator==(const SliceViews&, const SliceViews&) noexcept = default;
};
inline constexpr std::array kSliceNames{"axial", "coronal", "sagittal"};

/// Through `tip_mm`, of the volumes as `contents` has them now. Each picture shows all volumes.
[[nodiscard]] SliceViews slice_views(const SceneView& scene,
                                     std::span<const VolumeContent> contents,
                                     const glm::dvec3& tip_mm, int side);

}  // namespace kerf
