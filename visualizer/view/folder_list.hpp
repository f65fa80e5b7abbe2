// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kerf {

/// What a user may open in a folder: folders, scenes and volumes, by their names.
struct FolderList {
  struct Entry {
    std::string name;
    bool is_folder = false;
    friend bool operator==(const Entry&, const Entry&) noexcept = default;
  };
  static constexpr std::size_t kMost = 2000;  ///< more are left out, and `note` says so

  std::filesystem::path folder;
  std::vector<Entry> entries;  ///< the folder above, folders, files
  std::string note;            ///< one line: what is wrong, or left out; empty: nothing
  friend bool operator==(const FolderList&, const FolderList&) noexcept = default;
};

/// Throws nothing: a folder that cannot be read has only the one above, and a note.
[[nodiscard]] FolderList list_folder(const std::filesystem::path& folder);

/// Why `file` is neither a scene nor a volume, as one line; empty where it seems to be one.
[[nodiscard]] std::string why_not_open(const std::filesystem::path& file);

}  // namespace kerf
