// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <optional>

#include "shared/posix/new_file.hpp"

namespace kerf {

/// Files that belong together and appear together: all are written, none with a name, before the
/// first gets its own. A program that is killed before a commit leaves nothing; in a commit each
/// file is the old or the new one, and the other may be left beside it as NAME.new-PID-N.
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
  /// Tells the first that `commit` did not, with all taken back.
  template <class Commit>
  [[nodiscard]] const Named* commit_all(Commit commit);

  std::deque<Named> files_;
};

}  // namespace kerf
