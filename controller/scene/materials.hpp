// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "controller/scene/scene.hpp"

namespace kerf {

/// The default material table: index 0 none, then enamel, dentin and pulp, as the phantom's labels.
/// Load time.
[[nodiscard]] std::vector<Material> default_materials();

/// What is known of a material that a scene names: enamel, dentin, pulp, bone, caries, amalgam;
/// plain values for another name. Sources, and what is tuned, are in docs/cutting.md. Load time.
[[nodiscard]] Material known_material(std::string_view name);

/// What a label of a map of labels alone stands for that has no material: "label 4", plain values,
/// a colour that differs from its neighbours', seen from density `iso` on. Load time.
[[nodiscard]] Material label_material(std::size_t label, double iso);

}  // namespace kerf
