// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/scene/scene_keys.hpp"

namespace kerf {

/// The reference page of scene files, docs/scene-keys.md, in Markdown.
[[nodiscard]] std::string scene_keys_page(SceneKeys keys = scene_keys());

/// Every setting in effect, one line `table.key=value` each, values as a scene writes them. A key
/// that the scene would refuse, or that has no value, is left out.
[[nodiscard]] std::string settings_text(const Scene& scene, SceneKeys keys = scene_keys());

}  // namespace kerf
