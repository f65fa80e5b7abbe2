// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene_keys.hpp"

namespace kerf::ranges {

/// Keys of a scene (`table.key`) and the values that a file has for them. Missing keys are left
/// out of the file: the key's default.
using KeyTexts = std::map<std::string, std::string, std::less<>>;

/// The ends of the values of one key of a scene, as the file writes them. Read from the table of
/// keys, so that a new key has its ends here by itself.
struct KeyLevels {
  const SceneKey* key;
  /// Allowed by the key's own row: both ends, every word. Of a list: all at one end, and each end
  /// in its first place with the others at the other one or at 0. Of a law: every one that this
  /// program knows, at both ends of its settings.
  std::vector<std::string> ends;
  /// Just beyond each end, infinite, and no number: the loader must refuse them.
  std::vector<std::string> beyond;
};

/// Of every key that has a range, words, or names a law, or is a switch. Names and files have no
/// ends; of a file whose content another key asks for ("phantom") that word counts.
[[nodiscard]] std::vector<KeyLevels> key_levels(SceneKeys keys = scene_keys());

/// The key's value in a plain scene, and the form of its numbers: to look between it
/// and an end for the last value that a scene can have.
struct PlainNumber {
  double value;
  bool whole;
  std::size_t length;  ///< of a list; 0: one value
};
/// Empty if the key holds no number.
[[nodiscard]] std::optional<PlainNumber> plain_number(const SceneKey& key);
/// The same number in all places of the form.
[[nodiscard]] std::string number_text(const PlainNumber& form, double value);

/// Whether `key` is on in a scene with these values, by its row's condition.
[[nodiscard]] bool counts(const SceneKey& key, const KeyTexts& texts);

/// Adds to `texts` the value that the condition of `key` needs, if it is missing. Returns false if
/// something else stands there.
[[nodiscard]] bool meet_condition(const SceneKey& key, KeyTexts& texts);

/// A scene file with these values. It touches the small volume of combination.cpp with a ball of 1
/// mm that force cuts; values that no single key can give (a size with a tool's length, the size of
/// a phantom) stands beside the keys that ask for it.
[[nodiscard]] std::string scene_text(const KeyTexts& texts);

}  // namespace kerf::ranges
