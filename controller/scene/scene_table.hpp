// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene_keys.hpp"
#include "shared/text/toml.hpp"

namespace kerf {

/// One table of a scene file beside its rows of the table of keys. Each fault throws LoadError,
/// one line: `file:line: table.key = value is ..; remedy`.
///
/// Refers to the parsed file and to the rows, which must outlive it. Load time only.
class SceneTable {
 public:
  /// `node`: an empty table if the file has none.
  SceneTable(std::string name, std::string file, const TomlNode& node, SceneKeys keys);

  /// Sets the keys that count in every scene; each value has the right type and range.
  void read(SceneParts& parts) const;
  /// Sets those whose condition holds now, and refuses the others.
  void read_conditional(SceneParts& parts) const;

  // For the rules between keys; a key of a table below is `table.key`.
  [[nodiscard]] bool has(std::string_view key) const { return node_->find(key) != nullptr; }
  [[nodiscard]] bool is_text(std::string_view key) const;
  /// `file:line` of the key.
  [[nodiscard]] std::string where(std::string_view key) const;
  /// `file:line: table.key = value`, the beginning of every complaint about a value.
  [[nodiscard]] std::string location(std::string_view key) const;
  /// `file:line: table`, for what is missing.
  [[nodiscard]] std::string location() const;

 private:
  void read(const SceneKey& key, SceneParts& parts) const;

  std::string name_;
  std::string file_;
  const TomlNode* node_;
  std::vector<SceneKey> keys_;
};

/// Throws LoadError for the first name in the file that no row has, and for a table of another
/// form than in the table of keys: with line and column, with similar keys of the same table and
/// with the same name in other tables. Load time.
void check_names(const TomlNode& root, const std::string& file, SceneKeys keys);

/// `file:line: name = value`.
[[nodiscard]] std::string place_of(const TomlNode& node, std::string_view name,
                                   const std::string& file);

}  // namespace kerf
