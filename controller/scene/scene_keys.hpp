// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "controller/scene/scene.hpp"
#include "shared/text/toml.hpp"

// The table of keys of a scene file: one row is all that is known of a key.

namespace kerf {

/// The values that the rows point into: a scene, and the current entry of each list of tables.
struct SceneParts {
  SceneSpec scene;
  VolumeSpec volume;
  ToolSpec tool;
  Material material;
};

/// Address of the value of a key; its type is the type of the key.
using SceneSlot =
    std::variant<bool*, int*, double*, std::string*, std::array<double, 3>*, std::optional<int>*,
                 std::optional<double>*, std::optional<std::array<double, 2>>*,
                 std::optional<std::array<double, 3>>*, std::optional<std::array<double, 4>>*,
                 std::optional<VoxelGrid>*, Personality*, ForceModel*, CutModel*, CutPedal*, Grit*,
                 PulpMark*, NumericKind*, GradientKernel*, Denoise*, LawChoice*>;

/// Both ends are allowed values.
struct Range {
  double lo = 0, hi = 0;
};

/// Numbers in `range`; texts among `words`, in the order of an enumeration. A number with words
/// may also be one of these, and then keeps its default.
struct Allowed {
  Range range{};
  std::span<const std::string_view> words{};
};

/// The key counts only while another key is `word`, or is not.
struct SceneCondition {
  std::string_view key{};  ///< `table.key`; if empty, the key always counts
  std::string_view word{};
  bool is = true;
  std::string_view
      refusal{};  ///< message after `table.key = value` otherwise; if empty, names the choice
};

/// Whether a key is in the JSON of the scene, which readers of the segment get. The JSON is
/// hashed (config_hash). Give a new key `if_changed`: older scenes then keep their hash.
enum class InJson : std::uint8_t { used, always, if_changed, never };

/// Settings that few rows need.
struct KeyOptions {
  std::string_view default_text{};  ///< if the default is no plain value
  std::string_view required_as{};   ///< if there is no default: how to write one
  InJson json = InJson::used;       ///< scene_json.cpp writes volumes and tools
  bool one_for_all = false;         ///< one number means a list of equal ones
};

/// One row of the table of keys: all that is known of one key of a scene file. Reading, the answer
/// to every mistake, the JSON of settings, `--check` and docs/scene-keys.md come from it.
struct SceneKey {
  std::string_view name;  ///< `table.key`
  std::string_view unit;  ///< if empty, a plain number, a text or a switch
  SceneSlot (*at)(SceneParts&);
  Allowed allowed;
  std::string_view meaning;
  SceneCondition only_with{};  ///< if it does not hold, the key is refused
  KeyOptions options{};
};
using SceneKeys = std::span<const SceneKey>;

/// One table of a scene file.
struct SceneTableRow {
  std::string_view name;
  std::size_t limit;  ///< most entries of `[[name]]`; 0: `[name]`, once
  std::string_view meaning;
};

/// The table of keys, in the order of the reference page.
[[nodiscard]] SceneKeys scene_keys();
[[nodiscard]] std::span<const SceneTableRow> scene_tables();
/// Most entries of `[[table]]`; 0: it is `[table]`.
[[nodiscard]] std::size_t most_of(std::string_view table);

/// The names that come next below `prefix` (empty, `table.` or `table.key.`), in the table's order.
[[nodiscard]] std::vector<std::string_view> names_below(std::string_view prefix, SceneKeys keys);
/// The rows of one table.
[[nodiscard]] std::vector<SceneKey> keys_of(std::string_view table, SceneKeys keys);
/// `table.key` without the table.
[[nodiscard]] std::string_view name_in_table(const SceneKey& key);
[[nodiscard]] bool is_used(const SceneKey& key, SceneParts& parts);
/// The value of a key as a scene would write it; empty if it has none.
[[nodiscard]] TomlValue value_of(const SceneKey& key, SceneParts& parts);

/// The reference page of scene files, docs/scene-keys.md, in Markdown.
[[nodiscard]] std::string scene_keys_page(SceneKeys keys = scene_keys());

/// Every setting in effect, one line `table.key=value` each, values as a scene writes them. A key
/// that the scene would refuse, or that has no value, is left out.
[[nodiscard]] std::string settings_text(const SceneSpec& scene, SceneKeys keys = scene_keys());

}  // namespace kerf
