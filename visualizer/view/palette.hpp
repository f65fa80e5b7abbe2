// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/view/scene_view.hpp"

namespace kerf {

inline constexpr int kPaletteWidth = 256;  ///< entries of a row

/// Linear colours in two rows: by density (entry i is density i/255; adjoining materials blend over
/// a narrow band, so that their border is smooth on a cut), then by label. Material 0 is "none" and
/// colours nothing; without others everything is ivory. The fourth component is the opacity of the
/// material over one voxel edge, for the translucent renderers: its own, or else the softer, the
/// more opaque.
using Palette = std::array<std::array<glm::vec4, kPaletteWidth>, 2>;
[[nodiscard]] Palette make_palette(std::span<const MaterialView> materials);

/// The opacity that a material without one of its own has.
[[nodiscard]] double default_opacity(std::span<const MaterialView> materials, std::size_t index);

}  // namespace kerf
