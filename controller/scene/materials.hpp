// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace kerf
