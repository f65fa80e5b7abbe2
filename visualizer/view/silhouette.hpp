// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// A tool seen from the side, as rows from its tip upwards: height, left and right end, in mm.
using Silhouette = std::vector<std::array<double, 3>>;

/// Of the head, and where a shaft is felt of as much of that as the head is long. Empty where the
/// tool has no extent.
[[nodiscard]] Silhouette silhouette_of(const ToolView& tool);

}  // namespace kerf
