// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/scene/scene_keys.hpp"
#include "shared/text/toml.hpp"

// A scene file to a checked `SceneSpec`, and the keys that a command line overrides.

namespace kerf {

/// A key of a scene that replaces the value of the file: `table.key=VALUE` on a command line.
struct KeyOverride {
  std::string key;    ///< `table.key`
  std::string value;  ///< as TOML writes it; text needs no quotes
};

/// Reads `table.key=VALUE`; throws LoadError for another form or a key that no scene has.
[[nodiscard]] KeyOverride parse_setting(std::string_view text, SceneKeys keys = scene_keys());

/// Removes from `earlier` what `later` leaves without a meaning: the same key; if that chooses a
/// law, the settings of the law before it; for a force law also the coupling's own keys.
void drop_replaced(std::vector<KeyOverride>& earlier, const KeyOverride& later);

/// Replaces the values of the file by the settings, in order; every `[[table]]` of the file gets
/// the value of its key. A force law among the settings takes the place of the coupling, whose keys
/// in the file are dropped. The values are checked with the scene. Throws LoadError.
void override_keys(std::span<const KeyOverride> settings, TomlNode& root);

/// Reads TOML text. `settings` replace values of it. No file is opened: `path` appears in messages
/// and in the scene, and the script of the hand is relative to its folder. Throws LoadError, one
/// line with the line number, for anything that is not a valid scene. Any thread; load time only.
[[nodiscard]] SceneSpec parse_scene(std::string_view text, const std::filesystem::path& path,
                                    SceneKeys keys = scene_keys(),
                                    std::span<const KeyOverride> settings = {});

/// The text of a scene file of at most 1 MiB. Throws LoadError.
[[nodiscard]] std::string read_scene_text(const std::filesystem::path& path);

/// Both in one.
[[nodiscard]] SceneSpec parse_scene_file(const std::filesystem::path& path,
                                         std::span<const KeyOverride> settings = {});

/// Gives the limits that the scene leaves out the figures of its device
/// (shared/wire/personality.hpp), and throws LoadError for one, or a torque scale, that the device
/// does not allow. Again after another device is named.
void settle_device(SceneSpec& scene);

/// Throws LoadError if the scene names a hand script that is no file. Loading a scene does not
/// check this, since only an emulated hand needs the script.
void check_hand_script(const SceneSettings& scene);

}  // namespace kerf
