// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace kerf {

/// A file that cannot be written; the message is one line: path, reason, way out.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that appears whole or not at all: written under a temporary name in the same folder, and
/// renamed by `commit`. Without it the destructor removes it, and what was there before stays.
/// A path that is there and is no regular file (a pipe, /dev/null) is written to as it stands.
///
/// Every failure (no folder, no right, disk full) is a FileError that names the final path.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(const void* data, std::size_t size);
  /// Ends writing, on the disk. Some file systems report a full disk only here.
  void close();
  /// After `close`.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;  ///< empty: `path_` is written directly
  int fd_ = -1;
  bool committed_ = false;
};

/// Throws now what a NewFile at `path` would throw later; leaves nothing behind. For long runs.
void check_new_file(const std::filesystem::path& path);

/// All of `bytes` as one new file.
void write_new_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace kerf
