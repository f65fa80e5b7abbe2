// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "controller/scene/scene.hpp"
#include "controller/scene/scene_key.hpp"
#include "controller/scene/scene_setting.hpp"

namespace kerf {

/// Reads TOML text. `settings` replace what it says. No file is opened: `path` stands in messages
/// and in the scene, and the hand's script is named from its folder. Throws SceneError, one line
/// with the line number, for anything that is not a valid scene. Any thread; load time only.
[[nodiscard]] Scene parse_scene(std::string_view text, const std::filesystem::path& path,
                                SceneKeys keys = scene_keys(),
                                std::span<const SceneSetting> settings = {});

/// Reads a scene file of at most 1 MiB.
[[nodiscard]] Scene parse_scene_file(const std::filesystem::path& path,
                                     std::span<const SceneSetting> settings = {});

/// Throws SceneError where the scene names a hand script that is no file. Loading a scene does not
/// check this, since only an emulated hand needs the script.
void check_hand_script(const SceneSettings& scene);

}  // namespace kerf
