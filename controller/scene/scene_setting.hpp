// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "controller/scene/scene_key.hpp"
#include "shared/text/toml.hpp"

namespace kerf {

/// A key of a scene with another value than the file's: `table.key=VALUE` on a command line.
struct SceneSetting {
  std::string key;    ///< `table.key`
  std::string value;  ///< as TOML writes it; text may do without its quotes
};

/// Reads `table.key=VALUE`; throws SceneError for another form or a key that no scene has.
[[nodiscard]] SceneSetting parse_setting(std::string_view text, SceneKeys keys = scene_keys());

/// Puts the settings in the place of what the file says, in order; every `[[table]]` of the file
/// gets the value of its key. What they may hold is checked with the scene. Throws SceneError.
void put_settings(std::span<const SceneSetting> settings, TomlNode& root);

}  // namespace kerf
