// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <optional>

#include "shared/posix/new_file.hpp"

namespace kerf {

/// Files that belong together and appear together: all are written, each without its name, before
/// the first gets its own.
///
/// Throws FileError, and then what was there before stays as it was, as does every file that none
/// of this process wrote.
class NewFiles {
 public:
  /// Written to and closed by the caller.
  [[nodiscard]] NewFile& add(const std::filesystem::path& path);
  /// They replace what is there.
  void commit();
  /// They replace nothing: where something is there already, also since a moment ago, that one is
  /// told, and no file appears. Of several that do this with the same names, one gets them.
  [[nodiscard]] std::optional<std::filesystem::path> commit_if_new();

 private:
  struct Named {
    explicit Named(const std::filesystem::path& at) : path(at), file(at) {}
    std::filesystem::path path;
    NewFile file;
  };
  std::deque<Named> files_;
};

}  // namespace kerf
